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
    Some(judged(scenario, fault, keep))
}

/// The same of a scenario whose controller needs no Python.
fn judged(scenario: &str, fault: &str, keep: &Path) -> Vec<(String, String, String)> {
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
    all
}

/// Every verdict is passed.
fn passes(found: &[(String, String, String)]) {
    assert!(found.iter().all(|(_, verdict, _)| verdict == "passed"), "{found:?}");
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
        let interception = &told["interception"];
        let sinks = interception["sinks"].as_object().expect("litres by sink");
        let sum: f64 = sinks.values().filter_map(serde_json::Value::as_f64).sum();
        let litres = told["litres"].as_f64().expect("litres");
        assert!(sinks.len() == 7 && (sum - litres).abs() <= 1e-9 * litres, "{fault}: {sinks:?} {litres}");
        scores.push(told["score"].as_f64().expect("leaves passed"));
        // A controller that leaves everything open is worse, and the oracle better.
        let off = |of: &serde_json::Value| of["off_target_share"].as_f64();
        if fault == "none" {
            let (own, always) = (off(interception), off(&interception["constant"]));
            assert!(own > Some(0.0) && own < always, "{interception}");
            assert!(off(&interception["oracle"]) < always, "{interception}");
            let not_modelled = told["not_modelled"].to_string();
            for word in ["air", "drift", "droplets", "run-off", "evaporation"] {
                assert!(not_modelled.contains(word), "{not_modelled}");
            }
        }
    }
    assert!(
        scores.windows(2).all(|pair| pair[0] > pair[1]),
        "good, no compensation, reversed, dead: {scores:?}"
    );
    assert!(scores[0] > 0.95 && scores[3] == 0.0, "{scores:?}");
}

/// All of its leaves get their share, and the gaps theirs: interception tells it from a controller.
#[test]
fn a_controller_that_leaves_all_open_is_farther_off_target_than_the_good_one() {
    let folder = tempfile::tempdir().expect("a folder");
    let off = ["none", "all_open"].map(|fault| {
        let keep = folder.path().join(fault);
        let found = verdicts("row.toml", fault, &keep)?;
        let (.., verdict, message) =
            found.iter().find(|(name, ..)| name.contains("off_target_share"))?.clone();
        assert_eq!(verdict, if fault == "none" { "passed" } else { "failed" }, "{message}");
        let told = score(&keep, 0);
        assert!(told["recall"].as_f64() > Some(0.99), "{fault}: {}", told["recall"]);
        told["interception"]["off_target_share"].as_f64()
    });
    if let [Some(good), Some(open)] = off {
        assert!(open > good + 0.2, "{good} {open}");
    }
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
fn the_reference_controller_passes_in_lockstep_and_is_told_beside_the_oracle() {
    let folder = tempfile::tempdir().expect("a folder");
    passes(&judged("reference.toml", "none", folder.path()));
    let told = score(folder.path(), 0);
    let share = told["relative"]["score"].as_f64().expect("both are known");
    assert!((0.95..=1.0).contains(&share), "{}", told["relative"]);
    // A rig whose scanner looks the other way is refused before anything opens.
    let boom = Path::new(env!("CARGO_MANIFEST_DIR")).join("tools/scenarios/sprayer/boom.toml");
    let rig = folder.path().join("rig.toml");
    std::fs::write(&rig, "version = 2\n[[rig.scanner]]\nrow = \"left\"\n").expect("written");
    let args =
        ["spray", "tcp://127.0.0.1:1", "--can", "socketcan:none", "--boom", text(&boom), "--rig", text(&rig)];
    let ended = run(&args);
    assert_eq!(ended.code, Some(2));
    assert_says(&ended.stderr, &["the boom sprays to the right, and no scanner looks there"]);
}

#[test]
fn a_controller_in_cpp_passes_from_start_to_verdict() {
    if Command::new("g++").arg("--version").output().is_err() {
        eprintln!("SKIPPED: sprayer: no g++ on this machine");
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    passes(&judged("cpp.toml", "none", folder.path()));
    let lines = include_str!("../../tools/scenarios/sprayer/spray.cpp").lines().count();
    assert!(lines <= 200, "{lines} lines");
}

#[test]
fn demo_sprays_the_same_bytes_for_a_seed_and_draws_them() {
    let folder = tempfile::tempdir().expect("a folder");
    let svg = folder.path().join("map.svg");
    let scene = folder.path().join("row.toml");
    std::fs::write(&scene, "version = 2\n[orchard]\npreset = \"paper\"\ntrees = 3\nmissing = [1]\n")
        .expect("written");
    let demo = |seed: &str| {
        let args =
            ["demo", text(&scene), "--spray", "--seed", seed, "--format", "json", "--picture", text(&svg)];
        let ended = run(&args);
        assert_eq!(ended.code, Some(0), "{}", ended.stderr);
        ended.stdout
    };
    let first = demo("3");
    assert_eq!(first, demo("3"));
    assert_ne!(first, demo("4"));
    let told: serde_json::Value = serde_json::from_str(&first).expect("JSON");
    let number = |of: &serde_json::Value| of.as_f64().expect("known");
    assert!(number(&told["recall"]) > 0.9 && number(&told["waste"]) < 0.3, "{first}");
    assert!(number(&told["litres"]) > 0.0 && number(&told["oracle"]["recall"]) > 0.99, "{first}");
    let off = |of: &serde_json::Value| number(&of["off_target_share"]);
    assert!(off(&told["interception"]) < off(&told["interception"]["constant"]), "{first}");
    assert!(std::fs::read_to_string(&svg).expect("drawn").starts_with("<svg"));
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
