//! Turns put together from datagrams: lost, twice, late, in another order, mutated, and of a scanner that has restarted.

use std::collections::BTreeSet;
use std::time::Duration;

use proptest::prelude::*;
use rowscan_protocol::compact::{CompactListener, REORDER, ScanTelegram, Telegram, crc32};
use rowscan_protocol::device::{Device, MeasuredEcho, MeasuredLine};
use rowscan_protocol::host::{HostEvent, HostSession};
use rowscan_protocol::random::{Rng, Stream};
use rowscan_protocol::scan::{NO_ECHO, Scan};
use rowscan_protocol::time::SimTime;

use crate::datagrams::{self, scan_of};
use crate::picoscan::streaming;

/// Turns of a device, each with what was measured and its datagrams.
struct Turns {
    lines: Vec<Vec<MeasuredEcho>>,
    datagrams: Vec<Vec<Vec<u8>>>,
    scans: Vec<Scan>,
}

/// What nobody else measures: each beam of each turn has ranges of its own, and every seventh none.
fn line(device: &Device, turn: u16) -> Vec<MeasuredEcho> {
    let count = device.mirror().beams.len() as u16;
    let range_mm = |echo: u16, beam: u16| {
        if beam.is_multiple_of(7) { 0 } else { 1000 + 7000 * echo + (beam * 3 + turn * 11) % 6000 }
    };
    let echo = |echo: u16| MeasuredEcho {
        range_mm: (0..count).map(|beam| range_mm(echo, beam)).collect(),
        remission: (0..count).map(|beam| 0x1000 + beam).collect(),
    };
    (0..3).map(echo).collect()
}

fn turns(profile: u8, count: u16) -> Turns {
    let mut device = streaming(profile);
    let mut turns = Turns { lines: Vec::new(), datagrams: Vec::new(), scans: Vec::new() };
    for number in 0..count {
        let echoes = line(&device, number);
        let hertz = f64::from(device.mirror().frequency_centihz) / 100.0;
        let at = SimTime::ZERO + Duration::from_secs_f64(f64::from(number) / hertz);
        let line = MeasuredLine { grid: device.mirror().beams, echoes: &echoes };
        let (mut scan, mut datagrams) = (Scan::default(), Vec::new());
        device.measure(at, &line).unwrap().to_scan_into(&mut scan).unwrap();
        device.segments(at, &[line], &mut datagrams);
        let sent = datagrams.into_iter().map(|datagram| device.send(datagram).unwrap().1).collect();
        turns.lines.push(echoes);
        turns.datagrams.push(sent);
        turns.scans.push(scan);
    }
    turns
}

/// The scans that come of these datagrams.
fn heard<'a>(datagrams: impl IntoIterator<Item = &'a Vec<u8>>) -> (Vec<Scan>, CompactListener) {
    datagrams::heard(datagrams, |_| {})
}

fn encoded(scan: ScanTelegram) -> Vec<u8> {
    let mut bytes = Vec::new();
    Telegram::Scan(scan.seal()).encode(&mut bytes).unwrap();
    bytes
}

#[test]
fn a_whole_turn_is_the_scan_that_cola_sends_of_it() {
    for (profile, segments) in [(1, 10), (2, 10), (3, 10), (5, 10), (8, 5), (9, 10), (10, 5), (11, 10)] {
        let turns = turns(profile, 4);
        assert!(turns.datagrams.iter().all(|sent| sent.len() == segments), "profile {profile}");
        let (scans, listener) = heard(turns.datagrams.iter().flatten());
        assert_eq!(scans.len(), 4, "profile {profile}");
        for (found, cola) in scans.iter().zip(&turns.scans) {
            assert_eq!(found.beams, cola.beams, "profile {profile}");
            assert_eq!(found.scan_frequency_hz, cola.scan_frequency_hz, "profile {profile}");
            assert_eq!(found.echoes[0].range_m, cola.echoes[0].range_m, "profile {profile}");
            assert_eq!((found.echoes.len(), found.serial_number), (3, cola.serial_number));
            // A step of the clock is a microsecond.
            assert!(found.scan_time_us.abs_diff(cola.scan_time_us) <= 1, "profile {profile}");
        }
        let numbers: Vec<u16> = scans.iter().map(|scan| scan.telegram_counter).collect();
        assert!(numbers.windows(2).all(|pair| pair[1] == pair[0] + 1), "{numbers:?}");
        assert_eq!(listener.segments().lost, 0);
    }
}

/// What a channel does to datagrams: each is dropped, doubled, or overtaken by up to [`REORDER`] others.
fn channel(sent: &[Vec<u8>], seed: u64, drop: f64) -> (Vec<Vec<u8>>, BTreeSet<usize>) {
    let mut random = Stream::keyed(seed, &[0xC0]);
    let (mut due, mut dropped) = (Vec::new(), BTreeSet::new());
    for place in 0..sent.len() {
        if random.unit() < drop {
            dropped.insert(place);
            continue;
        }
        let late = if random.unit() < 0.3 { random.next_u64() % REORDER } else { 0 };
        due.push((place as u64 + late, place));
        if random.unit() < 0.1 {
            due.push((place as u64 + random.next_u64() % 8, place));
        }
    }
    due.sort();
    (due.into_iter().map(|(_, place)| sent[place].clone()).collect(), dropped)
}

/// The place of a turn's beam in its segment, for segments of so many beams.
fn segment_of(beam: usize, beams: usize, segments: usize) -> usize {
    (beam / beams).min(segments - 1)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// What comes out is what was sent, less exactly what was dropped, and that is told as unknown.
    #[test]
    fn nothing_is_missing_but_what_was_dropped(seed in any::<u64>(), drop in 0.0..0.4_f64, wide in any::<bool>()) {
        let (profile, segments, width) = if wide { (7, 5, 240) } else { (1, 10, 60) };
        let turns = turns(profile, 8);
        let sent: Vec<Vec<u8>> = turns.datagrams.iter().flatten().cloned().collect();
        let (received, dropped) = channel(&sent, seed, drop);
        let (scans, listener) = heard(&received);
        let mut shown = BTreeSet::new();
        for scan in &scans {
            let turn = usize::from(scan.scan_counter);
            shown.insert(turn);
            let whole = &turns.lines[turn];
            // Until a first segment has come, nobody knows how far out beams go.
            let first = ((scan.beams.angle_deg(0) + 48.0) / scan.beams.step_deg()).round() as usize;
            for (beam, range_m) in (first..).zip(&scan.echoes[0].range_m) {
                let raw = whole[0].range_mm[beam];
                let is_lost = dropped.contains(&(turn * segments + segment_of(beam, width, segments)));
                let expected = if raw == 0 { NO_ECHO } else { f64::from(raw) / 1000.0 };
                prop_assert!(
                    if is_lost { range_m.is_nan() } else { *range_m == expected },
                    "turn {turn}, beam {beam}: {range_m}, lost: {is_lost}, sent: {expected}"
                );
            }
            // Beams beyond those of the grid are not known either.
            for beam in (0..first).chain(first + scan.beams.len()..whole[0].range_mm.len()) {
                prop_assert!(dropped.contains(&(turn * segments + segment_of(beam, width, segments))));
            }
            let begun_us = (first as f64 * scan.beams.step_deg() / 360.0 / scan.scan_frequency_hz * 1e6) as u32;
            let expected_us = turns.scans[turn].scan_time_us + begun_us;
            prop_assert!(scan.scan_time_us.abs_diff(expected_us) <= 2, "{turn}");
        }
        let came: BTreeSet<usize> = (0..sent.len()).filter(|place| !dropped.contains(place)).collect();
        let has = |turn: usize, segment| came.contains(&(turn * segments + segment));
        let heard_first = came.first().map_or(0, |place| place / segments);
        let heard_last = came.last().map_or(0, |place| place / segments);
        for turn in 0..turns.lines.len() {
            let came_at_all = (0..segments).any(|segment| has(turn, segment));
            // A turn that was under way when the stream was first heard, or last, is no whole one.
            let is_cut = turn == heard_first && !has(turn, 0) || turn == heard_last && !has(turn, segments - 1);
            prop_assert!(shown.contains(&turn) == came_at_all || is_cut, "turn {turn}");
        }
        let between = came.first().zip(came.last()).map_or(0, |(first, last)| last - first + 1);
        prop_assert_eq!(listener.segments().lost, (between - came.len()) as u64);
        prop_assert!(scans.windows(2).all(|pair| pair[0].scan_counter < pair[1].scan_counter));
        // The counter that an estimate goes by stands for lost turns as well.
        let counters = |scan: &Scan| scan.telegram_counter - scan.scan_counter;
        prop_assert!(scans.windows(2).all(|pair| counters(&pair[1]) == counters(&pair[0])));
    }

    /// Bytes that a peer sends on purpose, with a right CRC, are refused or give a scan, and what follows is read again.
    #[test]
    fn mutated_segments_are_told_and_pass(seed in any::<u64>()) {
        let turns = turns(1, 20);
        let mut random = Stream::keyed(seed, &[0xB4D]);
        let mut sent: Vec<Vec<u8>> = turns.datagrams.iter().flatten().cloned().collect();
        // Who forges the number of a later turn has a segment in it.
        let mut claimed = BTreeSet::new();
        for datagram in sent.iter_mut().skip(10).take(50) {
            if random.unit() < 0.3 {
                // Of the header and the module's metadata, and now and then of its beams.
                let end = if random.unit() < 0.8 { 104 } else { datagram.len() - 4 };
                let at = 8 + (random.next_u64() as usize) % (end - 8);
                datagram[at] ^= 1 << (random.next_u64() % 8);
                let summed = datagram.len() - 4;
                if random.unit() < 0.8 {
                    let crc = crc32(&datagram[..summed]).to_le_bytes();
                    datagram[summed..].copy_from_slice(&crc);
                }
                if let Ok(Telegram::Scan(forged)) = Telegram::decode(datagram) {
                    claimed.extend(forged.modules.0.iter().map(|module| module.frame_number));
                }
            }
        }
        let (scans, _) = heard(&sent);
        for scan in &scans {
            prop_assert!(scan.echoes.iter().all(|echo| echo.range_m.len() == scan.beams.len()));
        }
        // Half a second after the last of them all is well: the counters of 64 telegrams are remembered.
        for (turn, whole) in turns.scans.iter().enumerate().skip(14) {
            if claimed.contains(&(turn as u64)) {
                continue;
            }
            let found = scans.iter().find(|scan| usize::from(scan.scan_counter) == turn);
            let found = found.map(|scan| (scan.beams, &scan.echoes[0].range_m));
            prop_assert!(
                found == Some((whole.beams, &whole.echoes[0].range_m)),
                "turn {turn}: beams {:?}, expected {:?}",
                found.map(|(beams, _)| beams),
                whole.beams
            );
        }
    }
}

#[test]
fn what_is_overtaken_by_more_is_lost_and_harms_nothing_else() {
    let turns = turns(1, 6);
    let mut sent: Vec<Vec<u8>> = turns.datagrams.iter().flatten().cloned().collect();
    let late = sent.remove(23);
    sent.insert(40, late);
    let (scans, listener) = heard(&sent);
    assert_eq!((scans.len(), listener.segments().lost), (6, 1));
    let unknown: Vec<usize> = scans
        .iter()
        .map(|scan| scan.echoes[0].range_m.iter().filter(|range| range.is_nan()).count())
        .collect();
    assert_eq!(unknown, [0, 0, 60, 0, 0, 0]);
}

#[test]
fn a_scanner_that_restarts_is_followed() {
    let (before, after) = (turns(1, 20), turns(1, 5));
    let (scans, listener) = heard(before.datagrams.iter().chain(&after.datagrams).flatten());
    assert_eq!((scans.len(), listener.segments().lost), (25, 0));
    let anew: Vec<usize> = (0..).zip(&scans).filter(|(_, scan)| scan.begins_anew).map(|(n, _)| n).collect();
    assert_eq!(anew, [20]);
    // One that was heard for so short a time that its counters could be late ones: after some turns it is.
    let (before, after) = (turns(1, 3), turns(1, 12));
    let (scans, _) = heard(before.datagrams.iter().chain(&after.datagrams).flatten());
    let last = scans.last().map(|scan| scan.scan_counter);
    // Heard again when it has turned more often than before, it looks as if turns were missing: only telegrams are counted anew.
    let (before, after) = (turns(1, 9), turns(1, 16));
    let first = scan_of(&after.datagrams[12][0]).telegram_counter;
    let late = after.datagrams[12..].iter().flatten().map(|datagram| {
        let mut scan = scan_of(datagram);
        scan.telegram_counter -= first - 1;
        encoded(scan)
    });
    let sent: Vec<_> = before.datagrams.iter().flatten().cloned().chain(late).collect();
    let (again, _) = heard(&sent);
    let mut counting = rowscan_protocol::counting::Counting::default();
    for scan in &again {
        counting.observe(scan);
    }
    assert_eq!(
        (counting.restarts, counting.lost),
        (1, 0),
        "{:?}",
        again.iter().map(|scan| scan.scan_counter).collect::<Vec<_>>()
    );
    assert!(scans.len() >= 10 && last == Some(11), "{} scans up to {last:?}", scans.len());
}

#[test]
fn one_absurd_number_costs_no_more_than_its_turn() {
    let turns = turns(1, 8);
    for set in [
        (|scan: &mut ScanTelegram| scan.telegram_counter = u64::MAX) as fn(&mut ScanTelegram),
        |scan| scan.telegram_counter = 0,
        |scan| scan.modules.0[0].frame_number = u64::MAX,
        |scan| scan.modules.0[0].frame_number = 0,
        |scan| scan.modules.0[0].segment_counter = u64::MAX,
        |scan| scan.modules.0[0].segment_counter = 63,
        |scan| scan.modules.0[0].time_start_us.0[0] = u64::MAX,
        |scan| scan.modules.0[0].theta_stop_rad.0[0] = f32::NAN,
        |scan| scan.modules.0[0].distance_scale.0 = 0.0,
    ] {
        let mut sent = turns.datagrams.clone();
        let mut scan = scan_of(&sent[4][3]);
        set(&mut scan);
        sent[4][3] = encoded(scan);
        let (scans, _) = heard(sent.iter().flatten());
        for turn in [0, 1, 2, 3, 6, 7] {
            let found = scans.iter().find(|scan| usize::from(scan.scan_counter) == turn);
            assert_eq!(found.map(|scan| &scan.echoes[0]), Some(&turns_scan(&turns, turn)), "turn {turn}");
        }
    }
}

/// The first echo of a turn as Compact has it: RSSI in both bytes.
fn turns_scan(turns: &Turns, turn: usize) -> rowscan_protocol::scan::Echo {
    let remission =
        |(range_mm, remission): (&u16, &u16)| if *range_mm == 0 { 0 } else { remission / 256 * 257 };
    let line = &turns.lines[turn][0];
    rowscan_protocol::scan::Echo {
        range_m: turns.scans[turn].echoes[0].range_m.clone(),
        remission: line.range_mm.iter().zip(&line.remission).map(remission).collect(),
    }
}

#[test]
fn what_no_scan_can_be_made_of_says_why() {
    let turns = turns(1, 1);
    let first = scan_of(&turns.datagrams[0][0]);
    for (set, said) in [
        (
            (|scan: &mut ScanTelegram| scan.modules.0.push(scan.modules.0[0].clone()))
                as fn(&mut ScanTelegram),
            "two of its lines have the elevation 0°",
        ),
        (
            |scan| {
                scan.modules.0.push(scan.modules.0[0].clone());
                scan.modules.0[1].segment_counter += 1;
            },
            "of several segments",
        ),
        (|scan| scan.modules.0.clear(), "it has no modules"),
        (|scan| scan.modules.0[0].phi_rad.0[0] = 2.0, "elevation is 114.59"),
        (|scan| scan.modules.0[0].phi_rad.0[0] = f32::NAN, "elevation is NaN"),
        (|scan| scan.modules.0[0].segment_counter = 64, "number 64, expected below 64"),
        (|scan| scan.modules.0[0].theta_stop_rad.0[0] = 20.0, "its beams go from"),
        (|scan| scan.modules.0[0].theta_stop_rad.0[0] += 0.1, "off its place"),
        (|scan| scan.modules.0[0].distance_scale.0 = 100.0, "scale factor is 100"),
    ] {
        let mut scan = first.clone();
        set(&mut scan);
        let mut listener = CompactListener::default();
        listener.handle_datagram(Duration::ZERO, &encoded(scan));
        let Some(HostEvent::Malformed { fault }) = listener.poll_event() else { panic!("taken: {said}") };
        assert!(fault.to_string().contains(said), "{fault}");
    }
}
