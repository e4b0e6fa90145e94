//! Any file: MCAP, pcap, pcapng, candump, ranges, hex or raw bytes. It is read to its end or refused, and reading never gives more than
//! a bounded multiple of the file.
#![no_main]

use std::io::Cursor;

use libfuzzer_sys::fuzz_target;
use rowscan_recording::Recording;

/// What a file may begin with, so that the readers behind the format's magic are reached from any input.
const HEADS: [&[u8]; 5] = [
    b"",
    b"\x89MCAP0\r\n",
    b"\xD4\xC3\xB2\xA1\x02\x00\x04\x00\x00\x00\x00\x00\x00\x00\x00\x00\xFF\xFF\x00\x00\x01\x00\x00\x00",
    b"\x0A\x0D\x0D\x0A\x1C\x00\x00\x00\x4D\x3C\x2B\x1A\x01\x00\x00\x00\xFF\xFF\xFF\xFF\xFF\xFF\xFF\xFF\x1C\x00\x00\x00",
    b"02 73 ",
];

fuzz_target!(|data: &[u8]| {
    let Some((&choice, bytes)) = data.split_first() else { return };
    let file = [HEADS[usize::from(choice) % HEADS.len()], bytes].concat();
    let Ok(mut recording) = Recording::read(Box::new(Cursor::new(file.clone()))) else { return };
    let mut packets = 0;
    while let Ok(Some(packet)) = recording.next_packet() {
        packets += 1;
        // A packet costs the file a byte, or stands for a gap; compressed chunks may hold a thousand times their size.
        assert!(packets <= 4096 * (file.len() + 1), "{packets} packets of {} bytes", file.len());
        drop(packet);
    }
    let _ = (recording.torn(), recording.streams(), recording.about(), recording.began_ns());
});
