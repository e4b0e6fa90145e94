//! Pages that a command writes are what it writes now, and the settings file keeps its promise on the command line.

use crate::common;

use std::path::Path;

use common::binary::{assert_says, refused, run};

#[test]
fn the_pages_of_models_and_refusals_are_up_to_date() {
    for (page, arguments) in [
        ("docs/models.md", &["models", "--markdown"][..]),
        ("docs/refusals.md", &["models", "--refusals", "--markdown"]),
        ("docs/faults.md", &["faults", "--markdown"]),
        ("docs/orchard-parameters.md", &["orchard", "parameters", "paper", "--markdown"]),
    ] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(page);
        let kept = std::fs::read_to_string(&path).expect("the page is there");
        let written = run(arguments).stdout;
        assert!(kept == written, "{page} is old: run `cargo run -- {} > {page}`", arguments.join(" "));
    }
}

#[test]
fn a_torn_or_foreign_settings_file_is_refused_and_kept() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("scanner.txt");
    for (content, complaint) in [
        ("[package]\n", "not a file of scanner settings"),
        ("rowscan settings 1 lms111\nsWN LICsrc 0\n", "torn"),
        ("rowscan settings 1 lms511\nend 00\n", "those of a lms511"),
    ] {
        std::fs::write(&path, content).expect("written");
        let ended = run(&["emulate", "--state", path.to_str().expect("a path"), "--tcp", "127.0.0.1:0"]);
        assert_eq!(ended.code, Some(2), "{}", ended.stderr);
        assert!(
            ended.stderr.contains(complaint) && ended.stderr.contains("stays as it is"),
            "{}",
            ended.stderr
        );
        assert_eq!(std::fs::read_to_string(&path).expect("still there"), content);
    }
}

#[test]
fn a_line_the_model_does_not_have_is_told_at_once() {
    let ended = run(&["emulate", "--output", "9=on", "--tcp", "127.0.0.1:0"]);
    assert_eq!(ended.code, Some(2));
    assert!(ended.stderr.contains("LMS111 has 3 digital outputs; there is no number 9"), "{}", ended.stderr);
}

#[test]
fn one_model_is_told_alone() {
    let told = run(&["models", "lms111"]);
    assert_eq!(told.code, Some(0), "{}", told.stderr);
    assert!(
        told.stdout.contains("lms111")
            && !told.stdout.contains("tim561")
            && told.stdout.lines().count() < 100
    );
    let rows: Vec<serde_json::Value> =
        serde_json::from_str(&run(&["models", "tim561", "lms291", "--format", "json"]).stdout).expect("json");
    let names: Vec<_> = rows.iter().map(|row| row["name"].as_str()).collect();
    assert_eq!(names, [Some("tim561"), Some("lms291")]);
    assert_says(&refused(&["models", "lms112"]), &["lms112", "lms111"]);
}
