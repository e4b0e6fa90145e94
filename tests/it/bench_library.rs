//! The scenarios of tools/scenarios: each with its verdict, each red without its faults, and our own driver in each of them.

use std::fs;
use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::common::binary::{Ended, run, text};

fn library() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tools/scenarios")
}

/// Files that others use, and scenarios that tests/it/check.rs holds.
const ELSEWHERE: &[&str] =
    &["base", "row", "encoder", "two-sided", "deaf", "quits", "redial", "steady", "two-scanners"];

/// A folder with the whole library, for scenarios that change one of it.
fn copy() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    for file in fs::read_dir(library()).expect("the library").flatten().filter(|file| file.path().is_file()) {
        fs::copy(file.path(), folder.path().join(file.file_name())).expect("copied");
    }
    folder
}

fn check(scenario: &Path, flags: &[&str]) -> Ended {
    run(&[&["check", text(scenario)], flags].concat())
}

fn passes(name: &str) {
    let ended = check(&library().join(name).with_extension("toml"), &[]);
    assert_eq!(ended.code, Some(0), "{}{}", ended.stdout, ended.stderr);
}

/// Faults of these ids whose time never comes: expectations that name them are still judged.
fn idle_faults(scenario: &str) -> String {
    let ids = scenario.split("id = \"").skip(1).filter_map(|rest| rest.split_once("\", name = "));
    let idle = |id: &str| format!("{{ id = \"{id}\", name = \"stall\", at = {{ s = 80000 }} }}");
    ids.map(|(id, _)| id).filter(|id| !id.contains('"')).map(idle).collect::<Vec<_>>().join(", ")
}

/// Without its faults a scenario's expectations of them do not hold.
fn is_red_without_faults(name: &str) {
    let folder = copy();
    let scenario = folder.path().join("without.toml");
    let written = fs::read_to_string(library().join(name).with_extension("toml")).expect("there");
    let faults = idle_faults(&written);
    fs::write(&scenario, format!("use = \"{name}.toml\"\nfault = [{faults}]\n")).expect("written");
    let ended = check(&scenario, &[]);
    let reds = ["FAILED", "there was no event", "nothing ends that: add a [[fault]]"];
    let is_red = reds.iter().any(|red| ended.stdout.contains(red));
    assert!(ended.code != Some(0) && is_red, "{name}: {}", ended.stdout);
}

/// What a run of our driver ended with.
struct Driven {
    /// The verdicts' messages.
    messages: Vec<String>,
    /// The estimate it printed.
    estimate: Value,
    log: String,
}

impl Driven {
    fn count(&self, key: &str) -> u64 {
        self.estimate[key].as_u64().unwrap_or_else(|| panic!("{key}: {}", self.estimate))
    }

    /// Lost, repeated, bad.
    fn counts(&self) -> (u64, u64, u64) {
        (self.count("scans_lost"), self.count("scans_repeated"), self.count("telegrams_bad"))
    }
}

/// Our driver in place of the controller, with these expectations; all must hold.
fn drives(name: &str, expects: &[&str]) -> Driven {
    let folder = copy();
    let scenario = folder.path().join("driven.toml");
    let command = r#"["{rowscan}", "estimate", "tcp://{left.tcp}", "--wait", "--rig", "{scenario}/row.toml", "--format", "json"]"#;
    // Where connections are refused at first it is ready before it is connected.
    let ready =
        if matches!(name, "late" | "cold-start") { "" } else { r#", ready = { line = "connected" }"# };
    let run = format!(r#"run = [{{ id = "sut", command = {command}{ready} }}]"#);
    let written = format!("use = \"{name}.toml\"\n{run}\nexpect = [\n  {},\n]\n", expects.join(",\n  "));
    fs::write(&scenario, written).expect("written");
    let keep = folder.path().join("kept");
    let ended = check(&scenario, &["--format", "jsonl", "--keep", text(&keep)]);
    assert_eq!(ended.code, Some(0), "{name}: {}{}", ended.stdout, ended.stderr);
    let lines = ended.stdout.lines().map(|line| serde_json::from_str::<Value>(line).expect(line));
    let verdicts = lines.filter(|line| line["kind"] == "verdict");
    let messages = verdicts.map(|line| line["message"].as_str().unwrap_or_default().to_owned()).collect();
    let log = fs::read_to_string(keep.join("01-driven/seed-7-run-1/sut.log")).expect("its log");
    let out = log.lines().filter_map(|line| line.split_once("\tout\t").map(|(_, out)| out));
    let estimate = serde_json::from_str(&out.collect::<String>()).expect("an estimate");
    Driven { messages, estimate, log }
}

const NOTHING_LOST: &str =
    r#"{ what = "scans_lost", equals = 0 }, { what = "telegrams_bad", equals = 0 }, { what = "exit_code" }"#;
const AS_WITHOUT: &str =
    r#"{ what = "impacted_total_area_m2", equals_run_without = "faults", tolerance = 0 }"#;

/// The same of scenarios whose child no driver takes the place of.
macro_rules! whole_rigs {
    ($($module:ident, $name:literal;)*) => {
        $(mod $module {
            #[test]
            fn holds() {
                super::passes($name);
            }

            #[test]
            fn is_red_without_its_faults() {
                super::is_red_without_faults($name);
            }
        })*

        /// Those that are tested so.
        const WHOLE_RIGS: &[&str] = &[$($name),*];
    };
}

whole_rigs! {
    gnss, "gnss";
    ntp, "ntp";
    bus_off, "bus-off";
    no_tecu, "no-tecu";
    slip, "slip";
    encoder_stuck, "encoder-stuck";
}

/// A module a scenario: its verdict with the controller, without its faults, and with our driver.
macro_rules! scenarios {
    ($($module:ident, $name:literal, $driven:ident;)*) => {
        $(mod $module {
            #[test]
            fn holds_with_the_controller() {
                super::passes($name);
            }

            #[test]
            fn is_red_without_its_faults() {
                super::is_red_without_faults($name);
            }

            #[test]
            fn holds_with_our_driver() {
                super::$driven();
            }
        })*

        /// Those that the tests here run.
        const HERE: &[&str] = &[$($name),*];
    };
}

scenarios! {
    every_cut, "every-cut", drives_every_cut;
    dribble, "dribble", drives_dribble;
    damaged, "damaged", drives_damaged;
    paused, "paused", drives_paused;
    slow_link, "slow-link", drives_slow_link;
    cable, "cable", drives_cable;
    half_open, "half-open", drives_half_open;
    reset, "reset", drives_reset;
    late, "late", drives_late;
    wrap, "wrap", drives_wrap;
    dirty, "dirty", drives_dirty;
    cold_start, "cold-start", drives_cold_start;
    crank, "crank", drives_crank;
}

fn drives_every_cut() {
    let acts = r#"{ what = "fault_acts", of = "cut", above = 1000 }"#;
    let driven = drives("every-cut", &[acts, NOTHING_LOST, AS_WITHOUT]);
    assert_eq!(driven.counts(), (0, 0, 0));
}

fn drives_dribble() {
    let acts = r#"{ what = "fault_acts", of = "drip", equals = 50 }"#;
    let driven = drives("dribble", &[acts, NOTHING_LOST, AS_WITHOUT]);
    assert_eq!(driven.counts(), (0, 0, 0));
}

fn drives_damaged() {
    let lost = r#"{ what = "scans_lost", equals = 4 }, { what = "telegrams_bad", equals = 1 }"#;
    let again = r#"{ what = "scans_repeated", equals = 1 }, { what = "streaming", after = "short.end", within_s = 0.041 }"#;
    let driven = drives("damaged", &[lost, again, r#"{ what = "reconnects", equals = 0 }"#]);
    assert_eq!(driven.counts(), (4, 1, 1), "{}", driven.log);
}

fn drives_paused() {
    let acts = r#"{ what = "fault_acts", of = "busy", equals = 1 }"#;
    let driven = drives("paused", &[acts, NOTHING_LOST, AS_WITHOUT]);
    assert_eq!(driven.counts(), (0, 0, 0));
}

fn drives_slow_link() {
    let acts = r#"{ what = "fault_acts", of = "late", equals = 1 }, { what = "fault_acts", of = "uneven", equals = 1 }"#;
    let driven = drives("slow-link", &[acts, NOTHING_LOST]);
    assert_eq!(driven.counts(), (0, 0, 0));
}

fn drives_cable() {
    let lost = r#"{ what = "scans_lost", equals = "device" }, { what = "scans_lost", above = 20 }"#;
    let driven = drives("cable", &[lost, r#"{ what = "reconnects", equals = 0 }"#]);
    let by_bench = driven.messages[0].rsplit(' ').next().and_then(|found| found.parse().ok());
    assert_eq!(Some(driven.count("scans_lost")), by_bench, "{:?}", driven.messages);
    assert_eq!((driven.count("scans_repeated"), driven.count("telegrams_bad")), (0, 0));
}

fn drives_half_open() {
    let noticed = r#"{ what = "log", matches = "trying again", after = "out", within_s = 6 }"#;
    let back =
        r#"{ what = "streaming", after = "out.end", within_s = 4 }, { what = "scans_lost", above = 100 }"#;
    let driven = drives("half-open", &[noticed, back]);
    let by_bench = driven.messages[2].rsplit(' ').next().and_then(|found| found.parse().ok());
    assert_eq!(Some(driven.count("scans_lost")), by_bench, "{:?}", driven.messages);
}

fn drives_reset() {
    let noticed = r#"{ what = "log", matches = "trying again", after = "cut", within_s = 1 }"#;
    let back =
        r#"{ what = "streaming", after = "cut.end", within_s = 2 }, { what = "reconnects", equals = 1 }"#;
    let driven = drives("reset", &[noticed, back, r#"{ what = "scans_lost", above = 1 }"#]);
    let by_bench = driven.messages[3].rsplit(' ').next().and_then(|found| found.parse().ok());
    assert_eq!(Some(driven.count("scans_lost")), by_bench, "{:?}", driven.messages);
}

fn drives_late() {
    let back = r#"{ what = "first_scan", after = "boot.end", within_s = 4 }, { what = "fault_acts", of = "boot", equals = 1 }"#;
    let driven = drives("late", &[back, NOTHING_LOST]);
    assert_eq!(driven.counts(), (0, 0, 0));
}

fn drives_wrap() {
    let acts = r#"{ what = "fault_acts", of = "wrap", equals = 1 }, { what = "fault_acts", of = "back", equals = 1 }"#;
    let driven =
        drives("wrap", &[acts, NOTHING_LOST, &AS_WITHOUT.replace("tolerance = 0", "tolerance = 1e-9")]);
    assert_eq!(driven.counts(), (0, 0, 0));
}

fn drives_dirty() {
    let acts = r#"{ what = "fault_acts", of = "dirt", equals = 1 }"#;
    // A third of the row is unknown, and the exit code says so.
    let unknown = r#"{ what = "scans_lost", equals = 0 }, { what = "exit_code", equals = 1 }"#;
    let driven = drives("dirty", &[acts, unknown]);
    assert_eq!(driven.counts(), (0, 0, 0));
    // A second of 50 scans: what dirty beams say is left out, and told.
    let excluded = driven.count("scans_excluded");
    assert!((49..=51).contains(&excluded), "{excluded} scans were left out");
}

fn drives_cold_start() {
    let up = r#"{ what = "first_scan", after = "power.end", within_s = 60 }"#;
    let driven = drives("cold-start", &[up, r#"{ what = "telegrams_bad", equals = 0 }"#]);
    assert_eq!(driven.count("telegrams_bad"), 0);
}

fn drives_crank() {
    let back = r#"{ what = "streaming", after = "crank.end", within_s = 38 }"#;
    let driven = drives("crank", &[back, r#"{ what = "telegrams_bad", equals = 0 }"#]);
    assert_eq!(driven.count("telegrams_bad"), 0, "{}", driven.log);
}

#[test]
fn a_stored_dialect_stops_neither_the_controller_nor_our_driver() {
    passes("stored-dialect");
    let driven = drives("stored-dialect", &[NOTHING_LOST]);
    assert_eq!(driven.counts(), (0, 0, 0));
    // Its start is the fault: the controller speaks CoLa A only, and hears nothing of a scanner in CoLa B.
    let folder = copy();
    let scenario = folder.path().join("other.toml");
    let device = r#"device = [{ id = "left", model = "lms111", start = "cola-b" }]"#;
    let clock = r#"clock = { mode = "lockstep", startup_wall_s = 2 }"#;
    fs::write(&scenario, format!("use = \"stored-dialect.toml\"\n{device}\n{clock}\n")).expect("written");
    assert_eq!(check(&scenario, &[]).code, Some(2));
}

#[test]
fn our_driver_finds_an_lms2xx_that_was_left_streaming() {
    passes("left-streaming");
}

#[test]
fn a_controller_hears_the_whole_tractor_and_is_ready_when_it_says_so_on_the_bus() {
    passes("tractor");
    // One that is waited for and never comes.
    let folder = copy();
    let scenario = folder.path().join("other.toml");
    let written = fs::read_to_string(library().join("tractor.toml")).expect("there");
    let clock = r#"clock = { mode = "paced", startup_wall_s = 2 }"#;
    let written = written.replace("0x18FF1080", "0x18FF1081").replace(r#"clock = { mode = "paced" }"#, clock);
    fs::write(&scenario, written).expect("written");
    let ended = check(&scenario, &[]);
    assert_eq!(ended.code, Some(2), "{}", ended.stdout);
    assert!(ended.stdout.contains("`sut` was not ready within 2s"), "{}", ended.stdout);
}

#[test]
fn every_scenario_of_the_library_is_run() {
    let alone = ["stored-dialect", "left-streaming", "tractor"];
    let known =
        |name: &str| HERE.iter().chain(WHOLE_RIGS).chain(ELSEWHERE).chain(&alone).any(|known| *known == name);
    let files = fs::read_dir(library()).expect("the library").flatten().map(|file| file.path());
    let scenarios = files.filter(|path| path.extension().is_some_and(|ending| ending == "toml"));
    let names = scenarios.filter_map(|path| Some(path.file_stem()?.to_str()?.to_owned()));
    let unknown: Vec<String> = names.filter(|name| !known(name)).collect();
    assert!(unknown.is_empty(), "no test runs {unknown:?}");
}
