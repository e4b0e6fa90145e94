//! No command writes over a file that it reads, whichever of its options names the file, and by whichever of the file's names.

use std::any::TypeId;
use std::fs;
use std::path::{Path, PathBuf};

use rowscan_protocol::frame::{Dialect, encode};

use crate::common::binary::{assert_says, run, text};
use crate::common::studies::small;

/// What a file holds.
#[derive(Clone, Copy)]
enum Holds {
    Scene,
    Study,
    Search,
    Classes,
    Leaves,
    Scans,
    Recording,
    Faults,
    Scenario,
    Shard,
    Sheet,
}

/// An option that names a file to be written: command, option, what the file holds, its name, and the command line, where `F` is the file and `P` the
/// beginning of its name.
type Case = (&'static str, &'static str, Holds, &'static str, &'static [&'static str]);

/// Every option that names a file to be written. A new one without a case here fails the test below.
const CASES: &[Case] = &[
    ("demo", "picture", Holds::Scene, "f.png", &["demo", "F", "--time-scale", "max", "--picture", "F"]),
    (
        "emulate",
        "truth",
        Holds::Scene,
        "f.jsonl",
        &["emulate", "F", "--seconds", "1", "--time-scale", "max", "--tcp", "127.0.0.1:0", "--truth", "F"],
    ),
    (
        "emulate",
        "truth",
        Holds::Faults,
        "f.jsonl",
        &[
            "emulate",
            "post",
            "--seconds",
            "1",
            "--time-scale",
            "max",
            "--tcp",
            "127.0.0.1:0",
            "--faults",
            "F",
            "--truth",
            "F",
        ],
    ),
    (
        "emulate",
        "record",
        Holds::Scene,
        "f.mcap",
        &["emulate", "F", "--seconds", "1", "--time-scale", "max", "--tcp", "127.0.0.1:0", "--record", "F"],
    ),
    (
        "estimate",
        "map",
        Holds::Scans,
        "f.geojson",
        &["estimate", "F", "--rig", "post", "--map", "F", "--map-from", "41,0,0"],
    ),
    (
        "watch",
        "map",
        Holds::Scans,
        "f.geojson",
        &["watch", "F", "--rig", "post", "--web", "127.0.0.1:0", "--map", "F", "--map-from", "41,0,0"],
    ),
    ("estimate", "record", Holds::Scans, "f.mcap", &["estimate", "F", "--record", "F"]),
    ("watch", "record", Holds::Scans, "f.mcap", &["watch", "F", "--web", "127.0.0.1:0", "--record", "F"]),
    (
        "replay",
        "record",
        Holds::Recording,
        "f.mcap",
        &["replay", "F", "--tcp", "127.0.0.1:0", "--record", "F"],
    ),
    ("check", "junit", Holds::Scenario, "f.toml", &["check", "F", "--junit", "F"]),
    ("check", "junit", Holds::Scenario, "f.toml", &["check", "F", "-j", "2", "--junit", "F"]),
    ("score", "picture", Holds::Scene, "f.svg", &["score", "F", "--picture", "F"]),
    ("orchard truth", "output", Holds::Scene, "f.csv", &["orchard", "truth", "F", "--cells", "-o", "F"]),
    ("orchard grow", "output", Holds::Scene, "f_leaves.txt", &["orchard", "grow", "F", "-o", "P"]),
    ("orchard export", "output", Holds::Scene, "f_leaves.txt", &["orchard", "export", "F", "-o", "P"]),
    ("orchard export", "svg", Holds::Scene, "f.svg", &["orchard", "export", "F", "--svg", "F"]),
    (
        "orchard import",
        "output",
        Holds::Leaves,
        "f_leaves.txt",
        &["orchard", "import", "--leaves", "F", "-o", "P"],
    ),
    ("orchard render", "output", Holds::Scene, "f.png", &["orchard", "render", "F", "-o", "F"]),
    ("scene show", "svg", Holds::Scene, "f.svg", &["scene", "show", "F", "--svg", "F"]),
    ("rig show", "svg", Holds::Scene, "f.svg", &["rig", "show", "F", "--svg", "F"]),
    ("scan", "output", Holds::Scene, "f_points.csv", &["scan", "F", "-o", "P"]),
    ("scan", "picture", Holds::Scene, "f.svg", &["scan", "F", "--picture", "F"]),
    ("record", "output", Holds::Scans, "f.mcap", &["record", "F", "-o", "F"]),
    ("export", "output", Holds::Recording, "f.csv", &["export", "F", "--to", "csv", "-o", "F"]),
    ("study run", "output", Holds::Study, "f.toml", &["study", "run", "F", "-o", "F"]),
    ("study run", "figure", Holds::Study, "f.svg", &["study", "run", "F", "--figure", "F"]),
    ("study search", "output", Holds::Search, "f.toml", &["study", "search", "F", "-o", "F"]),
    ("study areas", "output", Holds::Scene, "f.json", &["study", "areas", "F", "-o", "F"]),
    ("study areas", "calibration", Holds::Scene, "f.toml", &["study", "areas", "F", "--calibration", "F"]),
    ("study areas", "figure", Holds::Scene, "f.svg", &["study", "areas", "F", "--figure", "F"]),
    ("study resolution", "output", Holds::Scene, "f.json", &["study", "resolution", "F", "-o", "F"]),
    ("study resolution", "figure", Holds::Scene, "f.svg", &["study", "resolution", "F", "--figure", "F"]),
    (
        "study physics",
        "figure",
        Holds::Scene,
        "f.svg",
        &["study", "physics", "F", "--seeds", "1..1", "--figure", "F"],
    ),
    (
        "study calibration",
        "output",
        Holds::Scene,
        "f.toml",
        &["study", "calibration", "F", "--seeds", "1..2", "-o", "F"],
    ),
    (
        "study transfer",
        "output",
        Holds::Classes,
        "f.toml",
        &["study", "transfer", "--classes", "F", "-o", "F"],
    ),
    (
        "study transfer",
        "between_class",
        Holds::Classes,
        "f.csv",
        &["study", "transfer", "--classes", "F", "--between-class", "F"],
    ),
    ("study field", "output", Holds::Sheet, "f.csv", &["study", "field", "F", "--rig", "spindle", "-o", "F"]),
    ("study pieces", "table", Holds::Scene, "f.csv", &["study", "pieces", "F", "--table", "F"]),
    (
        "study coverage",
        "output",
        Holds::Classes,
        "f.toml",
        &["study", "coverage", "--classes", "F", "-o", "F"],
    ),
    ("study merge", "calibration", Holds::Shard, "f.toml", &["study", "merge", "F", "--calibration", "F"]),
    ("study merge", "figure", Holds::Shard, "f.svg", &["study", "merge", "F", "--figure", "F"]),
];

/// Options and arguments that name a file to be read, a folder, a device or a link; and files that are kept by name: see docs/bad-input.md.
const OTHERS: &[(&str, &[&str])] = &[
    ("emulate", &["fault_file", "pty", "serial", "state"]),
    ("check", &["scenarios", "keep"]),
    ("score", &["run", "beside"]),
    ("demo", &["boom"]),
    ("spray", &["boom"]),
    ("orchard import", &["branches", "leaves", "mesh"]),
    ("record", &["repair"]),
    ("replay", &["file", "fault_file", "pty", "serial", "state"]),
    ("export", &[]),
    ("decode", &["file"]),
    ("bus decode", &["file"]),
    ("proxy", &["fault_file", "pty", "record", "serial"]),
    ("scene new", &["file"]),
    ("rig new", &["file"]),
    ("man", &["folder"]),
    ("study run", &["file"]),
    ("study field", &["sheet"]),
    // These have no figure, and say so.
    ("study search", &["file", "selected", "figure"]),
    // Its table is written as that of `study transfer` is.
    ("study merge", &["files", "between_class"]),
    ("study transfer", &["classes", "figure"]),
    ("study coverage", &["classes", "figure"]),
];

#[test]
fn every_option_that_names_a_file_is_known_here() {
    let mut unknown = Vec::new();
    visit(&rowscan::cli::command(), "", &mut unknown);
    assert!(unknown.is_empty(), "say below what they do: {unknown:?}");
}

fn visit(command: &clap::Command, above: &str, unknown: &mut Vec<String>) {
    for sub in command.get_subcommands() {
        let name = format!("{above}{}", sub.get_name());
        for argument in sub.get_arguments() {
            let id = argument.get_id().as_str();
            let names_a_file = argument.get_value_parser().type_id() == TypeId::of::<PathBuf>();
            let is_written = CASES.iter().any(|(command, option, ..)| *command == name && *option == id);
            let is_other = OTHERS.iter().any(|(command, ids)| *command == name && ids.contains(&id));
            // A folder, in which studies name the files of their rows themselves.
            let is_kept = id == "keep" && name.starts_with("study ");
            if names_a_file && !is_written && !is_other && !is_kept {
                unknown.push(format!("{name} {id}"));
            }
        }
        visit(sub, &format!("{name} "), unknown);
    }
}

#[test]
fn no_command_writes_over_what_it_reads() {
    let mut wrong = Vec::new();
    for (index, case) in CASES.iter().enumerate() {
        // By the file's own name, by a link to it, and by its second name, in turn.
        let otherwise = [None, Some(link as fn(&Path, &Path)), Some(second_name)][index % 3];
        for named in [None, otherwise] {
            if let Err(why) = refuses(case, named) {
                wrong.push(why);
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n\n"));
}

fn link(file: &Path, name: &Path) {
    std::os::unix::fs::symlink(file, name).expect("linked");
}

fn second_name(file: &Path, name: &Path) {
    fs::hard_link(file, name).expect("linked");
}

/// Runs a case; with `named`, the file is read by one name and written by another.
fn refuses(
    (command, option, holds, name, line): &Case,
    named: Option<fn(&Path, &Path)>,
) -> Result<(), String> {
    let (folder, other) = (tempfile::tempdir().expect("a folder"), tempfile::tempdir().expect("a folder"));
    let (file, content) = (folder.path().join(name), content(*holds));
    fs::write(&file, &content).expect("written");
    let read = match named {
        None => file.clone(),
        Some(make) => {
            let other = other.path().join(name);
            make(&file, &other);
            other
        }
    };
    // What is read stands before what is written.
    let mut names = [text(&read), text(&file)].into_iter();
    let prefix = text(&file).split_once("/f").map(|_| folder.path().join("f")).expect("named so");
    let line: Vec<&str> = line
        .iter()
        .map(|word| match *word {
            "F" => names.next().expect("read, then written"),
            "P" => text(&prefix),
            word => word,
        })
        .collect();
    let ended = run(&line);
    let kept = fs::read(&file).expect("still there") == content;
    let is_refused = ended.code == Some(2)
        && (ended.stderr.contains("is read by this command") || ended.stderr.contains("already"));
    if kept && is_refused {
        return Ok(());
    }
    Err(format!("{command} {option}: {line:?}: exit {:?}, kept {kept}: {}", ended.code, ended.stderr))
}

fn content(holds: Holds) -> Vec<u8> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let shipped = |path: &str| fs::read(root.join(path)).expect("it ships");
    match holds {
        Holds::Scene => shipped("sim-scenes/scenes/spindle.toml"),
        Holds::Study => shipped("docs/examples/quick-study.toml"),
        Holds::Search => SEARCH.into(),
        Holds::Classes => CLASSES.into(),
        Holds::Leaves => leaves(),
        Holds::Scans => b"\x02sRN DeviceIdent\x03".into(),
        Holds::Recording => recording(),
        Holds::Faults => b"[[fault]]\nname = \"stall\"\nat = { scan = 10 }\nfor = { s = 1 }\n".into(),
        Holds::Scenario => SCENARIO.into(),
        Holds::Shard => shard(),
        Holds::Sheet => b"recording,from_m,to_m,leaf_area_m2\nrow.mcap,1,2,5\n".into(),
    }
}

const SEARCH: &[u8] = br#"version = 1
scene = "paper"
seeds = [3, 3]
[base]
iterations = [6]
shady_percent = [60.0]
"scene.orchard.trees" = 1
[[knob]]
key = "scene.orchard.tree.max_metamers"
values = [30]
"#;

const CLASSES: &[u8] = br#"version = 1
name = "two"
scene = "leafy"
[[axis]]
name = "rig_error"
[[axis.class]]
name = "none"
[[axis.class]]
name = "told too far"
told = { "rig.scanner.distance_m" = 2.4 }
"#;

const SCENARIO: &[u8] = br#"version = 1
scene = "post"
end = { s = 1 }
[[device]]
id = "left"
model = "lms111"
[[run]]
id = "sut"
command = ["true"]
[[expect]]
what = "exit_code"
"#;

/// A scan, on a loop of replays.
fn recording() -> Vec<u8> {
    let scan = b"sSN LMDscandata 1 1 16F4C7A 0 0 1 1 4E20 4E20 0 0 4 0 0 1388 168 0 1 DIST1 3F800000 00000000 FFF92230 1388 3 3E8 0 7D0 0 0 0 0 0 0";
    let mut bytes = Vec::new();
    encode(Dialect::A, scan, &mut bytes);
    bytes
}

/// A study of four quick orchards.
fn shard() -> Vec<u8> {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("whole.json");
    let ended = small(&["--output", text(&file)]);
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    fs::read(file).expect("written")
}

/// The leaves of one tree, as `orchard grow` writes them.
fn leaves() -> Vec<u8> {
    let folder = tempfile::tempdir().expect("a folder");
    let prefix = folder.path().join("g");
    let ended = run(&["orchard", "grow", "leafy", "-o", text(&prefix)]);
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    assert_says(&ended.stderr, &["leaves"]);
    fs::read(folder.path().join("g_leaves.txt")).expect("written")
}
