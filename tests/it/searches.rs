//! The search for the paper's numbers: it sets what it says, is the same in parts, and refuses what names nothing.

use crate::common;

use common::binary::{assert_says, refused, run, text};
use rowscan::feature::Feature;

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
    assert_says(&refused(&["study", "search", "nowhere.toml"]), &["cannot read", "nowhere.toml"]);
    for (wrong, parts) in [
        (content("vaze"), ["vaze", "vase, floral_only"]),
        (content("vase").replace("tree.rules", "tree.rulez"), ["rulez", "unknown key"]),
        (content("vase").replace("seeds = [3, 4]", "seeds = []"), ["seeds", "found none"]),
        (content("vase").replace("version = 1", "version = 2"), ["version must be 1", "found 2"]),
        (content("vase").replace("key = ", "keys = [] # "), ["[[knob]] needs", "`key`"]),
    ] {
        std::fs::write(&file, wrong).expect("written");
        let message = refused(&["study", "search", path]);
        assert_says(&message, &[path, parts[0], parts[1]]);
        assert!(!message.contains(":0:"), "it names the line: {message}");
    }
}

/// A small search: a base and one knob.
const SMALL: &str = r#"version = 1
scene = "paper"
seeds = [3, 4]
seen = [50]
one_at_a_time = true
[base]
iterations = [6, 8]
"scene.orchard.tree.internodes" = "table2"
shady_percent = [60.0, 101.0]
"lateral.dy_m" = 0.05
"lateral.dtheta_deg" = 1.0
"zenith.dy_m" = 0.05
"zenith.pitch_m" = 0.05
"scene.orchard.trees" = 1
[[knob]]
key = "scene.orchard.tree.rules"
values = ["floral_only"]
"#;

#[test]
fn points_are_confirmed_on_seeds_that_did_not_choose_them() {
    let folder = tempfile::tempdir().expect("a folder");
    let (file, found) = (folder.path().join("search.toml"), folder.path().join("found.json"));
    std::fs::write(&file, SMALL).expect("written");
    let search = |more: &[&str]| run(&[&["study", "search", text(&file)], more].concat());
    let selected = search(&["--output", text(&found), "--format", "json"]);
    assert_eq!(selected.code, Some(0), "{}", selected.stderr);
    let report: serde_json::Value = serde_json::from_str(&selected.stdout).expect("json");
    assert_eq!(report["points"][1]["confirmed"], false, "its own seeds confirm nothing");

    let confirm = ["--confirm", "101..110", "--selected", text(&found), "--best", "1", "--format", "json"];
    let confirmed = search(&confirm);
    assert_eq!(confirmed.code, Some(0), "{}", confirmed.stderr);
    let report: serde_json::Value = serde_json::from_str(&confirmed.stdout).expect("json");
    let points = report["points"].as_array().expect("points");
    assert_eq!((points.len(), &points[0]["point"], &points[1]["point"]), (2, &0.into(), &1.into()));
    for point in points {
        assert_eq!((&point["confirmed"], &point["seeds"]), (&true.into(), &10.into()));
        for regression in point["regressions"].as_array().expect("six") {
            let number = |value: &serde_json::Value| value.as_f64().expect("a number");
            for key in ["slope", "r2", "intercept_free_m2"] {
                let ends = &regression[format!("{key}_95")];
                let (low, middle, high) = (number(&ends[0]), number(&regression[key]), number(&ends[1]));
                assert!(low <= middle && middle <= high && low < high, "{key}: {low} {middle} {high}");
            }
        }
    }
    let again = search(&confirm);
    assert_eq!(again.stdout, confirmed.stdout, "the bootstrap repeats");
    let rows = search(&["--confirm", "101..110", "--points", "1", "--format", "csv"]);
    assert!(rows.stdout.starts_with("point,settings,seeds,confirmed,slope_distance,slope_distance_low"));
    assert_eq!(rows.stdout.lines().count(), 1 + 6, "a line a regression");

    for (seeds, parts) in [
        ("1..12", ["seeds 3, 4 had a part in choosing", "seeds above 50"]),
        ("45..60", ["seeds 50 had a part", "`seen`"]),
        ("101..105", ["at least 10", "found 5"]),
    ] {
        assert_says(&refused(&["study", "search", text(&file), "--confirm", seeds]), &parts);
    }
    let beyond = refused(&["study", "search", text(&file), "--confirm", "101..110", "--points", "7"]);
    assert_says(&beyond, &["points from 0 to 1", "found 7"]);
    std::fs::write(&file, SMALL.replace("seeds = [3, 4]", "seeds = [3, 5]")).expect("written");
    let other =
        refused(&["study", "search", text(&file), "--confirm", "101..110", "--selected", text(&found)]);
    assert_says(&other, &["results of this very search", "settings"]);
}

#[test]
fn the_paper_stands_beside_its_own_orchards_alone() {
    let study = |scene: &str, more: &[&str]| {
        let small = ["--iterations", "5,6", "--trees", "1", "--dy", "0.1", "--dtheta", "2", "--pitch", "0.1"];
        let few = ["--shady", "60,101"];
        let ended = run(&[&["study", "areas", scene], &small[..], &few, more].concat());
        assert_eq!(ended.code, Some(0), "{}", ended.stderr);
        ended.stdout
    };
    let (paper, own) = (study("paper", &[]), study("hedge", &[]));
    assert!(paper.contains("gates hold") && paper.contains("12.67") && paper.contains("paper slope"));
    assert!(!own.contains("gates") && !own.contains("12.67") && !own.contains("paper"), "{own}");
    let (paper, own) = (study("paper", &["--seeds", "1..10"]), study("hedge", &["--seeds", "1..10"]));
    assert!(paper.contains("off %") && paper.contains("percentile bootstrap") && paper.contains("10 seeds"));
    assert!(
        !own.contains("12.67") && !own.contains("gates") && own.contains("percentile bootstrap"),
        "{own}"
    );
}

#[test]
fn figures_are_written_as_their_names_say_and_other_names_are_refused_at_once() {
    let folder = tempfile::tempdir().expect("a folder");
    let study = |name: &str| {
        let path = folder.path().join(name);
        let small = ["--iterations", "5,6", "--trees", "1", "--dy", "0.1", "--dtheta", "2", "--pitch", "0.1"];
        let ended = run(&[&["study", "areas", "--figure", text(&path)], &small[..]].concat());
        (ended, path)
    };
    let (ended, path) = study("areas.svg");
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    let svg = std::fs::read_to_string(path).expect("written");
    assert!(
        svg.contains("font-style=\"italic\"") && !svg.contains("I_T") && !svg.contains("L_A"),
        "subscripts"
    );
    if Feature::Figures.is_built() {
        let (ended, path) = study("areas.pdf");
        if ended.stderr.contains("expected a sans-serif font") {
            eprintln!("SKIPPED: PDF and PNG: no font on this machine");
        } else {
            assert!(std::fs::read(path).expect("written").starts_with(b"%PDF-"), "{}", ended.stderr);
        }
    }
    let (ended, path) = study("areas.gif");
    assert!(ended.code == Some(2) && !path.exists(), "{}", ended.stderr);
    assert!(ended.stderr.contains(".svg, .pdf or .png"), "{}", ended.stderr);
}
