//! Studies: the gates on what they find, and what cannot be studied. Seeds are fixed here; none was chosen.

use crate::common;

use common::binary::{Emulator, assert_says, refused, run, text};
use common::studies::{SMALL, quick_areas, small, whole};
use rowscan_scenes::files::load_scene;
use rowscan_study::Header;
use rowscan_study::areas::{self, AreasReport, AreasStudy, Gate, Rule};
use rowscan_study::resolution::{self, ResolutionStudy};

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    values[values.len() / 2]
}

#[test]
fn twenty_orchards_hold_the_gates() {
    let reports: Vec<AreasReport> = (1..=5)
        .map(|seed| {
            let study = quick_areas(seed);
            areas::report(Header::of(&study), whole(&study))
        })
        .collect();
    assert!(reports.iter().all(|report| report.orchards.len() == 20));
    let gates = |rule: Rule| {
        reports.iter().flat_map(move |report| report.gates.iter().filter(move |gate| gate.rule == rule))
    };
    // At every seed: the range of leaf areas, and the order of slopes.
    for rule in [Rule::Spread, Rule::SlopeOrder] {
        assert!(gates(rule).count() >= 5);
        for gate in gates(rule) {
            assert!(gate.holds, "{gate}");
        }
    }
    // (h): at the middle seed, for a single set of twenty may have an outlier. docs/paper.md says how often the others do not hold.
    let place = |gate: &Gate| (gate.view, gate.area);
    let first = |rule: Rule| reports[0].gates.iter().filter(move |gate| gate.rule == rule);
    for one in first(Rule::R2).chain(first(Rule::R2Order)) {
        let same = gates(one.rule).filter(|gate| place(gate) == place(one));
        let found: Vec<f64> = same.filter_map(|gate| gate.found).collect();
        assert_eq!(found.len(), 5);
        assert!(median(found) >= one.limit, "{one}");
    }
    for fit in reports.iter().flat_map(|report| [&report.lateral.three_leaves, &report.zenith.three_leaves]) {
        let error = fit.as_ref().expect("a fit").loo_rmse_relative;
        assert!(error < 0.45, "{error}");
    }
    // (k): more seasons, more leaves, in the middle of all seeds and thresholds.
    let by_season: Vec<f64> = (7..=11)
        .map(|iterations| {
            let orchards = reports.iter().flat_map(|report| &report.orchards);
            median(orchards.filter(|o| o.iterations == iterations).map(|o| o.leaf_area_m2).collect())
        })
        .collect();
    assert!(by_season.windows(2).all(|pair| pair[0] < pair[1]), "{by_season:?}");
}

/// (j), (k), (m): one orchard at stricter and stricter thresholds, down to none of its leaves.
#[test]
fn shade_takes_leaves_and_leaves_wood() {
    let scanned: Vec<areas::Orchard> = [101.0, 80.0, 70.0, 60.0, 0.0]
        .into_iter()
        .map(|shady| {
            // A study of one orchard: the same seed, so the same tree, at every threshold.
            let study = AreasStudy { iterations: vec![8], shady_percent: vec![shady], ..quick_areas(1) };
            whole(&study).remove(0).result
        })
        .collect();
    assert!(scanned.windows(2).all(|pair| pair[0].seed == pair[1].seed));
    assert!(scanned.windows(2).all(|pair| pair[1].leaf_area_m2 < pair[0].leaf_area_m2), "strictly fewer");
    let bare = scanned.last().expect("five");
    assert_eq!(bare.leaf_area_m2, 0.0);
    for areas in [bare.lateral, bare.zenith] {
        assert_eq!((areas.leaf_m2, areas.three_leaves_m2), (0.0, 0.0));
        assert!(areas.total_m2 > 0.0, "the reason the paper gives for its intercepts");
    }
}

#[test]
fn a_study_s_calibration_loads_where_estimates_are_made() {
    let folder = tempfile::tempdir().expect("a folder");
    let calibration = folder.path().join("orchards.toml");
    let made = small(&["--calibration", text(&calibration)]);
    assert_eq!(made.code, Some(0), "{}", made.stderr);
    let emulator = Emulator::start(&["paper", "--time-scale", "max"]);
    let estimate = |calibration: &str| {
        let url = emulator.url();
        let asked =
            ["estimate", &url, "--rig", "paper", "--scans", "450", "--format", "json", "--calibration"];
        run(&[&asked[..], &[calibration]].concat())
    };
    let ended = estimate(text(&calibration));
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    let told: serde_json::Value = serde_json::from_str(&ended.stdout).expect("json");
    assert!(told["leaf_area_m2"].as_f64().is_some_and(|area| area > 0.0), "{}", ended.stdout);
    let class = "iterations, shady thresholds 60, 101 %";
    assert!(std::fs::read_to_string(&calibration).expect("written").contains(class));
    assert!(ended.stdout.contains(class), "the class is named with the result: {}", ended.stdout);
}

#[test]
fn twenty_millimetres_are_as_good_as_two() {
    let scene = load_scene("paper", |_| {}).expect("built in");
    let study = ResolutionStudy {
        orchards: 4,
        dy_mm: vec![2, 20],
        dtheta_deg: vec![1.0],
        offsets: 10,
        ..ResolutionStudy::new(scene)
    };
    let report = resolution::report(Header::of(&study), &whole(&study));
    let row = report.rows.iter().find(|row| row.dy_m == 0.02).expect("asked for");
    assert_eq!(row.n, 4 * 10, "orchards times offsets");
    assert!(row.error_mean.abs() < 0.05, "mean {}", row.error_mean);
    assert!(row.error_mean.abs() < 3.0 * row.error_sd / (row.n as f64).sqrt() + 1e-3, "no bias: {row:?}");
    assert!(row.error_mean != 0.0 && row.error_mean_se > 0.0, "drawn offsets, not all of them: {row:?}");
    let reference = report.rows.iter().find(|row| row.dy_m == 0.002).expect("asked for");
    assert_eq!((reference.n, reference.error_mean), (4, 0.0), "the reference against itself");
}

#[test]
fn trunks_in_one_phase_make_a_step_that_the_advance_does_not() {
    // Six trunks of 0.5 m: met by 3 or 4 lines of 150 mm.
    let scene = load_scene("cylinder", |_| {}).expect("built in");
    let sd = |spacing_m: Option<f64>| {
        let study = ResolutionStudy {
            orchards: 2,
            dy_mm: vec![2, 150],
            dtheta_deg: vec![1.0],
            offsets: 30,
            ..ResolutionStudy::new(scene.clone())
        };
        let study = ResolutionStudy { tree_spacing_m: spacing_m.unwrap_or(study.tree_spacing_m), ..study };
        let report = resolution::report(Header::of(&study), &whole(&study));
        report.rows.last().map(|row| row.error_sd).expect("a row")
    };
    // 2.1 m are 14 advances: all trunks are met alike.
    let (locked, free) = (sd(Some(2.1)), sd(None));
    assert!(free < 0.6 * locked, "{free} {locked}");
}

#[test]
fn impossible_studies_are_refused() {
    assert_says(&refused(&["study", "areas", "--shard", "5/4", "--output", "x"]), &["5/4", "I from 1 to N"]);
    assert_says(&refused(&["study", "areas", "--shard", "1/2"]), &["--output"]);
    assert_says(&refused(&["study", "areas", "--resume"]), &["--output"]);
    assert_says(
        &refused(&[&SMALL[..12], &["--dtheta", "0"]].concat()),
        &["angle between beams", "positive", "found 0"],
    );
    assert_says(&refused(&["study", "resolution", "--advances-mm", "0"]), &["--advances-mm"]);
    assert_says(
        &refused(&["study", "resolution", "--advances-mm", "7000", "--trees", "1"]),
        &["too short", "14 m"],
    );
    assert_says(&refused(&["study", "merge", "Cargo.toml"]), &["Cargo.toml", "no shard of a study"]);
}

/// A row repeats: a drive that begins before its first tree, or behind it, passes as much leaf area as one that begins with it.
#[test]
fn a_row_is_as_wrong_wherever_the_drive_starts() {
    use rowscan_emulator::stage::Stage;
    use rowscan_protocol::model;
    use rowscan_study::trial::Trial;

    let of = |start_m: f64| {
        let mut scene = crate::common::small_scene();
        let mut rig = scene.resolved_rig();
        rig.start_m = start_m;
        scene.rig = rig;
        let stage = Stage::grow(scene, &|_, _| {}).expect("it grows");
        let trial =
            Trial::drive_past(&stage, model::by_name("lms111").expect("a model"), None, &[]).expect("tried");
        let raw_m2 = trial.estimate.leaf.areas.contact_raw_m2().expect("known");
        let scanned_m = trial.estimate.scanned_m.expect("known");
        assert!((scanned_m - trial.length_m).abs() < 0.05, "{start_m}: {scanned_m} m of {}", trial.length_m);
        (raw_m2 / trial.truth.leaf_area_m2, trial.estimate.trees)
    };
    let (whole, _) = of(0.0);
    for start_m in [-2.0, -1.0, 2.0] {
        let (found, trees) = of(start_m);
        assert!((found / whole - 1.0).abs() < 0.05, "{start_m}: {found} beside {whole}");
        assert!(trees.iter().any(|tree| tree.complete), "{start_m}");
    }
}
