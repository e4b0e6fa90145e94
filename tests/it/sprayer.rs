//! A sprayer in scenarios: the controller of tools/scenarios/sprayer passes, each of its errors fails by a named expectation, and a kept run is scored again.

use std::path::Path;
use std::process::Command;

use crate::common::binary::{assert_says, run, text};

/// What `check` says of a scenario with one of the controller's errors: expectations with their verdicts and messages.
fn verdicts(scenario: &str, fault: &str, keep: &Path) -> Option<Vec<(String, String, String)>> {
    if Command::new("python3").arg("--version").output().is_err() {
        eprintln!("SKIPPED: sprayer: no python3 on this machine");
        return None;
    }
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tools/scenarios/sprayer").join(scenario);
    let ended = Command::new(env!("CARGO_BIN_EXE_rowscan"))
        .args(["check", text(&path), "--format", "jsonl", "--keep", text(keep)])
        .env("SPRAY_FAULT", fault)
        .output()
        .expect("it runs");
    let told = String::from_utf8_lossy(&ended.stdout).into_owned();
    let lines = told.lines().map(|line| serde_json::from_str::<serde_json::Value>(line).expect("JSON"));
    let word = |line: &serde_json::Value, key: &str| line[key].as_str().unwrap_or_default().to_owned();
    let verdicts = lines.filter(|line| line["kind"] == "verdict");
    let all: Vec<_> =
        verdicts.map(|line| (word(&line, "name"), word(&line, "verdict"), word(&line, "message"))).collect();
    assert!(!all.is_empty(), "{told}{}", String::from_utf8_lossy(&ended.stderr));
    Some(all)
}

/// The scores of a kept run; `code` is 1 where they are unknown.
fn score(folder: &Path, code: i32) -> serde_json::Value {
    let ended = run(&["score", text(folder), "--format", "json"]);
    assert_eq!(ended.code, Some(code), "{}", ended.stderr);
    serde_json::from_str(&ended.stdout).expect("JSON")
}

#[test]
fn the_good_controller_passes_and_each_error_fails_by_its_expectation() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut scores = Vec::new();
    for (fault, caught_by) in
        [("none", ""), ("no_compensation", "latency_error_m open"), ("reversed", "edges"), ("dead", "recall")]
    {
        let keep = folder.path().join(fault);
        let Some(found) = verdicts("row.toml", fault, &keep) else { return };
        let wrong: Vec<&str> = found
            .iter()
            .filter(|(_, verdict, _)| verdict != "passed")
            .map(|(name, ..)| name.as_str())
            .collect();
        let is_caught =
            found.iter().any(|(name, verdict, _)| name.contains(caught_by) && verdict == "failed");
        assert!(if caught_by.is_empty() { wrong.is_empty() } else { is_caught }, "{fault}: {found:?}");
        // Who never sprays wastes nothing, of nothing.
        let told = score(&keep, i32::from(fault == "dead"));
        // The same number as the verdict had.
        let recall = told["recall"].as_f64().expect("leaves passed");
        let (_, _, message) = &found[0];
        assert!(message.contains(&format!("found {recall:.4}")), "{fault}: {recall}: {message}");
        assert!(told["oracle"]["recall"].as_f64() >= told["recall"].as_f64(), "{fault}");
        scores.push(told["score"].as_f64().expect("leaves passed"));
    }
    assert!(
        scores.windows(2).all(|pair| pair[0] > pair[1]),
        "good, no compensation, reversed, dead: {scores:?}"
    );
    assert!(scores[0] > 0.95 && scores[3] == 0.0, "{scores:?}");
}

#[test]
fn valves_are_shut_soon_after_the_scanner_is_lost_and_a_controller_that_holds_them_fails() {
    let folder = tempfile::tempdir().expect("a folder");
    let Some(good) = verdicts("lost.toml", "none", folder.path()) else { return };
    assert!(good.iter().all(|(_, verdict, _)| verdict == "passed"), "{good:?}");
    let Some(holds) = verdicts("lost.toml", "keeps_open", folder.path()) else { return };
    let failed = holds.iter().find(|(name, ..)| name.contains("time_to_safe_s after out")).expect("expected");
    assert_eq!(failed.1, "failed", "{holds:?}");
}

#[test]
fn faults_of_the_machine_are_found_by_scores_and_kept_with_the_run() {
    let folder = tempfile::tempdir().expect("a folder");
    let Some(found) = verdicts("machine.toml", "none", folder.path()) else { return };
    assert!(found.iter().all(|(_, verdict, _)| verdict == "passed"), "{found:?}");
    let told = score(folder.path(), 0);
    let recall = told["recall"].as_f64().expect("leaves passed");
    assert!(found.iter().any(|(_, _, message)| message.contains(&format!("found {recall:.4}"))), "{found:?}");
    // The oracle's machine is sound.
    assert!(told["oracle"]["recall"].as_f64() > Some(0.999), "{told}");
    let rules: Vec<&str> = told["forbidden"]
        .as_array()
        .into_iter()
        .flatten()
        .filter(|breach| breach["litres"].as_f64() > Some(0.0))
        .filter_map(|breach| breach["rule"].as_str())
        .collect();
    assert!(rules.contains(&"override"), "{told}");
    // What the pump gave went through nozzles, back to the tank or into hoses.
    let litres = |key: &str| told["hydraulics"][key].as_f64().expect("litres");
    let rest = litres("pump_l") - litres("nozzles_l") - litres("returned_l") - litres("hoses_l");
    assert!(rest.abs() < 1e-9 * litres("pump_l"), "{told}");
    assert!((litres("nozzles_l") - told["litres"].as_f64().expect("litres")).abs() < 1e-9, "{told}");
    assert!(told["rate"]["p95"].is_f64(), "{told}");
}

#[test]
fn the_same_run_gives_the_same_valves_and_scores_to_the_byte() {
    let folder = tempfile::tempdir().expect("a folder");
    let kept = ["one", "two"].map(|name| folder.path().join(name));
    for keep in &kept {
        if verdicts("row.toml", "none", keep).is_none() {
            return;
        }
    }
    let bytes = kept
        .each_ref()
        .map(|keep| std::fs::read(keep.join("01-row/seed-7-run-1/sprayer.json")).expect("it is kept"));
    assert!(bytes[0] == bytes[1], "commands or drive differ");
    // Beside itself a run is as good.
    let svg = folder.path().join("row.svg");
    let ended = run(&[
        "score",
        text(&kept[0]),
        "--beside",
        text(&kept[1]),
        "--format",
        "csv",
        "--picture",
        text(&svg),
    ]);
    let recall = ended.stdout.lines().find(|line| line.starts_with("recall,")).expect("a row");
    let cells: Vec<&str> = recall.split(',').collect();
    assert_eq!(cells[1], cells[4], "{recall}");
    let picture = std::fs::read_to_string(&svg).expect("drawn");
    assert!(
        picture.starts_with("<svg")
            && picture.contains("wanted and sprayed")
            && picture.contains("s, by section")
    );
}

#[test]
fn a_folder_without_a_run_and_a_wrong_boom_are_told() {
    let folder = tempfile::tempdir().expect("a folder");
    let ended = run(&["score", text(folder.path())]);
    assert_eq!(ended.code, Some(2));
    assert_says(
        &ended.stderr,
        &["sprayer.json", "expected the folder of a run with a sprayer that `check --keep` kept"],
    );
    std::fs::write(folder.path().join("sprayer.json"), "{}").expect("written");
    let ended = run(&["score", text(folder.path())]);
    assert_eq!(ended.code, Some(2));
    assert_says(&ended.stderr, &["expected a sprayer's run of version 1", "missing field"]);
    let path = folder.path().join("it.toml");
    let scenario = |sprayer: &str| {
        let text = format!(
            "version = 1\nscene = \"spindle\"\nend = {{ s = 1 }}\ndevice = [{{ id = \"left\", model = \"lms111\" }}]\n\
             bus = [{{ id = \"can0\", port = \"socketcand:127.0.0.1:0\" }}]\n{sprayer}\nexpect = [{{ what = \"recall\", above = 0.5 }}]\n"
        );
        std::fs::write(&path, text).expect("written");
        let ended = run(&["check", path.to_str().expect("a name")]);
        assert_eq!(ended.code, Some(2), "{}", ended.stdout);
        ended.stdout
    };
    std::fs::write(folder.path().join("boom.toml"), "version = 1\n[[section]]\nid = \"a\"\nside = \"up\"\n")
        .expect("written");
    assert_says(&scenario("sprayer = { boom = \"boom.toml\", bus = \"can0\" }"), &["boom.toml: line 4:"]);
    assert_says(
        &scenario("sprayer = { boom = \"none.toml\", bus = \"can0\" }"),
        &["`sprayer.boom`", "none.toml"],
    );
    std::fs::write(
        folder.path().join("boom.toml"),
        "version = 1\n[[section]]\nid = \"a\"\nside = \"left\"\nz_from_m = 1\nz_to_m = 2\n",
    )
    .expect("written");
    assert_says(&scenario("sprayer = { boom = \"boom.toml\", bus = \"can1\" }"), &["there is no bus `can1`"]);
    assert_says(&scenario("sprayer = { boom = \"boom.toml\" }"), &["add `bus`"]);
    assert_says(
        &scenario("sprayer = { boom = \"boom.toml\", command = \"can0:SectionDuty.Sektion{n}\" }"),
        &["`sprayer.command` of section 1"],
    );
}
