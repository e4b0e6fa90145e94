//! The live page beside an LMS2xx: on its line, and played again.
#![cfg(target_os = "linux")]

use serde_json::Value;

use crate::common::binary::{Telling, run};
use crate::common::recorded::{estimate, folder};
use crate::web::{http, json, line_of, page_of, state_when};

#[test]
fn an_lms2xx_shows_its_lines_emulated_and_replayed() {
    let (_folder, file) = folder();
    let (scene, link, recording) = (file("row.toml"), file("lms"), file("run.mcap"));
    let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().build().expect("a runtime");
    let flags = ["--model", "lms291", "--pty", &link, "--time-scale", "4", "--web", "127.0.0.1:0"];
    let mut emulating = Telling::start("emulate", &[&[scene.as_str()][..], &flags].concat());
    let page = page_of(&mut emulating);
    let scans = ["--model", "lms291", "--scans", "60", "--record", &recording];
    let read: Value =
        serde_json::from_str(&estimate(&format!("serial:{link}"), &scene, &scans)).expect("json");
    assert_eq!(read["scans"], 60);
    runtime.block_on(async {
        let state = state_when(page, |state| state["scanners"][0]["lines"].as_u64() >= Some(60)).await;
        assert_eq!(state["scanners"][0]["beams"], read["points_per_scan"]);
        let (_, _, picture) = http(page, "GET /watch/scan HTTP/1.1", "").await;
        let (_, range, _, classes) =
            line_of(&picture).expect("a line, with its classes and where its beams went out");
        assert!(classes.contains(&1), "it stands beside leaves");
        for (range, class) in range.iter().zip(&classes) {
            assert_eq!(range.is_finite(), *class != 0);
        }
        let strip = json(page, "/watch/strip").await;
        let measured = strip["strip"]["measured"][0].as_array().expect("measured");
        assert!(measured.iter().any(|metre| metre["impacted_m2"].as_f64() > Some(0.0)), "{strip}");
    });
    emulating.end();

    let again = file("again");
    // Recorded four times as fast as its line carries it: a paced clock would drop most of it.
    let flags = ["--pty", &again, "--web", "127.0.0.1:0", "--rig", &scene, "--loop", "--time-scale", "max"];
    let mut replaying = Telling::start("replay", &[&[recording.as_str()][..], &flags].concat());
    let page = page_of(&mut replaying);
    let ended =
        run(&["estimate", &format!("serial:{again}"), "--rig", &scene, "--model", "lms291", "--scans", "20"]);
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    runtime.block_on(async {
        let state = state_when(page, |state| state["scanners"][0]["lines"].as_u64() >= Some(20)).await;
        assert_eq!(state["scanners"][0]["beams"], read["points_per_scan"]);
    });
    replaying.end();
}
