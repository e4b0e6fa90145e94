//! What must hold for any scan, any number, any bytes.

use std::time::Duration;

use proptest::prelude::*;
use rowscan_protocol::client::{ColaClient, ColaConfig};
use rowscan_protocol::device::command::{self, COMMANDS};
use rowscan_protocol::device::{Device, DialectPolicy, Identity, Session};
use rowscan_protocol::frame::{Dialect, encode as frame};
use rowscan_protocol::host::{HostEvent, HostSession};
use rowscan_protocol::model::MODELS;
use rowscan_protocol::scan::{NO_ECHO, Scan};
use rowscan_protocol::telegram::wire::{FixedText, Reader, ShortString, WireError};
use rowscan_protocol::telegram::{
    Args, Channel, DateTime, Encoder, EventInfo, Kind, LmdScandata, Position, SopasError, Telegram, encode,
};
use rowscan_protocol::time::SimTime;
use rowscan_protocol::visit::{Group, Value, Visitor};

/// Counts what a visitor is told: every telegram is one struct, and every begin has its end.
#[derive(Default)]
struct Balance {
    open: i32,
    roots: u32,
}

impl Visitor for Balance {
    fn value(&mut self, _: Value<'_>) {
        assert!(self.open > 0, "a value outside the struct");
    }

    fn begin(&mut self, group: Group) {
        if self.open == 0 {
            assert_eq!(group, Group::Struct);
            self.roots += 1;
        }
        self.open += 1;
    }

    fn field(&mut self, _: &'static str, _: Option<&'static str>) {}

    fn end(&mut self) {
        self.open -= 1;
    }
}

fn name<const N: usize>() -> impl Strategy<Value = FixedText<N>> {
    prop::collection::vec(prop::sample::select(b"ABCDISTRNGL12345".as_slice()), N)
        .prop_map(|letters| FixedText(letters.try_into().unwrap()))
}

/// Any text a device can hold, blanks and line ends included.
fn text() -> impl Strategy<Value = ShortString> {
    "[ -~\u{80}-\u{ff}\n]{0,128}".prop_map(ShortString)
}

fn number() -> impl Strategy<Value = f32> {
    any::<f32>().prop_filter("comparable", |value| !value.is_nan())
}

fn channel<T: Arbitrary + Clone>() -> impl Strategy<Value = Channel<T>> {
    let grid = (any::<i32>(), any::<u16>());
    (name::<5>(), number(), number(), grid, prop::collection::vec(any::<T>(), 0..300)).prop_map(
        |(name, scale, offset, (start_angle, step), values)| Channel {
            name,
            scale,
            offset,
            start_angle,
            step,
            values,
        },
    )
}

prop_compose! {
    fn blocks()(
        position in prop::option::of((prop::array::uniform6(number()), any::<u8>())),
        name in prop::option::of(text()),
        comment in prop::option::of(text()),
        time in prop::option::of(any::<(u16, [u8; 5], u32)>()),
        event in prop::option::of((name::<4>(), any::<u32>(), any::<u32>(), any::<i32>())),
    ) -> LmdScandata {
        LmdScandata {
            position: position.map(|([x, y, z, rotation_x, rotation_y, rotation_z], rotation_type)| {
                Position { x, y, z, rotation_x, rotation_y, rotation_z, rotation_type }
            }),
            name,
            comment,
            time: time.map(|(year, [month, day, hour, minute, second], microsecond)| {
                DateTime { year, month, day, hour, minute, second, microsecond }
            }),
            event: event.map(|(kind, encoder_position, time_us, angle)| EventInfo { kind, encoder_position, time_us, angle }),
            ..LmdScandata::default()
        }
    }
}

prop_compose! {
    fn scan()(
        blocks in blocks(),
        small in any::<([u16; 4], i16, [u8; 6])>(),
        large in any::<[u32; 5]>(),
        encoders in prop::collection::vec(any::<(u32, u16)>(), 0..4),
        channels16 in prop::collection::vec(channel::<u16>(), 0..4),
        channels8 in prop::collection::vec(channel::<u8>(), 0..4),
    ) -> LmdScandata {
        let ([version, device_number, telegram_counter, scan_counter], layer_angle, [a, b, c, d, e, f]) = small;
        let [serial_number, scan_time_us, transmit_time_us, scan_frequency, measurement_frequency] = large;
        LmdScandata {
            version, device_number, telegram_counter, scan_counter, layer_angle,
            device_status: [a, b], inputs: [c, d], outputs: [e, f],
            serial_number, scan_time_us, transmit_time_us, scan_frequency, measurement_frequency,
            encoders: encoders.into_iter().map(|(position, speed)| Encoder { position, speed }).collect(),
            channels16, channels8,
            ..blocks
        }
    }
}

fn payload(dialect: Dialect, scan: &LmdScandata) -> Vec<u8> {
    let mut payload = Vec::new();
    encode(dialect, Kind::Sn, "LMDscandata", scan, &mut payload);
    payload
}

proptest! {
    #[test]
    fn any_scan_survives_both_dialects(first in scan(), second in scan()) {
        // Into the same value twice: nothing of the first may be left.
        let mut decoded = LmdScandata::default();
        for scan in [&first, &second] {
            for dialect in [Dialect::A, Dialect::B] {
                let payload = payload(dialect, scan);
                let telegram = Telegram::parse(dialect, &payload).unwrap();
                telegram.args.decode_into(&mut decoded).unwrap();
                prop_assert_eq!(&decoded, scan);
            }
        }
    }

    #[test]
    fn text_scans_hold_no_frame_marks(scan in scan()) {
        prop_assert!(payload(Dialect::A, &scan).iter().all(|b| !matches!(b, 2 | 3)));
    }

    #[test]
    fn hosts_may_write_numbers_in_any_form(value in any::<i32>(), zeros in "0{0,9}") {
        let unsigned = value as u32;
        for text in [format!("{value:+}"), format!("{unsigned:X}"), format!("{zeros}{unsigned:x}")] {
            prop_assert_eq!(Reader::new(Dialect::A, text.as_bytes()).u32(), Ok(unsigned), "{}", text);
        }
        let byte = format!("{:+}", value as i8);
        prop_assert_eq!(Reader::new(Dialect::A, byte.as_bytes()).u8(), Ok(value as u8));
    }

    #[test]
    fn values_of_a_channel_may_be_written_in_any_form(values in prop::collection::vec((any::<u16>(), 0..4u8), 0..50)) {
        let mut text = format!("{:X}", values.len());
        for (value, form) in &values {
            text += &match form {
                0 => format!(" {value:X}"),
                1 => format!(" {value:x}"),
                2 => format!(" {value:06X}"),
                _ => format!(" +{value}"),
            };
        }
        let mut read: Vec<u16> = Vec::new();
        let mut reader = Reader::new(Dialect::A, text.as_bytes());
        reader.counted(&mut read).unwrap();
        reader.end().unwrap();
        prop_assert_eq!(read, values.into_iter().map(|(value, _)| value).collect::<Vec<_>>());
    }

    /// One odd token among plain ones, at any place: it is read like any number, or refused.
    #[test]
    fn an_odd_token_among_plain_ones_is_read_or_refused(
        plain in prop::collection::vec(any::<u16>(), 0..60), at in any::<prop::sample::Index>(),
        odd in prop_oneof!["[0-9A-Fa-f]{1,6}", "[+-][0-9]{1,6}", "[0-9A-F]{0,2}[!-~][0-9A-F]{0,2}"],
    ) {
        let at = at.index(plain.len() + 1);
        let mut tokens: Vec<String> = plain.iter().map(|value| format!("{value:X}")).collect();
        tokens.insert(at, odd.clone());
        let text = format!("{:X} {}", tokens.len(), tokens.join(" "));
        let mut expected = plain.clone();
        let odd = Reader::new(Dialect::A, odd.as_bytes()).u16().ok();
        let mut read: Vec<u16> = Vec::new();
        let mut reader = Reader::new(Dialect::A, text.as_bytes());
        let result = reader.counted(&mut read).and_then(|()| reader.end());
        match odd {
            Some(odd) => {
                expected.insert(at, odd);
                prop_assert_eq!((result, read), (Ok(()), expected));
            }
            None => prop_assert!(result.is_err(), "{}", text),
        }
    }

    /// Whatever a telegram of the table holds, it is read or refused, never more.
    #[test]
    fn no_arguments_panic(
        bytes in prop::collection::vec(prop_oneof![Just(0u8), Just(1), Just(b' '), Just(b'1'), any::<u8>()], 0..300),
        dialect in prop::sample::select(&[Dialect::A, Dialect::B]),
    ) {
        for entry in COMMANDS {
            for kind in [Kind::Ra, Kind::An, Kind::Sn, Kind::Ea] {
                let telegram = Telegram { kind, name: entry.name, args: Args { dialect, bytes: &bytes } };
                let mut balance = Balance::default();
                if let Some(Ok(())) = command::visit(&telegram, &mut balance) {
                    prop_assert_eq!((balance.open, balance.roots), (0, 1), "{:?}", telegram);
                }
            }
        }
        let mut scan = LmdScandata::default();
        if (Args { dialect, bytes: &bytes }).decode_into(&mut scan).is_ok() {
            let _ = scan.to_scan_into(&mut Scan::default());
        }
        let _ = Telegram::parse(dialect, &bytes);
    }

    /// A scan with a few bytes changed is read or refused; where it is read, its meaning has no value that is not a number.
    #[test]
    fn no_changed_scan_panics(
        scan in scan(),
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..4),
        dialect in prop::sample::select(&[Dialect::A, Dialect::B]),
    ) {
        let mut payload = payload(dialect, &scan);
        for (at, byte) in changes {
            let at = at.index(payload.len());
            payload[at] = byte;
        }
        let Ok(telegram) = Telegram::parse(dialect, &payload) else { return Ok(()) };
        let mut decoded = LmdScandata::default();
        let mut meaning = Scan::default();
        if telegram.args.decode_into(&mut decoded).is_ok() && decoded.to_scan_into(&mut meaning).is_ok() {
            for echo in &meaning.echoes {
                prop_assert!(echo.range_m.iter().all(|range| *range >= 0.0));
                prop_assert_eq!(echo.range_m.len(), meaning.beams.len());
                prop_assert!(echo.remission.is_empty() || echo.remission.len() == meaning.beams.len());
            }
        }
    }

    #[test]
    fn no_bytes_upset_a_session(bytes in hostile()) {
        for policy in [DialectPolicy::Auto, DialectPolicy::Strict(Dialect::A), DialectPolicy::Strict(Dialect::B)] {
            let mut device = Device::new(MODELS[0], Identity::default());
            let mut session = Session::new(policy);
            let mut replies = Vec::new();
            bytes.chunks(13).for_each(|piece| session.handle_bytes(&mut device, SimTime::ZERO, piece, &mut replies));
            prop_assert!(replies.iter().all(|reply| reply.bytes.len() < 200));
        }
    }

    #[test]
    fn no_bytes_upset_a_client(bytes in hostile()) {
        for mut client in [ColaClient::new(ColaConfig::default(), Dialect::A), ColaClient::new(ColaConfig::default(), Dialect::B), ColaClient::listen(4096)] {
            for piece in bytes.chunks(13) {
                client.handle_bytes(Duration::ZERO, piece);
                while client.poll_event().is_some() {}
                while client.poll_transmit().is_some() {}
            }
            client.handle_end();
            client.handle_timeout(Duration::from_secs(60));
            while client.poll_event().is_some() {}
        }
    }
}

/// Good frames with odd contents, and junk.
fn hostile() -> impl Strategy<Value = Vec<u8>> {
    let names: Vec<&str> = COMMANDS.iter().map(|entry| entry.name).chain(["field001", "0", "x"]).collect();
    let kind = prop::sample::select(Kind::ALL.as_slice());
    let arguments = prop::collection::vec(
        prop_oneof![Just(0u8), Just(1), Just(b' '), Just(b'1'), Just(b'A'), any::<u8>()],
        0..40,
    );
    let dialect = prop::sample::select(&[Dialect::A, Dialect::B]);
    let framed = (kind, prop::sample::select(names), arguments, dialect).prop_map(
        |(kind, name, arguments, dialect)| {
            let mut out = Vec::new();
            frame(
                dialect,
                &[kind.letters().as_bytes(), b" ", name.as_bytes(), b" ", &arguments].concat(),
                &mut out,
            );
            out
        },
    );
    let login = Just(b"\x02sMN SetAccessMode 3 F4724744\x03".to_vec());
    let junk = prop::collection::vec(any::<u8>(), 0..40);
    prop::collection::vec(prop_oneof![4 => framed, 1 => login, 1 => junk], 0..30)
        .prop_map(|parts| parts.concat())
}

fn small_scan(value: u16) -> LmdScandata {
    let channel = |name: &[u8; 5]| Channel {
        name: FixedText(*name),
        scale: 1.0,
        step: 2500,
        values: vec![value; 1081],
        ..Channel::default()
    };
    LmdScandata { channels16: vec![channel(b"DIST1"), channel(b"RSSI1")], ..LmdScandata::default() }
}

#[test]
fn a_second_scan_of_the_same_shape_reuses_every_buffer() {
    for dialect in [Dialect::A, Dialect::B] {
        let mut decoded = LmdScandata::default();
        let mut meaning = Scan::default();
        let mut seen = Vec::new();
        for value in [0xFFFF, 500] {
            let payload = payload(dialect, &small_scan(value));
            Telegram::parse(dialect, &payload).unwrap().args.decode_into(&mut decoded).unwrap();
            decoded.to_scan_into(&mut meaning).unwrap();
            let echo = &meaning.echoes[0];
            seen.push((
                decoded.channels16[1].values.as_ptr(),
                echo.range_m.as_ptr(),
                echo.remission.as_ptr(),
            ));
        }
        assert_eq!(seen[0], seen[1]);
    }
}

/// Found by fuzzing: a channel without a name took its neighbours' place in text.
#[test]
fn a_channel_without_a_name_keeps_its_place_in_text() {
    let telegram = LmdScandata {
        channels16: vec![Channel { values: vec![7], ..Channel::default() }],
        ..LmdScandata::default()
    };
    let payload = payload(Dialect::A, &telegram);
    let again: LmdScandata = Telegram::parse(Dialect::A, &payload).unwrap().args.decode().unwrap();
    assert_eq!(again.channels16[0].values, [7]);
}

#[test]
fn remission_is_found_by_the_distance_channels_digit_in_either_width() {
    let distance = |name: &[u8; 5]| Channel {
        name: FixedText(*name),
        scale: 2.0,
        offset: 1.0,
        step: 5000,
        values: vec![1000, 16, 15, 2, 0],
        ..Channel::default()
    };
    let telegram = LmdScandata {
        channels16: vec![
            distance(b"DIST1"),
            distance(b"DIST2"),
            Channel {
                name: FixedText(*b"RSSI2"),
                values: vec![300, 400, 500, 600, 700],
                ..Channel::default()
            },
            Channel { name: FixedText(*b"ANGL1"), ..Channel::default() },
        ],
        channels8: vec![Channel {
            name: FixedText(*b"RSSI1"),
            values: vec![7, 8, 9, 10, 11],
            ..Channel::default()
        }],
        ..LmdScandata::default()
    };
    let mut scan = Scan::default();
    telegram.to_scan_into(&mut scan).unwrap();
    assert_eq!(scan.echoes[0].range_m[..2], [2.001, 0.033]);
    assert!(scan.echoes[0].range_m[2..].iter().all(|range| *range == NO_ECHO));
    assert_eq!(scan.echoes[0].remission, [7, 8, 9, 10, 11]);
    assert_eq!(scan.echoes[1].remission, [300, 400, 500, 600, 700]);
}

#[test]
fn a_scan_without_distances_is_an_error_that_names_the_remedy() {
    let mut scan = Scan::default();
    let error = LmdScandata::default().to_scan_into(&mut scan).unwrap_err();
    assert!(error.to_string().contains("LMDscandatacfg"));
    let mut bytes = Vec::new();
    frame(Dialect::B, &payload(Dialect::B, &LmdScandata::default()), &mut bytes);
    let mut client = ColaClient::listen(4096);
    client.handle_bytes(Duration::ZERO, &bytes);
    assert!(matches!(client.poll_event(), Some(HostEvent::Malformed { .. })));
}

fn number_error(text: &str) -> WireError {
    Reader::new(Dialect::A, text.as_bytes()).u16().unwrap_err()
}

#[test]
fn errors_say_what_was_expected_and_what_stood_where() {
    assert_eq!(
        number_error("12x4").to_string(),
        "expected a 16-bit number, found \"12x4\" at byte 0 of the arguments"
    );
    assert_eq!(
        number_error("10000").to_string(),
        "expected a 16-bit number, found \"10000\", which is too large, at byte 0 of the arguments"
    );
    assert_eq!(
        number_error("").to_string(),
        "expected a 16-bit number, found the end at byte 0 of the arguments"
    );
    for (text, code) in [
        ("-", SopasError::InvalidCharacter),
        ("+65536", SopasError::ValueOverflow),
        ("-32769", SopasError::ValueOverflow),
        ("", SopasError::BufferUnderflow),
    ] {
        assert_eq!(SopasError::from(number_error(text)), code, "{text}");
    }
    assert_eq!(Reader::new(Dialect::A, b"-32768").u16(), Ok(0x8000));
}

#[test]
fn a_value_too_large_for_an_8_bit_channel_is_refused() {
    let plain = "0 ".repeat(40);
    for odd in ["100", "-129", "+256"] {
        let text = format!("51 {plain}{odd} {plain}0");
        let mut values: Vec<u8> = Vec::new();
        let error = Reader::new(Dialect::A, text.as_bytes()).counted(&mut values).unwrap_err();
        assert_eq!((error.expected, error.at), ("an 8-bit number", 3 + plain.len()), "{error}");
    }
}

/// A false count must not reserve what the frame cannot hold.
#[test]
fn a_count_larger_than_the_telegram_is_refused_before_memory_is_taken() {
    for (dialect, arguments) in [(Dialect::A, b"FFFF 1 2 3".as_slice()), (Dialect::B, &[0xFF, 0xFF, 0, 1])] {
        let mut values: Vec<u16> = Vec::new();
        Reader::new(dialect, arguments).counted(&mut values).unwrap_err();
        assert_eq!(values.capacity(), 0);
    }
}
