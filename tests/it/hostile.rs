//! A hostile client costs the others nothing.

use crate::common;

use std::io::{Read, Write};
use std::net::TcpStream;
use std::time::Duration;

use common::binary::Emulator;

/// A plain CoLa A client that counts telegrams.
struct Listener {
    stream: TcpStream,
    bytes: Vec<u8>,
}

impl Listener {
    fn subscribe(address: &str) -> Self {
        let mut stream = TcpStream::connect(address).expect("it listens");
        stream.set_read_timeout(Some(Duration::from_secs(10))).expect("a time-out");
        stream.write_all(b"\x02sEN LMDscandata 1\x03").expect("sent");
        let mut listener = Self { stream, bytes: Vec::new() };
        assert_eq!(listener.telegram(), "sEA LMDscandata 1");
        listener
    }

    fn telegram(&mut self) -> String {
        loop {
            if let Some(end) = self.bytes.iter().position(|byte| *byte == 3) {
                let telegram: Vec<u8> = self.bytes.drain(..=end).collect();
                return String::from_utf8(telegram[1..end].to_vec()).expect("text");
            }
            let mut chunk = [0; 4096];
            let read = self.stream.read(&mut chunk).expect("the emulator goes on");
            assert!(read > 0, "the emulator hung up on a client that did no harm");
            self.bytes.extend_from_slice(&chunk[..read]);
        }
    }

    /// The telegram counters of the next scans.
    fn counters(&mut self, scans: usize) -> Vec<u16> {
        (0..scans)
            .map(|_| {
                let telegram = self.telegram();
                let counter = telegram.split(' ').nth(7).expect("a counter");
                u16::from_str_radix(counter, 16).expect("hex")
            })
            .collect()
    }

    fn expect_no_gap(&mut self, scans: usize) {
        let counters = self.counters(scans);
        for pair in counters.windows(2) {
            assert_eq!(pair[1], pair[0].wrapping_add(1), "{counters:?}");
        }
    }
}

#[test]
fn floods_and_silence_leave_the_others_served_and_memory_bounded() {
    let emulator = Emulator::start(&["--time-scale", "2"]);
    let mut good = Listener::subscribe(&emulator.address);
    good.expect_no_gap(20);
    let before = emulator.resident_bytes();

    let connect = || TcpStream::connect(&emulator.address).expect("it listens");
    let mut flood = connect();
    let mut held = Vec::new();
    for (name, attack) in [
        ("a megabyte of STX", vec![0x02; 1 << 20]),
        ("a length of 4 GB", [&[2, 2, 2, 2, 0xFF, 0xFF, 0xFF, 0xFF][..], &[b's'; 100_000]].concat()),
        ("bad checksums", [2, 2, 2, 2, 0, 0, 0, 1, b's', 0].repeat(50_000)),
        ("headers in headers", [2, 2, 2, 2, 0, 0, 0x0F, 0xF0].repeat(50_000)),
        ("an ASCII frame without an end", [&[2][..], &[b's'; 1 << 20]].concat()),
    ] {
        flood.write_all(&attack).unwrap_or_else(|_| panic!("{name}: the emulator hung up"));
        good.expect_no_gap(10);
    }
    let mut half = connect();
    half.write_all(&[2, 2, 2, 2, 0, 0, 0, 15, b's', b'R']).expect("sent");
    for _ in 0..300 {
        held.push(connect());
    }
    good.expect_no_gap(50);

    // Three hundred silent connections do not lock a newcomer out.
    let mut newcomer = Listener::subscribe(&emulator.address);
    newcomer.expect_no_gap(20);
    good.expect_no_gap(20);

    let grown = emulator.resident_bytes().saturating_sub(before);
    assert!(grown < 32 << 20, "memory grew by {grown} bytes");
    drop((flood, half, held));
    good.expect_no_gap(20);
}
