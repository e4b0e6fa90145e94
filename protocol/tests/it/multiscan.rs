//! multiScan136: 16 lines a turn in four modules a telegram, put together again line by line.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use crate::bench::Bench;
use crate::datagrams::{self, scan_of};
use proptest::prelude::*;
use rowscan_protocol::compact::{CompactListener, Module, Telegram, theta_rad};
use rowscan_protocol::device::{Device, Identity, MeasuredEcho, MeasuredLine, Mirror};
use rowscan_protocol::host::{HostEvent, HostSession};
use rowscan_protocol::model::by_name;
use rowscan_protocol::random::Stream;
use rowscan_protocol::scan::{NO_ECHO, Scan, elevation_deg};
use rowscan_protocol::time::SimTime;

const MODEL: &str = "multiscan136";
/// Elevations by a public client's table, highest first, 1/1000°.
const TABLE: [i32; 16] = [
    22_710, 17_560, 12_480, 7_510, 2_490, 70, -2_430, -7_290, -12_790, -17_280, -21_940, -26_730, -31_860,
    -34_420, -37_180, -42_790,
];
/// The client is told where a layer is farther off than this.
const CLIENT_TAKES_DEG: f64 = 1.5;

/// A unit that streams to this machine.
fn streaming(unit: u64) -> Bench {
    let mut bench = Bench::new(MODEL);
    bench.device = Device::new(by_name(MODEL).unwrap(), Identity { unit, ..Identity::default() });
    bench.table(&[
        ("sMN SetAccessMode 4 81BE23AA", "sAN SetAccessMode 1"),
        ("sWN ScanDataEthSettings 1 +127 +0 +0 +1 +2115", "sWA ScanDataEthSettings"),
        ("sWN ScanDataEnable 1", "sWA ScanDataEnable"),
    ]);
    bench
}

/// What nobody else measures: each beam of each line of each turn has ranges of its own, and every seventh none.
fn echoes(mirror: &Mirror, line: usize, turn: u16) -> Vec<MeasuredEcho> {
    let range_mm = |echo: u16, beam: u16| {
        let own = 1000 + 9000 * echo + 97 * line as u16 + (beam * 3 + turn * 11) % 6000;
        if beam.is_multiple_of(7) { 0 } else { own }
    };
    let echo = |echo: u16| MeasuredEcho {
        range_mm: (0..mirror.beams.count).map(|beam| range_mm(echo, beam)).collect(),
        remission: (0..mirror.beams.count).map(|beam| 0x1000 + beam).collect(),
    };
    (0..3).map(echo).collect()
}

/// Turns of a device, each with what its lines measured and its datagrams.
struct Turns {
    mirrors: Vec<Mirror>,
    lines: Vec<Vec<Vec<MeasuredEcho>>>,
    datagrams: Vec<Vec<Vec<u8>>>,
    /// The level line of each as CoLa sends it.
    scans: Vec<Scan>,
}

fn turns(device: &mut Device, count: u16) -> Turns {
    let mirrors = device.mirrors();
    let (mut lines, mut datagrams, mut scans) = (Vec::new(), Vec::new(), Vec::new());
    for turn in 0..count {
        let measured: Vec<_> =
            mirrors.iter().enumerate().map(|(line, mirror)| echoes(mirror, line, turn)).collect();
        let of = |(mirror, echoes): (&Mirror, &Vec<MeasuredEcho>)| (mirror.beams, echoes.clone());
        let kept: Vec<_> = mirrors.iter().zip(&measured).map(of).collect();
        let given: Vec<_> = kept.iter().map(|(grid, echoes)| MeasuredLine { grid: *grid, echoes }).collect();
        let at = SimTime::ZERO + Duration::from_millis(50) * u32::from(turn);
        let (mut scan, mut waiting) = (Scan::default(), Vec::new());
        device.measure(at, &given[0]).unwrap().to_scan_into(&mut scan).unwrap();
        device.segments(at, &given, &mut waiting);
        datagrams.push(waiting.into_iter().map(|datagram| device.send(datagram).unwrap().1).collect());
        lines.push(measured);
        scans.push(scan);
    }
    Turns { mirrors, lines, datagrams, scans }
}

fn heard<'a>(datagrams: impl IntoIterator<Item = &'a Vec<u8>>) -> (Vec<Scan>, CompactListener) {
    datagrams::heard(datagrams, |other| panic!("{other:?}"))
}

fn shapes(modules: &[Module]) -> Vec<[u32; 3]> {
    modules.iter().map(|module| [module.shape.lines, module.shape.beams, module.shape.echoes]).collect()
}

#[test]
fn telegrams_are_laid_out_as_recorded_ones() {
    let mut bench = streaming(7);
    let turns = turns(&mut bench.device, 2);
    let mut over_half_a_turn = 0;
    for (number, datagram) in turns.datagrams[1].iter().enumerate() {
        // As SICK's recorded ones with three echoes.
        assert_eq!(datagram.len(), 14_160);
        let scan = scan_of(datagram);
        let modules = &scan.modules.0;
        assert_eq!(shapes(modules), [[7, 30, 3], [7, 30, 3], [1, 240, 3], [1, 240, 3]]);
        assert_eq!(scan.module_bytes.0, 3390);
        assert_eq!(
            modules.iter().map(|module| module.next_module_bytes.0).collect::<Vec<_>>(),
            [3390, 3672, 3672, 0]
        );
        assert!(
            modules.iter().all(|module| module.segment_counter == number as u64 && module.frame_number == 1)
        );
        // All lines begin and end together.
        let times = |of: fn(&Module) -> &Vec<u64>| modules.iter().flat_map(of).collect::<BTreeSet<_>>();
        let (start, stop) = (times(|module| &module.time_start_us.0), times(|module| &module.time_stop_us.0));
        let ([start], [stop]) = (&Vec::from_iter(start)[..], &Vec::from_iter(stop)[..]) else {
            panic!("several")
        };
        assert!(start.abs_diff(50_000 + number as u64 * 50_000 / 12) <= 1, "segment {number}: {start}");
        assert!((4_027..=4_028).contains(&(*stop - *start)), "segment {number}: {}", *stop - *start);
        assert!(
            (3_900..=10_000).contains(&(scan.transmit_time_us - **stop)),
            "{}",
            scan.transmit_time_us - **stop
        );
        for module in modules {
            for line in 0..module.shape.lines as usize {
                let [start, stop] =
                    [module.theta_start_rad.0[line], module.theta_stop_rad.0[line]].map(f64::from);
                assert!((-180.0..180.0).contains(&start.to_degrees()), "{}", start.to_degrees());
                over_half_a_turn += u32::from(stop.to_degrees() > 180.0);
                let steps = f64::from(module.shape.beams - 1);
                for beam in 0..module.shape.beams as usize {
                    let code = module.beams.theta[beam * module.shape.lines as usize + line];
                    let off = start + (stop - start) * beam as f64 / steps - theta_rad(code);
                    assert!((-1e-6..1.001 / 5215.0).contains(&off), "beam {beam}: {off}");
                }
            }
        }
    }
    // Each line passes there once a turn, between two segments or within one.
    assert!((12..=16).contains(&over_half_a_turn), "{over_half_a_turn}");
}

#[test]
fn each_unit_has_elevations_of_its_own_near_the_table() {
    let told = |unit: u64| {
        let mut bench = streaming(unit);
        let turns = turns(&mut bench.device, 1);
        let scan = scan_of(&turns.datagrams[0][5]);
        let phi_deg = |module: &Module| {
            module.phi_rad.0.iter().map(|phi| f64::from(*phi).to_degrees()).collect::<Vec<_>>()
        };
        scan.modules.0.iter().flat_map(phi_deg).collect::<Vec<_>>()
    };
    let mut first_of_units = BTreeSet::new();
    for unit in 0..200 {
        let phi_deg = told(unit);
        let mut sorted = phi_deg.clone();
        sorted.sort_by(|a, b| b.total_cmp(a));
        for (found, ideal) in sorted.iter().zip(TABLE) {
            // The layer that the client takes each for is the one it is.
            let nearest = TABLE.iter().min_by_key(|other| ((found * 1e3) as i32 - **other).abs());
            let off_deg = (found - f64::from(ideal) / 1e3).abs();
            assert!(nearest == Some(&ideal) && off_deg <= 0.71 && off_deg < CLIENT_TAKES_DEG, "{found}");
        }
        // The fine ones are number 6 and 14; the first module looks up.
        assert!(phi_deg[0] > 20.0 && phi_deg[14].abs() < 1.0 && (phi_deg[15] + 34.42).abs() < 1.0);
        first_of_units.insert((phi_deg[0] * 100.0).round() as i32);
    }
    assert!(first_of_units.len() > 60, "{}", first_of_units.len());
    assert_eq!(told(3), told(3));
}

#[test]
fn every_line_of_a_turn_is_a_scan_of_its_layer() {
    let mut bench = streaming(11);
    let turns = turns(&mut bench.device, 3);
    let (scans, listener) = heard(turns.datagrams.iter().flatten());
    assert_eq!((scans.len(), listener.segments().lost, listener.segments().taken), (3 * 16, 0, 36));
    let by_layer: BTreeMap<i16, usize> =
        turns.mirrors.iter().enumerate().map(|(line, mirror)| (mirror.layer_centideg, line)).collect();
    assert_eq!(by_layer.len(), 16);
    let mut counter = scans[0].telegram_counter;
    for scan in &scans {
        assert_eq!(scan.telegram_counter, counter);
        counter = counter.wrapping_add(1);
        let (turn, line) = (usize::from(scan.scan_counter), by_layer[&scan.layer_centideg]);
        let beams = turns.mirrors[line].beams;
        assert_eq!((scan.beams.step, scan.beams.count), (beams.step, beams.count), "line {line}");
        assert_eq!((scan.beams.start - beams.start).rem_euclid(3_600_000), 0, "line {line}");
        assert_eq!((scan.scan_frequency_hz, scan.echoes.len()), (20.0, 3));
        assert!(scan.scan_time_us.abs_diff(50_000 * turn as u32) <= 1, "{}", scan.scan_time_us);
        for (echo, found) in scan.echoes.iter().enumerate() {
            let sent = turns.lines[turn][line][echo].range_mm.iter();
            let sent: Vec<f64> =
                sent.map(|mm| if *mm == 0 { NO_ECHO } else { f64::from(*mm) / 1000.0 }).collect();
            assert_eq!(found.range_m, sent, "line {line}, echo {echo}");
        }
    }
    // The level one is the scan that CoLa sends.
    let level: Vec<_> = scans.iter().filter(|scan| by_layer[&scan.layer_centideg] == 0).collect();
    for (found, cola) in level.iter().zip(&turns.scans) {
        assert_eq!((found.beams, found.layer_centideg), (cola.beams, cola.layer_centideg));
        assert_eq!(found.echoes[0].range_m, cola.echoes[0].range_m);
        assert!(elevation_deg(found.layer_centideg).abs() < 1.0);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// What comes out is what was sent, less exactly what was dropped, in every line; datagrams that were lost are counted once and not by line.
    #[test]
    fn nothing_is_missing_but_what_was_dropped(seed in any::<u64>(), drop in 0.0..0.3_f64) {
        let mut bench = streaming(seed);
        let turns = turns(&mut bench.device, 5);
        let mut random = Stream::keyed(seed, &[0xC0]);
        let all: Vec<&Vec<u8>> = turns.datagrams.iter().flatten().collect();
        // The first segment comes, for a turn that was under way when the stream began is none; and the last turn, for the end cuts what hangs over.
        let is_dropped: Vec<bool> =
            (0..all.len()).map(|place| (1..48).contains(&place) && random.unit() < drop).collect();
        let came = all.iter().zip(&is_dropped).filter(|(_, dropped)| !**dropped).map(|(datagram, _)| *datagram);
        let (scans, listener) = heard(came);
        let dropped = is_dropped.iter().filter(|dropped| **dropped).count();
        prop_assert_eq!(listener.segments().lost, dropped as u64);
        for scan in &scans {
            let turn = usize::from(scan.scan_counter);
            let line = turns.mirrors.iter().position(|mirror| mirror.layer_centideg == scan.layer_centideg).unwrap();
            let beams = turns.mirrors[line].beams;
            prop_assert_eq!((scan.beams.start - beams.start).rem_euclid(3_600_000), 0);
            let a_segment = beams.len() / 12;
            // In the first turn nobody knows yet what follows the last segment that came; what is missing before it is a hole.
            let heard = if turn == 0 { is_dropped[..12].iter().rposition(|dropped| !dropped).unwrap() + 1 } else { 12 };
            if turn == 0 {
                prop_assert_eq!(scan.beams.len(), heard * a_segment);
            }
            prop_assert!(scan.beams.len() <= beams.len() && (turn < 4 || scan.beams.len() == beams.len()));
            prop_assert_eq!(scan.scan_frequency_hz, 20.0);
            prop_assert!(scan.scan_time_us.abs_diff(50_000 * turn as u32) <= 2, "turn {turn}: {}", scan.scan_time_us);
            for (beam, found) in scan.echoes[0].range_m.iter().enumerate() {
                let sent = turns.lines[turn][line][0].range_mm[beam];
                if is_dropped[turn * 12 + beam / a_segment] {
                    prop_assert!(found.is_nan(), "turn {turn}, line {line}, beam {beam}: {found}");
                } else {
                    let sent = if sent == 0 { NO_ECHO } else { f64::from(sent) / 1000.0 };
                    prop_assert!(*found == sent, "turn {turn}, line {line}, beam {beam}: {found}");
                }
            }
        }
    }
}

/// The wrong twin: a line that is turned by five degrees in one segment fits no turn.
#[test]
fn a_segment_with_a_line_beside_its_place_is_told() {
    let mut bench = streaming(1);
    let turns = turns(&mut bench.device, 3);
    let mut sent = turns.datagrams.clone();
    let mut scan = scan_of(&sent[1][4]);
    let module = &mut scan.modules.0[1];
    // Line 3 begins where the segment before has its last beams.
    for angle in [&mut module.theta_start_rad.0[3], &mut module.theta_stop_rad.0[3]] {
        *angle -= 5_f32.to_radians();
    }
    for beam in 0..30 {
        module.beams.theta[beam * 7 + 3] -= 455;
    }
    let mut bytes = Vec::new();
    Telegram::Scan(scan.seal()).encode(&mut bytes).unwrap();
    sent[1][4] = bytes;
    let mut listener = CompactListener::default();
    let mut faults = Vec::new();
    for datagram in sent.iter().flatten() {
        listener.handle_datagram(Duration::ZERO, datagram);
        while let Some(event) = listener.poll_event() {
            if let HostEvent::Malformed { fault } = event {
                faults.push(fault.to_string());
            }
        }
    }
    assert_eq!(
        faults,
        ["its fields cannot be read: segment 4 of turn 1 does not fit the other segments of it"]
    );
}

#[test]
fn lines_of_layers_that_are_off_are_not_sent() {
    let mut bench = streaming(5);
    let mut by_height: Vec<i16> = bench.device.mirrors().iter().map(|mirror| mirror.layer_centideg).collect();
    by_height.sort_unstable();
    // The second and the sixth, counted from the highest.
    bench.table(&[
        ("sRN LFPlayerFilter", "sRA LFPlayerFilter 0 1 1 1 1 1 1 1 1 1 1 1 1 1 1 1 1"),
        ("sWN LFPlayerFilter 1 0 1 0 0 0 1 0 0 0 0 0 0 0 0 0 0", "sWA LFPlayerFilter"),
        ("sWN FREchoFilter 2", "sWA FREchoFilter"),
    ]);
    let some = turns(&mut bench.device, 3);
    assert_eq!(shapes(&scan_of(&some.datagrams[0][3]).modules.0), [[1, 30, 1], [1, 240, 1]]);
    let (scans, _) = heard(some.datagrams.iter().flatten());
    let layers: BTreeSet<i16> = scans.iter().map(|scan| scan.layer_centideg).collect();
    assert_eq!((scans.len(), layers), (6, BTreeSet::from([by_height[1], by_height[5]])));
    assert!(scans.iter().all(|scan| scan.scan_frequency_hz == 20.0));
    // The filter's layers without effect while it is off; none of them: nothing goes out.
    bench.ask("sWN LFPlayerFilter 0 0 1 0 0 0 1 0 0 0 0 0 0 0 0 0 0");
    assert_eq!(shapes(&scan_of(&turns(&mut bench.device, 1).datagrams[0][3]).modules.0).len(), 4);
    bench.ask("sWN LFPlayerFilter 1 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0");
    assert!(turns(&mut bench.device, 1).datagrams[0].is_empty());
}

#[test]
fn the_angle_filter_knows_elevations_and_the_whole_turn() {
    let mut bench = streaming(5);
    // From −180° to −90°, and elevations of −10° to +10°.
    assert_eq!(
        bench.ask("sWN LFPangleRangeFilter 1 FFE488C0 FFF24460 FFFE7960 186A0 1"),
        "sWA LFPangleRangeFilter"
    );
    let some = turns(&mut bench.device, 1);
    let mut seen = 0;
    for module in some.datagrams[0].iter().flat_map(|datagram| scan_of(datagram).modules.0) {
        let (lines, echoes) = (module.shape.lines as usize, module.shape.echoes as usize);
        for (place, counts) in module.beams.distance.iter().enumerate().step_by(echoes) {
            let line = place / echoes % lines;
            let theta_deg = theta_rad(module.beams.theta[place / echoes]).to_degrees();
            let phi_deg = f64::from(module.phi_rad.0[line]).to_degrees();
            let theta_deg = if theta_deg >= 179.99 { theta_deg - 360.0 } else { theta_deg };
            let is_inside = (-180.02..=-89.98).contains(&theta_deg) && phi_deg.abs() <= 10.0;
            assert!(*counts == 0 || is_inside, "{theta_deg} {phi_deg}");
            seen += u32::from(*counts > 0);
        }
    }
    // A quarter of five coarse layers and of a fine one, less each seventh beam.
    assert!((900..1000).contains(&seen), "{seen}");
    // Of twelve segments those are left that a line of these layers has a beam in.
    assert!((4..=8).contains(&some.datagrams[0].len()), "{}", some.datagrams[0].len());
}

#[test]
fn the_start_up_of_sick_scan_xd_is_answered_and_what_it_lacks_is_not() {
    Bench::new(MODEL).table(&[
        ("sMN SetAccessMode 4 81BE23AA", "sAN SetAccessMode 1"),
        ("sWN FREchoFilter 2", "sWA FREchoFilter"),
        ("sWN LFPangleRangeFilter 0 FFE488C0 1B7740 FFF24460 DBBA0 1", "sWA LFPangleRangeFilter"),
        ("sWN LFPlayerFilter 0 1 1 1 1 1 1 1 1 1 1 1 1 1 1 1 1", "sWA LFPlayerFilter"),
        ("sMN Run", "sAN Run 1"),
        ("sMN SetAccessMode 4 81BE23AA", "sAN SetAccessMode 1"),
        ("sRN FREchoFilter", "sRA FREchoFilter 2"),
        ("sRN LFPangleRangeFilter", "sRA LFPangleRangeFilter 0 FFE488C0 1B7740 FFF24460 DBBA0 1"),
        ("sRN LFPlayerFilter", "sRA LFPlayerFilter 0 1 1 1 1 1 1 1 1 1 1 1 1 1 1 1 1"),
        ("sWN ScanDataEthSettings 1 +127 +0 +0 +1 +2115", "sWA ScanDataEthSettings"),
        ("sWN ScanDataFormat 2", "sWA ScanDataFormat"),
        ("sWN ScanDataPreformatting 1", "sWA ScanDataPreformatting"),
        ("sWN ScanDataPreformatting 2", "sFA 4"),
        ("sWN ImuDataEthSettings 1 +127 +0 +0 +1 +7503", "sWA ImuDataEthSettings"),
        ("sMN Run", "sAN Run 1"),
        ("sMN SetAccessMode 4 81BE23AA", "sAN SetAccessMode 1"),
        ("sWN ScanDataEnable 1", "sWA ScanDataEnable"),
        ("sWN ImuDataEnable 1", "sWA ImuDataEnable"),
        ("sMN LMCstartmeas", "sAN LMCstartmeas 0"),
        ("sRN DeviceIdent", "sRA DeviceIdent 9 multiScan 8 2.4.2.0R"),
        ("sRN PerformanceProfileNumber", "sFA 3"),
        ("sRN ScanConfig", "sFA 3"),
        ("sRN ScanLayerFilter", "sFA 3"),
    ]);
    // What a picoScan lacks of it.
    let mut pico = Bench::new("picoscan150");
    pico.ask("sMN SetAccessMode 4 81BE23AA");
    pico.table(&[
        ("sRN LFPlayerFilter", "sFA 3"),
        ("sWN ScanDataPreformatting 1", "sFA 3"),
        ("sWN LFPangleRangeFilter 0 FFE488C0 1B7740 FFF24460 DBBA0 1", "sFA 4"),
    ]);
}
