//! `rowscan score` of a run that was kept, and of what becomes of it when one thing in it is changed.

use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use serde_json::{Value, json};

use crate::common::binary::{Ended, assert_says, run, text};

/// A run of the reference controller, kept in `folder`. One run serves all tests here: none of them changes what it found.
fn kept(folder: &Path) -> (PathBuf, Value) {
    static RUN: LazyLock<Vec<u8>> = LazyLock::new(|| {
        let folder = tempfile::tempdir().expect("a folder");
        let scenario = Path::new(env!("CARGO_MANIFEST_DIR")).join("tools/scenarios/sprayer/reference.toml");
        let ended = run(&["check", text(&scenario), "--keep", text(folder.path())]);
        assert_eq!(ended.code, Some(0), "{}{}", ended.stdout, ended.stderr);
        let file = folder.path().join("01-reference/seed-7-run-1/sprayer.json");
        std::fs::read(&file).unwrap_or_else(|cause| panic!("{}: {cause}", file.display()))
    });
    let file = folder.join("sprayer.json");
    std::fs::write(&file, &*RUN).expect("written");
    (file, serde_json::from_slice(&RUN).expect("JSON"))
}

/// The same run with one thing changed.
fn changed(folder: &Path, name: &str, run: &Value, change: impl FnOnce(&mut Value)) -> PathBuf {
    let mut run = run.clone();
    change(&mut run);
    let path = folder.join(format!("{name}.json"));
    std::fs::write(&path, run.to_string()).expect("written");
    path
}

fn json_of(ended: &Ended) -> Value {
    serde_json::from_str(&ended.stdout)
        .unwrap_or_else(|cause| panic!("{cause}: {}{}", ended.stdout, ended.stderr))
}

fn score(flags: &[&str]) -> Ended {
    run(&[&["score", "--format", "json"], flags].concat())
}

/// All commands of a run.
fn commands(run: &mut Value) -> &mut Vec<Value> {
    run["commands"].as_array_mut().expect("commands")
}

#[test]
fn what_a_score_does_not_know_and_what_it_was_not_told_is_said() {
    let folder = tempfile::tempdir().expect("a folder");
    let (file, whole) = kept(folder.path());
    let sound = score(&[text(&file)]);
    assert_eq!(sound.code, Some(0), "{}", sound.stderr);
    let told = json_of(&sound);
    assert_eq!(told["unheeded"], json!([]));
    assert!(!sound.stderr.contains("no result") && !sound.stderr.contains("boom:"), "{}", sound.stderr);
    // Zero has no sign, wherever it stands.
    assert!(!sound.stdout.contains("-0.0,") && !sound.stdout.contains("-0.0\n"), "{}", sound.stdout);

    // No valve is open by more than all.
    for duty in [7.0, -0.1] {
        let wrong = changed(folder.path(), "wrong", &whole, |run| commands(run)[1]["duty"] = json!(duty));
        let ended = score(&[text(&wrong)]);
        assert_eq!(ended.code, Some(2), "{}", ended.stdout);
        let found = format!("expected a `duty` from 0 to 1, found {duty}");
        assert_says(&ended.stderr, &["command 2 of `commands`", &found]);
    }

    // Nobody said anything: nothing of it is known, not even that litres were saved.
    let unheard = changed(folder.path(), "unheard", &whole, |run| commands(run).clear());
    let ended = score(&[text(&unheard)]);
    assert_eq!(ended.code, Some(1));
    assert_says(&ended.stderr, &["no result: no command was heard in the whole run"]);
    let silent = json_of(&ended);
    for key in ["recall", "row_recall", "waste", "score", "saved_litres"] {
        assert!(silent[key].is_null() && !told[key].is_null(), "{key}: {}", silent[key]);
    }

    assert_eq!((&silent["edges"], &silent["forbidden"]), (&json!([]), &json!([])), "nor of edges and rules");

    // It ended before its end: the scores are of what was driven, and no result.
    let why = "the run ended at 5.000 s";
    let cut = changed(folder.path(), "cut", &whole, |run| run["cut_off"] = json!(why));
    let ended = score(&[text(&cut)]);
    assert_eq!((ended.code, &json_of(&ended)["cut_off"]), (Some(1), &json!(why)));
    assert_says(&ended.stderr, &["no result: the run ended at 5.000 s; scores are of what was driven"]);
    assert!(told["cut_off"].is_null() && json_of(&ended)["recall"] == told["recall"]);

    // All was kept shut.
    let shut = changed(folder.path(), "shut", &whole, |run| {
        commands(run).iter_mut().for_each(|command| command["duty"] = json!(0.0));
    });
    let ended = score(&[text(&shut)]);
    assert_eq!((ended.code, json_of(&ended)["recall"].as_f64()), (Some(1), Some(0.0)));
    assert_says(&ended.stderr, &["no result: waste is unknown: nothing was sprayed"]);

    // Parts that the boom lacks: to open them is told, to shut them is not.
    let lacking = changed(folder.path(), "lacking", &whole, |run| {
        let said =
            |target: Value, duty: f64| json!({ "t_ns": 1_000_000_000_u64, "target": target, "duty": duty });
        let more = [
            said(json!({ "section": 9 }), 1.0),
            said(json!({ "nozzle": 99 }), 0.5),
            said(json!({ "section": 8 }), 0.0),
        ];
        commands(run).extend(more);
    });
    let ended = score(&[text(&lacking)]);
    assert_eq!(ended.code, Some(0));
    assert_says(
        &ended.stderr,
        &["2 commands opened parts that the boom does not have: section 9, nozzle 99"],
    );
    let unheeded = json_of(&ended)["unheeded"].clone();
    let wanted = json!([
        { "target": { "section": 9 }, "commands": 1 },
        { "target": { "nozzle": 99 }, "commands": 1 },
    ]);
    assert_eq!(unheeded, wanted);

    // Sections over each other: a boom may be so, and is told.
    let overlapping = changed(folder.path(), "overlapping", &whole, |run| {
        run["boom"]["section"][1]["z_from_m"] = json!(0.9);
    });
    assert_says(&score(&[text(&overlapping)]).stderr, &["boom: nozzles of one side overlap in height"]);
}

#[test]
fn a_run_beside_says_what_differs_and_has_all_rows_of_either() {
    let folder = tempfile::tempdir().expect("a folder");
    let (file, whole) = kept(folder.path());
    let beside = |other: &Path| score(&[text(&file), "--beside", text(other)]);
    let same = beside(&file);
    assert_eq!((json_of(&same)["differences"].clone(), same.code), (json!([]), Some(0)));
    assert!(!same.stderr.contains("differ"), "{}", same.stderr);
    // Another controller only, 200 ms later or sooner: all edges lag, or all lead, by that and what the reference controller was off.
    for (name, sooner_ns, later_ns, way, none) in
        [("late", 0, 200_000_000, "lag", "lead"), ("soon", 200_000_000, 0, "lead", "lag")]
    {
        let other = changed(folder.path(), name, &whole, |run| {
            for command in commands(run) {
                let t_ns = command["t_ns"].as_u64().expect("a time");
                command["t_ns"] = json!((t_ns + later_ns).saturating_sub(sooner_ns));
            }
        });
        let ended = beside(&other);
        let told = json_of(&ended);
        assert_eq!(told["differences"], json!([]), "{}", ended.stderr);
        let edges = &told["beside"]["edges"][0];
        let number = |key: &str| edges[way][key].as_f64().unwrap_or_else(|| panic!("{way} {key}: {edges}"));
        assert_eq!(edges[none]["edges"], 0, "{edges}");
        assert!(
            number("edges") > 0.0 && number("p50_s") > 0.15 && number("worst_m") >= number("p50_m"),
            "{edges}"
        );
        assert!((number("p50_m") / number("p50_s") - 1.5).abs() < 0.01, "at 1.5 m/s: {edges}");
        let signed = edges["p50_s"].as_f64().expect("a median");
        assert_eq!(signed > 0.0, way == "lag", "{edges}");
    }

    // Another seed, boom and speed are said, each by its key.
    let other = changed(folder.path(), "other", &whole, |run| {
        run["scene"]["seed"] = json!(run["scene"]["seed"].as_u64().expect("a seed") + 1);
        run["boom"]["offset_y_m"] = json!(1.25);
        run["boom"]["rate"] = json!({ "at_m_s": 1.5 });
        run["boom"]["section"].as_array_mut().expect("sections").pop();
    });
    let ended = beside(&other);
    let words =
        ["scene.seed: 7, beside 8", "boom.offset_y_m: 1.0, beside 1.25", "boom.section: 4 of them, beside 3"];
    assert_says(
        &ended.stderr,
        &words
            .map(|word| ["not only the controllers differ: ", word].concat())
            .each_ref()
            .map(String::as_str),
    );
    let differences = json_of(&ended)["differences"].to_string();
    assert!(words.iter().all(|word| differences.contains(word)), "{differences}");
    // A row that only the other has is there, with nothing in this run's column.
    let csv = run(&["score", text(&file), "--beside", text(&other), "--format", "csv"]).stdout;
    let rate = csv.lines().find(|line| line.starts_with("rate_mean_error,")).expect("a row of the other");
    assert!(rate.starts_with("rate_mean_error,,,,") && !rate.ends_with(','), "{rate}");
}

#[test]
fn a_rate_that_did_not_settle_is_said_in_words_and_as_null_with_its_reason() {
    let folder = tempfile::tempdir().expect("a folder");
    let (_, whole) = kept(folder.path());
    // Half as fast again as the flow was meant for: no step settles.
    let file =
        changed(folder.path(), "unsettled", &whole, |run| run["boom"]["rate"] = json!({ "at_m_s": 1.0 }));
    let told = json_of(&score(&[text(&file)]));
    let of = |key: &str| told["rate"][key].clone();
    assert_eq!((of("settling_s"), of("settling")), (json!(null), json!("not_settled")), "{}", told["rate"]);
    let row = |format: &str| {
        let all = run(&["score", text(&file), "--format", format]).stdout;
        all.lines()
            .find(|line| line.contains("rate_settling_s"))
            .unwrap_or_else(|| panic!("{all}"))
            .to_owned()
    };
    assert!(row("table").contains("not settled"), "{}", row("table"));
    assert!(row("csv").starts_with("rate_settling_s,,"), "{}", row("csv"));
    // The oracle and this controller could meet all edges: none is said to be unmeetable.
    let unmeetable = told["edges"].as_array().expect("edges").iter().map(|edges| edges["unmeetable"].clone());
    assert!(
        unmeetable.clone().count() > 0 && unmeetable.into_iter().all(|count| count == 0),
        "{}",
        told["edges"]
    );
}

/// A row of one alley repeats before and behind itself; its own trees are told apart.
#[test]
fn the_rows_own_trees_are_told_apart_from_its_repetitions() {
    let folder = tempfile::tempdir().expect("a folder");
    let (_, whole) = kept(folder.path());
    let row = changed(folder.path(), "row", &whole, |run| {
        run["scene"]["orchard"]["trees"] = json!(2);
        commands(run).clear();
        commands(run).push(json!({ "t_ns": 0, "target": "all", "duty": 1.0 }));
    });
    let told = json_of(&score(&[text(&row)]));
    let number = |key: &str| told[key].as_f64().unwrap_or_else(|| panic!("{key}: {told}"));
    let (all_m2, own_m2) = (number("wanted_area_m2"), number("row_area_m2"));
    assert!(own_m2 > 0.0 && all_m2 > 1.5 * own_m2, "{all_m2} {own_m2}");
    assert!(number("row_missed_area_m2") <= number("missed_area_m2"));
    let trees = told["interception"]["on_leaves"]["by_tree"].as_array().expect("trees");
    let own: Vec<&str> = trees
        .iter()
        .filter(|tree| tree["repeated"] != json!(true))
        .map(|tree| tree["part"].as_str().expect("a name"))
        .collect();
    // Two trees, numbered from 0; those before have numbers below, those behind from 2 on.
    assert!(own.iter().all(|name| name.ends_with(", tree 0") || name.ends_with(", tree 1")), "{own:?}");
    assert!(trees.len() > own.len() && !own.is_empty(), "{trees:?}");

    // Where the drive has headlands the rows end: only their own trees are wanted, or sprayed at.
    let row: Value = serde_json::from_slice(&std::fs::read(&row).expect("a run")).expect("JSON");
    let ends = changed(folder.path(), "ends", &row, |run| run["scene"]["drive"] = json!({ "alleys": 2 }));
    let ended = json_of(&score(&[text(&ends)]));
    assert_eq!(ended["wanted_area_m2"], ended["row_area_m2"]);
    let found_m2 = ended["row_area_m2"].as_f64().expect("a row");
    assert!((found_m2 - own_m2).abs() < 0.05 * own_m2, "{found_m2} {own_m2}");
    let trees = ended["interception"]["on_leaves"]["by_tree"].as_array().expect("trees");
    assert!(!trees.is_empty() && trees.iter().all(|tree| tree["repeated"] != json!(true)), "{trees:?}");
}

/// Who leaves in the middle of the row leaves a run that is cut off, and the file says so.
#[test]
fn a_run_whose_controller_left_early_has_no_result() {
    let folder = tempfile::tempdir().expect("a folder");
    let tools = Path::new(env!("CARGO_MANIFEST_DIR")).join("tools/scenarios");
    let of_sprayer = |name: &str| tools.join("sprayer").join(name);
    let scenario = folder.path().join("left.toml");
    let text_of = format!(
        "use = {:?}\nscene = {:?}\nsprayer = {{ boom = {:?}, bus = \"can0\" }}\nexpect = [{{ what = \"exit_code\" }}]\n\
         run = [{{ id = \"sut\", command = [\"python3\", {:?}, \"{{left.tcp}}\", \"--quit-after\", \"60\"], ready = {{ line = \"connected\" }} }}]\n",
        of_sprayer("base.toml"),
        of_sprayer("wall.toml"),
        of_sprayer("boom.toml"),
        tools.join("controller.py"),
    );
    std::fs::write(&scenario, text_of).expect("written");
    let kept = folder.path().join("kept");
    let ended = run(&["check", text(&scenario), "--keep", text(&kept)]);
    assert_eq!(ended.code, Some(1), "{}{}", ended.stdout, ended.stderr);
    let told = score(&[text(&kept)]);
    assert_eq!(told.code, Some(1), "{}", told.stderr);
    let cut_off = json_of(&told)["cut_off"].as_str().unwrap_or_default().to_owned();
    assert!(cut_off.contains("before its end, row 12 m: `sut` had left"), "{cut_off}");
}
