//! Any bytes from a device, with time-outs in between: a client only ever sends good frames, and never for ever.
#![no_main]

use std::time::Duration;

use libfuzzer_sys::fuzz_target;
use rowscan_protocol::client::{ColaClient, ColaConfig};
use rowscan_protocol::host::{HostSession, Transmit};
use rowscan_protocol::frame::{Accept, Dialect, FrameDecoder};

/// A byte that few replies hold: time passes.
const WAIT: u8 = 0xFE;

fuzz_target!(|data: &[u8]| {
    let [kind, bytes @ ..] = data else { return };
    let mut client = match kind % 3 {
        0 => ColaClient::new(ColaConfig::default(), Dialect::A),
        1 => ColaClient::new(ColaConfig::default(), Dialect::B),
        _ => ColaClient::listen(4096),
    };
    let mut now = Duration::ZERO;
    let drain = |client: &mut ColaClient| {
        for turn in 0.. {
            assert!(turn < 10_000, "it goes on for ever");
            let sent = client.poll_transmit().and_then(Transmit::into_frame);
            if let Some(sent) = &sent {
                let mut decoder = FrameDecoder::new(Accept::Either, 4096);
                decoder.push(sent);
                assert_eq!(decoder.next_frame().expect("a whole frame").len, sent.len());
            }
            if sent.is_none() && client.poll_event().is_none() {
                break;
            }
        }
    };
    drain(&mut client);
    for piece in bytes.split_inclusive(|byte| *byte == WAIT) {
        client.handle_bytes(now, piece);
        drain(&mut client);
        if let Some(timeout) = client.poll_timeout().filter(|_| piece.ends_with(&[WAIT])) {
            now = now.max(timeout);
            client.handle_timeout(now);
            drain(&mut client);
        }
    }
    client.stop(now);
    client.handle_end();
    drain(&mut client);
});
