//! What public clients found out about earlier versions of this device: byte sequences that real scanners answer, one test each.

use std::time::Duration;

use crate::bench::Bench;
use rowscan_protocol::device::{MeasuredLine, Options, Profile, Start};
use rowscan_protocol::frame::{Dialect, encode};
use rowscan_protocol::model::MODELS;
use rowscan_protocol::time::SimTime;

fn in_the_field(model: &str, start: Start) -> Bench {
    let mut bench = Bench::new(model);
    let options = Options { profile: Profile::Field, start, ..Options::default() };
    bench.device = bench.device.with_options(options);
    bench
}

/// Two public nodes ask STlms once, straight after LMCstartmeas, and give up for ever if it is not 7.
#[test]
fn a_measuring_scanner_stays_measuring_when_it_is_started() {
    for model in MODELS {
        for strict_login in [false, true] {
            let options = Options {
                profile: Profile::Field,
                start: Start::Streaming,
                strict_login,
                ..Options::default()
            };
            let mut bench = Bench::new(model.name);
            bench.device = bench.device.with_options(options);
            bench.now = SimTime::ZERO + Duration::from_secs(100);
            bench.log_in();
            assert_eq!(bench.ask("sMN LMCstartmeas"), "sAN LMCstartmeas 0");
            let status = bench.ask("sRN STlms");
            assert!(status.starts_with("sRA STlms 7 "), "{}: {status}", model.name);
        }
    }
    // A motor that stands spins up first, and one that spins up is not hurried.
    let mut bench = in_the_field("lms111", Start::Stopped);
    bench.log_in();
    bench.ask("sMN LMCstartmeas");
    assert!(bench.ask("sRN STlms").starts_with("sRA STlms 4 "));
    bench.now = bench.now + Duration::from_secs(1);
    bench.ask("sMN LMCstartmeas");
    assert!(bench.ask("sRN STlms").starts_with("sRA STlms 4 "));
    bench.now = bench.now + Duration::from_millis(4_500);
    assert!(bench.ask("sRN STlms").starts_with("sRA STlms 7 "));
}

/// A public node allocates as many beams as the range and the step that it reads back have, and gets as many as the device sends.
#[test]
fn an_output_range_reads_back_as_it_was_written() {
    let mut bench = Bench::new("lms111");
    assert_eq!(bench.ask("sRN LMPoutputRange"), "sRA LMPoutputRange 1 1388 FFF92230 225510", "as delivered");
    bench.log_in();
    for written in ["FFF92230 225510", "FFF92233 22550D", "0 DBBA0"] {
        assert_eq!(bench.ask(&format!("sWN LMPoutputRange 1 1388 {written}")), "sWA LMPoutputRange");
        assert_eq!(bench.ask("sRN LMPoutputRange"), format!("sRA LMPoutputRange 1 1388 {written}"));
    }
    // The beams start at -45° all the same.
    bench.ask("sWN LMPoutputRange 1 1388 FFF92233 22550D");
    let line = MeasuredLine { grid: bench.device.mirror().beams, echoes: &[] };
    let channel = &bench.device.measure(bench.now, &line).unwrap().channels16[0];
    assert_eq!((channel.start_angle, channel.values.len()), (-450_000, 541));
}

/// What a public program for the LMS511 sends to make remission appear.
#[test]
fn an_lms5xx_takes_an_empty_echo_mask_and_sends_one_echo() {
    const WRITE: &str = "sWN LMDscandatacfg 00 00 1 0 0 0 00 0 0 0 1 1";
    for model in MODELS {
        let mut bench = Bench::logged_in(model.name);
        if !model.name.starts_with("lms5") {
            assert_eq!(bench.ask(WRITE), "sFA 4", "{}", model.name);
            continue;
        }
        assert_eq!(bench.ask(WRITE), "sWA LMDscandatacfg");
        assert_eq!(bench.ask("sRN LMDscandatacfg"), "sRA LMDscandatacfg 0 0 1 0 0 0 0 0 0 0 1 1");
        let line = MeasuredLine { grid: bench.device.mirror().beams, echoes: &[] };
        let scan = bench.device.measure(bench.now, &line).unwrap();
        let names16: Vec<_> = scan.channels16.iter().map(|channel| channel.name.0).collect();
        let names8: Vec<_> = scan.channels8.iter().map(|channel| channel.name.0).collect();
        assert_eq!((&names16[..], &names8[..]), (&[*b"DIST1"][..], &[*b"RSSI1"][..]));
    }
}

/// A public TiM driver sends the index without the blank.
#[test]
fn an_index_is_read_with_and_without_the_blank() {
    for model in MODELS {
        let mut bench = Bench::new(model.name);
        let reply = bench.ask("sRI 0");
        assert!(
            reply.starts_with(&format!("sRA 0 {:X} {} ", model.ident_name.len(), model.ident_name)),
            "{reply}"
        );
        assert_eq!(bench.ask("sRI0"), reply);
    }
    let mut bench = Bench::new("tim571");
    let mut both = Vec::new();
    for payload in [&b"sRI 0"[..], b"sRI0"] {
        let mut frame = Vec::new();
        encode(Dialect::B, payload, &mut frame);
        both.push(bench.send(&frame).remove(0).bytes);
    }
    assert_eq!(both[0], both[1]);
    // A letter is no index.
    let mut bench = Bench::new("tim571");
    assert_eq!(bench.ask("sRIO"), "sFA C");
    assert_eq!(bench.ask("sRI7"), "sFA 3");
}

#[test]
fn boot_and_save_times_can_be_set() {
    let mut bench = Bench::new("lms111");
    let options = Options {
        profile: Profile::Field,
        start: Start::PowerUp,
        boot: Some(Duration::from_secs(2)),
        save: Some(Duration::from_millis(300)),
        ..Options::default()
    };
    bench.device = bench.device.with_options(options);
    bench.now = SimTime::ZERO + Duration::from_millis(1_999);
    assert!(bench.send(b"\x02sRN STlms\x03").is_empty());
    bench.now = SimTime::ZERO + Duration::from_secs(2);
    bench.log_in();
    let replies = bench.send(b"\x02sMN mEEwriteall\x03");
    assert_eq!(replies[0].delay, Duration::from_millis(300));
}
