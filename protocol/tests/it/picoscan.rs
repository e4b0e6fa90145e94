//! picoScan150: what sick_scan_xd's start-up hears in CoLa, and what goes out over UDP afterwards.

use std::collections::BTreeMap;
use std::time::Duration;

use crate::bench::Bench;
use rowscan_protocol::compact::{Module, REFLECTOR, Telegram, theta_rad};
use rowscan_protocol::device::{
    Datagram, Device, Identity, MeasuredEcho, MeasuredLine, Options, Profile, Silent, Start, Stream,
};
use rowscan_protocol::frame::{Dialect, encode};
use rowscan_protocol::model::by_name;
use rowscan_protocol::time::SimTime;

const MODEL: &str = "picoscan150";

fn pico() -> Bench {
    Bench::new(MODEL)
}

fn logged_in() -> Bench {
    let mut bench = pico();
    assert_eq!(bench.ask("sMN SetAccessMode 4 81BE23AA"), "sAN SetAccessMode 1");
    bench
}

/// A device that streams to this machine.
pub(crate) fn streaming(profile: u8) -> Device {
    let mut bench = logged_in();
    bench.table(&[
        ("sWN ScanDataEthSettings 1 +127 +0 +0 +1 +2115", "sWA ScanDataEthSettings"),
        ("sWN ScanDataEnable 1", "sWA ScanDataEnable"),
    ]);
    let reply = bench.ask(&format!("sWN PerformanceProfileNumber {profile:X}"));
    assert_eq!(reply, "sWA PerformanceProfileNumber");
    bench.device
}

/// A line of three echoes whose beam `i` has ranges of 1000 + i mm and 1000 mm farther each, and strengths of 0x40 and less.
fn echoes(device: &Device) -> Vec<MeasuredEcho> {
    let count = device.mirror().beams.len() as u16;
    (0..3)
        .map(|echo: u16| MeasuredEcho {
            range_mm: (0..count).map(|beam| 1000 + 1000 * echo + beam).collect(),
            remission: (0..count).map(|_| 0x4012 - 0x1000 * echo).collect(),
        })
        .collect()
}

/// The datagrams of the turn that begins at `at`.
fn turn(device: &mut Device, at: SimTime, echoes: &[MeasuredEcho]) -> Vec<Datagram> {
    let line = MeasuredLine { grid: device.mirror().beams, echoes };
    let mut datagrams = Vec::new();
    if device.measure(at, &line).is_some() {
        device.segments(at, &[line], &mut datagrams);
    }
    datagrams
}

fn scan(device: &mut Device, datagram: Datagram) -> (u64, u64, Module) {
    let (_, bytes) = device.send(datagram).unwrap();
    let Telegram::Scan(scan) = Telegram::decode(&bytes).unwrap() else { panic!("no scan") };
    let [module] = &scan.modules.0[..] else { panic!("{} modules", scan.modules.0.len()) };
    (scan.telegram_counter, scan.transmit_time_us, module.clone())
}

fn modules(device: &mut Device, at: SimTime) -> Vec<Module> {
    let echoes = echoes(device);
    let datagrams = turn(device, at, &echoes);
    datagrams.into_iter().map(|datagram| scan(device, datagram).2).collect()
}

#[test]
fn the_start_up_of_sick_scan_xd_is_answered_as_on_the_wire() {
    pico().table(&[
        ("sMN SetAccessMode 4 81BE23AA", "sAN SetAccessMode 1"),
        ("sWN FREchoFilter 2", "sWA FREchoFilter"),
        ("sWN LFPangleRangeFilter 0 FFF24460 DBBA0 FFF24460 DBBA0 1", "sWA LFPangleRangeFilter"),
        ("sWN LFPintervalFilter 0 +2", "sWA LFPintervalFilter"),
        ("sMN Run", "sAN Run 1"),
        ("sMN SetAccessMode 4 81BE23AA", "sAN SetAccessMode 1"),
        ("sRN FREchoFilter", "sRA FREchoFilter 2"),
        // Six whole numbers: a client that gets floats or fewer gives up.
        ("sRN LFPangleRangeFilter", "sRA LFPangleRangeFilter 0 FFF24460 DBBA0 FFF24460 DBBA0 1"),
        ("sMN SetAccessMode 4 81BE23AA", "sAN SetAccessMode 1"),
        ("sWN ScanDataEthSettings 1 +127 +0 +0 +1 +2115", "sWA ScanDataEthSettings"),
        ("sWN ScanDataFormat 2", "sWA ScanDataFormat"),
        ("sWN PerformanceProfileNumber 2", "sWA PerformanceProfileNumber"),
        ("sWN ImuDataEthSettings 1 +127 +0 +0 +1 +7503", "sWA ImuDataEthSettings"),
        ("sMN Run", "sAN Run 1"),
        ("sMN SetAccessMode 4 81BE23AA", "sAN SetAccessMode 1"),
        ("sWN ScanDataEnable 1", "sWA ScanDataEnable"),
        ("sWN ImuDataEnable 1", "sWA ImuDataEnable"),
        ("sMN Run", "sAN Run 1"),
        ("sMN SetAccessMode 4 81BE23AA", "sAN SetAccessMode 1"),
        ("sMN LMCstartmeas", "sAN LMCstartmeas 0"),
        ("sRN DeviceIdent", "sRA DeviceIdent 8 picoScan 8 2.2.1.0R"),
        ("sRN ScanDataEthSettings", "sRA ScanDataEthSettings 1 7F 0 0 1 843"),
    ]);
}

#[test]
fn what_has_no_effect_or_no_login_is_refused() {
    pico().table(&[
        ("sWN ScanDataEnable 1", "sFA A"),
        ("sMN SetAccessMode 3 F4724744", "sAN SetAccessMode 0"),
        ("sRN ScanDataEnable", "sRA ScanDataEnable 0"),
    ]);
    logged_in().table(&[
        ("sWN ScanDataFormat 5", "sFA 4"),
        ("sWN ScanDataEnable 2", "sFA 5"),
        ("sWN PerformanceProfileNumber C", "sFA 4"),
        ("sWN LFPangleRangeFilter 0 FFF24460 DBBA0", "sFA 8"),
        ("sWN LFPangleRangeFilter 0 FFF24460 DBBA0 FFF24460 DBBA0 15", "sFA 4"),
        ("sWN DeviceType 1 X", "sFA A"),
        ("sRN LFPlayerFilter", "sFA 3"),
        ("sWN LMPoutputRange 1 1388 0 DBBA0", "sFA 3"),
    ]);
    // An LMS1xx has none of these.
    Bench::new("lms111").table(&[("sRN ScanDataEnable", "sFA 3"), ("sRN PerformanceProfileNumber", "sFA 3")]);
}

#[test]
fn binary_settings_are_those_of_the_guide() {
    let mut bench = logged_in();
    let mut ask = |payload: &[u8]| {
        let mut request = Vec::new();
        encode(Dialect::B, payload, &mut request);
        // The dialect stays what the connection began with: another connection.
        bench.session = rowscan_protocol::device::Session::new(rowscan_protocol::device::DialectPolicy::Auto);
        bench.send(&{
            let mut login = Vec::new();
            encode(Dialect::B, b"sMN SetAccessMode \x04\x81\xBE\x23\xAA", &mut login);
            login
        });
        bench.send(&request).pop().unwrap().bytes
    };
    let set = ask(b"sWN ScanDataEthSettings \x01\xC0\xA8\x00\x64\x08\x43");
    assert_eq!(
        set,
        [b"\x02\x02\x02\x02\x00\x00\x00\x18sWA ScanDataEthSettings ".as_slice(), &[0x16]].concat()
    );
    let filter = ask(
        b"sWN LFPangleRangeFilter \x01\xFF\xF2\x44\x60\x00\x0D\xBB\xA0\xFF\xF2\x44\x60\x00\x0D\xBB\xA0\x00\x01",
    );
    assert!(filter.windows(24).any(|part| part == b"sWA LFPangleRangeFilter "), "{filter:?}");
    let read = ask(b"sRN LFPangleRangeFilter");
    let value = b"\x01\xFF\xF2\x44\x60\x00\x0D\xBB\xA0\xFF\xF2\x44\x60\x00\x0D\xBB\xA0\x00\x01";
    assert!(read.windows(value.len()).any(|part| part == value), "{read:?}");
}

#[test]
fn every_profile_goes_out_in_whole_segments() {
    for profile in 1..=11 {
        let mut device = streaming(profile);
        let mirror = device.mirror();
        let (hertz, step_deg) = (f64::from(mirror.frequency_centihz) / 100.0, mirror.beams.step_deg());
        let (segments, width_deg) = if hertz >= 30.0 { (5, 60.0) } else { (10, 30.0) };
        let at = SimTime(1_000_000_000);
        let modules = modules(&mut device, at);
        assert_eq!(modules.len(), segments, "profile {profile}");
        let beams: u32 = modules.iter().map(|module| module.shape.beams).sum();
        assert_eq!(beams as usize, mirror.beams.len());
        let mut number = 0;
        for (place, module) in modules.iter().enumerate() {
            assert_eq!(module.segment_counter, place as u64);
            assert_eq!(module.shape.echoes, 3);
            // Clients divide by the number of steps.
            assert!(module.shape.beams > 1, "profile {profile}, segment {place}");
            let start_deg = f64::from(module.theta_start_rad.0[0]).to_degrees();
            assert!((start_deg - (-138.0 + width_deg * place as f64)).abs() < 1e-4, "{start_deg}");
            // Evenly in time: 360° are a turn.
            let sweep_s = f64::from(module.shape.beams - 1) * step_deg / 360.0 / hertz;
            let (start, stop) = (module.time_start_us.0[0], module.time_stop_us.0[0]);
            assert!(((stop - start) as f64 - 1e6 * sweep_s).abs() <= 1.0, "{start} to {stop}");
            for beam in 0..module.shape.beams as usize {
                let distances = &module.beams.distance[3 * beam..][..3];
                assert_eq!(distances, [1000 + number, 2000 + number, 3000 + number]);
                assert_eq!(module.beams.rssi[3 * beam..][..3], [0x4040, 0x3030, 0x2020]);
                assert_eq!(module.beams.properties[beam], 0);
                let theta_deg = theta_rad(module.beams.theta[beam]).to_degrees();
                assert!((theta_deg + 138.0 - f64::from(number) * step_deg).abs() < 0.02, "{theta_deg}");
                number += 1;
            }
        }
        let stop_deg = f64::from(modules.last().unwrap().theta_stop_rad.0[0]).to_degrees();
        assert!((stop_deg - 138.0).abs() < 1e-4, "{stop_deg}");
    }
}

#[test]
fn a_segment_is_due_when_its_last_beam_is_measured() {
    let mut device = streaming(1);
    let at = SimTime(2_000_000_000);
    let echoes = echoes(&device);
    let datagrams = turn(&mut device, at, &echoes);
    // Segment 0 of the recorded profile: 59 steps of 0.5° at 15 Hz are 5463 µs; the recorded ones took 5445 to 5467.
    let first = datagrams[0].at.0 - at.0;
    assert!((5_462_900..=5_463_000).contains(&first), "{first}");
    let gaps: Vec<u64> = datagrams.windows(2).map(|pair| pair[1].at.0 - pair[0].at.0).collect();
    assert!(gaps[..8].iter().all(|gap| (5_555_500..=5_555_600).contains(gap)), "{gaps:?}");
    assert!(datagrams.iter().all(|datagram| datagram.stream == Stream::Scan));
    // As recorded: said to be sent before the last beam.
    for datagram in datagrams {
        let (_, transmitted, module) = scan(&mut device, datagram);
        assert!(transmitted < module.time_stop_us.0[0]);
    }
}

#[test]
fn counters_rise_by_one_a_telegram_and_frames_by_one_a_turn() {
    let mut device = streaming(2);
    let (mut counters, mut frames) = (Vec::new(), BTreeMap::<u64, Vec<u64>>::new());
    let mut at = SimTime::ZERO;
    for number in 0..20 {
        let echoes = echoes(&device);
        for datagram in turn(&mut device, at, &echoes) {
            let (counter, _, module) = scan(&mut device, datagram);
            counters.push(counter);
            frames.entry(module.frame_number).or_default().push(module.segment_counter);
        }
        at = SimTime(u64::from(number + 1_u32) * 66_666_667);
    }
    assert_eq!(counters, (1..=200).collect::<Vec<u64>>());
    assert_eq!(frames.keys().copied().collect::<Vec<_>>(), (0..20).collect::<Vec<u64>>());
    assert!(frames.values().all(|segments| *segments == (0..10).collect::<Vec<u64>>()));
}

#[test]
fn the_echo_filter_leaves_one_echo() {
    for (filter, first_mm) in [(0, 1000), (2, 3000)] {
        let mut bench = Bench::new(MODEL);
        bench.device = streaming(1);
        bench.table(&[("sMN SetAccessMode 4 81BE23AA", "sAN SetAccessMode 1")]);
        assert_eq!(bench.ask(&format!("sWN FREchoFilter {filter}")), "sWA FREchoFilter");
        let modules = modules(&mut bench.device, SimTime::ZERO);
        assert!(modules.iter().all(|module| module.shape.echoes == 1));
        assert_eq!(modules[0].beams.distance[0], first_mm);
    }
}

#[test]
fn the_angle_filter_sends_zeros_and_no_hidden_segment() {
    let mut bench = logged_in();
    bench.device = streaming(1);
    bench.table(&[
        ("sMN SetAccessMode 4 81BE23AA", "sAN SetAccessMode 1"),
        // -10° to +10°: in segments 4 (-18° to 11.5°) alone, so one datagram.
        ("sWN LFPangleRangeFilter 1 -100000 +100000 -900000 +900000 1", "sWA LFPangleRangeFilter"),
    ]);
    let one = modules(&mut bench.device, SimTime::ZERO);
    assert_eq!(one.iter().map(|module| module.segment_counter).collect::<Vec<_>>(), [4]);
    let module = &one[0];
    assert_eq!((module.shape.beams, module.theta_start_rad.0[0]), (60, (-18.0_f64).to_radians() as f32));
    let seen = module.beams.distance.chunks(3).filter(|echoes| echoes[0] > 0).count();
    assert_eq!(seen, 41, "-10° to 10° in steps of 0.5°");
    // Every second beam.
    assert_eq!(
        bench.ask("sWN LFPangleRangeFilter 1 -100000 +100000 -900000 +900000 2"),
        "sWA LFPangleRangeFilter"
    );
    let module = &modules(&mut bench.device, SimTime(1))[0];
    assert_eq!(module.beams.distance.chunks(3).filter(|echoes| echoes[0] > 0).count(), 21);
}

#[test]
fn the_interval_filter_sends_every_nth_turn() {
    let mut bench = logged_in();
    bench.device = streaming(11);
    bench.table(&[
        ("sMN SetAccessMode 4 81BE23AA", "sAN SetAccessMode 1"),
        ("sWN LFPintervalFilter 1 +4", "sWA LFPintervalFilter"),
    ]);
    let sent: Vec<usize> = (0..8).map(|number| modules(&mut bench.device, SimTime(number)).len()).collect();
    assert_eq!(sent, [10, 0, 0, 0, 10, 0, 0, 0]);
}

#[test]
fn a_beam_without_echo_is_zero_and_a_mirror_sets_the_reflector_bit() {
    let mut device = streaming(11);
    let mut echoes = echoes(&device);
    echoes.truncate(1);
    echoes[0].range_mm[3] = 0;
    echoes[0].remission[4] = 0xFFFF;
    let first = turn(&mut device, SimTime::ZERO, &echoes).remove(0);
    let (.., module) = scan(&mut device, first);
    assert_eq!(
        (module.beams.distance[9..12].to_vec(), module.beams.rssi[9..12].to_vec()),
        (vec![0; 3], vec![0; 3])
    );
    assert_eq!(module.beams.distance[6..9], [1002, 0, 0]);
    assert_eq!(module.beams.properties[3..6], [0, REFLECTOR, 0]);
    assert_eq!(module.beams.rssi[12], 0xFFFF);
}

#[test]
fn nothing_goes_out_unless_it_is_enabled_measures_and_is_compact_over_udp() {
    let mut bench = logged_in();
    let destination = |bench: &Bench| bench.device.destination(Stream::Scan);
    assert_eq!(destination(&bench), Err(Silent::Off));
    bench.ask("sWN ScanDataEnable 1");
    assert_eq!(destination(&bench).unwrap().to_string(), "192.168.0.100:2115", "as delivered");
    for (change, back) in [
        ("sWN ScanDataFormat 3", "sWN ScanDataFormat 2"),
        ("sWN ScanDataFormat 1", "sWN ScanDataFormat 2"),
        ("sWN ScanDataEthSettings 2 +127 +0 +0 +1 +2115", "sWN ScanDataEthSettings 1 +127 +0 +0 +1 +2115"),
    ] {
        bench.ask(change);
        assert_eq!(destination(&bench), Err(Silent::Otherwise), "{change}");
        bench.ask(back);
        assert!(destination(&bench).is_ok());
    }
    bench.ask("sMN LMCstopmeas");
    assert_eq!(destination(&bench), Err(Silent::Off));
    bench.ask("sMN LMCstartmeas");
    assert!(destination(&bench).is_ok());
    // What waited for its instant when the stream was switched off is not sent, and not numbered.
    let echoes = echoes(&bench.device);
    let mut waiting = turn(&mut bench.device, SimTime::ZERO, &echoes);
    let last = waiting.split_off(9).remove(0);
    for datagram in waiting {
        assert!(bench.device.send(datagram).is_some());
    }
    bench.ask("sWN ScanDataEnable 0");
    assert!(bench.device.send(last.clone()).is_none());
    bench.ask("sWN ScanDataEnable 1");
    assert_eq!(scan(&mut bench.device, last).0, 10);
}

#[test]
fn lmd_scandata_comes_in_format_3_alone() {
    let mut bench = logged_in();
    assert!(!bench.device.sends_scan_events());
    bench.ask("sWN ScanDataFormat 3");
    assert!(bench.device.sends_scan_events());
    let echoes = echoes(&bench.device);
    let line = MeasuredLine { grid: bench.device.mirror().beams, echoes: &echoes };
    let scan = bench.device.measure(SimTime::ZERO, &line).unwrap();
    let channel = &scan.channels16[0];
    assert_eq!((channel.start_angle, channel.step, channel.values.len()), (-480_000, 3333, 829));
    assert!(Bench::new("lms111").device.sends_scan_events());
}

#[test]
fn settings_live_until_a_restart_unless_they_are_saved() {
    let mut bench = logged_in();
    bench.table(&[
        ("sWN LFPintervalFilter 1 +7", "sWA LFPintervalFilter"),
        ("sWN PerformanceProfileNumber 8", "sWA PerformanceProfileNumber"),
        ("sMN mEEwriteall", "sAN mEEwriteall 1"),
        ("sWN LFPintervalFilter 1 +9", "sWA LFPintervalFilter"),
    ]);
    let text = bench.device.saved_settings();
    bench.ask("sMN mSCreboot");
    let mut bench = Bench { session: Bench::new(MODEL).session, ..bench };
    bench.table(&[
        ("sRN LFPintervalFilter", "sRA LFPintervalFilter 1 7"),
        ("sRN PerformanceProfileNumber", "sRA PerformanceProfileNumber 8"),
    ]);
    let mut other = Bench::new(MODEL);
    other.device.restore(&text).unwrap();
    other.table(&[
        ("sRN LFPintervalFilter", "sRA LFPintervalFilter 1 7"),
        ("sRN PerformanceProfileNumber", "sRA PerformanceProfileNumber 8"),
    ]);
    assert_eq!(other.device.saved_settings(), text);
}

/// Start and stop of each segment and the time of its transmission, in a device of this profile and seed.
fn stamps(profile: Profile, seed: u64) -> Vec<(u64, u64, u64)> {
    let options = Options { profile, seed, start: Start::Streaming, ..Options::default() };
    let mut device = Device::new(by_name(MODEL).unwrap(), Identity::default()).with_options(options);
    device.enable_streaming();
    let echoes = echoes(&device);
    let mut stamps = Vec::new();
    for number in 0..100 {
        let at = SimTime::ZERO + Duration::from_secs(1) + Duration::from_nanos(number * 66_666_667);
        for datagram in turn(&mut device, at, &echoes) {
            let (_, sent, module) = scan(&mut device, datagram);
            stamps.push((module.time_start_us.0[0], module.time_stop_us.0[0], sent));
        }
    }
    stamps
}

#[test]
fn stamps_scatter_in_the_field_only_and_by_their_seed() {
    let (bench, field) = (stamps(Profile::Bench, 7), stamps(Profile::Field, 7));
    assert_eq!(bench.len(), 1000);
    assert_eq!(field, stamps(Profile::Field, 7));
    assert_ne!(field, stamps(Profile::Field, 8));
    assert_eq!(bench, stamps(Profile::Bench, 8));
    assert!(bench.iter().all(|(start, _, sent)| sent - start == 400));
    let off = |of: fn(&(u64, u64, u64)) -> u64| -> Vec<i64> {
        field.iter().zip(&bench).map(|(field, bench)| of(field) as i64 - of(bench) as i64).collect()
    };
    for off in [off(|stamp| stamp.0), off(|stamp| stamp.1)] {
        let most = off.iter().map(|off| off.abs()).max().unwrap();
        assert!((15..=21).contains(&most), "{most}");
    }
    let late: Vec<i64> = field.iter().map(|(start, _, sent)| *sent as i64 - *start as i64).collect();
    assert!(late.iter().all(|late| (-420..=1700).contains(late)));
    assert!(late.iter().any(|late| *late < -200) && late.iter().any(|late| *late > 1500));
}

/// The picoScan120: what sick_scan_xd's start-up for it hears, and one echo in segments of 30°.
#[test]
fn a_picoscan120_has_one_echo_one_mode_and_fewer_variables() {
    let mut bench = Bench::new("picoscan120");
    bench.table(&[
        ("sMN SetAccessMode 4 81BE23AA", "sAN SetAccessMode 1"),
        ("sRN DeviceIdent", "sRA DeviceIdent B picoScan120 8 2.2.1.0R"),
        ("sRN FREchoFilter", "sFA 3"),
        ("sRN LFPangleRangeFilter", "sFA 3"),
        ("sWN ImuDataEthSettings 1 +127 +0 +0 +1 +7503", "sFA 3"),
        ("sRN PerformanceProfileNumber", "sFA 3"),
        ("sWN ScanDataEthSettings 1 +127 +0 +0 +1 +2115", "sWA ScanDataEthSettings"),
        ("sWN ScanDataFormat 2", "sWA ScanDataFormat"),
        ("sWN ScanDataEnable 1", "sWA ScanDataEnable"),
        ("sMN LMCstartmeas", "sAN LMCstartmeas 0"),
    ]);
    let mut device = bench.device;
    assert_eq!((device.imu_period(), device.destination(Stream::Encoder)), (None, Err(Silent::Off)));
    let modules = modules(&mut device, SimTime(50_000_000));
    assert_eq!(modules.len(), 10);
    assert_eq!(
        modules.iter().map(|module| module.beams.distance.len()).sum::<usize>(),
        2761,
        "one echo a beam"
    );
    let us: Vec<u64> = modules.iter().map(|module| module.time_start_us.0[0]).collect();
    assert!(us.windows(2).all(|pair| (4166..=4168).contains(&(pair[1] - pair[0]))), "20 Hz: {us:?}");
    // What it saves it takes back.
    let saved = device.saved_settings();
    device.restore(&saved).unwrap();
    assert!(!saved.contains("ImuDataEnable") && saved.contains("ScanDataFormat"), "{saved}");
}

/// Simulated seconds that the endurance of profiles is tried for; `cargo xtask full` takes ten minutes.
fn endurance_s() -> u64 {
    std::env::var("ROWSCAN_PICOSCAN_SECONDS").map_or(4, |text| text.parse().unwrap())
}

/// Turn after turn, all segments go out, and no counter has a gap.
#[test]
fn the_fastest_and_the_finest_profile_have_no_gap() {
    for (profile, hertz, segments) in [(8, 50, 5), (9, 15, 10)] {
        let mut device = streaming(profile);
        let echoes = echoes(&device);
        let (turns, mut sent) = (endurance_s() * hertz, 0_u64);
        let mut due = SimTime::ZERO;
        for number in 1..=turns {
            let at = SimTime(1_000_000_000 * number / hertz);
            let datagrams = turn(&mut device, at, &echoes);
            assert_eq!(datagrams.len() as u64, segments, "turn {number}");
            for (place, datagram) in datagrams.into_iter().enumerate() {
                assert!(datagram.at > due && datagram.at.0 < at.0 + 1_000_000_000 / hertz, "turn {number}");
                due = datagram.at;
                let (counter, _, module) = scan(&mut device, datagram);
                sent += 1;
                let frame = number - 1;
                assert_eq!(
                    (counter, module.frame_number, module.segment_counter),
                    (sent, frame, place as u64),
                    "turn {number}"
                );
            }
        }
        assert_eq!(sent, turns * segments, "profile {profile}");
    }
}
