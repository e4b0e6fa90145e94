#![allow(clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

use super::*;
use crate::verdict::{Tried, Verdict};

fn case(name: &str, verdict: Verdict, message: &str) -> Case {
    Case {
        name: name.to_owned(),
        verdict,
        message: message.to_owned(),
        t_s: Some(1.5),
        row_m: Some(0.75),
        tree: Some(1),
        last_events: vec!["1.400 s, 0.70 m: left.disconnected".to_owned()],
        rerun: "rowscan check a.toml --seed 7".to_owned(),
        picture: None,
    }
}

fn tried() -> Tried {
    Tried {
        scenario: "a.toml".into(),
        name: "a".to_owned(),
        seed: Some(7),
        facts: vec![("scene".to_owned(), "spindle".to_owned())],
        cases: vec![
            case("1. scans_lost: 0 [seed 7]", Verdict::Passed, "found 0"),
            case("2. log # 1 [seed 7]", Verdict::Failed, "expected <a & \"b\">\u{1b}[31m,\nfound \u{0}none"),
            case("3. exit_code [seed 7]", Verdict::Error, "no acknowledgement"),
            case("4. can [seed 7]", Verdict::Skipped, "no vcan"),
        ],
        events: Vec::new(),
        output: "é".repeat(OUTPUT_LIMIT) + "\u{7}the end",
        simulated_s: 2.0,
        wall_s: 0.5,
    }
}

#[test]
fn junit_has_one_case_an_expectation_and_no_control_characters() {
    let text = junit(&[tried()]);
    let read = quick_junit::Report::deserialize_from_str(&text).expect("it reads");
    assert_eq!((read.tests, read.skipped, read.failures, read.errors), (4, 1, 1, 1));
    let suite = &read.test_suites[0];
    assert_eq!(suite.name.as_str(), "a [seed 7]");
    let names: std::collections::BTreeSet<_> =
        suite.test_cases.iter().map(|case| case.name.as_str()).collect();
    assert_eq!(names.len(), 4);
    assert!(text.chars().all(|c| !c.is_control() || c == '\n' || c == '\t'), "{text}");
    let output = suite.system_out.as_ref().expect("kept").as_str();
    assert!(output.len() <= OUTPUT_LIMIT && output.ends_with("the end"));
    // On one line as the attribute, and in the text, for readers that take either.
    assert_eq!(text.matches("expected &lt;a &amp; &quot;b&quot;&gt;[31m, found none").count(), 2, "{text}");
    assert!(text.contains("again: rowscan check a.toml --seed 7"));
}

#[test]
fn tap_counts_escapes_and_explains() {
    let text = tap(&[tried()]);
    let expected = "TAP version 14\n1..4\nok 1 - a: 1. scans_lost: 0 [seed 7]\nnot ok 2 - a: 2. log \\# 1 [seed 7]\n  ---\n  \
                    message: \"expected <a & \\\"b\\\">[31m, found none\"\n  severity: fail\n";
    assert!(text.starts_with(expected), "{text}");
    assert!(text.ends_with("ok 4 - a: 4. can [seed 7] # SKIP no vcan\n"), "{text}");
}

#[test]
fn people_read_where_it_was_and_how_to_run_it_again() {
    let text = text(&tried());
    let expected = "  FAILED  2. log # 1 [seed 7]: expected <a & \"b\">[31m, found none\n          at 1.500 s, row 0.75 m, tree 1\n          \
                    event 1.400 s, 0.70 m: left.disconnected\n          again: rowscan check a.toml --seed 7\n";
    assert!(text.contains(expected), "{text}");
}

#[test]
fn lines_are_json() {
    for line in jsonl(&tried()).lines() {
        let value: serde_json::Value = serde_json::from_str(line).expect(line);
        assert_eq!(value["kind"], "verdict");
    }
}

#[test]
fn what_was_tried_comes_back_from_its_record() {
    let tried = tried();
    let record = serde_json::to_string(&tried).expect("written");
    assert_eq!(serde_json::from_str::<Tried>(&record).expect("read"), tried);
}
