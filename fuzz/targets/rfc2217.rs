//! Any bytes to both ends of a serial line over TCP, in any pieces: the same data, answers and settings as in one piece, and what
//! one side answers holds no data for the other.
#![no_main]

use libfuzzer_sys::fuzz_target;
use rowscan_protocol::rfc2217::{Client, Server, Settings, escape};

fn server(bytes: &[u8], piece: usize) -> (Vec<u8>, Vec<u8>, Settings) {
    let (mut server, mut data, mut answer) = (Server::new(), Vec::new(), Vec::new());
    bytes.chunks(piece).for_each(|bytes| server.decode(bytes, &mut data, &mut answer));
    (data, answer, server.settings())
}

fn client(bytes: &[u8], piece: usize) -> (Vec<u8>, Vec<u8>, Option<u32>, bool, bool) {
    let (mut client, mut data, mut answer) = (Client::new(), Vec::new(), Vec::new());
    bytes.chunks(piece).for_each(|bytes| client.decode(bytes, &mut data, &mut answer));
    (data, answer, client.rate(), client.is_agreed(), client.is_refused())
}

fuzz_target!(|data: &[u8]| {
    let Some((&piece, bytes)) = data.split_first() else { return };
    let piece = usize::from(piece).max(1);
    let whole = bytes.len().max(1);
    let served = server(bytes, whole);
    assert_eq!(server(bytes, piece), served);
    assert_eq!(client(bytes, piece), client(bytes, whole));
    // Answers are bounded by what was asked, and are commands only.
    assert!(served.0.len() <= bytes.len() && served.1.len() <= 8 * bytes.len());
    assert!(client(&served.1, whole).0.is_empty());
    // Bytes that were escaped arrive as they were.
    let mut wire = Vec::new();
    escape(bytes, &mut wire);
    assert_eq!(server(&wire, piece).0, bytes);
});
