//! Every setting a client can write is seen in the scan telegrams, or in what comes instead of them.

use std::time::Duration;

use crate::bench::Bench;
use rowscan_protocol::device::{DialectPolicy, Options, Session, writable};
use rowscan_protocol::device::{EncoderSpeed, MeasuredEcho, MeasuredLine, SavedSettingsError, Start};
use rowscan_protocol::frame::{Dialect, encode};
use rowscan_protocol::model::{MODELS, by_name};
use rowscan_protocol::telegram::{Encoder, LmdScandata};
use rowscan_protocol::time::SimTime;

/// Beams see 1000, 2000 and 0 mm in turn; remission 0x1200 and up.
fn line(beams: usize) -> [MeasuredEcho; 1] {
    let range_mm = [1000, 2000, 0].into_iter().cycle().take(beams).collect();
    let remission = (0..beams).map(|beam| 0x1200 + beam as u16).collect();
    [MeasuredEcho { range_mm, remission }]
}

/// The next telegram, within a hundred turns of 20 ms and of 20 mm.
fn next_scan(bench: &mut Bench) -> Option<LmdScandata> {
    (0..100).find_map(|_| turn(bench))
}

fn turn(bench: &mut Bench) -> Option<LmdScandata> {
    let echoes = line(bench.device.mirror().beams.len());
    bench.now = bench.now + Duration::from_millis(20);
    bench.device.set_encoder_ticks(bench.now.as_secs_f64() * 1000.0);
    bench
        .device
        .measure(bench.now, &MeasuredLine { grid: bench.device.mirror().beams, echoes: &echoes })
        .cloned()
}

fn scan_with(model: &str, writes: &[&str]) -> LmdScandata {
    let mut bench = Bench::logged_in(model);
    for write in writes {
        let reply = bench.ask(write);
        assert!(reply.starts_with("sWA") || reply.starts_with("sAN"), "{write}: {reply}");
    }
    next_scan(&mut bench).unwrap()
}

const PLAIN: &str = "sWN LMDscandatacfg 01 00 0 0 0 00 00 0 0 0 0 +1";

#[test]
fn every_field_of_lmd_scandatacfg_changes_the_telegram() {
    let plain = scan_with("lms511", &[PLAIN]);
    assert_eq!((plain.channels16.len(), plain.channels8.len()), (1, 0));
    let with = |config: &str| scan_with("lms511", &[&format!("sWN LMDscandatacfg {config}")]);

    let all_echoes = with("1F 00 0 0 0 00 00 0 0 0 0 +1");
    let names: Vec<String> = all_echoes.channels16.iter().map(|channel| channel.name.to_string()).collect();
    assert_eq!(names, ["DIST1", "DIST2", "DIST3", "DIST4", "DIST5"]);
    assert!(all_echoes.channels16[1..].iter().all(|channel| channel.values.iter().all(|&raw| raw == 0)));
    assert_eq!(with("02 00 0 0 0 00 00 0 0 0 0 +1").channels16[0].name.to_string(), "DIST2");

    assert_eq!(with("01 00 1 0 0 00 00 0 0 0 0 +1").channels8[0].values[..2], [0x12, 0x12]);
    let wide = with("01 00 1 1 0 00 00 0 0 0 0 +1");
    assert_eq!((wide.channels16[1].values[1], wide.channels8.len()), (0x1201, 0));
    assert_eq!(with("01 00 0 0 0 01 00 0 0 0 0 +1").encoders.len(), 1);
    assert!(with("01 00 0 0 0 00 00 1 0 0 0 +1").position.is_some());
    assert_eq!(with("01 00 0 0 0 00 00 0 1 0 0 +1").name.unwrap().0, "not defined");
    assert!(with("01 00 0 0 0 00 00 0 0 1 0 +1").comment.is_some());
    assert!(with("01 00 0 0 0 00 00 0 0 0 1 +1").time.is_some());

    let mut bench = Bench::logged_in("lms511");
    bench.ask("sWN LMDscandatacfg 01 00 0 0 0 00 00 0 0 0 0 +5");
    assert_eq!((0..50).filter(|_| turn(&mut bench).is_some()).count(), 10);
}

#[test]
fn the_output_range_cuts_and_the_scan_mode_widens_the_steps() {
    let cut = scan_with("lms111", &["sWN LMPoutputRange 1 1388 +0 +900000"]);
    assert_eq!((cut.channels16[0].start_angle, cut.channels16[0].values.len()), (0, 181));
    // The beam at 0 degrees is number 90 of the full turn: cut, not rotated.
    assert_eq!(cut.channels16[0].values[..3], [1000, 2000, 0]);
    let cut = scan_with("lms111", &["sWN LMPoutputRange 1 1388 +5000 +900000"]);
    assert_eq!(cut.channels16[0].values[..3], [2000, 0, 1000]);
    let fine = scan_with("lms111", &["sMN mLMPsetscancfg +2500 +1 +2500 -450000 +2250000"]);
    assert_eq!(
        (fine.scan_frequency, fine.channels16[0].step, fine.channels16[0].values.len()),
        (2500, 2500, 1081)
    );
}

#[test]
fn the_encoder_counts_when_it_is_set_up_and_only_then() {
    let block = "sWN LMDscandatacfg 01 00 0 0 0 01 00 0 0 0 0 +1";
    let lms1xx = [block, "sWN LICsrc 1", "sWN LICencset 1", "sWN LICencres 1"];
    let mut lms5xx = lms1xx.to_vec();
    lms5xx.push("sWN DO3And4Fnc 1");
    for (model, writes) in [("lms111", &lms1xx[..]), ("lms511", &lms5xx[..])] {
        let mut bench = Bench::logged_in(model);
        for left_out in 1..writes.len() {
            let mut bench = Bench::logged_in(model);
            let some = writes.iter().enumerate().filter(|(n, _)| *n != left_out);
            some.for_each(|(_, write)| assert!(bench.ask(write).starts_with("sWA")));
            turn(&mut bench);
            let position = turn(&mut bench).unwrap().encoders[0].position;
            // The resolution is 1 out of the box.
            assert_eq!(position == 40, left_out == 3, "{model} without {}", writes[left_out]);
        }
        writes.iter().for_each(|write| assert!(bench.ask(write).starts_with("sWA"), "{write}"));
        turn(&mut bench);
        let encoder = turn(&mut bench).unwrap().encoders[0];
        assert_eq!((encoder.position, encoder.speed), (40, 1));
    }
    assert_eq!(Bench::logged_in("tim781").ask("sWN LICencset 1"), "sFA 3");
}

/// The wheel gives 500 ticks a metre and rolls a metre a second.
#[test]
fn the_encoder_counts_the_wheels_ticks_whatever_the_client_says_of_them() {
    let speeds = |encoder_speed| {
        ["3F000000", "3F800000", "40000000"].map(|ticks_per_mm| {
            let mut bench = Bench::new("lms111");
            bench.device = bench.device.with_options(Options { encoder_speed, ..Options::default() });
            bench.log_in();
            for write in [
                "LMDscandatacfg 01 00 0 0 0 01 00 0 0 0 0 +1",
                "LICsrc 1",
                "LICencset 1",
                &format!("LICencres {ticks_per_mm}"),
            ] {
                assert!(bench.ask(&format!("sWN {write}")).starts_with("sWA"), "{write}");
            }
            let mut last = Encoder::default();
            for turn in 0..=50 {
                bench.now = SimTime(turn * 20_000_000);
                bench.device.set_encoder_ticks((turn * 10) as f64);
                let line = MeasuredLine { grid: bench.device.mirror().beams, echoes: &[] };
                last = bench.device.measure(bench.now, &line).unwrap().encoders[0];
                assert_eq!(u64::from(last.position), turn * 10, "LICencres {ticks_per_mm}");
            }
            last.speed
        })
    };
    // A client that says 0.5 ticks a millimetre is right. Halves are rounded up.
    assert_eq!(speeds(EncoderSpeed::MmPerMs), [1, 1, 0]);
    assert_eq!(speeds(EncoderSpeed::MmPerS), [1000, 500, 250]);
    assert_eq!(speeds(EncoderSpeed::TicksPerMs), [1, 1, 1]);
}

#[test]
fn the_filters_change_what_is_sent() {
    let mut bench = Bench::logged_in("lms111");
    bench.ask("sWN LFPmeanfilter 1 +4 0");
    assert_eq!((0..40).filter(|_| turn(&mut bench).is_some()).count(), 10);
    assert_eq!(bench.ask("sRN LFPmeanfilter"), "sRA LFPmeanfilter 1 4 0");
    // The output rate counts what the filters leave.
    bench.ask("sWN LMDscandatacfg 01 00 0 0 0 00 00 0 0 0 0 +5");
    assert_eq!((0..40).filter(|_| turn(&mut bench).is_some()).count(), 2);
    let median = scan_with("lms111", &["sWN LFPmedianfilter 1 +3"]);
    assert_eq!(median.channels16[0].values[..4], [1000, 2000, 2000, 2000]);
    let particle = scan_with("lms111", &["sWN LFPparticle 1 +500"]);
    assert_eq!(particle.channels16[0].values[..5], [1000, 2000, 0, 0, 2000]);
    let none = scan_with("lms111", &["sWN LFPparticle 1 +1500"]);
    assert_eq!(none.channels16[0].values[..5], [1000, 2000, 0, 1000, 2000]);
}

#[test]
fn names_applications_and_the_calendar_are_seen() {
    let config = "sWN LMDscandatacfg 01 00 0 0 0 00 00 0 1 0 1 +1";
    let scan = scan_with(
        "lms111",
        &[config, "sWN LocationName 5 north", "sMN LSPsetdatetime +2024 +2 +29 +12 +0 +0 +0"],
    );
    assert_eq!(scan.name.unwrap().0, "north");
    let time = scan.time.unwrap();
    assert_eq!((time.year, time.month, time.day, time.microsecond), (2024, 2, 29, 20_000));

    let mut bench = Bench::logged_in("lms111");
    assert_eq!(bench.ask("sWN SetActiveApplications 1 RANG 0"), "sWA SetActiveApplications");
    assert!(next_scan(&mut bench).is_none());
    assert_eq!(bench.ask("sRN SetActiveApplications"), "sRA SetActiveApplications 2 RANG 0 FEVL 1");
    bench.ask("sWN SetActiveApplications 2 RANG 1 FEVL 1");
    assert!(next_scan(&mut bench).is_some());
}

/// What an LMS511 (of layers, an MRS1000) is told first, and a write after which its scans are others. Nothing is told first where there is nothing to see: the
/// variables that cannot be changed here.
const EFFECTS: &[(&str, &[&str], &str)] = &[
    ("FREchoFilter", &["sWN LMDscandatacfg 03 00 0 0 0 00 00 0 0 0 0 +1", "sWN FREchoFilter 1"], "0"),
    ("LFPmeanfilter", &[PLAIN], "1 +4 0"),
    ("LFPmedianfilter", &[PLAIN], "1 +3"),
    ("LFPparticle", &[PLAIN], "1 +500"),
    ("LICencres", ENCODER, "3F000000"),
    ("LICencset", ENCODER, "0"),
    ("LICsrc", ENCODER, "0"),
    ("DO3And4Fnc", ENCODER, "0"),
    ("LMDscandatacfg", &[PLAIN], "01 00 1 0 0 00 00 0 0 0 0 +1"),
    ("LMPoutputRange", &[PLAIN], "1 683 +0 +900000"),
    ("LocationName", &["sWN LMDscandatacfg 01 00 0 0 0 00 00 0 1 0 0 +1"], "5 north"),
    ("SetActiveApplications", &[PLAIN], "1 RANG 0"),
    ("EIgate", &[], "C0 A8 00 63"),
    ("EIIpAddr", &[], "C0 A8 00 63"),
    ("EImask", &[], "FF FF 00 00"),
    ("ScanLayerFilter", &[PLAIN], "4 0 1 0 0"),
    ("TSCTCInterface", &[], "1"),
    ("TSCRole", &[], "1"),
    ("TSCTCSrvAddr", &[], "C0 A8 00 63"),
    ("TSCTCupdatetime", &[], "63"),
    ("TSCTCtimezone", &[], "D"),
    ("LMPautostartmeas", &[], "0"),
];

const ENCODER: &[&str] = &[
    "sWN LMDscandatacfg 01 00 0 0 0 01 00 0 0 0 0 +1",
    "sWN DO3And4Fnc 1",
    "sWN LICsrc 1",
    "sWN LICencset 1",
    "sWN LICencres 1",
];

#[test]
fn every_writable_variable_changes_the_scans_or_is_refused() {
    let told: Vec<&str> = EFFECTS.iter().map(|(name, ..)| *name).collect();
    // What EIHstCola changes is how the next connection is answered: the test of the stored dialect has it. MSsuppmode acts on what the
    // eye sees, before a line is measured: tests/it/optics.rs has it.
    let writable = || writable().filter(|name| !["EIHstCola", "MSsuppmode"].contains(name));
    writable()
        .for_each(|name| assert!(told.contains(&name), "a client may write {name}: what does it change?"));
    assert_eq!(told.len(), writable().count());
    for (name, setting_up, value) in EFFECTS {
        let write = format!("sWN {name} {value}");
        let scans = |writes: &[&str]| {
            let model = if *name == "ScanLayerFilter" { "mrs1000" } else { "lms511" };
            let mut bench = Bench::logged_in(model);
            writes.iter().for_each(|write| assert!(bench.ask(write).starts_with("sWA"), "{write}"));
            (0..8).map(|_| turn(&mut bench)).collect::<Vec<_>>()
        };
        if setting_up.is_empty() {
            assert_eq!(Bench::logged_in("lms511").ask(&write), "sFA 4", "{name}");
        } else {
            let with = [*setting_up, &[write.as_str()]].concat();
            assert!(scans(setting_up) != scans(&with), "{name} changes nothing");
        }
    }
}

#[test]
fn a_tim_codes_beams_without_an_echo_as_recorded() {
    let scan = scan_with("tim781s", &[PLAIN]);
    assert_eq!(scan.channels16[0].values[..3], [1000, 2000, 2]);
    assert_eq!((scan.version, scan.channels16[0].values.len(), scan.channels16[0].step), (1, 811, 3333));
    assert_eq!(scan.transmit_time_us - scan.scan_time_us, 7000);
}

#[test]
fn every_models_output_range_reads_its_own_grid() {
    for model in MODELS {
        let mut bench = Bench::new(model.name);
        let reply = bench.ask("sRN LMPoutputRange");
        let (start, stop) = (model.start_angle, model.stop_angle);
        assert_eq!(reply, format!("sRA LMPoutputRange 1 {:X} {start:X} {stop:X}", model.default_mode.step));
        assert!(bench.ask("sRN DeviceIdent").contains(model.ident_name));
    }
}

/// One write a saved variable, none of them the value out of the box.
const SAVED: [&str; 12] = [
    "sMN mLMPsetscancfg +2500 +1 +2500 -50000 +1850000",
    "sWN LMDscandatacfg 3 0 1 1 0 1 0 1 1 1 1 2",
    "sWN LMPoutputRange 1 9C4 0 DBBA0",
    "sWN FREchoFilter 2",
    "sWN LFPmeanfilter 1 5 0",
    "sWN LFPmedianfilter 1 3",
    "sWN LFPparticle 1 12C",
    "sWN DO3And4Fnc 1",
    "sWN LICsrc 1",
    "sWN LICencset 2",
    "sWN LICencres 40000000",
    "sWN LocationName B row 3, end ",
];

#[test]
fn what_was_saved_survives_a_restart_and_a_file_and_nothing_else_does() {
    let mut bench = Bench::logged_in("lms511");
    let factory = bench.device.saved_settings();
    for write in SAVED {
        let reply = bench.ask(write);
        assert!(!reply.starts_with("sFA"), "{write}: {reply}");
    }
    bench.ask("sWN SetActiveApplications 1 FEVL 0");
    assert_eq!((bench.device.saved_settings(), bench.device.saves()), (factory.clone(), 0));
    bench.ask("sMN mEEwriteall");
    let saved = bench.device.saved_settings();
    assert_eq!(bench.device.saves(), 1);
    for write in SAVED.iter().skip(1) {
        assert!(saved.contains(&format!("\n{write}\n")), "{write} in\n{saved}");
    }

    let mut other = Bench::new("lms511");
    other.device.restore(&saved).unwrap();
    assert_eq!(other.device.saved_settings(), saved);
    assert_eq!(other.ask("sRN LocationName"), "sRA LocationName B row 3, end ");
    assert_eq!(other.device.mirror().frequency_centihz, 2500);
    other.log_in();
    other.ask("sWN FREchoFilter 0");
    other.ask("sMN mSCreboot");
    other.session = Session::new(DialectPolicy::Auto);
    assert_eq!(other.ask("sRN FREchoFilter"), "sRA FREchoFilter 2");
    assert_eq!((other.device.reboots(), other.ask("sRN ODpwrc")), (1, "sRA ODpwrc 39".to_owned()));
}

#[test]
fn a_torn_or_foreign_file_is_refused_and_changes_nothing() {
    let mut bench = Bench::new("lms511");
    let good = bench.device.saved_settings();
    for end in 0..good.len() {
        assert!(bench.device.restore(&good[..end]).is_err(), "{:?}", &good[..end]);
    }
    for at in 0..good.len() {
        let mut edited = good.clone().into_bytes();
        edited[at] ^= 1;
        let edited = String::from_utf8(edited).unwrap();
        assert!(bench.device.restore(&edited).is_err(), "{edited}");
    }
    let other = bench.device.saved_settings().replace("lms511", "lms111");
    assert!(matches!(bench.device.restore(&other), Err(SavedSettingsError::OtherModel { .. })));
    assert_eq!(bench.device.restore("[package]\nname = \"x\"\n"), Err(SavedSettingsError::Foreign));
    assert_eq!(
        bench.device.restore(&good.replace("sWN LICsrc 0", "sWN LICsrc 1")),
        Err(SavedSettingsError::Torn)
    );
    let mut body = good[..good.rfind("end ").unwrap()].replace("sWN LICsrc 0", "sWN LICsrc 9");
    let check = body.bytes().fold(0, |check, byte| check ^ byte);
    body.push_str(&format!("end {check:02X}\n"));
    assert!(matches!(bench.device.restore(&body), Err(SavedSettingsError::Line { .. })));
    assert_eq!(bench.device.saved_settings(), good);
    bench.device.restore(&good).unwrap();
}

#[test]
fn a_stored_dialect_is_saved_and_decides_strict_connections() {
    let options = Options { start: Start::Stored(Dialect::B), ..Options::default() };
    let mut bench = Bench::new("lms111");
    bench.device = bench.device.with_options(options);
    bench.session = Session::new(DialectPolicy::Strict(Dialect::A));
    assert!(bench.send(b"\x02sRN DeviceIdent\x03").is_empty());
    let mut request = Vec::new();
    encode(Dialect::B, b"sRN DeviceIdent", &mut request);
    assert_eq!(bench.send(&request).len(), 1);
    let mut other = rowscan_protocol::device::Device::new(by_name("lms111").unwrap(), Default::default());
    assert!(!other.saved_settings().contains("EIHstCola"));
    other.restore(&bench.device.saved_settings()).unwrap();
    assert!(other.saved_settings().contains("sWN EIHstCola 1\n"));
}
