//! Whatever a stream holds: no panic, no NaN, and the same result however it is looked at.

use crate::common::*;
use proptest::prelude::*;
use rowscan_canopy::{Parameters, Pipeline};
use rowscan_protocol::angle::BeamGrid;
use rowscan_protocol::rig::{BeamWidth, Mount, Orientation, Rig, Roof, RowSide};
use rowscan_protocol::scan::{Echo, NO_ECHO, Scan};
use rowscan_protocol::validity::DeviceStatus;

fn range() -> impl Strategy<Value = f64> {
    prop_oneof![
        6 => 0.01f64..20.0,
        2 => Just(NO_ECHO),
        1 => any::<f64>(),
        1 => prop::sample::select(vec![f64::NAN, f64::NEG_INFINITY, 0.0, -0.0, -1.0, 1e300, f64::MIN_POSITIVE, 1000.0]),
    ]
}

fn grid() -> impl Strategy<Value = BeamGrid> {
    prop_oneof![
        4 => Just(BeamGrid { start: 300_000, step: 20_000, count: 60 }),
        1 => (any::<i32>(), any::<u16>(), 0u16..80).prop_map(|(start, step, count)| BeamGrid { start, step, count }),
        1 => Just(BeamGrid::default()),
    ]
}

fn scan() -> impl Strategy<Value = Scan> {
    let counters = prop_oneof![4 => 0u16..20, 1 => any::<u16>()];
    let time = prop_oneof![4 => 0u32..400_000, 1 => any::<u32>()];
    let hertz = prop_oneof![4 => Just(50.0), 1 => any::<f64>()];
    let status = prop_oneof![8 => Just(DeviceStatus::Ok), 1 => Just(DeviceStatus::Error)];
    (counters, time, hertz, status, grid(), prop::collection::vec(range(), 0..90), 0usize..3).prop_map(
        |(telegram_counter, scan_time_us, scan_frequency_hz, status, beams, range_m, echoes)| Scan {
            status,
            telegram_counter,
            scan_time_us,
            scan_frequency_hz,
            beams,
            echoes: vec![Echo { range_m, remission: Vec::new() }; echoes],
            ..Scan::default()
        },
    )
}

fn rig() -> impl Strategy<Value = Rig> {
    let orientation = prop::sample::select(vec![Orientation::Side, Orientation::Up]);
    let roof = prop::sample::select(vec![None, Some(Roof::Forward), Some(Roof::Backward)]);
    let row = prop::sample::select(vec![RowSide::Right, RowSide::Left]);
    let spacing = || prop::option::of(0.05f64..1000.0);
    let mount = (orientation, roof, row, 0.01f64..100.0, 0.01f64..100.0).prop_map(
        |(orientation, roof, row, height_m, distance_m)| Mount {
            orientation,
            roof,
            row,
            height_m,
            distance_m,
            ..Mount::default()
        },
    );
    let optics = prop::option::of(Just(BeamWidth::Ideal));
    let ground = (-10.0f64..10.0, prop::option::of(-45.0f64..45.0));
    (0.0f64..100.0, -1e6f64..1e6, spacing(), prop::option::of(0.1f64..1000.0), ground, optics, mount)
        .prop_map(
            |(
                speed_m_s,
                start_m,
                tree_spacing_m,
                row_spacing_m,
                (ground_clearance_m, ground_slope_deg),
                optics,
                mount,
            )| {
                Rig {
                    optics,
                    speed_m_s,
                    start_m,
                    tree_spacing_m,
                    row_spacing_m,
                    ground_clearance_m,
                    ground_slope_deg,
                    scanners: vec![mount],
                    ..Rig::default()
                }
            },
        )
}

/// Every number in a JSON value, with its key; null only where the key may be unknown.
fn numbers_are_finite(value: &serde_json::Value) -> bool {
    match value {
        serde_json::Value::Number(number) => number.as_f64().is_some_and(f64::is_finite),
        serde_json::Value::Array(list) => list.iter().all(numbers_are_finite),
        serde_json::Value::Object(map) => map.values().all(numbers_are_finite),
        _ => true,
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn no_stream_panics_or_gives_a_number_that_is_none(
        rig in prop::option::of(rig()),
        scans in prop::collection::vec(scan(), 0..25),
    ) {
        let mut pipeline = Pipeline::new(rig.as_ref(), 0, None).unwrap();
        for scan in &scans {
            pipeline.push(scan);
            let progress = serde_json::to_value(pipeline.progress()).unwrap();
            prop_assert!(numbers_are_finite(&progress));
        }
        let estimate = pipeline.finish();
        let of_leaves = ["no_foliage", "optics_unknown", "other_beams", "ground_slope", "ground_as_canopy", "ground_level", "out_of_sight", "ground_silent", "stood_still", "in_the_air", "rides_along", "row_elsewhere", "mostly_unseen", "canopy_at_scanner", "too_few_beams", "too_many_leaves"];
        let withheld = estimate.leaf.areas.best_m2().err().is_some_and(|why| of_leaves.contains(&why.code()));
        // serde_json writes NaN as null: what must be a number is looked at by itself.
        for (key, value) in [
            ("scanned_m", estimate.scanned_m),
            ("impacted_total_area_m2", estimate.impacted_total_area_m2),
            ("leaf_area_m2", estimate.leaf.areas.best_m2().ok()),
            ("leaf_area_contact_raw_m2", estimate.leaf.areas.contact_raw_m2().ok()),
        ] {
            // Of what is no foliage there is no leaf area, nor through beams of an unknown width.
            let known = !(key.starts_with("leaf_area") && withheld);
            prop_assert_eq!(value.is_some(), known && estimate.impacted_total_area_m2.is_some(), "{}: {:?}", key, estimate.leaf.areas.best_m2());
            prop_assert!(value.is_none_or(|v| v.is_finite() && v >= 0.0), "{} = {:?}", key, value);
        }
        for number in [estimate.leaf.areas.lai().ok(), estimate.scan_frequency_hz, estimate.ranges.mean_m] {
            prop_assert!(number.is_none_or(|v| v.is_finite() && v >= 0.0));
        }
        for tree in &estimate.trees {
            prop_assert!(tree.impacted_total_area_m2.is_finite() && tree.volume_m3.is_finite() && tree.scanned_m > 0.0);
            prop_assert!(tree.leaf.areas.best_m2().ok().map_or(withheld, f64::is_finite));
        }
        if rig.is_some() && estimate.is_withheld() {
            let reasons = ["nothing_valid", "too_much_excluded", "no_time", "no_encoder", "no_foliage", "optics_unknown", "other_beams", "ground_slope", "ground_as_canopy", "ground_level", "out_of_sight", "ground_silent", "stood_still", "in_the_air", "rides_along", "row_elsewhere", "mostly_unseen", "canopy_at_scanner", "too_few_beams", "too_many_leaves", "stood", "unknown_beams"];
            let told = estimate.warnings.iter().any(|warning| reasons.contains(&warning.code()));
            prop_assert!(told, "areas are null without a reason: {:?}", estimate.warnings);
        }
        prop_assert_eq!(estimate.scans, scans.len() as u64);
    }

    #[test]
    fn a_look_in_between_changes_nothing(
        rig in rig(),
        scans in prop::collection::vec(scan(), 1..20),
        at in any::<prop::sample::Index>(),
    ) {
        let mut looked = Pipeline::new(Some(&rig), 0, None).unwrap();
        let mut blind = looked.clone();
        for (i, scan) in scans.iter().enumerate() {
            blind.push(scan);
            looked.push(scan);
            if i == at.index(scans.len()) {
                looked.estimate();
            }
        }
        prop_assert_eq!(looked.finish(), blind.finish());
    }

    #[test]
    fn lines_lost_inside_a_wall_leave_its_area(lost in prop::collection::vec(any::<bool>(), 60)) {
        let rig = open_rig();
        let grid = BeamGrid::spanning(300_000, 1_500_000, 5000);
        let scans = drive(&rig, grid, 50, 62, wall(1.9));
        let kept: Vec<&Scan> = scans
            .iter()
            .enumerate()
            .filter(|(i, _)| *i == 0 || *i == 61 || !lost[i - 1])
            .map(|(_, scan)| scan)
            .collect();
        // Any gap is short enough to be filled.
        let parameters = Parameters { max_gap_steps: 100.0, ..Parameters::default() };
        let whole = estimate_with(&rig, parameters, &scans).impacted_total_area_m2.unwrap();
        let found = estimate_with(&rig, parameters, kept).impacted_total_area_m2.unwrap();
        prop_assert!(relative(found, whole) < 1e-12, "{} {}", found, whole);
    }
}
