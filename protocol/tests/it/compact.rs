//! Compact telegrams: published bytes, sizes of real ones, and what must hold for any.

use proptest::prelude::*;
use rowscan_protocol::compact::{
    Beams, Content, DistanceScale, Encoder, Expected, Found, Imu, MAX_BEAMS, Module, Modules, PerLine,
    ScanTelegram, Shape, StreamDecoder, Telegram, Version, crc32, theta_code, theta_rad,
};

/// Two beams at −48° and −47.5°, one echo: 3000 mm and nothing. Computed by hand from the layout that SICK's perception SDK (1.0.1) reads and 17
/// real telegrams have.
const TWO_BEAMS: &str = "
    02020202 01000000 0700000000000000 20580f0000000000 04000000 56000000
    0300000000000000 a000000000000000 e5317001 01000000 02000000 01000000
    40420f0000000000 f3570f0000000000 00000000 507756bf 673b54bf 0000803f 00000000 01 03 03 00
    b80b a4a4 00 ef2e   0000 0000 00 1c2f   a1ccac86";

fn hex(text: &str) -> Vec<u8> {
    let digits: Vec<u8> = text.bytes().filter(u8::is_ascii_hexdigit).collect();
    let byte = |pair: &[u8]| u8::from_str_radix(core::str::from_utf8(pair).unwrap(), 16).unwrap();
    digits.chunks(2).map(byte).collect()
}

fn encoded(telegram: &Telegram) -> Vec<u8> {
    let mut bytes = Vec::new();
    telegram.encode(&mut bytes).unwrap();
    bytes
}

fn two_beams() -> ScanTelegram {
    let module = Module {
        segment_counter: 3,
        frame_number: 160,
        sender_id: 24_130_021,
        shape: Shape { lines: 1, beams: 2, echoes: 1 },
        time_start_us: PerLine(vec![1_000_000]),
        time_stop_us: PerLine(vec![1_005_555]),
        phi_rad: PerLine(vec![0.0]),
        theta_start_rad: PerLine(vec![(-48.0_f64).to_radians() as f32]),
        theta_stop_rad: PerLine(vec![(-47.5_f64).to_radians() as f32]),
        availability: 1,
        beams: Beams {
            distance: vec![3000, 0],
            rssi: vec![164 * 257, 0],
            properties: vec![0, 0],
            theta: [-48.0_f64, -47.5].map(|deg| theta_code(deg.to_radians())).to_vec(),
        },
        ..Module::default()
    };
    let (telegram_counter, transmit_time_us) = (7, 1_005_600);
    ScanTelegram {
        telegram_counter,
        transmit_time_us,
        modules: Modules(vec![module]),
        ..ScanTelegram::default()
    }
    .seal()
}

#[test]
fn the_published_scan_is_read_and_written_to_the_byte() {
    let bytes = hex(TWO_BEAMS);
    assert_eq!(bytes.len(), 122);
    assert_eq!(Telegram::decode(&bytes), Ok(Telegram::Scan(two_beams())));
    assert_eq!(encoded(&Telegram::Scan(two_beams())), bytes);
    let Telegram::Scan(scan) = Telegram::decode(&bytes).unwrap() else { panic!("no scan") };
    let deg = theta_rad(scan.modules.0[0].beams.theta[0]).to_degrees();
    assert!((-48.011..=-48.0).contains(&deg), "{deg}");
}

#[test]
fn the_published_imu_telegram_is_read_and_written_to_the_byte() {
    // Acceleration 0, 0, 9.81; unit quaternion; 1 s. The CRC was computed with zlib.
    let imu = Imu {
        acceleration_m_s2: [0.0, 0.0, 9.81],
        orientation_wxyz: [1.0, 0.0, 0.0, 0.0],
        time_us: 1_000_000,
        ..Imu::default()
    };
    let bytes = encoded(&Telegram::Imu(imu.clone()));
    assert_eq!((bytes.len(), &bytes[60..]), (64, &hex("8626dec6")[..]));
    assert_eq!(Telegram::decode(&bytes), Ok(Telegram::Imu(imu)));
}

#[test]
fn an_encoder_telegram_is_as_long_as_a_real_one() {
    let encoder = Encoder { tick: 40, speed: 1000.0, frame_number: 160, ..Encoder::default() };
    let bytes = encoded(&Telegram::Encoder(encoder.clone()));
    // 52 bytes behind the length, as a picoScan150 sends it.
    assert_eq!((bytes.len(), &bytes[28..32]), (88, &[52, 0, 0, 0][..]));
    assert_eq!(Telegram::decode(&bytes), Ok(Telegram::Encoder(encoder)));
}

#[test]
fn modules_have_the_sizes_of_real_ones() {
    // Lines, beams, echoes and size in real telegrams: picoScan150, multiScan136 (two kinds of modules), LRS4581.
    for (lines, beams, echoes, bytes) in
        [(1, 60, 3, 972), (7, 30, 3, 3390), (1, 240, 3, 3672), (1, 1500, 1, 10_572)]
    {
        let module = Module { shape: Shape { lines, beams, echoes }, ..Module::default() };
        assert_eq!(module.bytes(Version::V4), bytes);
        // Version 3 has no scale of distances.
        assert_eq!(module.bytes(Version::V3), bytes - 4);
    }
}

#[test]
fn version_3_has_the_angle_before_the_properties() {
    let mut scan = two_beams();
    scan.version = Version::V3;
    scan.modules.0[0].beams.properties = vec![1, 0];
    let bytes = encoded(&Telegram::Scan(scan.clone().seal()));
    assert_eq!(bytes.len(), 118);
    assert_eq!(bytes[100..107], [0xb8, 0x0b, 0xa4, 0xa4, 0xef, 0x2e, 1]);
    assert_eq!(Telegram::decode(&bytes), Ok(Telegram::Scan(scan.seal())));
}

/// With this number (little-endian) at `at`, and the CRC made right again.
fn forged(at: usize, number: u32) -> Vec<u8> {
    let mut bytes = hex(TWO_BEAMS);
    bytes[at..at + 4].copy_from_slice(&number.to_le_bytes());
    let end = bytes.len() - 4;
    let crc = crc32(&bytes[..end]);
    bytes[end..].copy_from_slice(&crc.to_le_bytes());
    bytes
}

#[test]
fn hostile_counts_are_refused_where_they_stand() {
    const LARGE: u64 = u32::MAX as u64;
    for (at, number, expected, found) in [
        (4, 9, Expected::Type, 9),
        (24, 5, Expected::Version, 5),
        // The module's size: more than there is, or not what its counts say.
        (28, u32::MAX, Expected::Bytes(LARGE), 86),
        (28, 85, Expected::ModuleSize(86), 85),
        (52, u32::MAX, Expected::Lines, LARGE),
        (52, 0, Expected::Lines, 0),
        (56, u32::MAX, Expected::Beams, LARGE),
        (56, MAX_BEAMS, Expected::Bytes(7 * u64::from(MAX_BEAMS)), 14),
        (60, u32::MAX, Expected::Echoes, LARGE),
        (60, 0, Expected::Echoes, 0),
        // One more module, of which nothing is there.
        (96, 0x1000, Expected::Bytes(0x1000), 0),
    ] {
        let error = Telegram::decode(&forged(at, number)).unwrap_err();
        assert_eq!((error.expected, error.found), (expected, found), "{number} at {at}: {error}");
    }
    let error = Telegram::decode(&forged(56, u32::MAX)).unwrap_err();
    assert_eq!(error.at, 56);
    assert_eq!(
        error.to_string(),
        "expected at most 65536 beams, found 4294967295 at byte 56 of the telegram"
    );
}

/// 2^38 echoes of which nothing is sent: to go through them would take an hour.
#[test]
fn beams_of_which_nothing_is_sent_cost_nothing() {
    let lines = 64;
    let module = Module {
        shape: Shape { lines, beams: MAX_BEAMS, echoes: 16 },
        time_start_us: PerLine(vec![0; lines as usize]),
        time_stop_us: PerLine(vec![0; lines as usize]),
        phi_rad: PerLine(vec![0.0; lines as usize]),
        theta_start_rad: PerLine(vec![0.0; lines as usize]),
        theta_stop_rad: PerLine(vec![0.0; lines as usize]),
        content: Content { echo: 0, beam: 0 },
        ..Module::default()
    };
    let telegram = ScanTelegram { modules: Modules(vec![module; 64]), ..ScanTelegram::default() }.seal();
    let telegram = Telegram::Scan(telegram);
    assert_eq!(Telegram::decode(&encoded(&telegram)), Ok(telegram));
}

#[test]
fn a_flipped_bit_is_told_by_the_checksum() {
    let mut bytes = hex(TWO_BEAMS);
    bytes[104] ^= 0x10;
    let error = Telegram::decode(&bytes).unwrap_err();
    assert_eq!(error.at, 118);
    assert!(error.to_string().ends_with("found 86ACCCA1 at byte 118 of the telegram"), "{error}");
}

#[test]
fn lists_that_contradict_the_counts_are_not_sent() {
    let mut scan = two_beams();
    scan.modules.0[0].beams.distance.pop();
    let mut bytes = Vec::new();
    let error = Telegram::Scan(scan).encode(&mut bytes).unwrap_err();
    assert_eq!((error.part, error.expected, error.found), ("distance", 2, 1));
    let unsealed = ScanTelegram { module_bytes: Default::default(), ..two_beams() };
    assert_eq!(Telegram::Scan(unsealed).encode(&mut bytes).unwrap_err().part, "module_bytes");
    assert!(bytes.is_empty());
}

fn finite() -> impl Strategy<Value = f32> {
    any::<f32>().prop_filter("comparable", |value| !value.is_nan())
}

prop_compose! {
    fn module()(
        shape in (1_u32..4, 0_u32..5, 1_u32..4).prop_map(|(lines, beams, echoes)| Shape { lines, beams, echoes }),
        content in (0_u8..4, 0_u8..4).prop_map(|(echo, beam)| Content { echo, beam }),
    )(
        numbers in any::<(u64, u64, u32, u8, u8)>(),
        times in prop::collection::vec(any::<u64>(), 2 * shape.lines as usize),
        angles in prop::collection::vec(finite(), 3 * shape.lines as usize),
        scale in finite(),
        echoes in prop::collection::vec(any::<(u16, u16)>(), shape.beams_of_lines() * shape.echoes as usize),
        beams in prop::collection::vec(any::<(u8, u16)>(), shape.beams_of_lines()),
        shape in Just(shape),
        content in Just(content),
    ) -> Module {
        let lines = shape.lines as usize;
        let (segment_counter, frame_number, sender_id, availability, reserved) = numbers;
        let sent = |is_sent: bool, values: Vec<u16>| if is_sent { values } else { Vec::new() };
        Module {
            segment_counter, frame_number, sender_id, shape, availability, content, reserved,
            time_start_us: PerLine(times[..lines].to_vec()),
            time_stop_us: PerLine(times[lines..].to_vec()),
            phi_rad: PerLine(angles[..lines].to_vec()),
            theta_start_rad: PerLine(angles[lines..2 * lines].to_vec()),
            theta_stop_rad: PerLine(angles[2 * lines..].to_vec()),
            distance_scale: DistanceScale(scale),
            beams: Beams {
                distance: sent(content.has_distance(), echoes.iter().map(|echo| echo.0).collect()),
                rssi: sent(content.has_rssi(), echoes.iter().map(|echo| echo.1).collect()),
                properties: if content.has_properties() { beams.iter().map(|beam| beam.0).collect() } else { Vec::new() },
                theta: sent(content.has_theta(), beams.iter().map(|beam| beam.1).collect()),
            },
            ..Module::default()
        }
    }
}

prop_compose! {
    fn scan()(
        numbers in any::<(u64, u64)>(),
        version in prop::sample::select(vec![Version::V3, Version::V4]),
        mut modules in prop::collection::vec(module(), 0..4),
    ) -> Telegram {
        if version == Version::V3 {
            modules.iter_mut().for_each(|module| module.distance_scale = DistanceScale::default());
        }
        let (telegram_counter, transmit_time_us) = numbers;
        let modules = Modules(modules);
        Telegram::Scan(ScanTelegram { telegram_counter, transmit_time_us, version, modules, ..ScanTelegram::default() }.seal())
    }
}

prop_compose! {
    fn imu()(a in prop::array::uniform3(finite()), r in prop::array::uniform3(finite()), q in prop::array::uniform4(finite()), t in any::<u64>()) -> Telegram {
        Telegram::Imu(Imu { acceleration_m_s2: a, rate_rad_s: r, orientation_wxyz: q, time_us: t, ..Imu::default() })
    }
}

prop_compose! {
    fn encoder()(a in any::<[u64; 6]>(), b in any::<[u32; 4]>(), speed in finite()) -> Telegram {
        let [telegram_counter, transmit_time_us, frame_number, tick_time_us, ref1_time_us, ref2_time_us] = a;
        let [sender_id, tick, tick_ref1, tick_ref2] = b;
        Telegram::Encoder(Encoder { telegram_counter, transmit_time_us, frame_number, tick_time_us, ref1_time_us, ref2_time_us,
            sender_id, tick, tick_ref1, tick_ref2, speed, ..Encoder::default() })
    }
}

fn any_telegram() -> impl Strategy<Value = Telegram> {
    prop_oneof![4 => scan(), 1 => imu(), 1 => encoder()]
}

/// What a stream of these pieces holds.
fn found(pieces: &[&[u8]]) -> Vec<Found> {
    let mut decoder = StreamDecoder::default();
    let mut found = Vec::new();
    for piece in pieces {
        decoder.push(piece);
        found.extend(std::iter::from_fn(|| decoder.next_found()));
    }
    decoder.finish();
    found.extend(std::iter::from_fn(|| decoder.next_found()));
    assert_eq!(decoder.pending(), 0);
    found
}

proptest! {
    #[test]
    fn what_is_written_is_read(telegram in any_telegram()) {
        let bytes = encoded(&telegram);
        prop_assert_eq!(Telegram::decode(&bytes), Ok(telegram));
    }

    #[test]
    fn every_changed_byte_is_refused(telegram in any_telegram(), at in any::<prop::sample::Index>(), flip in 1..=255_u8) {
        let mut bytes = encoded(&telegram);
        let at = at.index(bytes.len());
        bytes[at] ^= flip;
        prop_assert!(Telegram::decode(&bytes).is_err());
    }

    #[test]
    fn every_cut_and_every_byte_more_is_refused(telegram in any_telegram(), at in any::<prop::sample::Index>()) {
        let mut bytes = encoded(&telegram);
        prop_assert!(Telegram::decode(&bytes[..at.index(bytes.len())]).is_err());
        bytes.push(0);
        prop_assert!(Telegram::decode(&bytes).is_err());
    }

    #[test]
    fn any_fields_with_a_right_checksum_are_read_or_refused(mut bytes in prop::collection::vec(any::<u8>(), 0..200), kind in 1..5_u8) {
        let head = [2, 2, 2, 2, kind, 0, 0, 0];
        bytes.splice(..0, head);
        bytes.extend(crc32(&bytes).to_le_bytes());
        if let Ok(telegram) = Telegram::decode(&bytes) {
            prop_assert_eq!(encoded(&telegram), bytes);
        }
    }

    #[test]
    fn a_stream_gives_the_same_in_any_pieces(
        telegrams in prop::collection::vec(any_telegram(), 1..5),
        junk in prop::collection::vec(any::<u8>(), 0..20),
        cut in any::<prop::sample::Index>(),
    ) {
        let mut bytes: Vec<u8> = junk.clone();
        telegrams.iter().for_each(|telegram| telegram.encode(&mut bytes).unwrap());
        let (one, other) = bytes.split_at(cut.index(bytes.len()));
        let in_pieces = found(&[one, other]);
        // What is no telegram is one thing, however its bytes come.
        let bytewise: Vec<&[u8]> = bytes.chunks(1).collect();
        prop_assert_eq!(summary(&found(&bytewise)), summary(&found(&[&bytes])));
        prop_assert_eq!(summary(&in_pieces), summary(&found(&[&bytes])));
        let good: Vec<Telegram> = in_pieces.iter().filter_map(|found| match found {
            Found::Telegram { telegram, .. } => Some(telegram.clone()),
            Found::Bad { .. } => None,
        }).collect();
        prop_assert_eq!(good, telegrams);
        // Every byte is told once, in order.
        let mut told = 0;
        for found in &in_pieces {
            let (Found::Telegram { offset, len, .. } | Found::Bad { offset, len, .. }) = found;
            prop_assert_eq!(*offset, told);
            told += *len as u64;
        }
        prop_assert_eq!(told, bytes.len() as u64);
    }
}

proptest! {
    #[test]
    fn a_changed_bit_is_one_bad_telegram_however_the_bytes_come(
        telegrams in prop::collection::vec(any_telegram(), 3..6),
        which in any::<prop::sample::Index>(),
        at in any::<prop::sample::Index>(),
        bit in 0..8_u8,
    ) {
        let mut datagrams: Vec<Vec<u8>> = telegrams.iter().map(encoded).collect();
        let damaged = which.index(datagrams.len());
        let at = at.index(datagrams[damaged].len());
        datagrams[damaged][at] ^= 1 << bit;
        let pieces: Vec<&[u8]> = datagrams.iter().map(Vec::as_slice).collect();
        let bytes = datagrams.concat();
        for found in [found(&pieces), found(&[&bytes]), found(&bytes.chunks(7).collect::<Vec<_>>())] {
            let bad = found.iter().filter(|found| matches!(found, Found::Bad { .. })).count();
            prop_assert_eq!((bad, found.len()), (1, telegrams.len()));
        }
    }
}

/// Place, length and error of all stretches; telegrams by their length alone, as a NaN equals nothing.
fn summary(found: &[Found]) -> Vec<(u64, usize, Option<String>)> {
    let one = |found: &Found| match found {
        Found::Telegram { offset, len, .. } => (*offset, *len, None),
        Found::Bad { offset, len, error } => (*offset, *len, Some(format!("{error:?}"))),
    };
    found.iter().map(one).collect()
}

#[test]
fn telegrams_behind_a_damaged_one_are_found() {
    let good = hex(TWO_BEAMS);
    // The damaged one claims to be 16 KiB longer than it is.
    let mut damaged = good.clone();
    damaged[29] = 0x40;
    let all = found(&[&good, &damaged, &good, &good[..50]]);
    let places: Vec<(u64, bool)> = all
        .iter()
        .map(|found| match found {
            Found::Telegram { offset, .. } => (*offset, true),
            Found::Bad { offset, .. } => (*offset, false),
        })
        .collect();
    assert_eq!(places, [(0, true), (122, false), (244, true), (366, false)]);
}
