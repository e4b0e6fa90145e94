//! One telegram in both dialects: written, and read back: `cargo run -p rowscan-protocol --example cola_a_and_b`

#![allow(clippy::print_stdout, reason = "an example prints")]

use std::error::Error;

use rowscan_protocol::frame::{Accept, Dialect, FrameDecoder};
use rowscan_protocol::telegram::set_access_mode::{PasswordHash, SetAccessMode};
use rowscan_protocol::telegram::{Kind, Method, Telegram, encode_frame};

fn main() -> Result<(), Box<dyn Error>> {
    // The log-in of an authorised client, as every SICK driver sends it.
    let login = SetAccessMode { level: 3, password: PasswordHash(0xF472_4744) };
    for dialect in [Dialect::A, Dialect::B] {
        let bytes = write(dialect, &login);
        println!("{dialect}: {}", bytes.escape_ascii());
        println!("  read back: {:?}", read(dialect, &bytes)?);
    }
    Ok(())
}

/// The request as one frame: text between STX and ETX, or binary with length and checksum.
pub(crate) fn write(dialect: Dialect, login: &SetAccessMode) -> Vec<u8> {
    let mut bytes = Vec::new();
    encode_frame(dialect, Kind::Mn, SetAccessMode::NAME, login, &mut bytes);
    bytes
}

/// The first request in `bytes`. A damaged frame is skipped and counted, so that there is none.
pub(crate) fn read(dialect: Dialect, bytes: &[u8]) -> Result<SetAccessMode, Box<dyn Error>> {
    let mut decoder = FrameDecoder::new(Accept::Only(dialect), 1024);
    decoder.push(bytes);
    let frame = decoder.next_frame().ok_or("no good frame")?;
    Ok(Telegram::parse(frame.dialect, frame.payload)?.args.decode()?)
}
