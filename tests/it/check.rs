//! `rowscan check` with the scenarios and the controller of tools/scenarios.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::common::binary::{Ended, assert_says, run, text};

fn scenario(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tools/scenarios").join(name)
}

/// False, visibly, where the controller cannot run.
fn has_python() -> bool {
    let found = Command::new("python3").arg("--version").output().is_ok();
    if !found {
        eprintln!("SKIPPED: scenarios: no python3 on this machine");
    }
    found
}

fn check(name: &str, flags: &[&str]) -> Ended {
    let path = scenario(name);
    run(&[&["check", text(&path)], flags].concat())
}

#[test]
fn a_steady_run_passes_and_a_controller_that_quits_fails() {
    if !has_python() {
        return;
    }
    let ended = check("steady.toml", &["--seed", "7"]);
    assert_eq!(ended.code, Some(0), "{}", ended.stdout);
    assert_says(&ended.stderr, &["10 passed, 0 failed, 0 not judged, 0 skipped"]);

    let ended = check("quits.toml", &[]);
    assert_eq!(ended.code, Some(1), "{}", ended.stdout);
    assert_says(
        &ended.stdout,
        &[
            "FAILED  2. exit_code: 0 [seed 7]: exit code of sut: expected 0, found 1",
            "sut.exited: code 1",
            "quits.toml --seed 7",
        ],
    );
}

#[test]
fn what_cannot_be_judged_exits_with_2() {
    if has_python() {
        let ended = check("deaf.toml", &["--format", "tap"]);
        assert_eq!(ended.code, Some(2), "{}", ended.stdout);
        assert_says(&ended.stdout, &["1..1\nnot ok 1 - deaf", "no one took scans within 2s"]);
    }
    let ended = check("base.toml", &[]);
    assert_eq!(ended.code, Some(2));
    assert_says(&ended.stdout, &["it expects nothing; add an [[expect]]"]);
}

/// A JUnit document without its times.
fn timeless(junit: &str) -> String {
    let mut rest = junit;
    let mut kept = String::new();
    while let Some((before, after)) = ["time=\"", "timestamp=\""]
        .iter()
        .filter_map(|key| rest.split_once(key))
        .min_by_key(|(before, _)| before.len())
    {
        kept += before;
        rest = after.split_once('"').map_or("", |(_, rest)| rest);
    }
    kept + rest
}

#[test]
fn in_lockstep_the_same_seed_gives_the_same_junit_but_for_times() {
    if !has_python() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    for seed in ["7", "8", "9"] {
        let junit = |name: &str| {
            let file = folder.path().join(name);
            let ended = check("quits.toml", &["--seed", seed, "--junit", text(&file)]);
            assert_eq!(ended.code, Some(1), "{}", ended.stdout);
            timeless(&std::fs::read_to_string(file).expect("written"))
        };
        let (first, second) = (junit("first.xml"), junit("second.xml"));
        assert!(first.contains("0.400 s"), "{first}");
        assert_eq!(first, second, "seed {seed}");
    }
}

#[test]
fn the_manual_lists_all_that_can_be_expected() {
    let manual =
        std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/bench.md")).expect("there");
    let table = run(&["check", "--markdown"]).stdout;
    assert!(manual.contains(&table), "docs/bench.md: put in the table of `rowscan check --markdown`");
}
