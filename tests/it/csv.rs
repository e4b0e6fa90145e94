//! `--format csv`: every command that takes it writes a header and rows; a command that has no rows does not take it, and says so.

use crate::common;

use std::collections::BTreeSet;
use std::path::Path;

use clap::Command;
use common::binary::{Emulator, Ended, assert_says, refused, run, text};

/// Every command whose `--format` is one of data, and arguments with which it has something to say. `{}` is a folder with the files below.
const ROWS: &[(&str, &[&str])] = &[
    ("demo", &["{}/small.toml", "--time-scale", "max"]),
    ("estimate", &["{}/run.mcap", "--rig", "{}/small.toml"]),
    ("estimate", &["{}/run.mcap"]),
    ("watch", &["{}/none.mcap"]),
    ("orchard grow", &["{}/small.toml"]),
    ("orchard truth", &["{}/small.toml"]),
    ("orchard truth", &["post"]),
    ("orchard import", &["--mesh", "{}/tree.obj"]),
    ("orchard statistics", &["{}/small.toml", "--seeds", "1..2"]),
    ("orchard parameters", &["paper"]),
    ("scan", &["{}/small.toml", "--dy", "0.1", "--dtheta", "1"]),
    (
        "study areas",
        &[
            "--iterations",
            "6,7",
            "--shady",
            "60,101",
            "--trees",
            "1",
            "--dy",
            "0.1",
            "--pitch",
            "0.1",
            "--dtheta",
            "1",
        ],
    ),
    (
        "study resolution",
        &["--orchards", "2", "--offsets", "1", "--trees", "1", "--advances-mm", "100,200", "--angles", "1"],
    ),
    ("study accuracy", &["{}/small.toml", "--seeds", "1..2"]),
    ("study estimators", &["{}/small.toml", "--seeds", "1..2"]),
    ("study budget", &["{}/small.toml", "--seeds", "1..2"]),
    ("study physics", &["{}/small.toml", "--seeds", "201..201", "--model", "lms111", "--distance", "2"]),
    ("study eye", &["{}/small.toml", "--seeds", "401..401", "--model", "lms111", "--distance", "2"]),
    ("study run", &["docs/examples/quick-study.toml"]),
    ("study search", &["{}/search.toml"]),
    ("study transfer", &["--rows", "6", "--classes", "{}/classes.toml"]),
    ("study coverage", &["--rows", "5", "--classes", "{}/classes.toml"]),
    ("study merge", &["{}/shard.json"]),
    ("study recording", &["{}/run.mcap", "--model", "lms111"]),
    ("record", &["--info", "{}/run.mcap"]),
    ("decode", &["{}/run.mcap"]),
    ("bus decode", &["{}/candump.log"]),
    ("faults", &[]),
    ("models", &[]),
    ("models", &["--refusals"]),
    ("scene show", &["spindle"]),
    ("rig show", &["spindle"]),
];

const SCENE: &str = "version = 1\nname = \"small\"\n[orchard]\ntrees = 3\n[orchard.tree]\niterations = 5\n[rig]\nspeed_m_s = 2.0\n\
                     calibration = \"spindle\"\n[[rig.scanner]]\nmodel = \"lms111\"\n";

const SEARCH: &str = "version = 1\nscene = \"paper\"\nseeds = [3]\none_at_a_time = true\n[base]\niterations = [6]\nshady_percent = [60.0, 101.0]\n\
                      \"lateral.dy_m\" = 0.1\n\"lateral.dtheta_deg\" = 1.0\n\"zenith.dy_m\" = 0.1\n\"zenith.pitch_m\" = 0.1\n\
                      \"scene.orchard.trees\" = 1\n[[knob]]\nkey = \"scene.orchard.tree.max_metamers\"\nvalues = [30]\n";

const CLASSES: &str = "version = 1\nscene = \"small.toml\"\n[[axis]]\nname = \"rig_error\"\n[[axis.class]]\nname = \"none\"\n\
                       [[axis.class]]\nname = \"told too far\"\ntold = { \"rig.scanner.distance_m\" = 2.4 }\n";

/// Files for the commands.
fn prepare(folder: &Path) {
    let file = |name: &str| folder.join(name);
    for (name, content) in [
        ("small.toml", SCENE),
        ("search.toml", SEARCH),
        ("classes.toml", CLASSES),
        ("tree.obj", "usemtl leaf\nv 0 0 1\nv 0.1 0 1\nv 0.1 0.1 1\nf 1 2 3\n"),
        ("candump.log", "(1.000000) can0 0CFE48F0#E803E80300000000\n"),
    ] {
        std::fs::write(file(name), content).expect("written");
    }
    let scanner = Emulator::start(&[text(&file("small.toml")), "--time-scale", "max"]);
    let recorded = run(&["record", &scanner.url(), "-o", text(&file("run.mcap")), "--scans", "300"]);
    assert_eq!(recorded.code, Some(0), "{}", recorded.stderr);
    let shard = file("shard.json");
    let study =
        ["study", "run", "docs/examples/quick-study.toml", "--shard", "1/1", "--output", text(&shard)];
    assert_eq!(run(&study).code, Some(0));
}

/// Commands that have `--format` with CSV among its values, by their words.
fn with_csv(command: &Command, words: &str, found: &mut BTreeSet<String>) {
    let has_csv = |argument: &clap::Arg| {
        argument.get_long() == Some("format")
            && argument.get_possible_values().iter().any(|value| value.get_name() == "csv")
    };
    if command.get_arguments().any(has_csv) {
        found.insert(words.to_owned());
    }
    for inner in command.get_subcommands() {
        let words = format!("{words} {}", inner.get_name());
        with_csv(inner, words.trim(), found);
    }
}

fn csv_of(words: &str, arguments: &[&str], folder: &Path) -> Ended {
    let folder = text(folder);
    let mut all: Vec<String> = words.split(' ').map(str::to_owned).collect();
    all.extend(arguments.iter().map(|argument| argument.replace("{}", folder)));
    all.extend(["--format".to_owned(), "csv".to_owned()]);
    run(&all.iter().map(String::as_str).collect::<Vec<_>>())
}

#[test]
fn every_command_that_takes_csv_writes_a_header_and_rows() {
    let mut found = BTreeSet::new();
    with_csv(&rowscan::cli::command(), "", &mut found);
    let listed: BTreeSet<String> = ROWS.iter().map(|(words, _)| (*words).to_owned()).collect();
    assert_eq!(found, listed, "a command that takes --format csv is tried here");
    let folder = tempfile::tempdir().expect("a folder");
    prepare(folder.path());
    for (words, arguments) in ROWS.iter().filter(|(words, _)| *words != "watch") {
        let ended = csv_of(words, arguments, folder.path());
        // 1: the work was done, and found something wrong, such as areas that stay unknown.
        assert!(
            matches!(ended.code, Some(0 | 1)),
            "{words} {arguments:?}: {:?} {}",
            ended.code,
            ended.stderr
        );
        let mut reader = csv::Reader::from_reader(ended.stdout.as_bytes());
        let head = reader.headers().expect("a header").clone();
        assert!(head.len() > 1 && head.iter().all(|name| !name.is_empty()), "{words}: {head:?}");
        let rows: Result<Vec<_>, _> = reader.records().collect();
        let rows = rows.expect("as many fields as the header");
        assert!(!rows.is_empty(), "{words} {arguments:?} wrote no row: {}", ended.stderr);
    }
}

#[test]
fn commands_that_tell_events_refuse_csv_in_words() {
    for arguments in [
        &["emulate", "spindle"][..],
        &["replay", "run.mcap"],
        &["proxy", "tcp://127.0.0.1:1", "--tcp", "127.0.0.1:0"],
    ] {
        let said = refused(&[arguments, &["--format", "csv"]].concat());
        assert_says(&said, &["invalid value 'csv' for '--format", "table, json, jsonl"]);
    }
    let said = refused(&["record", "tcp://127.0.0.1:1", "-o", "x.mcap", "--format", "csv"]);
    assert_says(&said, &["--format csv", "--info"]);
}

#[test]
fn a_list_without_rows_says_so() {
    let folder = tempfile::tempdir().expect("a folder");
    let log = folder.path().join("empty.log");
    std::fs::write(&log, "").expect("written");
    let ended = run(&["bus", "decode", text(&log), "--format", "csv"]);
    assert_eq!((ended.code, ended.stdout.as_str()), (Some(1), ""));
    assert_says(&ended.stderr, &["empty.log: no frame", "no rows: there is nothing to write"]);
}
