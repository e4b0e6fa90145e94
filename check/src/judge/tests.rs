#![allow(clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

mod spared;
mod sprayer;

use std::collections::BTreeMap;
use std::path::Path;
use std::time::Duration;

use rowscan_emulator::Rig;
use rowscan_emulator::clock::TimeScale;
use rowscan_vehicle::Tractor;
use rowscan_vehicle::trajectory::Trajectory;

use super::*;
use crate::jitter::Jitter;
use crate::journal::Journal;
use crate::output::Match;
use crate::runner::ChildRecord;
use crate::verdict::Verdict;
use crate::what::Sprayed;
use crate::witness::tests::{bench, deliver};

const SECOND: u64 = 1_000_000_000;

/// What an expectation says of a run, in a word; the message for a wrong word.
fn verdict(expect: &str, tried: &Runs, folder: &Path) -> (Verdict, String) {
    let faults = ["early", "late", "never", "cut"].map(|id| format!("{{ id = \"{id}\", name = \"stall\" }}"));
    let text = format!(
        "version = 1\nscene = \"spindle\"\nend = {{ s = 1 }}\ndevice = [{{ id = \"left\", model = \"lms111\" }}]\n\
         run = [{{ id = \"sut\", command = [\"x\"] }}]\nfault = [{}]\nexpect = [{{ {expect} }}]\n",
        faults.join(", ")
    );
    let path = folder.join("scenario.toml");
    std::fs::write(&path, text).expect("written");
    let scenario = Scenario::load(&path).expect(expect);
    let judged = judge(&scenario, 0, &scenario.expects[0], tried);
    (judged.verdict, judged.message)
}

fn event(name: &str, t_s: f64) -> Event {
    Event { event: name.to_owned(), t_s, row_m: t_s, wall_s: 0.0, detail: String::new() }
}

/// A run that delivered nine of ten telegrams, one of them twice, at 0.02 s, 0.04 s …
pub(crate) fn record(folder: &Path) -> RunRecord {
    let (witness, telegrams) = bench(10);
    deliver(
        &witness,
        telegrams
            .iter()
            .enumerate()
            .filter(|(n, _)| *n != 4)
            .map(|(_, telegram)| telegram)
            .chain(&telegrams[9..]),
    );
    let mut streams = witness.close(true);
    let stream = streams.get_mut("left").expect("watched");
    stream.passed.iter_mut().for_each(|at| at.way_m = at.y_m);
    stream.scan_times = (1..=10).map(|scan| SimTime(scan * SECOND / 50)).collect();
    let matches = BTreeMap::from([(
        0,
        [SECOND / 2, 2 * SECOND].map(|at| Match { at: SimTime(at), value: None }).to_vec(),
    )]);
    let child = ChildRecord { exit_code: Some(3), matches, ..ChildRecord::default() };
    RunRecord {
        seed: 7,
        folder: folder.to_owned(),
        events: vec![
            event("start", 0.0),
            event("early", 0.1),
            event("late", 0.7),
            event("end", 1.0),
            event("late.end", 1.0),
        ],
        streams,
        children: BTreeMap::from([("sut".to_owned(), child)]),
        ended: SimTime(SECOND),
        wall_s: 0.1,
        fault_acts: BTreeMap::from([("cut".to_owned(), 5)]),
        ..RunRecord::default()
    }
}

/// What holds, what does not, and what cannot be judged, of one kind.
fn holds(cases: &[(&str, Verdict)]) {
    let folder = tempfile::tempdir().expect("a folder");
    let other = folder.path().join("other");
    std::fs::create_dir(&other).expect("made");
    for (name, text) in [("same", "a\nb\n"), ("differs", "a\nb\n"), ("kept", "a\nb\n")] {
        std::fs::write(folder.path().join(name), text).expect("written");
    }
    for (name, text) in [("same", "a\nb\n"), ("differs", "a\nc\n")] {
        std::fs::write(other.join(name), text).expect("written");
    }
    let tried = Runs {
        all: vec![record(folder.path()), record(&other)],
        without_faults: Some(record(&other)),
        bless: false,
    };
    for (expect, expected) in cases {
        let (found, message) = verdict(expect, &tried, folder.path());
        assert_eq!(found, *expected, "{expect}: {message}");
    }
}

use Verdict::{Error, Failed, Passed};

#[test]
fn the_next_scan() {
    holds(&[
        ("what = \"first_scan\", within_s = 0.03", Passed),
        ("what = \"first_scan\", within_s = 0.01", Failed),
        ("what = \"streaming\", after = \"early\", within_s = 0.05", Passed),
        ("what = \"streaming\", after = \"late\", within_s = 0.1", Failed),
        ("what = \"streaming\", after = \"never\", within_s = 1", Error),
        ("what = \"streaming\", after = \"late.end\", within_s = 1", Error),
        ("what = \"first_scan\", on = \"right\", within_s = 1", Error),
    ]);
}

#[test]
fn counts() {
    holds(&[
        ("what = \"scans_lost\", equals = 1", Passed),
        ("what = \"scans_lost\", equals = 0", Failed),
        ("what = \"scans_lost\", between = [0, 2]", Passed),
        ("what = \"scans_lost\", above = 1", Failed),
        ("what = \"scans_lost\", between = [\"early\", \"late\"], equals = 1", Passed),
        ("what = \"scans_lost\", between = [\"late\", \"early\"], equals = 0", Error),
        // It ends with the run.
        ("what = \"scans_lost\", after = \"late.end\", equals = 0", Error),
        ("what = \"scans_lost\", between = [\"late.end\", \"late.recovered\"], equals = 0", Error),
        ("what = \"scans_lost\", between = [\"late\", \"late.end\"], equals = 0", Passed),
        ("what = \"scans_lost\", between = [\"early\", \"never\"], equals = 0", Error),
        // Nothing tells here what the device has not sent.
        ("what = \"scans_lost\", equals = \"device\"", Error),
        ("what = \"scans_repeated\", equals = 1", Passed),
        ("what = \"telegrams_bad\", equals = 0", Passed),
        ("what = \"telegrams_bad\", above = 0", Failed),
        ("what = \"reconnects\", equals = 0", Passed),
        ("what = \"reconnects\", on = \"sut\", equals = 0", Error),
        // Nothing tells here who takes scans.
        ("what = \"unheard_s\", equals = 0", Error),
    ]);
}

/// What was lost before and behind the restart nobody can tell, and it is no 0.
#[test]
fn what_a_device_that_began_to_count_anew_lost_is_unknown() {
    let folder = tempfile::tempdir().expect("a folder");
    let (witness, telegrams) = bench(90);
    deliver(&witness, telegrams[80..].iter().chain(&telegrams[..3]));
    let streams = witness.close(true);
    assert_eq!(streams["left"].counts().untold, 1, "{:?}", streams["left"].counts());
    let run = RunRecord { streams, ..record(folder.path()) };
    let tried = Runs { all: vec![run], without_faults: None, bless: false };
    for bounds in ["equals = 0", "above = 0", "equals = \"device\""] {
        let (found, message) = verdict(&format!("what = \"scans_lost\", {bounds}"), &tried, folder.path());
        assert_eq!(found, Error, "{bounds}: {message}");
        assert!(message.contains("began to count anew"), "{message}");
    }
    let repeated = verdict("what = \"scans_repeated\", equals = 0", &tried, folder.path());
    assert_eq!(repeated.0, Passed, "{}", repeated.1);
}

#[test]
fn measures() {
    holds(&[
        ("what = \"impacted_total_area_m2\", below = 1", Passed),
        ("what = \"impacted_total_area_m2\", above = 1", Failed),
        ("what = \"impacted_total_area_m2\", equals_run_without = \"faults\"", Passed),
        ("what = \"impacted_total_area_m2\", on = \"right\", above = 0", Error),
        // No truth is known here: what is unknown cannot be judged.
        ("what = \"leaf_area_error\", abs_below = 1000", Error),
        ("what = \"leaf_area_error\", equals_run_without = \"faults\"", Error),
    ]);
}

#[test]
fn acts_of_faults() {
    holds(&[
        ("what = \"fault_acts\", of = \"cut\", equals = 5", Passed),
        ("what = \"fault_acts\", of = \"cut\", above = 5", Failed),
        ("what = \"fault_acts\", of = \"never\", above = 0", Failed),
    ]);
}

#[test]
fn log_lines() {
    holds(&[
        ("what = \"log\", matches = \"x\"", Passed),
        ("what = \"log\", matches = \"x\", after = \"early\", within_s = 0.5", Passed),
        ("what = \"log\", matches = \"x\", after = \"late\", within_s = 1", Failed),
        ("what = \"log\", of = \"other\", matches = \"x\"", Error),
        ("what = \"log\", matches = \"x\", after = \"never\"", Error),
    ]);
}

/// A journal of a drive that has begun at `began_s`.
pub(crate) fn journal(began_s: Option<u64>) -> Journal {
    let tractor = Tractor::new(Trajectory::straight(0.0, 1.0));
    began_s.into_iter().for_each(|began_s| tractor.begin(SimTime(began_s * SECOND)));
    Journal::new(Rig::new(tractor.clone(), TimeScale::Max).clock(), tractor)
}

#[test]
fn without_an_event_seconds_count_from_the_start_of_the_drive() {
    let folder = tempfile::tempdir().expect("a folder");
    // The host took nine seconds to start children.
    let judged = |expect: &str, began_s: Option<u64>, at_ms: u64| {
        let at = SimTime(at_ms * SECOND / 1000);
        let mut run = record(folder.path());
        (run.journal, run.ended) = (Some(journal(began_s)), SimTime(20 * SECOND));
        run.streams.get_mut("left").expect("watched").scan_times = vec![at];
        run.events.insert(3, event("sut.started", 2.0));
        let matches = vec![Match { at, value: None }];
        run.children.get_mut("sut").expect("there").matches.insert(0, matches);
        verdict(expect, &Runs { all: vec![run], without_faults: None, bless: false }, folder.path())
    };
    for what in ["first_scan\"", "log\", matches = \"x\""] {
        let within = format!("what = \"{what}, within_s = 2");
        let all = [100, 8900, 9000, 10_900, 11_000].map(|at_ms| judged(&within, Some(9), at_ms).0);
        assert_eq!(all, [Passed; 5], "{what}: before the drive, and in its first two seconds");
        assert_eq!(judged(&within, Some(9), 11_100).0, Failed, "{what}");
        assert_eq!(judged(&within, Some(0), 2100).0, Failed, "{what}: the drive began at once");
        // Whatever came in a run without a drive came before any drive.
        assert_eq!(judged(&within, None, 19_000).0, Passed, "{what}");
        // An event is counted from as it was.
        let after = format!("what = \"{what}, after = \"sut.started\", within_s = 2");
        assert_eq!(
            (judged(&after, Some(9), 3900).0, judged(&after, Some(9), 4100).0),
            (Passed, Failed),
            "{what}"
        );
    }
    let (_, why) = judged("what = \"log\", matches = \"x\", within_s = 2", Some(9), 11_132);
    assert!(
        why.contains(
            "only at 11.132 s; expected by 11.000 s, counted from the start of the drive at 9.000 s"
        ),
        "{why}"
    );
    let (_, why) = judged("what = \"first_scan\", within_s = 2", Some(9), 8900);
    assert!(why.contains("0.100 s before the drive"), "{why}");
}

#[test]
fn files() {
    holds(&[
        ("what = \"bytes_of\", file = \"same\", equals = \"kept\"", Passed),
        ("what = \"bytes_of\", file = \"same\", equals_run_without = \"faults\"", Passed),
        ("what = \"bytes_of\", file = \"differs\", equals_run_without = \"faults\"", Failed),
        ("what = \"bytes_of\", file = \"none\", equals = \"kept\"", Failed),
        ("what = \"bytes_of\", file = \"same\", equals = \"none\"", Error),
        ("what = \"same_bytes\", of = \"same\"", Passed),
        ("what = \"same_bytes\", of = \"differs\"", Failed),
        ("what = \"same_bytes\", of = \"none\"", Failed),
        ("what = \"same_bytes\", of = \"same\", runs = 3", Error),
    ]);
}

#[test]
fn files_that_tell_nothing_of_the_drive_are_not_compared() {
    let folder = tempfile::tempdir().expect("a folder");
    let judged = |content: &str, before: Option<u64>| {
        std::fs::write(folder.path().join("log"), content).expect("written");
        let bytes_before = before.map(|bytes| ("log".to_owned(), bytes)).into_iter().collect();
        let run = || RunRecord { bytes_before: BTreeMap::clone(&bytes_before), ..record(folder.path()) };
        let tried = Runs { all: vec![run(), run()], without_faults: Some(run()), bless: false };
        [
            "what = \"same_bytes\", of = \"log\"",
            "what = \"bytes_of\", file = \"log\", equals_run_without = \"faults\"",
        ]
        .map(|expect| verdict(expect, &tried, folder.path()).0)
    };
    assert_eq!(judged("started\n1\n", Some(8)), [Passed; 2]);
    assert_eq!(judged("started\n", None), [Passed; 2], "it was not there before");
    assert_eq!(judged("started\n", Some(8)), [Error; 2], "nothing came since");
    assert_eq!(judged("", None), [Error; 2]);
}

#[test]
fn what_was_open_when_a_controller_crashed_is_not_judged() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("log"), "1\n").expect("written");
    let judged = |expect: &str, code: i32, at_s: f64| {
        let mut run = record(folder.path());
        run.events.insert(3, event("sut.exited", at_s));
        run.children.get_mut("sut").expect("there").exit_code = Some(code);
        verdict(expect, &Runs { all: vec![run], without_faults: None, bless: false }, folder.path()).0
    };
    let lost = "what = \"scans_lost\", equals = 1";
    assert_eq!(judged(lost, 3, 0.8), Error);
    assert_eq!(judged("what = \"scans_lost\", equals = 0", 3, 0.8), Error, "and no failure");
    assert_eq!(judged(lost, 0, 0.8), Passed, "one that has done its work");
    // What it said last tells why.
    let mut run = record(folder.path());
    run.events.insert(3, event("sut.exited", 0.8));
    let child = run.children.get_mut("sut").expect("there");
    child.tail = "Traceback:\n  line 3\nNo such file: x\n\n".to_owned();
    let (_, why) = verdict(lost, &Runs { all: vec![run], without_faults: None, bless: false }, folder.path());
    assert!(
        why.starts_with(
            "`sut` had crashed at 0.800 s, with code 3 (it last said: No such file: x); until then: "
        ),
        "{why}"
    );
    // Decided before.
    assert_eq!(judged("what = \"first_scan\", within_s = 0.03", 3, 0.8), Passed);
    assert_eq!(judged("what = \"first_scan\", within_s = 0.01", 3, 0.8), Failed);
    assert_eq!(judged("what = \"scans_lost\", between = [\"early\", \"late\"], equals = 1", 3, 0.8), Passed);
    assert_eq!(judged("what = \"log\", matches = \"x\"", 3, 0.4), Error, "it matched at 0.5 s");
    // Somebody expects this code: no crash. Any other one is.
    let beside =
        |exit: &str, code: i32| judged(&format!("{lost} }}, {{ what = \"exit_code\"{exit}"), code, 0.8);
    assert_eq!((beside(", equals = 3", 3), beside(", of = \"sut\", equals = 3", 3)), (Passed, Passed));
    assert_eq!(
        (beside(", equals = 3", 1), beside("", 3), beside(", of = \"other\", equals = 3", 3)),
        (Error, Error, Error)
    );
}

#[test]
fn a_margin_below_the_hosts_jitter_is_no_verdict() {
    let folder = tempfile::tempdir().expect("a folder");
    let judged = |within_s: f64, p99_ms: u64| {
        let ms = Duration::from_millis;
        let jitter = Some(Jitter { p50: ms(1), p99: ms(p99_ms), worst: ms(90) });
        let run = RunRecord { jitter, ..record(folder.path()) };
        // The scan comes after 0.02 s.
        let expect = format!("what = \"first_scan\", within_s = {within_s}");
        verdict(&expect, &Runs { all: vec![run], without_faults: None, bless: false }, folder.path()).0
    };
    assert_eq!((judged(0.03, 9), judged(0.01, 9)), (Passed, Failed));
    assert_eq!((judged(0.03, 11), judged(0.01, 11)), (Error, Error));
}

#[test]
fn a_golden_file_is_written_anew_and_told_where_it_differs() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("log"), "1\n2\n3\n").expect("written");
    std::fs::write(folder.path().join("golden"), "1\n4\n3\n").expect("written");
    let judged = |bless: bool| {
        let tried = Runs { all: vec![record(folder.path())], without_faults: None, bless };
        verdict("what = \"bytes_of\", file = \"log\", equals = \"golden\"", &tried, folder.path())
    };
    let (found, message) = judged(false);
    assert_eq!(found, Failed);
    assert!(message.contains("line 2: found `2`, expected `4`"), "{message}");
    assert_eq!((judged(true).0, judged(false).0), (Passed, Passed));
    // Nothing that tells nothing becomes golden.
    std::fs::write(folder.path().join("log"), "").expect("written");
    assert_eq!(judged(true).0, Error);
    assert_eq!(std::fs::read(folder.path().join("golden")).expect("there"), b"1\n2\n3\n");
}

#[test]
fn exit_codes() {
    holds(&[
        ("what = \"exit_code\", equals = 3", Passed),
        ("what = \"exit_code\"", Failed),
        ("what = \"exit_code\", of = \"other\"", Error),
    ]);
}

#[test]
fn what_needs_the_sprayer_is_not_judged() {
    let keys = |what: &crate::what::What| match what.kind {
        Kind::Sprayer(Sprayed::LatencyError) => Some(", p95_below = 1000"),
        Kind::Sprayer(Sprayed::Valves) => Some(", all = \"closed\""),
        Kind::Sprayer(Sprayed::TimeToSafe) => Some(", after = \"early\", below = 1000"),
        Kind::Sprayer(Sprayed::Recall | Sprayed::Waste | Sprayed::OffTarget) => Some(", below = 0.5"),
        Kind::Sprayer(_) => Some(", below = 1000"),
        Kind::ProcessValue => Some(", element = 2, ddi = 161, value = \"as_setpoint\""),
        _ => None,
    };
    let sprayer: Vec<_> =
        crate::what::WHATS.iter().filter_map(|what| Some((what.name, keys(what)?))).collect();
    assert_eq!(sprayer.len(), 11);
    for (name, keys) in sprayer {
        holds(&[(&format!("what = \"{name}\"{keys}"), Error)]);
    }
}

#[test]
fn nothing_is_judged_of_a_run_that_broke_off() {
    let folder = tempfile::tempdir().expect("a folder");
    let broken = RunRecord { error: Some("no acknowledgement".to_owned()), ..record(folder.path()) };
    let tried = Runs { all: vec![broken], without_faults: None, bless: false };
    let (found, message) = verdict("what = \"exit_code\", equals = 3", &tried, folder.path());
    assert_eq!((found, message.as_str()), (Error, "no acknowledgement"));
    let tried = Runs { all: vec![record(folder.path())], without_faults: None, bless: false };
    let without = "what = \"impacted_total_area_m2\", equals_run_without = \"faults\"";
    assert_eq!(verdict(without, &tried, folder.path()).0, Error);
}

/// Without an encoder the estimate goes by the rig's speed: what it says of a drive at another speed is of another way.
#[test]
fn impacted_areas_of_another_way_are_unknown() {
    use crate::truth::Passed as At;
    let folder = tempfile::tempdir().expect("a folder");
    let driven = |way_m: f64| {
        let mut run = record(folder.path());
        for stream in run.streams.values_mut() {
            stream.estimate =
                stream.estimate.take().map(|told| rowscan_canopy::Estimate { advance_m: Some(10.0), ..told });
            stream.passed = vec![
                At { y_m: 0.0, way_m: 0.0 },
                At { y_m: 10.0, way_m },
                At { y_m: 10.0, way_m: 0.8 * way_m },
            ];
        }
        run
    };
    let bound = "what = \"impacted_total_area_m2\", below = 1";
    // An encoder that never counted: its places are none, and the way is the rig's.
    let mut dead = driven(10.0);
    for stream in dead.streams.values_mut() {
        stream.passed = vec![At { y_m: 0.0, way_m: 0.0 }, At { y_m: 0.0, way_m: 10.0 }];
    }
    let dead = Runs { all: vec![dead], without_faults: None, bless: false };
    assert_eq!(verdict(bound, &dead, folder.path()).0, Passed);
    let without = "what = \"impacted_total_area_m2\", equals_run_without = \"faults\"";
    for (way_m, expect, beside, expected) in [
        (10.0, bound, None, Passed),
        (9.9, bound, None, Passed),
        (9.7, bound, None, Error),
        (5.0, bound, None, Error),
        (10.0, without, Some(10.0), Passed),
        (10.0, without, Some(5.0), Error),
        (5.0, without, Some(10.0), Error),
    ] {
        let tried = Runs { all: vec![driven(way_m)], without_faults: beside.map(driven), bless: false };
        let (found, message) = verdict(expect, &tried, folder.path());
        assert_eq!(found, expected, "{way_m} m, {expect}: {message}");
        assert_eq!(message.contains("constant speed"), expected == Error, "{message}");
    }
}

/// A run without faults of a scenario that has none is the same run.
#[test]
fn nothing_is_compared_with_itself() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("scenario.toml");
    let text = "version = 1\nscene = \"spindle\"\nend = { s = 1 }\ndevice = [{ id = \"left\", model = \"lms111\" }]\n\
        expect = [{ what = \"impacted_total_area_m2\", equals_run_without = \"faults\" }]\n";
    std::fs::write(&path, text).expect("written");
    let scenario = Scenario::load(&path).expect("it loads");
    let runs =
        Runs { all: vec![record(folder.path())], without_faults: Some(record(folder.path())), bless: false };
    let found = judge(&scenario, 0, &scenario.expects[0], &runs);
    assert!(
        found.verdict == Error && found.message.contains("the scenario has no fault"),
        "{}",
        found.message
    );
}
