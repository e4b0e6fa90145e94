//! What a device does from power-up on, what it tells of it, and what events it sends, under virtual time.

use std::time::Duration;

use crate::bench::Bench;
use rowscan_protocol::device::{
    Device, DialectPolicy, Identity, MeasuredEcho, MeasuredLine, Options, Profile, Reply, Session, Start,
};
use rowscan_protocol::frame::{Dialect, encode};
use rowscan_protocol::model::{MODELS, by_name};
use rowscan_protocol::time::SimTime;

fn found(model: &str, profile: Profile, start: Start) -> Bench {
    let mut bench = Bench::new(model);
    bench.device = bench.device.with_options(Options { profile, start, ..Options::default() });
    bench
}

fn state(bench: &mut Bench) -> (char, char) {
    let status = bench.ask("sRN STlms");
    let ready = bench.ask("sRN SCdevicestate");
    (status.chars().nth("sRA STlms ".len()).unwrap(), ready.chars().last().unwrap())
}

fn turn(bench: &mut Bench) -> bool {
    bench.now = bench.now + Duration::from_millis(20);
    bench
        .device
        .measure(bench.now, &MeasuredLine { grid: bench.device.mirror().beams, echoes: &[] })
        .is_some()
}

fn text(reply: &Reply) -> String {
    String::from_utf8_lossy(&reply.bytes[1..reply.bytes.len() - 1]).into_owned()
}

#[test]
fn a_scanner_is_found_in_any_state() {
    for (start, expected, scans) in [
        (Start::Streaming, ('7', '1'), true),
        (Start::PowerUp, ('7', '1'), true),
        (Start::Standby, ('4', '3'), false),
        (Start::Stopped, ('3', '0'), false),
        (Start::LoggedIn, ('6', '0'), false),
        (Start::Error, ('0', '2'), false),
    ] {
        let mut bench = found("lms111", Profile::Bench, start);
        assert_eq!(state(&mut bench), expected, "{start:?}");
        assert_eq!(turn(&mut bench), scans, "{start:?}");
        // What every client does brings it back, unless it is broken.
        bench.log_in();
        bench.ask("sMN LMCstartmeas");
        bench.ask("sMN Run");
        let broken = start == Start::Error;
        assert_eq!(state(&mut bench), if broken { ('0', '2') } else { ('7', '1') }, "{start:?}");
        assert_eq!(turn(&mut bench), !broken);
    }
}

#[test]
fn in_the_field_power_up_takes_its_time_and_every_state_is_seen() {
    for model in MODELS {
        let mut bench = found(model.name, Profile::Field, Start::PowerUp);
        let times = model.times;
        assert!(bench.send(b"\x02sRN STlms\x03").is_empty(), "it answers while it boots");
        let mut seen = Vec::new();
        let mut first_scan = None;
        bench.now = SimTime::ZERO + times.boot;
        while bench.now < SimTime::ZERO + Duration::from_secs(60) {
            let state = state(&mut bench);
            if seen.last() != Some(&state) {
                seen.push(state);
            }
            if turn(&mut bench) {
                first_scan.get_or_insert(bench.now);
            }
        }
        assert_eq!(seen, [('1', '0'), ('4', '0'), ('5', '0'), ('7', '1')], "{}", model.name);
        let ready = times.boot + times.initialisation + times.spin_up + times.first_scan;
        let late = first_scan.unwrap().elapsed() - ready;
        assert!(late < Duration::from_millis(20), "{}: {late:?}", model.name);
        let first_counter = bench.device.last_scan().unwrap();
        assert!(first_counter.scan_time_us > 0);
    }
}

#[test]
fn a_new_scan_mode_keeps_an_lms1xx_busy_for_half_a_minute() {
    let mut bench = found("lms111", Profile::Field, Start::Streaming);
    bench.log_in();
    bench.ask("sMN mLMPsetscancfg +2500 +1 +2500 -450000 +2250000");
    bench.ask("sMN LMCstartmeas");
    bench.ask("sMN Run");
    let start = bench.now;
    while state(&mut bench).1 == '0' {
        bench.now = bench.now + Duration::from_secs(1);
    }
    assert_eq!(bench.now, start + Duration::from_secs(30));
    // The same mode again costs nothing.
    bench.log_in();
    bench.ask("sMN LMCstartmeas");
    bench.ask("sMN Run");
    bench.now = bench.now + Duration::from_secs(1);
    assert_eq!(state(&mut bench), ('7', '1'));
}

#[test]
fn the_first_scan_of_an_lms111_is_its_fourth_and_comes_after_80_ms() {
    let mut bench = found("lms111", Profile::Field, Start::Streaming);
    bench.log_in();
    (0..3).for_each(|_| assert!(turn(&mut bench)));
    bench.ask("sMN LMCstartmeas");
    assert_eq!((0..4).map(|_| turn(&mut bench)).collect::<Vec<_>>(), [false, false, false, true]);
    assert_eq!(bench.device.last_scan().unwrap().scan_counter, 4);
}

#[test]
fn replies_take_as_long_as_recorded_in_the_field_and_no_time_on_the_bench() {
    let delays = |profile| -> Vec<u128> {
        let mut bench = found("lms111", profile, Start::Streaming);
        let requests = b"\x02sRN STlms\x03\x02sMN SetAccessMode 3 F4724744\x03\x02sMN LMCstartmeas\x03";
        bench.send(requests).iter().map(|reply| reply.delay.as_millis()).collect()
    };
    assert_eq!(delays(Profile::Bench), [0, 0, 0]);
    assert_eq!(delays(Profile::Field), [1, 3, 14]);
}

/// The status of a polled scan as it stands on the wire: in text, and in bytes.
fn status_on_the_wire(bench: &mut Bench) -> (String, [u8; 2]) {
    assert!(turn(bench));
    let text = bench.ask("sRN LMDscandata");
    let mut request = Vec::new();
    encode(Dialect::B, b"sRN LMDscandata", &mut request);
    let binary = Session::new(DialectPolicy::Auto);
    let text_session = std::mem::replace(&mut bench.session, binary);
    let reply = bench.send(&request).remove(0).bytes;
    bench.session = text_session;
    // Behind the head of 8 bytes, the name, version and device number of 2 bytes each and the serial number of 4.
    let at = 8 + "sRA LMDscandata ".len() + 8;
    (text.split(' ').skip(5).take(2).collect::<Vec<_>>().join(" "), reply[at..at + 2].try_into().unwrap())
}

#[test]
fn contamination_is_read_and_marks_the_second_status_byte_of_scans() {
    for model in ["lms111", "lms511", "tim781s"] {
        let mut bench = Bench::logged_in(model);
        for (level, status) in [(0, 0), (1, 2), (2, 4), (3, 4)] {
            bench.device.set_contamination(level);
            assert_eq!(bench.ask("sRN LCMstate"), format!("sRA LCMstate {level}"));
            assert_eq!(status_on_the_wire(&mut bench), (format!("0 {status}"), [0, status]), "{model}");
        }
    }
}

/// However it is found, and after it was switched off and on.
#[test]
fn dirt_stays_on_the_window_whatever_state_a_scanner_is_in() {
    let states =
        [Start::Streaming, Start::PowerUp, Start::Standby, Start::Stopped, Start::LoggedIn, Start::Error];
    for start in states {
        let mut bench = found("lms111", Profile::Bench, start);
        assert_eq!(bench.ask("sRN LCMstate"), "sRA LCMstate 0", "{start:?}");
        let mut dirty = Device::new(by_name("lms111").unwrap(), Identity::default());
        dirty.set_contamination(2);
        bench.device = dirty.with_options(Options { start, ..Options::default() });
        bench.now = SimTime::ZERO + Duration::from_secs(60);
        assert_eq!(bench.ask("sRN LCMstate"), "sRA LCMstate 2", "{start:?}");
    }
}

#[test]
fn a_dirty_scanner_that_starts_marks_the_laser_s_start_beside_its_dirt() {
    let mut bench = Bench::logged_in("lms511");
    bench.device.set_contamination(1);
    bench.ask("sMN LMCstartmeas");
    assert_eq!(status_on_the_wire(&mut bench), ("1 2".to_owned(), [1, 2]));
    assert_eq!(status_on_the_wire(&mut bench), ("0 2".to_owned(), [0, 2]));
}

#[test]
fn scan_times_jitter_in_the_field_within_what_was_recorded() {
    let mut bench = found("lms111", Profile::Field, Start::Streaming);
    let mut off = Vec::new();
    for _ in 0..500 {
        turn(&mut bench);
        let time_us = bench.device.last_scan().unwrap().scan_time_us;
        off.push(i64::from(time_us) - bench.now.elapsed().as_micros() as i64);
    }
    let periods: Vec<f64> = off.iter().zip(&off[1..]).map(|(a, b)| (b - a) as f64).collect();
    let within = by_name("lms111").unwrap().scatter.period_within_us() + 2.0;
    assert!(periods.iter().all(|us| us.abs() <= within), "{periods:?}");
    assert!(periods.iter().any(|us| us.abs() > 25.0), "{periods:?}");
}

/// Events due to this session.
fn events(bench: &mut Bench) -> Vec<String> {
    let mut replies = Vec::new();
    bench.session.poll_events(&mut bench.device, bench.now, &mut replies);
    replies.iter().map(text).collect()
}

#[test]
fn changed_inputs_are_told_once_to_those_who_subscribed_and_are_in_the_scans() {
    let mut bench = Bench::new("tim781s");
    bench.device.set_input(bench.now, 1, true).unwrap();
    assert!(events(&mut bench).is_empty());
    bench.ask("sEN LIDinputstate 1");
    assert!(events(&mut bench).is_empty(), "what was before the subscription is not told");
    bench.device.set_input(bench.now, 1, true).unwrap();
    assert!(events(&mut bench).is_empty(), "nothing has changed");
    bench.device.set_input(bench.now, 2, true).unwrap();
    assert_eq!(events(&mut bench), ["sSN LIDinputstate 0 0 1 1 0 0 0"]);
    assert!(events(&mut bench).is_empty());
    turn(&mut bench);
    assert_eq!(bench.device.last_scan().unwrap().inputs, [3, 0]);
    bench.ask("sEN LIDinputstate 0");
    bench.device.set_input(bench.now, 2, false).unwrap();
    assert!(events(&mut bench).is_empty());
    let error = bench.device.set_input(bench.now, 5, true).unwrap_err();
    assert_eq!(error.to_string(), "TiM781S has 4 digital inputs; there is no number 5");
}

#[test]
fn an_lms511_times_its_inputs() {
    let mut bench = Bench::new("lms511");
    bench.ask("sEN LIDinputstate 1");
    bench.now = SimTime::ZERO + Duration::from_secs(2);
    bench.device.set_input(bench.now, 4, true).unwrap();
    assert_eq!(events(&mut bench), ["sSN LIDinputstate 0 1E8480 0 0 0 1 1 7B2 1 1 0 0 2 0"]);
}

/// As recorded: the outputs switch when the scans after LMCstartmeas are no longer marked, and that is told.
#[test]
fn outputs_switch_while_measuring_starts() {
    let mut bench = Bench::logged_in("lms111");
    bench.ask("sEN LIDoutputstate 1");
    let replies = bench.send(b"\x02sMN LMCstartmeas\x03");
    assert_eq!(text(&replies[0]), "sAN LMCstartmeas 0");
    assert!(text(&replies[1]).starts_with("sSN LIDoutputstate 1 0 0 0 0 0 0 1 2 0"), "{}", text(&replies[1]));
    (0..6).for_each(|_| assert!(turn(&mut bench)));
    assert!(events(&mut bench).is_empty());
    assert_eq!(bench.device.last_scan().unwrap().outputs, [1, 0]);
    turn(&mut bench);
    let told = events(&mut bench);
    assert!(told[0].starts_with("sSN LIDoutputstate 1 222E0 0 0 0 0 1 2 2 0"), "{told:?}");
    turn(&mut bench);
    assert_eq!(bench.device.last_scan().unwrap().outputs, [4, 0]);
    bench.device.set_output(bench.now, 1, true).unwrap();
    assert_eq!(events(&mut bench).len(), 1);
    assert!(bench.device.set_output(bench.now, 4, true).is_err(), "output 4 is unused");
}

#[test]
fn an_lms511_tells_its_outputs_with_the_subscription() {
    let mut bench = Bench::new("lms511");
    let replies = bench.send(b"\x02sEN LIDoutputstate 1\x03");
    assert_eq!(text(&replies[0]), "sEA LIDoutputstate 1");
    assert!(text(&replies[1]).starts_with("sSN LIDoutputstate 0 0 0 0 0 0 1 0 1 0"));
    // With the length of the recorded frame: 14 outputs and a time.
    let mut binary = Vec::new();
    rowscan_protocol::frame::encode(
        rowscan_protocol::frame::Dialect::B,
        b"sEN LIDoutputstate \x01",
        &mut binary,
    );
    bench.session = Session::new(DialectPolicy::Auto);
    assert_eq!(bench.send(&binary)[1].bytes.len(), 117);
}

#[test]
fn the_field_is_evaluated_and_its_results_are_told() {
    let mut bench = Bench::logged_in("tim781s");
    bench.device.watch_fields(&[1500]).unwrap();
    bench.ask("sEN LFErec 1");
    let mut results = Vec::new();
    for range_mm in [2000, 1400, 1400, 0, 1500] {
        let echoes = [MeasuredEcho { range_mm: vec![range_mm; 811], remission: Vec::new() }];
        bench.device.measure(bench.now, &MeasuredLine { grid: bench.device.mirror().beams, echoes: &echoes });
        for event in events(&mut bench) {
            assert!(event.starts_with("sSN LFErec 3 1 1 0 3F800000 00000000 D05 FFF92230 "), "{event}");
            results.push(event.split(' ').nth(10).unwrap().to_owned());
        }
    }
    assert_eq!(results, ["1", "2", "1", "2"]);
    bench.ask("sWN SetActiveApplications 1 FEVL 0");
    turn(&mut bench);
    assert!(events(&mut bench)[0].contains(" FFF92230 0 "));
}

#[test]
fn a_tim7_reports_three_fields_of_43_bytes_as_recorded() {
    let mut bench = Bench::new("tim781s");
    let mut request = Vec::new();
    rowscan_protocol::frame::encode(rowscan_protocol::frame::Dialect::B, b"sRN LFErec", &mut request);
    let reply = bench.send(&request)[0].bytes.len();
    assert_eq!(reply, 9 + "sRA LFErec ".len() + 2 + 3 * 43);
}

/// Each field has its own result and the time of its own last change.
#[test]
fn three_fields_are_evaluated_one_by_one() {
    let mut bench = Bench::logged_in("tim781");
    assert!(bench.ask("sRN LFErec").starts_with("sRA LFErec 3 1 1 0 3F800000 00000000 D05 FFF92230 0 "));
    assert_eq!(bench.device.watch_fields(&[1, 2, 3, 4]).unwrap_err().most, 3);
    bench.device.watch_fields(&[500, 1500]).unwrap();
    bench.ask("sEN LFErec 1");
    let mut told = Vec::new();
    for range_mm in [2000, 1000, 400] {
        let echoes = [MeasuredEcho { range_mm: vec![range_mm; 811], remission: Vec::new() }];
        bench.device.measure(bench.now, &MeasuredLine { grid: bench.device.mirror().beams, echoes: &echoes });
        for event in events(&mut bench) {
            let tokens: Vec<&str> = event.split(' ').collect();
            // 19 tokens a field: eight to the result, three empty blocks, a flag and the time's seven.
            told.push([10, 29, 48].map(|at| tokens[at].to_owned()).join(" "));
        }
    }
    assert_eq!(told, ["1 1 0", "1 2 0", "2 2 0"]);
    // Models without results of their own report what is set.
    let mut bench = Bench::logged_in("lms111");
    assert_eq!(bench.ask("sRN LFErec"), "sRA LFErec 0");
    bench.device.watch_fields(&[1500, 700]).unwrap();
    assert!(bench.ask("sRN LFErec").starts_with("sRA LFErec 2 "));
}

/// Device time is 32 bits of microseconds: it begins again after 71 minutes and 35 seconds, in the middle of a stream.
#[test]
fn scan_times_begin_again_after_seventy_one_minutes() {
    let mut bench = found("lms111", Profile::Bench, Start::Streaming);
    bench.now = SimTime((u64::from(u32::MAX) + 1) * 1000 - 50_000_000);
    let times: Vec<u32> = (0..5)
        .map(|_| {
            assert!(turn(&mut bench));
            bench.device.last_scan().unwrap().scan_time_us
        })
        .collect();
    assert!(times[1] > u32::MAX - 20_000 && times[2] < 20_000, "{times:?}");
    assert!(times.windows(2).all(|pair| pair[1].wrapping_sub(pair[0]) == 20_000), "{times:?}");
}

/// Two scanners of one rig share its seed, and nothing random.
#[test]
fn scanners_of_one_rig_have_different_stamps() {
    let stamps = |scanner| {
        let mut bench = Bench::new("lms111");
        let options = Options {
            profile: Profile::Field,
            start: Start::Streaming,
            seed: 1,
            scanner,
            ..Options::default()
        };
        bench.device = bench.device.with_options(options);
        let stamp = |_| {
            assert!(turn(&mut bench));
            bench.device.last_scan().unwrap().scan_time_us
        };
        (0..150).map(stamp).collect::<Vec<u32>>()
    };
    let (first, second) = (stamps(0), stamps(1));
    let equal = first.iter().zip(&second).filter(|(a, b)| a == b).count();
    // Uniform over 101 values: 1.5 of 150 are equal by chance.
    assert!(equal < 10, "{equal} of 150");
    assert_eq!(first, stamps(0));
}
