//! One rule of counting, of every framing: each damaged telegram counts once, those beside it too, and one that is whole and does not check is no end of
//! the file.

use std::io::Cursor;

use rowscan_protocol::compact::{self, Encoder, Imu};
use rowscan_protocol::frame::{Dialect, encode};
use rowscan_protocol::lms2xx;
use rowscan_recording::Recording;

/// Telegrams of one framing, and where in each a byte is changed: behind what says how long it is.
fn framings() -> Vec<(&'static str, Vec<u8>, Vec<usize>)> {
    let mut all = Vec::new();
    for payload in [&b"sSN LMDscandata \x00\x01\x02\x03\x00\x02\x02\x02\x02\x00"[..], b"sRA STlms \x00\x07"] {
        let mut bytes = Vec::new();
        encode(Dialect::B, payload, &mut bytes);
        // Its first letter is how a start is told from bytes of a scan that look like one.
        let places = (9..bytes.len()).collect();
        all.push(("CoLa B", bytes, places));
    }
    for body in [&[0xA0, 0, 0x10][..], &[0xB0, 3, 0x40, 2, 0x80, 30, 0, 5, 6, 0x15, 2, 0x80, 0x10]] {
        let mut bytes = Vec::new();
        lms2xx::frame::encode(lms2xx::frame::FROM_DEVICE, body, &mut bytes);
        // The address of a start within: from the host, it would be a request that cuts the telegram off.
        let places = (4..bytes.len()).filter(|place| *place != 8).collect();
        all.push(("LMS2xx", bytes, places));
    }
    for telegram in [compact::Telegram::Imu(Imu::default()), compact::Telegram::Encoder(Encoder::default())] {
        let mut bytes = Vec::new();
        telegram.encode(&mut bytes).unwrap();
        let places = (48..bytes.len()).collect();
        all.push(("Compact", bytes, places));
    }
    all
}

/// Sound and bad telegrams, and where the file breaks off.
fn read(bytes: Vec<u8>) -> (u64, u64, Option<String>) {
    let mut recording = Recording::read(Box::new(Cursor::new(bytes))).unwrap();
    while recording.next_packet().unwrap().is_some() {}
    let found = recording.soundness();
    (found.sound, found.bad, recording.torn().map(ToString::to_string))
}

const TELEGRAMS: usize = 6;

#[test]
fn each_damaged_telegram_counts_once_wherever_it_stands() {
    let mut wrong = Vec::new();
    for (name, telegram, places) in framings() {
        // Every choice of damaged ones that leaves the first, which tells the language.
        for damaged in 1_u32..1 << (TELEGRAMS - 1) {
            for place in &places {
                for change in [0x01, 0x80, 0xFF] {
                    let mut bytes = telegram.repeat(TELEGRAMS);
                    for number in (1..TELEGRAMS).filter(|number| damaged >> (number - 1) & 1 == 1) {
                        bytes[number * telegram.len() + place] ^= change;
                    }
                    let bad = u64::from(damaged.count_ones());
                    let found = read(bytes);
                    if found != (TELEGRAMS as u64 - bad, bad, None) {
                        wrong.push(format!(
                            "{name} {damaged:05b} byte {place} of {} ^ {change:02X}: {found:?}",
                            telegram.len()
                        ));
                    }
                }
            }
        }
    }
    assert!(
        wrong.is_empty(),
        "{} wrong, as {}",
        wrong.len(),
        wrong.iter().step_by(wrong.len() / 40 + 1).cloned().collect::<Vec<_>>().join("\n")
    );
}

/// A text of telegrams, one a line, is cut nowhere in two: its copy has all bytes, damaged ones too.
#[test]
fn a_copy_of_hex_text_keeps_its_damaged_telegrams() {
    let mut scan = Vec::new();
    encode(Dialect::B, b"sRA STlms \x00\x07", &mut scan);
    for damaged in [vec![], vec![0], vec![2], vec![TELEGRAMS - 1], vec![1, 2], vec![0, TELEGRAMS - 1]] {
        let line = |number: usize| {
            let mut bytes = scan.clone();
            // Longer than it is, or not as its checksum says.
            bytes[if number.is_multiple_of(2) { 7 } else { 10 }] ^=
                if damaged.contains(&number) { 0x20 } else { 0 };
            bytes.iter().map(|byte| format!("{byte:02x} ")).collect::<String>() + "\n"
        };
        let text: String = (0..TELEGRAMS).map(line).collect();
        let recording = || Recording::read(Box::new(Cursor::new(text.clone().into_bytes()))).unwrap();
        let mut out = Cursor::new(Vec::new());
        let copied =
            rowscan_recording::copy(recording(), None, &mut out, Default::default(), Default::default())
                .unwrap();
        let bytes = (TELEGRAMS * scan.len()) as u64;
        assert_eq!(copied.recorded.bytes, bytes, "{damaged:?}");
        let (sound, bad, _) = read(out.into_inner());
        assert_eq!(sound, (TELEGRAMS - damaged.len()) as u64, "{damaged:?}");
        // Damaged telegrams beside each other may be one stretch of junk.
        assert_eq!(bad > 0, !damaged.is_empty(), "{damaged:?}");
    }
}
