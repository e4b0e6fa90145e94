//! An LMS1000: turns that are interlaced, each in its telegram, and the table of angles beside them.

use crate::bench::Bench;
use rowscan_protocol::device::{MeasuredEcho, MeasuredLine, scan_event};
use rowscan_protocol::frame::Dialect;
use rowscan_protocol::telegram::lmd_scandata::ANGLES;
use rowscan_protocol::telegram::{LmdScandata, Telegram};

/// Where a beam of the wall stands, by its angle: a value that tells the angle, 16 to 27 616.
fn range_mm(angle_deg: f64) -> u16 {
    (16.0 + (angle_deg + 48.0) * 100.0).round() as u16
}

/// The next turn's telegram, of ranges that tell the angles at which they were measured.
fn turn(bench: &mut Bench) -> LmdScandata {
    let grid = bench.device.mirror().beams;
    let echo = MeasuredEcho {
        range_mm: (0..grid.len()).map(|beam| range_mm(grid.angle_deg(beam))).collect(),
        remission: vec![0x8000; grid.len()],
    };
    let echoes = [echo.clone(), echo.clone(), echo];
    bench.device.measure(bench.now, &MeasuredLine { grid, echoes: &echoes }).cloned().unwrap()
}

/// Frequency, step, turns.
const MODES: [(&str, &str, u32); 3] = [("3A98", "1D4C", 1), ("1D4C", "EA6", 2), ("EA6", "753", 4)];

fn set_mode(bench: &mut Bench, frequency: &str, step: &str) {
    let asked = format!("{frequency} 1 {step} FFF8AD00 22CA40");
    assert_eq!(bench.ask(&format!("sMN mLMPsetscancfg {asked}")), format!("sAN mLMPsetscancfg 0 {asked}"));
    assert_eq!(bench.ask("sRN LMPscancfg"), format!("sRA LMPscancfg {asked}"));
}

#[test]
fn turns_begin_a_step_of_the_mode_later_and_the_first_has_a_beam_more() {
    for (frequency, step, turns) in MODES {
        let mut bench = Bench::logged_in("lms1000");
        set_mode(&mut bench, frequency, step);
        let fine = 7500 / turns as i32;
        let mut angles = Vec::new();
        for number in 0..3 * turns {
            // What the mirror says is cast is what the telegram then says.
            let told = bench.device.mirror();
            assert_eq!(told.frequency_centihz, 15_000, "a turn takes 6.67 ms in every mode");
            let scan = turn(&mut bench);
            let place = number % turns;
            let channel = &scan.channels16[0];
            assert_eq!(channel.start_angle, -480_000 + place as i32 * fine);
            assert_eq!((channel.step, scan.scan_frequency), (7500, 15_000));
            assert_eq!(channel.values.len(), if place == 0 { 369 } else { 368 });
            assert_eq!((scan.layer_angle, scan.measurement_frequency), (0, 720));
            assert_eq!(u32::from(scan.telegram_counter), number);
            for (beam, &raw) in channel.values.iter().enumerate() {
                let ten_thousandths = channel.start_angle + beam as i32 * 7500;
                assert_eq!(raw, range_mm(f64::from(ten_thousandths) / 10_000.0));
                angles.extend((number < turns).then_some(ten_thousandths));
            }
        }
        angles.sort_unstable();
        let all: Vec<i32> = (0..=2_760_000 / fine).map(|beam| -480_000 + beam * fine).collect();
        assert_eq!(angles, all, "a sequence is the whole field, each beam once");
    }
}

#[test]
fn a_cut_keeps_the_starts_of_turns_apart() {
    let mut bench = Bench::logged_in("lms1000");
    set_mode(&mut bench, "EA6", "753");
    assert_eq!(bench.ask("sWN LMPoutputRange 1 753 +0 +1800000"), "sWA LMPoutputRange");
    let starts: Vec<i32> = (0..4).map(|_| turn(&mut bench).channels16[0].start_angle).collect();
    assert_eq!(starts, [0, 1875, 3750, 5625]);
    // Between two beams of a turn others have one: a range that some turns leave empty is refused.
    assert_eq!(bench.ask("sWN LMPoutputRange 1 753 +1000 +2000"), "sFA 4");
}

#[test]
fn a_mean_is_of_turns_with_one_start() {
    let mut bench = Bench::logged_in("lms1000");
    set_mode(&mut bench, "1D4C", "EA6");
    assert_eq!(bench.ask("sWN LFPmeanfilter 1 +2 0"), "sWA LFPmeanfilter");
    let mut found = Vec::new();
    for _ in 0..8 {
        let grid = bench.device.mirror().beams;
        let range_mm = (0..grid.len()).map(|beam| range_mm(grid.angle_deg(beam))).collect();
        let echoes = [MeasuredEcho { range_mm, remission: vec![0; grid.len()] }];
        if let Some(scan) = bench.device.measure(bench.now, &MeasuredLine { grid, echoes: &echoes }) {
            let channel = &scan.channels16[0];
            assert_eq!(channel.values[7], range_mm_of(channel.start_angle + 7 * 7500));
            found.push(channel.start_angle);
        }
    }
    assert_eq!(found, [-480_000, -476_250, -480_000, -476_250]);
}

fn range_mm_of(ten_thousandths: i32) -> u16 {
    range_mm(f64::from(ten_thousandths) / 10_000.0)
}

#[test]
fn the_table_of_angles_says_what_the_grid_says() {
    let mut bench = Bench::logged_in("lms1000");
    set_mode(&mut bench, "1D4C", "EA6");
    assert_eq!(bench.ask("sWN LMDscandatacfg 07 00 3 0 0 00 00 0 0 0 1 +1"), "sWA LMDscandatacfg");
    turn(&mut bench);
    let scan = turn(&mut bench);
    let names: Vec<String> = scan.channels16.iter().map(|channel| channel.name.to_string()).collect();
    assert_eq!(names, ["DIST1", "DIST2", "DIST3", "ANGL1"]);
    assert_eq!(scan.channels8.len(), 3);
    let table = scan.channels16.iter().find(|channel| channel.name == ANGLES).unwrap();
    assert_eq!(table.offset.to_bits(), 0xC700_0000, "a client takes no other");
    for (beam, &raw) in table.values.iter().enumerate() {
        let correction = f32::from(raw) * table.scale + table.offset;
        assert_eq!(correction, 0.0);
        assert_eq!(table.start_angle + beam as i32 * 7500, -476_250 + beam as i32 * 7500);
    }
    assert_eq!(table.values.len(), 368);
    // 21 bytes of a header and two a value, in each of four channels; one a value in three.
    let mut bytes = Vec::new();
    scan_event(Dialect::B, &scan, &mut bytes);
    let channels = 4 * (21 + 2 * 368) + 3 * (21 + 368);
    assert_eq!(bytes.len(), 8 + 16 + 38 + 2 + channels + 2 + 8 + 11 + 2 + 1);
    let payload = &bytes[8..bytes.len() - 1];
    let read: LmdScandata = Telegram::parse(Dialect::B, payload).unwrap().args.decode().unwrap();
    assert_eq!(read, scan);
    // Without it: the same channels but the table. Nothing else takes it.
    assert_eq!(bench.ask("sWN LMDscandatacfg 07 00 1 0 0 00 00 0 0 0 1 +1"), "sWA LMDscandatacfg");
    assert!(turn(&mut bench).channels16.iter().all(|channel| channel.name != ANGLES));
    assert_eq!(bench.ask("sWN LMDscandatacfg 07 00 7 0 0 00 00 0 0 0 1 +1"), "sFA 4");
    for model in rowscan_protocol::model::MODELS.iter().filter(|model| !model.angle_table) {
        let reply = Bench::logged_in(model.name).ask("sWN LMDscandatacfg 01 00 3 0 0 00 00 0 0 0 1 +1");
        assert_eq!(reply, "sFA 4", "{}", model.name);
    }
}

#[test]
fn it_answers_what_public_clients_ask_of_it() {
    let mut bench = Bench::logged_in("lms1000");
    bench.table(&[
        ("sWN SetActiveApplications 1 FEVL 0", "sWA SetActiveApplications"),
        ("sWN SetActiveApplications 1 RANG 1", "sWA SetActiveApplications"),
        ("sRN FirmwareVersion", "sRA FirmwareVersion 9 V 2.2.1  "),
        ("sWN LFPmeanfilter 0 +2 0", "sWA LFPmeanfilter"),
        ("sWN LFPmedianfilter 0 +3", "sWA LFPmedianfilter"),
        // No echo filter, no encoder, no IMU; the mode of older firmware.
        ("sRN FREchoFilter", "sFA 3"),
        ("sRN LICencset", "sFA 3"),
        ("sEN InertialMeasurementUnit 1", "sFA F"),
        ("sMN mLMPsetscancfg 1388 1 9C4 FFF8AD00 22CA40", "sAN mLMPsetscancfg 3 3A98 1 1D4C FFF8AD00 22CA40"),
    ]);
}
