//! `--format csv` and `--format json`: every command that takes the one writes a header and rows, the other one document and nothing else; a command
//! that has no rows does not take CSV, and says so.

use crate::common;

use std::collections::BTreeSet;
use std::io::{BufRead, BufReader, Lines, Read};
use std::path::Path;
use std::process::{Child, ChildStderr, Stdio};

use clap::Command;
use common::binary::{Emulator, Ended, assert_says, interrupt, refused, rowscan, run, text};
use serde_json::Value;

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
    ("study pieces", &["{}/small.toml", "--seeds", "1201..1201", "--model", "lms111", "--distance", "2"]),
    ("study clumping", &["{}/small.toml", "vase", "--lai", "1,2", "--seeds", "1..2", "--distance", "2"]),
    ("study sides", &["{}/small.toml", "--seeds", "1301..1302", "--model", "lms111"]),
    ("study field", &["--plan", "--rig", "spindle"]),
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
    ("score", &["{}/kept/01-row"]),
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
    let sprayed = Path::new(env!("CARGO_MANIFEST_DIR")).join("tools/scenarios/sprayer/row.toml");
    let kept = run(&["check", text(&sprayed), "--keep", text(&file("kept"))]);
    assert_eq!(kept.code, Some(0), "{}", kept.stdout);
    let shard = file("shard.json");
    let study =
        ["study", "run", "docs/examples/quick-study.toml", "--shard", "1/1", "--output", text(&shard)];
    assert_eq!(run(&study).code, Some(0));
}

/// Commands that have `--format` with this among its values, by their words.
fn taking(format: &str, command: &Command, words: &str, found: &mut BTreeSet<String>) {
    let takes = |argument: &clap::Arg| {
        argument.get_long() == Some("format")
            && argument.get_possible_values().iter().any(|value| value.get_name() == format)
    };
    if command.get_arguments().any(takes) {
        found.insert(words.to_owned());
    }
    for inner in command.get_subcommands() {
        let words = format!("{words} {}", inner.get_name());
        taking(format, inner, words.trim(), found);
    }
}

fn formatted(format: &str, words: &str, arguments: &[&str], folder: &Path) -> Ended {
    let folder = text(folder);
    let mut all: Vec<String> = words.split(' ').map(str::to_owned).collect();
    all.extend(arguments.iter().map(|argument| argument.replace("{}", folder)));
    all.extend(["--format".to_owned(), format.to_owned()]);
    run(&all.iter().map(String::as_str).collect::<Vec<_>>())
}

#[test]
fn every_command_that_takes_csv_writes_a_header_and_rows() {
    let mut found = BTreeSet::new();
    taking("csv", &rowscan::cli::command(), "", &mut found);
    let listed: BTreeSet<String> = ROWS.iter().map(|(words, _)| (*words).to_owned()).collect();
    assert_eq!(found, listed, "a command that takes --format csv is tried here");
    let folder = tempfile::tempdir().expect("a folder");
    prepare(folder.path());
    for (words, arguments) in ROWS.iter().filter(|(words, _)| *words != "watch") {
        let ended = formatted("csv", words, arguments, folder.path());
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
        // A list of records is JSON as a whole.
        let is_one = |cell: &str| match serde_json::from_str(cell) {
            Ok(Value::Object(_)) => false,
            Ok(_) => true,
            Err(_) => !cell.starts_with(['{', '[']),
        };
        let record = rows.iter().flat_map(|row| row.iter().zip(&head)).find(|(cell, _)| !is_one(cell));
        assert_eq!(record, None, "{words} {arguments:?}: a cell holds one value or one list");
    }
}

/// Standard output of a command asked for JSON.
fn one_document(what: &str, ended: &Ended) -> Value {
    assert!(matches!(ended.code, Some(0 | 1)), "{what}: {:?} {}", ended.code, ended.stderr);
    // Anything before or behind a document is not JSON.
    serde_json::from_str(&ended.stdout).unwrap_or_else(|why| panic!("{what}: {why}: {}", ended.stdout))
}

#[test]
fn every_command_that_takes_json_writes_one_document_and_nothing_else() {
    let mut found = BTreeSet::new();
    taking("json", &rowscan::cli::command(), "", &mut found);
    let mut tried: BTreeSet<String> = ROWS.iter().map(|(words, _)| (*words).to_owned()).collect();
    tried.extend(["emulate", "replay", "proxy"].map(str::to_owned));
    assert_eq!(found, tried, "a command that takes --format json is tried here or below");
    let folder = tempfile::tempdir().expect("a folder");
    prepare(folder.path());
    for (words, arguments) in ROWS.iter().filter(|(words, _)| *words != "watch") {
        let ended = formatted("json", words, arguments, folder.path());
        let told = one_document(words, &ended);
        assert!(told.is_object() || told.is_array(), "{words}: {told}");
    }
}

/// A command that serves, asked for JSON: it has told on standard error that it is ready, and where.
struct Serving {
    child: Child,
    said: Lines<BufReader<ChildStderr>>,
    address: String,
}

impl Serving {
    fn start(arguments: &[&str]) -> Self {
        let mut command = rowscan();
        command.args(arguments).args(["--format", "json"]).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().expect("the binary runs");
        let mut said = BufReader::new(child.stderr.take().expect("piped")).lines();
        let mut address = String::new();
        while address.is_empty() {
            let line = said.next().expect("it listens").expect("text");
            let event: Value = serde_json::from_str(&line).unwrap_or_default();
            if event["event"] == "listening" && event["endpoint"] == "tcp" {
                event["address"].as_str().expect("an address").clone_into(&mut address);
            }
        }
        Self { child, said, address }
    }

    fn end(mut self, what: &str) -> (Value, Vec<Value>) {
        interrupt(&self.child);
        let events = self.said.map_while(Result::ok).filter_map(|line| serde_json::from_str(&line).ok());
        let events: Vec<Value> = events.collect();
        let mut stdout = String::new();
        self.child.stdout.take().expect("piped").read_to_string(&mut stdout).expect("text");
        let code = self.child.wait().expect("it ends").code();
        (one_document(what, &Ended { code, stdout, stderr: String::new() }), events)
    }
}

#[test]
fn events_beside_a_document_go_to_standard_error() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = |name: &str| text(&folder.path().join(name)).to_owned();
    prepare(folder.path());
    let scanner = Serving::start(&[
        "emulate",
        &file("small.toml"),
        "--tcp",
        "127.0.0.1:0",
        "--nmea",
        "tcp:127.0.0.1:0",
    ]);
    let source = format!("tcp://{}", scanner.address);
    let proxy = Serving::start(&["proxy", &source, "--tcp", "127.0.0.1:0"]);
    let log = format!("candump:{}", file("sensor.log"));
    let through = format!("tcp://{}", proxy.address);
    let estimate = [
        "estimate",
        &through,
        "--rig",
        &file("small.toml"),
        "--scans",
        "20",
        "--can",
        &log,
        "--format",
        "json",
    ];
    let ended = run(&estimate);
    assert_eq!(one_document("estimate", &ended)["scans"], 20);
    let events = ended.stderr.lines().filter_map(|line| serde_json::from_str::<Value>(line).ok());
    assert!(events.clone().any(|event| event["event"] == "listening"), "{}", ended.stderr);
    let (told, events) = proxy.end("proxy");
    assert_eq!((told["event"].as_str(), told["connections"].as_u64()), (Some("end"), Some(1)), "{told}");
    assert!(events.iter().any(|event| event["event"] == "connected"), "{events:?}");
    let (told, events) = scanner.end("emulate");
    assert!(told["streams"][0]["scans_sent"].as_u64() >= Some(20), "{told}");
    assert!(events.iter().any(|event| event["event"] == "ready"), "{events:?}");
    let replay = Serving::start(&["replay", &file("run.mcap"), "--tcp", "127.0.0.1:0"]);
    let (told, _) = replay.end("replay");
    assert_eq!(told["streams"][0]["scans_sent"], 0, "{told}");
    let said = refused(&["record", "tcp://127.0.0.1:1", "-o", "x.mcap", "--format", "json"]);
    assert_says(&said, &["--format json", "--info", "jsonl"]);
}

#[test]
fn a_demo_in_rows_has_the_truth_beside_the_estimate() {
    let ended = run(&["demo", "spindle", "--format", "csv"]);
    let mut reader = csv::Reader::from_reader(ended.stdout.as_bytes());
    let head = reader.headers().expect("a header").clone();
    let column = |name: &str| {
        head.iter().position(|found| found == name).unwrap_or_else(|| panic!("{name}: {head:?}"))
    };
    let (leaf, truth, error) =
        (column("leaf_area_m2"), column("truth_leaf_area_m2"), column("leaf_area_error"));
    let number = |row: &csv::StringRecord, column: usize| row[column].parse::<f64>().expect("a number");
    let rows: Vec<_> = reader.records().map(|row| row.expect("a row")).collect();
    assert_eq!(rows.len(), 12);
    for row in &rows {
        let (found, real) = (number(row, leaf), number(row, truth));
        assert!((number(row, error) - (found - real) / real).abs() < 1e-9, "{row:?}");
    }
}

#[test]
fn lines_are_of_what_by_says_whatever_else_is_asked_for() {
    let folder = tempfile::tempdir().expect("a folder");
    let (scene, file) = (folder.path().join("small.toml"), folder.path().join("run.mcap"));
    std::fs::write(&scene, SCENE).expect("written");
    let scanner = Emulator::start(&[text(&scene), "--time-scale", "max"]);
    let estimate = |more: &[&str]| {
        let recorded =
            ["estimate", text(&file), "--rig", text(&scene), "--estimators", "voxel", "--format", "csv"];
        run(&[&recorded[..], more].concat())
    };
    assert_eq!(run(&["record", &scanner.url(), "-o", text(&file), "--scans", "300"]).code, Some(0));
    for (more, column, said) in [
        (&[][..], "estimator", false),
        (&["--by", "tree"], "tree", true),
        (&["--by", "band", "--profile", "0.5"], "from_m", true),
    ] {
        let ended = estimate(more);
        let head = ended.stdout.lines().next().unwrap_or_default();
        assert!(head.split(',').any(|name| name.starts_with(column)), "{more:?}: {head}");
        assert_eq!(ended.stderr.contains("estimators side by side are left out"), said, "{}", ended.stderr);
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

/// 300 scans of a post, in the form that `export --what scans` writes, of this model.
fn ranges_of(model: &str) -> String {
    let head = format!(
        "# rowscan ranges 1; frequency_hz 50; start_deg 0; step_deg 0.5; unit mm; model {model}\nreceived_s,telegram_counter,scan_time_us,status,{}\n",
        (0..361).map(|beam| format!("range_{beam}")).collect::<Vec<_>>().join(",")
    );
    let line = |scan: u32| {
        let ranges: Vec<String> =
            (0..361).map(|beam| (1500 + (beam * 7 + scan * 3) % 900).to_string()).collect();
        format!("{},{scan},{},0,{}\n", f64::from(scan) * 0.02, scan * 20_000, ranges.join(","))
    };
    head + &(0..300).map(line).collect::<String>()
}

#[test]
fn a_recording_is_taken_for_the_model_that_it_names() {
    let folder = tempfile::tempdir().expect("a folder");
    for (named, other) in [("lms511", "tim571"), ("lms111", "lms511")] {
        let file = folder.path().join(named);
        std::fs::write(&file, ranges_of(named)).expect("written");
        let estimate = |args: &[&str]| {
            let asked = ["estimate", text(&file), "--rig", "spindle", "--format", "json"];
            let ended = run(&[&asked[..], args].concat());
            let told: Value =
                serde_json::from_str(&ended.stdout).unwrap_or_else(|_| panic!("{}", ended.stderr));
            (told, ended.stderr)
        };
        let warned = |told: &Value| told["warnings"].to_string().contains("other_model");
        let (by_file, said) = estimate(&[]);
        let (as_asked, quiet) = estimate(&["--model", named]);
        assert_eq!(by_file, as_asked, "{named}");
        assert!(!warned(&by_file) && !quiet.contains("names the model"), "{by_file}");
        // The rig's own is an LMS111.
        assert_eq!(said.contains(&format!("names the model {named}")), named != "lms111", "{said}");
        // The wrong twin.
        let (told, _) = estimate(&["--model", other]);
        assert!(warned(&told), "{named} taken for {other}: {told}");
    }
}

/// What is told of a row and of its trees has one form each: the columns do not go by what is known.
#[test]
fn estimates_as_rows_have_one_form_whatever_is_known() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = |name: &str| text(&folder.path().join(name)).to_owned();
    let dark = "version = 2\n[rig]\nspeed_m_s = 2.0\nrow_spacing_m = 4.0\ntree_spacing_m = 1.5\n[[rig.scanner]]\nmodel = \"lms111\"\n";
    for (name, content) in [("small.toml", SCENE), ("dark.toml", dark)] {
        std::fs::write(file(name), content).expect("written");
    }
    let (run_file, told, withheld) = (file("run.mcap"), file("small.toml"), file("dark.toml"));
    let scanner = Emulator::start(&[&told, "--time-scale", "max"]);
    let recorded = run(&["record", &scanner.url(), "-o", &run_file, "--scans", "300"]);
    assert_eq!(recorded.code, Some(0), "{}", recorded.stderr);
    let rows = |args: &[&str]| {
        let ended = run(&[&["estimate", &run_file, "--format", "csv"], args].concat());
        let mut reader = csv::Reader::from_reader(ended.stdout.as_bytes());
        let head: Vec<String> = reader.headers().expect("a header").iter().map(str::to_owned).collect();
        let rows: Vec<Vec<String>> = reader
            .records()
            .map(|row| row.expect("as many fields as the header").iter().map(str::to_owned).collect())
            .collect();
        (head, rows, ended.code)
    };
    let cell = |(head, rows, _): &(Vec<String>, Vec<Vec<String>>, Option<i32>), row: usize, name: &str| {
        let column =
            head.iter().position(|found| found == name).unwrap_or_else(|| panic!("{name}: {head:?}"));
        rows[row][column].clone()
    };
    let known = rows(&["--rig", &told]);
    assert_eq!((known.1.len(), known.2), (1, Some(0)));
    assert!(cell(&known, 0, "leaf_area_m2").parse::<f64>().expect("a number") > 0.0);
    assert_eq!(cell(&known, 0, "leaf_area_withheld"), "");
    for (args, why) in [(&["--rig", withheld.as_str()][..], "optics_unknown"), (&[], "no_rig")] {
        let dark = rows(args);
        assert_eq!((&dark.0, dark.1.len()), (&known.0, 1), "{args:?}");
        assert_eq!(cell(&dark, 0, "leaf_area_m2"), "", "an area that is withheld is an empty cell, never 0");
        assert_eq!(cell(&dark, 0, "leaf_area_withheld"), why);
        assert_eq!(cell(&dark, 0, "scans"), cell(&known, 0, "scans"));
    }
    assert!(cell(&rows(&["--rig", &withheld]), 0, "warnings").contains("optics_unknown"));
    // Every number and word of the document is in the rows.
    for args in [&["--rig", told.as_str()][..], &["--rig", &withheld], &[]] {
        let ended = run(&[&["estimate", &run_file, "--format", "json"], args].concat());
        let document: Value = serde_json::from_str(&ended.stdout).expect("JSON");
        for (key, value) in document.as_object().expect("an object") {
            assert!(
                known.0.contains(key) || !(value.is_number() || value.is_string()),
                "{key} is in no column"
            );
        }
    }

    let known = rows(&["--rig", &told, "--by", "tree"]);
    let nothing = rows(&["--by", "tree"]);
    assert_eq!((&nothing.0, nothing.1.len()), (&known.0, 0), "the header is written where there is no row");
    let dark = rows(&["--rig", &withheld, "--by", "tree"]);
    assert_eq!(dark.0, known.0);
    assert!(known.1.len() > 2 && dark.1.len() == known.1.len(), "{} and {}", known.1.len(), dark.1.len());
    for tree in 0..known.1.len() {
        assert!(!cell(&known, tree, "leaf_area_m2").is_empty());
        assert_eq!(cell(&dark, tree, "leaf_area_m2"), "");
        for name in ["scans_lost", "segments_lost"] {
            assert_eq!((cell(&known, tree, name), cell(&dark, tree, name)), ("0".to_owned(), "0".to_owned()));
        }
        assert!(
            cell(&dark, tree, "warnings").contains("optics_unknown"),
            "every line says what its reader must know"
        );
    }
}
