//! The search for the paper's numbers: it sets what it says, is the same in parts, and refuses what names nothing.
#![allow(
    clippy::expect_used,
    clippy::panic,
    clippy::print_stderr,
    reason = "a test fails by panicking and says what it skips"
)]

use crate::common;

use common::binary::{assert_says, refused, run, text};

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
