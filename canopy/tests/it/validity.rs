//! Where the advance comes from when a source is dead, and what scans that are left out do to a row.

use crate::common::{self, lms111, open_rig, wall};
use rowscan_canopy::{AdvanceSource, GroundSpeed, Pipeline, Warning};
use rowscan_protocol::angle::BeamGrid;
use rowscan_protocol::model::AnyModel;
use rowscan_protocol::rig::{Mount, Rig};
use rowscan_protocol::scan::{EncoderReading, Scan};
use rowscan_protocol::validity::DeviceStatus;

fn rig() -> Rig {
    Rig { encoder_ticks_per_m: Some(1000.0), ..open_rig() }
}

/// Five seconds past a wall, with these encoder readings a scan.
fn drive(ticks: impl Fn(u32) -> u32) -> Vec<Scan> {
    let mut scans = common::drive(&rig(), lms111(), 50, 250, wall(1.9));
    for (turn, scan) in (0..).zip(&mut scans) {
        scan.encoders = vec![EncoderReading { position_ticks: ticks(turn), speed: 0 }];
    }
    scans
}

/// A client that changes the scanner's mode on the way.
#[test]
fn scans_of_another_resolution_than_the_first_are_told() {
    let told = |scans: &[Scan]| {
        let warnings = pushed(Pipeline::new(Some(&rig()), 0, None).unwrap(), scans).warnings;
        warnings.into_iter().find(|warning| warning.code() == "other_resolution")
    };
    let fine = drive(|turn| 20 * turn);
    let mut mixed = fine.clone();
    for scan in mixed.iter_mut().skip(200) {
        let beams = scan.beams;
        scan.beams = BeamGrid::spanning(
            beams.start,
            beams.start + i32::from(beams.step) * i32::from(beams.count - 1),
            2 * beams.step,
        );
        let ranges = std::mem::take(&mut scan.echoes[0].range_m);
        scan.echoes[0].range_m = ranges.into_iter().step_by(2).collect();
    }
    assert_eq!(told(&fine), None);
    let first_deg = fine[0].beams.step_deg();
    assert_eq!(
        told(&mixed),
        Some(Warning::OtherResolution { first_deg, other_deg: 2.0 * first_deg, scans: 50 })
    );
}

fn pushed(mut pipeline: Pipeline, scans: &[Scan]) -> rowscan_canopy::Estimate {
    scans.iter().for_each(|scan| pipeline.push(scan));
    pipeline.finish()
}

#[test]
fn a_dead_encoder_gives_way_to_the_rigs_speed_and_is_told() {
    let new = || Pipeline::new(Some(&rig()), 0, None).unwrap();
    let without = Pipeline::new(Some(&Rig { encoder_ticks_per_m: None, ..rig() }), 0, None).unwrap();
    let passing = uneven(drive(|_| 7));
    let by_speed = pushed(without, &passing);
    let dead = pushed(new(), &passing);
    assert_eq!(dead.advance_source, Some(AdvanceSource::Constant));
    assert_eq!(dead.impacted_total_area_m2, by_speed.impacted_total_area_m2);
    assert!(dead.warnings.contains(&Warning::EncoderStood { lines: 250 }), "{:?}", dead.warnings);
    // One that stands first and counts then is alive.
    let late = pushed(new(), &drive(|turn| turn.saturating_sub(100) * 20));
    assert_eq!(late.advance_source, Some(AdvanceSource::Encoder));
    assert!((late.advance_m.unwrap() - 149.0 * 0.02).abs() < 1e-9, "{:?}", late.advance_m);
    // Who wants the encoder gets it, standing or not.
    let asked = pushed(new().by_encoder_only(), &passing);
    assert_eq!((asked.advance_source, asked.advance_m), (Some(AdvanceSource::Encoder), Some(0.0)));
}

/// The same past a wall whose stones stand out by turns.
fn uneven(mut scans: Vec<Scan>) -> Vec<Scan> {
    for (turn, scan) in scans.iter_mut().enumerate() {
        for (beam, range_m) in scan.echoes[0].range_m.iter_mut().enumerate() {
            *range_m += if (beam * 7 + turn / 3 * 13) % 5 < 2 { 0.3 } else { 0.0 };
        }
    }
    scans
}

/// An encoder that counts nothing is in order where the tractor stands: the picture does, too. Nothing was driven past, so nothing is known.
#[test]
fn a_tractor_that_stands_tells_no_area_whatever_its_way_is_taken_from() {
    let standing = drive(|_| 7);
    let new = || Pipeline::new(Some(&rig()), 0, None).unwrap();
    let mut by_gnss = new();
    let stands = GroundSpeed { source: AdvanceSource::Gnss, speed_m_s: Some(0.0) };
    standing.iter().for_each(|scan| by_gnss.push_at_speed(scan, stands));
    let found = [pushed(new(), &standing), pushed(new().by_encoder_only(), &standing), by_gnss.finish()];
    for estimate in found {
        assert_eq!((estimate.advance_m, estimate.impacted_total_area_m2), (Some(0.0), None));
        assert!(estimate.warnings.contains(&Warning::Stood { scans: 250 }), "{:?}", estimate.warnings);
    }
}

#[test]
fn an_encoder_that_was_asked_for_and_is_not_there_withholds_areas() {
    let mut scans = drive(|turn| turn * 20);
    scans.iter_mut().for_each(|scan| scan.encoders.clear());
    let estimate = pushed(Pipeline::new(Some(&rig()), 0, None).unwrap().by_encoder_only(), &scans);
    assert_eq!(estimate.impacted_total_area_m2, None);
    assert!(estimate.is_withheld() && estimate.warnings.contains(&Warning::NoEncoder { scans: 250 }));
}

#[test]
fn scans_without_the_rigs_encoder_go_by_constant_speed_and_it_is_told() {
    let mut bare = drive(|_| 0);
    bare.iter_mut().for_each(|scan| scan.encoders.clear());
    let told = |rig: &Rig, scans: &[Scan]| pushed(Pipeline::new(Some(rig), 0, None).unwrap(), scans);
    let by_speed = |estimate: &rowscan_canopy::Estimate| {
        estimate.warnings.iter().filter(|warning| warning.code() == "constant_speed").count()
    };
    let found = told(&rig(), &bare);
    assert_eq!(found.advance_source, Some(AdvanceSource::Constant));
    assert!(found.warnings.contains(&Warning::ConstantSpeed {
        scans: 250,
        speed_m_s: rig().speed_m_s,
        has_encoder: true
    }));
    // The encoder's remedy is told of models that have one, and of no other.
    for model in AnyModel::all() {
        let mut of_model = rig();
        of_model.scanners[0].model = model.name().to_owned();
        let told = told(&of_model, &bare).warnings.iter().map(ToString::to_string).collect::<String>();
        assert!(told.contains("and 250 scans have no reading"), "{}: {told}", model.name());
        assert_eq!(told.contains("encoder=on"), model.tells_ticks(), "{}: {told}", model.name());
        assert_eq!(
            told.contains("tells no encoder's count"),
            !model.tells_ticks(),
            "{}: {told}",
            model.name()
        );
    }
    // It is a warning: the area is that of a rig without an encoder.
    let without = Rig { encoder_ticks_per_m: None, ..rig() };
    assert_eq!(found.impacted_total_area_m2, told(&without, &bare).impacted_total_area_m2);
    // Neither a reading, nor a rig without an encoder, nor a speed that the user chose gives cause for it.
    let mut chosen = Pipeline::new(Some(&rig()), 0, None).unwrap();
    let constant = GroundSpeed { source: AdvanceSource::Constant, speed_m_s: None };
    bare.iter().for_each(|scan| chosen.push_at_speed(scan, constant));
    let silent = [told(&rig(), &drive(|turn| turn * 20)), told(&without, &bare), chosen.finish()];
    assert_eq!((by_speed(&found), silent.each_ref().map(by_speed)), (1, [0; 3]));
}

#[test]
fn a_drive_that_goes_on_behind_the_row_is_told() {
    // To 4.98 m past a wall.
    let past = |trees, spacing_m| {
        let rig = Rig { trees, tree_spacing_m: Some(spacing_m), ..open_rig() };
        let estimate = pushed(Pipeline::new(Some(&rig), 0, None).unwrap(), &drive(|_| 0));
        let told =
            estimate.warnings.iter().find(|warning| warning.code() == "past_row").map(Warning::to_string);
        told.map(|told| told.split(" were scanned").next().unwrap().to_owned())
    };
    assert_eq!(past(Some(2), 1.5).as_deref(), Some("past_row: 2.0 m behind the row's end at 3.0 m"));
    // Also less than a tree: of a few wide trees that is much.
    assert_eq!(past(Some(1), 3.5).as_deref(), Some("past_row: 1.5 m behind the row's end at 3.5 m"));
    assert_eq!(past(Some(3), 1.5).as_deref(), Some("past_row: 0.5 m behind the row's end at 4.5 m"));
    // As a wheel slips; and a row of which nobody says where it ends.
    assert_eq!((past(Some(6), 0.8), past(None, 1.5)), (None, None));
}

#[test]
fn lines_before_the_rows_first_tree_are_told() {
    let before = |start_m: f64| {
        let rig = Rig { trees: Some(20), tree_spacing_m: Some(1.5), start_m, ..rig() };
        let estimate = pushed(Pipeline::new(Some(&rig), 0, None).unwrap(), &drive(|turn| turn * 20));
        estimate.warnings.into_iter().find(|warning| warning.code() == "before_row")
    };
    let Some(Warning::BeforeRow { before_m }) = before(-3.0) else { panic!("told") };
    assert!((before_m - 3.0).abs() < 1e-9, "{before_m}");
    let Some(Warning::BeforeRow { before_m }) = before(-1.0) else { panic!("less than a tree") };
    assert!((before_m - 1.0).abs() < 1e-9, "{before_m}");
    assert_eq!((before(-0.2), before(0.0), before(4.0)), (None, None, None));
}

/// With a yaw the plane meets the row ahead of the tractor, or behind it: what is told is what was scanned.
#[test]
fn what_a_turned_scanner_sees_beyond_the_row_is_told() {
    let told = |yaw_deg: f64| {
        let mount = Mount { yaw_deg, ..rig().scanners[0].clone() };
        let rig = Rig { trees: Some(3), tree_spacing_m: Some(1.7), scanners: vec![mount], ..rig() };
        let estimate = pushed(Pipeline::new(Some(&rig), 0, None).unwrap(), &drive(|turn| turn * 20));
        let codes = estimate.warnings.iter().map(Warning::code);
        codes.filter(|code| ["before_row", "past_row"].contains(code)).collect::<Vec<_>>()
    };
    assert_eq!(told(0.0), Vec::<&str>::new());
    assert_eq!((told(-45.0), told(45.0)), (vec!["before_row"], vec!["past_row"]));
}

#[test]
fn lines_that_are_left_out_are_filled_by_their_neighbours() {
    let whole = drive(|turn| turn * 20);
    let mut holed = whole.clone();
    holed.iter_mut().skip(10).step_by(7).for_each(|scan| scan.status = DeviceStatus::Error);
    let new = || Pipeline::new(Some(&rig()), 0, None).unwrap();
    let (whole, holed) = (pushed(new(), &whole), pushed(new(), &holed));
    let area = |estimate: &rowscan_canopy::Estimate| estimate.impacted_total_area_m2.unwrap();
    assert!((area(&holed) / area(&whole) - 1.0).abs() < 1e-9, "{} {}", area(&holed), area(&whole));
    assert_eq!((holed.scans, holed.scans_lost, holed.scans_excluded), (250, Some(0), 35));
    assert_eq!(holed.scan_frequency_hz, whole.scan_frequency_hz);
}

/// The first readings of an encoder that has telegrams of its own may be lost, or come late.
#[test]
fn the_row_begins_with_the_first_reading_of_an_encoder_that_is_there_a_second_later_at_most() {
    let missing = |count: usize| {
        let mut scans = drive(|turn| 4000 + turn * 10);
        scans.iter_mut().take(count).for_each(|scan| scan.encoders.clear());
        pushed(Pipeline::new(Some(&rig()), 0, None).unwrap(), &scans)
    };
    let whole = missing(0);
    for count in [1, 10, 50] {
        let found = missing(count);
        assert_eq!(found.advance_source, Some(AdvanceSource::Encoder), "{count} missing");
        let expected_m = whole.advance_m.unwrap() - count as f64 * 0.01;
        assert!(
            (found.advance_m.unwrap() - expected_m).abs() < 1e-9,
            "{count} missing: {:?}",
            found.advance_m
        );
        assert!(found.warnings.iter().all(|warning| warning.code() != "constant_speed"));
        let way_m2 = |estimate: &rowscan_canopy::Estimate| {
            estimate.impacted_total_area_m2.unwrap() / estimate.scanned_m.unwrap()
        };
        assert!((way_m2(&found) / way_m2(&whole) - 1.0).abs() < 1e-3, "a metre of wall is a metre of wall");
    }
    let too_late = missing(60);
    assert_eq!(too_late.advance_source, Some(AdvanceSource::Constant));
    assert!(too_late.warnings.iter().any(|warning| warning.code() == "constant_speed"));
}

/// Set anew by somebody, or of 16 bits: the scanner goes on meanwhile.
#[test]
fn an_encoder_that_jumps_is_no_way_and_is_told() {
    let new = || Pipeline::new(Some(&rig()), 0, None).unwrap();
    let whole = pushed(new(), &drive(|turn| turn * 20));
    for jumps in [
        &|turn: u32| (turn * 20) % 1999,
        &|turn: u32| if turn < 120 { turn * 20 } else { (turn - 120) * 20 },
        &|turn: u32| if turn < 120 { turn * 20 } else { turn * 20 + 100_000 },
    ] as [&dyn Fn(u32) -> u32; 3]
    {
        let found = pushed(new(), &drive(jumps));
        assert!((found.advance_m.unwrap() - whole.advance_m.unwrap()).abs() < 1e-3, "{:?}", found.advance_m);
        assert!(
            found.warnings.iter().any(|warning| warning.code() == "encoder_jumped"),
            "{:?}",
            found.warnings
        );
    }
    // A tractor that does go back does so at a tractor's speed.
    let back = pushed(new(), &drive(|turn| if turn < 120 { turn * 20 } else { 2400 - (turn - 120) * 10 }));
    assert!(back.warnings.iter().all(|warning| warning.code() != "encoder_jumped"));
}

/// Of an encoder whose way is not that of the tractor no area is told, whatever the scale: ticks that are missed, jumps at each turn.
#[test]
fn an_encoder_of_another_scale_is_told_and_tells_no_area() {
    for (drives, code, is_told) in [
        (&|turn: u32| turn * 20, "", true),
        (&|turn: u32| turn * 10, "encoder_speed", true),
        (&|turn: u32| turn * 2, "encoder_speed", false),
        (&|turn: u32| turn / 5, "encoder_speed", false),
        (&|turn: u32| turn * 200, "encoder_speed", false),
        (&|turn: u32| turn * 20_000, "encoder_jumped", false),
    ] as [(&dyn Fn(u32) -> u32, &str, bool); 6]
    {
        let found = pushed(Pipeline::new(Some(&rig()), 0, None).unwrap(), &drive(drives));
        let codes: Vec<_> = found.warnings.iter().map(rowscan_canopy::Warning::code).collect();
        assert_eq!(codes.iter().any(|code| code.starts_with("encoder_")), !code.is_empty(), "{codes:?}");
        assert!(code.is_empty() || codes.contains(&code), "{code}: {codes:?}");
        assert_eq!(found.impacted_total_area_m2.is_some(), is_told, "{code}: {codes:?}");
    }
}
