//! Studies: the gates on what they find, and that cutting, stopping and resuming change nothing. Seeds are fixed here; none was chosen.
#![allow(
    clippy::expect_used,
    clippy::unwrap_used,
    clippy::panic,
    clippy::print_stderr,
    reason = "a test fails by panicking and says what it skips"
)]

mod common;

use std::io::{self, Write};
use std::path::Path;
use std::process::{Command, Stdio};

use common::binary::{Emulator, Ended, finish, run};
use rowscan::config::load_scene;
use rowscan::study::areas::{self, AreasReport, AreasStudy, Gate, Rule};
use rowscan::study::journal::{self, Journal};
use rowscan::study::resolution::{self, ResolutionStudy};
use rowscan::study::{self, Header, Shard, Study, Unit};
use rowscan_scenes::scan::ScanSettings;

/// The paper's study with coarse scans: it takes a second instead of ten.
fn quick_areas(seed: u64) -> AreasStudy {
    let mut scene = load_scene("paper").expect("built in");
    scene.seed = seed;
    let study = AreasStudy::new(scene);
    let coarse =
        |settings: ScanSettings| ScanSettings { dy_m: 0.04, dtheta_deg: 1.0, pitch_m: 0.04, ..settings };
    AreasStudy { lateral: coarse(study.lateral.clone()), zenith: coarse(study.zenith.clone()), ..study }
}

fn whole<S: Study>(study: &S) -> Vec<Unit<S::Result>> {
    study::run(study, Shard::WHOLE, Vec::new(), &|_| Ok(())).expect("it runs")
}

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
    // At every seed: the range of leaf areas, and both orders.
    for rule in [Rule::Spread, Rule::SlopeOrder, Rule::R2Order] {
        assert!(gates(rule).count() >= 5);
        for gate in gates(rule) {
            assert!(gate.holds, "{gate}");
        }
    }
    // (h): at the middle seed, for a single set of twenty may have an outlier. docs/paper.md says how often the others do not hold.
    let place = |gate: &Gate| (gate.view, gate.area);
    for one in gates(Rule::R2).take(6) {
        let found: Vec<f64> =
            gates(Rule::R2).filter(|gate| place(gate) == place(one)).filter_map(|gate| gate.found).collect();
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
fn a_search_sets_what_it_says_and_is_the_same_in_parts() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("search.toml");
    let content = |value: &str| {
        format!(
            r#"version = 1
scene = "paper"
seeds = [3, 4]
one_at_a_time = true
joint = 1
[base]
iterations = [6, 7]
shady_percent = [60.0, 101.0]
"lateral.dy_m" = 0.05
"lateral.dtheta_deg" = 1.0
"zenith.dy_m" = 0.05
"zenith.pitch_m" = 0.05
"scene.orchard.trees" = 1
[[knob]]
key = "scene.orchard.tree.rules"
values = ["{value}"]
[[knob]]
key = "scene.orchard.tree.max_metamers"
values = [30]
"#
        )
    };
    std::fs::write(&file, content("floral_only")).expect("written");
    let search = |more: &[&str]| run(&[&["study", "search", text(&file), "--format", "json"], more].concat());
    let straight = search(&[]);
    assert_eq!(straight.code, Some(0), "{}", straight.stderr);
    let report: serde_json::Value = serde_json::from_str(&straight.stdout).expect("json");
    let points = report["points"].as_array().expect("points");
    assert_eq!(points.len(), 4, "base, two single knobs, one by lot");
    assert_eq!(points[1]["settings"]["scene.orchard.tree.rules"], "floral_only");
    assert_ne!(points[0]["leaf_area_m2"], points[1]["leaf_area_m2"]);
    assert_eq!((&points[0]["seeds"], &points[2]["seeds"]), (&2.into(), &0.into()));
    assert!(points[2]["refused"].as_str().is_some_and(|why| why.contains("exceeds 30 metamers")));
    assert!(points[0]["slope_distance"].is_number() && points[2]["slope_distance"].is_null());
    let parts: Vec<String> = (1..=3)
        .map(|shard| {
            let part = folder.path().join(format!("{shard}.json"));
            let ended = search(&["--shard", &format!("{shard}/3"), "--output", text(&part)]);
            assert_eq!(ended.code, Some(0), "{}", ended.stderr);
            text(&part).to_owned()
        })
        .collect();
    let merged = run(&["study", "merge", "--format", "json", &parts[0], &parts[1], &parts[2]]);
    assert!(merged.stdout == straight.stdout, "{}", merged.stderr);

    let path = text(&file);
    refused(&["study", "search", "nowhere.toml"], &["cannot read", "nowhere.toml"]);
    for (wrong, parts) in [
        (content("vaze"), ["vaze", "vase, floral_only"]),
        (content("vase").replace("tree.rules", "tree.rulez"), ["rulez", "unknown field"]),
        (content("vase").replace("seeds = [3, 4]", "seeds = []"), ["seeds", "found none"]),
        (content("vase").replace("version = 1", "version = 2"), ["version must be 1", "found 2"]),
        (content("vase").replace("key = ", "keys = [] # "), ["[[knob]] needs", "`key`"]),
    ] {
        std::fs::write(&file, wrong).expect("written");
        refused(&["study", "search", path], &[path, parts[0], parts[1]]);
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
    let scene = load_scene("paper").expect("built in");
    let study = ResolutionStudy {
        orchards: 4,
        dy_mm: vec![2, 20],
        dtheta_deg: vec![1.0],
        ..ResolutionStudy::new(scene)
    };
    let report = resolution::report(Header::of(&study), &whole(&study));
    let row = report.rows.iter().find(|row| row.dy_m == 0.02).expect("asked for");
    assert_eq!(row.n, 4 * 10, "orchards times offsets");
    assert!(row.error_mean.abs() < 0.05, "mean {}", row.error_mean);
    assert!(row.error_mean.abs() < 3.0 * row.error_sd / (row.n as f64).sqrt() + 1e-3, "no bias: {row:?}");
    let reference = report.rows.iter().find(|row| row.dy_m == 0.002).expect("asked for");
    assert_eq!((reference.n, reference.error_mean), (4, 0.0), "the reference against itself");
}

/// Four quick orchards.
const SMALL: [&str; 16] = [
    "study",
    "areas",
    "--iterations",
    "7,8",
    "--shady",
    "60,101",
    "--trees",
    "1",
    "--dy",
    "0.05",
    "--pitch",
    "0.05",
    "--dtheta",
    "1",
    "--format",
    "json",
];

fn small(more: &[&str]) -> Ended {
    run(&[&SMALL, more].concat())
}

fn text(path: &Path) -> &str {
    path.to_str().expect("UTF-8")
}

#[test]
fn shards_and_an_interrupted_run_give_the_same_numbers() {
    let folder = tempfile::tempdir().expect("a folder");
    let straight = small(&[]);
    assert_eq!(straight.code, Some(0), "{}", straight.stderr);
    let files: Vec<String> = (1..=4)
        .map(|shard| {
            let file = folder.path().join(format!("{shard}.json"));
            let ended = small(&["--shard", &format!("{shard}/4"), "--output", text(&file)]);
            assert_eq!((ended.code, ended.stdout.as_str()), (Some(0), ""), "{}", ended.stderr);
            text(&file).to_owned()
        })
        .collect();
    let merge = |files: &[&String]| {
        run(&[
            &["study", "merge", "--format", "json"][..],
            &files.iter().map(|f| f.as_str()).collect::<Vec<_>>(),
        ]
        .concat())
    };
    let merged = merge(&files.iter().collect::<Vec<_>>());
    assert_eq!(merged.code, Some(0), "{}", merged.stderr);
    assert_eq!(merged.stdout, straight.stdout);
    let keys: serde_json::Value = serde_json::from_str(&merged.stdout).expect("json");
    for key in ["slope", "slope_origin", "r2", "r2_uncentred", "loo_rmse_relative"] {
        assert!(keys["zenith"]["I_3L"][key].is_number(), "{key}");
    }
    assert!(
        keys["lateral"]["I_T"]["intercept_m2"].is_number()
            && keys["lateral"]["I_L"]["intercept_m2"].is_null()
    );
    assert!(keys["orchards"][0]["lateral"]["I_L"].is_number());

    let missing = merge(&[&files[0], &files[2]]);
    assert_eq!(missing.code, Some(2));
    assert!(missing.stderr.contains("2 of 4 orchards"), "{}", missing.stderr);
    let twice = merge(&[&files[0], &files[0], &files[1], &files[2], &files[3]]);
    assert!(twice.code == Some(2) && twice.stderr.contains("again in"), "{}", twice.stderr);

    // A full disk in the middle, by a limit on file size: the first line and one orchard fit.
    let file = folder.path().join("whole.json");
    let mut shell = Command::new("sh");
    shell.args(["-c", "trap '' XFSZ; ulimit -f 4; exec \"$@\"", "sh", env!("CARGO_BIN_EXE_rowscan")]);
    shell.args(SMALL).args(["--output", text(&file)]).env("RAYON_NUM_THREADS", "1");
    let full = finish(shell.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("sh runs"));
    assert_eq!(full.code, Some(2), "{}", full.stderr);
    assert!(full.stderr.contains("--resume"), "{}", full.stderr);
    assert!(!file.exists(), "a shard is whole or it is not there");
    let begun = small(&["--output", text(&file)]);
    assert!(begun.code == Some(2) && begun.stderr.contains("--resume"), "{}", begun.stderr);
    let resumed = small(&["--output", text(&file), "--resume"]);
    assert_eq!((resumed.code, resumed.stdout == straight.stdout), (Some(0), true), "{}", resumed.stderr);
    let again = small(&["--output", text(&file), "--resume"]);
    assert!(again.stdout == straight.stdout && again.stderr.contains("finished already"), "{}", again.stderr);

    let other = folder.path().join("other.json");
    let resolution = run(&[
        "study",
        "resolution",
        "--orchards",
        "1",
        "--trees",
        "1",
        "--advances-mm",
        "50,100",
        "--angles",
        "2",
        "--output",
        text(&other),
    ]);
    assert_eq!(resolution.code, Some(0), "{}", resolution.stderr);
    let mixed = merge(&[&files[0], &text(&other).to_owned()]);
    assert!(mixed.code == Some(2) && mixed.stderr.contains("of study resolution"), "{}", mixed.stderr);
}

/// Takes so many bytes, then the disk is full.
struct FullDisk {
    kept: Vec<u8>,
    room: usize,
}

impl Write for &mut FullDisk {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let fits = bytes.len().min(self.room - self.kept.len());
        self.kept.extend_from_slice(&bytes[..fits]);
        if fits == 0 { Err(io::ErrorKind::StorageFull.into()) } else { Ok(fits) }
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[test]
fn a_journal_keeps_what_was_whole_wherever_the_disk_filled_up() {
    let study = quick_areas(1);
    let mut scene = study.scene.clone();
    scene.orchard.trees = Some(1);
    let study = AreasStudy { scene, iterations: vec![7], ..study };
    let units = whole(&study);
    let mut all = FullDisk { kept: Vec::new(), room: 1 << 20 };
    let mut journal = Journal::begin(&mut all, &study, Shard::WHOLE).expect("room");
    units.iter().for_each(|unit| journal.keep(unit).expect("room"));
    for room in (0..all.kept.len()).step_by(97) {
        let mut disk = FullDisk { kept: Vec::new(), room };
        if let Ok(mut journal) = Journal::begin(&mut disk, &study, Shard::WHOLE) {
            assert!(units.iter().any(|unit| journal.keep(unit).is_err()), "room for {room} bytes");
        }
        let Some(kept) = journal::read(&disk.kept, &study, Shard::WHOLE).expect("a journal") else {
            continue;
        };
        assert!(kept.units.len() < units.len() && kept.units == units[..kept.units.len()], "{room}");
        let resumed = study::run(&study, Shard::WHOLE, kept.units, &|_| Ok(())).expect("it runs");
        assert!(resumed == units);
    }
    let other = AreasStudy { clearance_m: 0.7, ..study.clone() };
    assert!(journal::read(&all.kept, &other, Shard::WHOLE).is_err(), "another run's journal");
    assert!(
        journal::read(&all.kept, &study, "1/2".parse().expect("a shard")).is_err(),
        "another shard's journal"
    );
    assert!(journal::read(b"{}\n", &study, Shard::WHOLE).is_err(), "no journal at all");
}

fn refused(args: &[&str], parts: &[&str]) {
    let ended = run(args);
    assert_eq!(ended.code, Some(2), "{args:?}: {}", ended.stderr);
    for part in parts {
        assert!(ended.stderr.contains(part), "expected `{part}` in: {}", ended.stderr);
    }
}

#[test]
fn impossible_studies_and_scans_are_refused() {
    refused(&["study", "areas", "--shard", "5/4", "--output", "x"], &["5/4", "I from 1 to N"]);
    refused(&["study", "areas", "--shard", "1/2"], &["--output"]);
    refused(&["study", "areas", "--resume"], &["--output"]);
    refused(&[&SMALL[..12], &["--dtheta", "0"]].concat(), &["angle between beams", "positive", "found 0"]);
    refused(&["study", "resolution", "--advances-mm", "0"], &["--advances-mm"]);
    refused(&["study", "resolution", "--advances-mm", "7000", "--trees", "1"], &["too short", "7 m"]);
    refused(&["study", "merge", "Cargo.toml"], &["Cargo.toml", "no shard of a study"]);
    refused(&["scan", "--dtheta", "0"], &["angle between beams", "positive"]);
    refused(&["scan", "--type", "sideways"], &["zenith-orthogonal"]);
    refused(&["scan", "--wood", "net"], &["exact, mesh or mesh:HALF"]);
    refused(&["scan", "--wood", "mesh:0.001,0,0.001"], &["a mesh needs", "found 0.001, 0 and 0.001"]);
    refused(&["scan", "--type", "zenith", "--two-rows"], &["--two-rows", "zenith"]);
    refused(&["scan", "--distance", "0.2"], &["inside a tree", "0.2 m", "distance"]);
    refused(&["scan", "--type", "zenith", "--overhead", "1"], &["inside a tree", "height overhead"]);
}

#[test]
fn a_scan_writes_the_matrix_and_every_return_and_says_when_it_sees_nothing() {
    let folder = tempfile::tempdir().expect("a folder");
    let prefix = folder.path().join("row");
    let scanned = run(&[
        "scan",
        "spindle",
        "--two-rows",
        "--dy",
        "0.1",
        "--dtheta",
        "1",
        "--output",
        text(&prefix),
        "--write",
        "matrix,npy,csv,ply,las",
        "--format",
        "json",
    ]);
    assert_eq!(scanned.code, Some(0), "{}", scanned.stderr);
    let scans: serde_json::Value = serde_json::from_str(&scanned.stdout).expect("json");
    assert_eq!((&scans[0]["type"], &scans[1]["type"]), (&"opposite".into(), &"lateral".into()));
    assert_ne!(scans[0]["leaf_area_m2"], scans[1]["leaf_area_m2"], "different trees left and right");
    let read = |end: &str| std::fs::read(folder.path().join(format!("row{end}"))).expect(end);
    for (scan, side) in [(&scans[0], "_left"), (&scans[1], "_right")] {
        let matrix = String::from_utf8(read(&format!("{side}_L.csv"))).expect("UTF-8");
        let rows: Vec<&str> = matrix.lines().filter(|line| !line.starts_with('#')).collect();
        assert_eq!(Some(rows.len() as u64), scan["beams"].as_u64());
        assert!(rows.iter().all(|row| Some(row.split(',').count() as u64) == scan["lines"].as_u64()));
        let escapes = rows.iter().flat_map(|row| row.split(',')).filter(|range| *range == "1000").count();
        assert_eq!(Some(escapes as u64), scan["escapes"].as_u64());

        let npy = read(&format!("{side}_L.npy"));
        let (head, numbers) = npy.split_at(10 + usize::from(u16::from_le_bytes([npy[8], npy[9]])));
        let shape = format!("'shape': ({}, {})", rows.len(), scan["lines"]);
        let dictionary = String::from_utf8_lossy(&head[10..]);
        assert!(npy.starts_with(b"\x93NUMPY\x01\x00") && head.len() % 64 == 0 && dictionary.contains(&shape));
        let values =
            rows.iter().flat_map(|row| row.split(',')).map(|range| range.parse::<f64>().expect("a number"));
        let floats = numbers.chunks_exact(4).map(|four| f32::from_le_bytes(four.try_into().expect("four")));
        assert!(values.map(|range| range as f32).eq(floats), "the same matrix");
        let told = String::from_utf8(read(&format!("{side}_L.txt"))).expect("UTF-8");
        assert!(!told.is_empty() && matrix.starts_with(&told));

        let points = String::from_utf8(read(&format!("{side}_points.csv"))).expect("UTF-8");
        let first: Vec<&str> =
            points.lines().skip(1).filter(|line| line.split(',').nth(6) == Some("1")).collect();
        let of =
            |class: &str| first.iter().filter(|line| line.split(',').nth(3) == Some(class)).count() as u64;
        for (class, key) in [("leaf", "leaf_hits"), ("wood", "wood_hits"), ("ground", "ground_hits")] {
            assert_eq!(Some(of(class)), scan[key].as_u64(), "{class}");
        }
        let count = points.lines().count() - 1;
        let mut cloud =
            las::Reader::from_path(folder.path().join(format!("row{side}_points.las"))).expect("LAS");
        assert_eq!(cloud.header().number_of_points(), count as u64);
        let described = cloud.header().vlrs().iter().find(|vlr| vlr.record_id == 4).expect("extra bytes");
        assert_eq!((described.data.len(), &described.data[4..9]), (192, &b"organ"[..]));
        let organs =
            points.lines().skip(1).map(|line| line.split(',').nth(5).and_then(|organ| organ.parse().ok()));
        let all = cloud.read_all().expect("points");
        let kept = all.points().map(|point| {
            let bytes = point.expect("a point").extra_bytes;
            Some(u32::from_le_bytes(bytes.try_into().expect("four"))).filter(|organ| *organ != u32::MAX)
        });
        assert!(kept.eq(organs), "organs of the LAS file are those of the text");
        let mut ply = io::Cursor::new(read(&format!("{side}_points.ply")));
        let parsed = ply_rs_bw::parser::Parser::<ply_rs_bw::ply::DefaultElement>::new()
            .read_ply(&mut ply)
            .expect("PLY");
        assert_eq!(parsed.payload["vertex"].len(), count);
    }
    let blind = run(&["scan", "--range", "85..89", "--dy", "0.5"]);
    assert_eq!(blind.code, Some(1), "{}", blind.stderr);
    assert!(blind.stderr.contains("sees nothing"), "{}", blind.stderr);
}
