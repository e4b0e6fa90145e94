#![allow(clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

use std::collections::BTreeMap;
use std::path::Path;
use std::time::Duration;

use rowscan_sprayer::{Boom, Command, Drive, Pass, Target};

use super::*;
use crate::jitter::Jitter;
use crate::output::Match;
use crate::runner::ChildRecord;
use crate::sprayer::SprayerRun;
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

#[test]
fn measures() {
    holds(&[
        ("what = \"impacted_total_area_m2\", below = 1", Passed),
        ("what = \"impacted_total_area_m2\", above = 1", Failed),
        ("what = \"impacted_total_area_m2\", equals_run_without = \"faults\"", Passed),
        ("what = \"impacted_total_area_m2\", on = \"right\", above = 0", Error),
        // No truth is known here: unknown holds nothing.
        ("what = \"leaf_area_error\", abs_below = 1000", Failed),
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

/// A sprayer of one section that drove past 5 m of leaf, from 2 to 7 m at 1 m/s, with nozzles beside the scanner, and heard these commands.
fn sprayed(commands: &[(f64, f64)]) -> SprayerRun {
    let boom = "version = 1\noffset_y_m = 0\nstrip_m = 0\n[valve]\non_ms = 0\noff_ms = 0\nrise_ms = 0\nfall_ms = 0\n\
        [[section]]\nid = \"a\"\nside = \"right\"\nz_from_m = 1\nz_to_m = 2\n";
    let corners = [[0.0, 2.0, 1.0], [0.0, 7.0, 1.0], [0.0, 7.0, 2.0], [0.0, 2.0, 2.0]];
    let leaf = rowscan_scenes::Leaf::new(corners).expect("a leaf");
    let orchard = rowscan_scenes::Orchard::from_organs(vec![leaf], Vec::new(), f64::INFINITY);
    let tractor = rowscan_vehicle::Tractor::new(rowscan_vehicle::trajectory::Trajectory::straight(0.0, 1.0));
    tractor.begin(SimTime::ZERO);
    let drive = Drive::of(|at| tractor.motion(at), SimTime::ZERO, SimTime(10 * SECOND));
    let command = |(at_s, duty): &(f64, f64)| Command {
        at: SimTime((at_s * 1e9) as u64),
        target: Target::All,
        duty: *duty,
    };
    let pass = Pass::new(Boom::read(boom).expect("a boom"), &orchard, drive, 1);
    SprayerRun::judged(pass, commands.iter().map(command).collect(), orchard.into())
}

#[test]
fn a_sprayer_is_judged_by_its_commands_and_unknown_without_any() {
    let folder = tempfile::tempdir().expect("a folder");
    let judged = |expect: &str, commands: &[(f64, f64)]| {
        let run = RunRecord {
            sprayer: Some(Ok(sprayed(commands))),
            ended: SimTime(10 * SECOND),
            events: vec![event("early", 6.0), event("end", 10.0)],
            ..record(folder.path())
        };
        verdict(expect, &Runs { all: vec![run], without_faults: None, bless: false }, folder.path()).0
    };
    // 0.4 s late on, 0.4 s late off: 4.6 of 5 m, and 0.4 of 5 s for nothing.
    let late = [(2.4, 1.0), (7.4, 0.0)];
    for (expect, found) in [
        ("what = \"recall\", between = [0.9199, 0.9201]", Passed),
        ("what = \"recall\", above = 0.93", Failed),
        ("what = \"waste\", between = [0.0799, 0.0801]", Passed),
        ("what = \"waste\", below = 0.07", Failed),
        // One litre a minute for 5 s less than for 10 s.
        ("what = \"saved_litres\", between = [0.0833, 0.0834]", Passed),
        ("what = \"latency_error_m\", edge = \"open\", p95_below = 0.41", Passed),
        ("what = \"latency_error_m\", edge = \"close\", p95_below = 0.39", Failed),
        // From 1.5 m before a wall of 1 m less than half of the fan is on it; 0.4 s of 5 meet a gap.
        ("what = \"off_target_share\", between = [0.5, 0.6]", Passed),
        ("what = \"off_target_share\", below = 0.5", Failed),
        ("what = \"edges\", equals = 0", Passed),
        ("what = \"valves\", all = \"open\", after = \"early\"", Passed),
        ("what = \"valves\", all = \"closed\", after = \"early\", within_s = 1.5", Passed),
        ("what = \"valves\", all = \"closed\", after = \"early\", within_s = 1.3", Failed),
        ("what = \"valves\", all = \"closed\", after = \"early\", within_s = 9", Error),
        ("what = \"time_to_safe_s\", after = \"early\", between = [1.399, 1.401]", Passed),
        ("what = \"time_to_safe_s\", after = \"early\", below = 1.3", Failed),
    ] {
        assert_eq!(judged(expect, &late), found, "{expect}");
        assert_eq!(judged(expect, &[]), Error, "{expect}: no command was ever heard");
    }
    // Shut when it came, and to the end: there was nothing to make safe.
    assert_eq!(
        judged("what = \"time_to_safe_s\", after = \"early\", below = 9", &[(2.4, 1.0), (5.0, 0.0)]),
        Error
    );
    assert_eq!(
        judged("what = \"time_to_safe_s\", after = \"early\", below = 9", &[(6.5, 1.0), (7.4, 0.0)]),
        Passed
    );
    // One that is never shut, and one that is told to stay shut.
    assert_eq!(judged("what = \"time_to_safe_s\", after = \"early\", below = 99", &[(0.0, 1.0)]), Failed);
    assert_eq!(judged("what = \"edges\", of = \"missed\", equals = 2", &[(0.0, 0.0)]), Passed);
    assert_eq!(judged("what = \"recall\", above = 0.1", &[(0.0, 0.0)]), Failed);
    assert_eq!(judged("what = \"waste\", below = 0.1", &[(0.0, 0.0)]), Error);
    assert_eq!(judged("what = \"latency_error_m\", p95_below = 1e9", &[(0.0, 0.0)]), Failed);
}

#[test]
fn a_rate_is_judged_beside_the_speed_and_reported_litres_beside_the_true_ones() {
    let folder = tempfile::tempdir().expect("a folder");
    let judged_of = |expect: &str, at_m_s: f64, reports: &[(f64, f64)], commands: &[(f64, f64)]| {
        let mut sprayer = sprayed(commands);
        let boom = Boom {
            rate: (at_m_s > 0.0).then_some(rowscan_sprayer::hydraulics::RateTable {
                at_m_s,
                window_s: 0.1,
                band: 0.1,
            }),
            ..sprayer.pass.boom().clone()
        };
        let orchard = rowscan_scenes::Orchard::from_organs(Vec::new(), Vec::new(), f64::INFINITY);
        let pass = Pass::new(boom, &orchard, sprayer.pass.drive().clone(), 1);
        sprayer = SprayerRun::judged(pass, sprayer.log, orchard.into());
        sprayer.reports = reports.to_vec();
        let run = RunRecord {
            sprayer: Some(Ok(sprayer)),
            ended: SimTime(10 * SECOND),
            events: vec![event("late", 8.0), event("end", 10.0)],
            ..record(folder.path())
        };
        verdict(expect, &Runs { all: vec![run], without_faults: None, bless: false }, folder.path()).0
    };
    let judged = |expect: &str, at_m_s: f64, reports: &[(f64, f64)]| {
        judged_of(expect, at_m_s, reports, &[(2.0, 1.0), (7.0, 0.0)])
    };
    // At 1 m/s, one litre a minute is right at 1 m/s and 25 % too much where it was meant for 1.25 m/s.
    for (expect, at_m_s, found) in [
        ("what = \"rate_error\", below = 0.01", 1.0, Passed),
        ("what = \"rate_error\", below = 0.2", 1.25, Failed),
        ("what = \"rate_error\", of = \"mean\", between = [0.2499, 0.2501]", 1.25, Passed),
        ("what = \"rate_error\", of = \"mean\", abs_below = 0.01", 0.8, Failed),
        ("what = \"rate_error\", of = \"settling_s\", below = 0.2", 1.0, Passed),
        ("what = \"rate_error\", of = \"settling_s\", below = 99", 1.25, Failed),
        ("what = \"rate_error\", of = \"overshoot\", below = 0.01", 1.0, Passed),
        ("what = \"rate_error\", after = \"late\", below = 1", 1.0, Error),
        ("what = \"rate_error\", below = 1", 0.0, Error),
        ("what = \"rate_error\", of = \"reported\", below = 1", 1.0, Error),
    ] {
        assert_eq!(judged(expect, at_m_s, &[]), found, "{expect}, {at_m_s}");
    }
    // No step comes behind the one at 2 s: 8 s later, when the run ends, the rate has not settled. Less than 8 s is wrong, and less than 99 s unknown.
    for (below, found) in [("7", Failed), ("99", Error)] {
        let expect = format!("what = \"rate_error\", of = \"settling_s\", below = {below}");
        assert_eq!(judged_of(&expect, 1.25, &[], &[(2.0, 1.0)]), found, "{expect}");
    }
    // Valves that nobody opens have no step.
    assert_eq!(
        judged_of("what = \"rate_error\", of = \"settling_s\", below = 99", 1.0, &[], &[(2.0, 0.0)]),
        Error
    );
    // A litre a minute for 5 s are 83 ml; the meter says 4 % more.
    let reports = [(1.0, 5.0), (4.0, 5.04), (9.0, 5.0 + 1.04 / 12.0)];
    let reported = "what = \"rate_error\", of = \"reported\"";
    assert_eq!(judged(&format!("{reported}, between = [0.0399, 0.0401]"), 1.0, &reports), Passed);
    assert_eq!(judged(&format!("{reported}, abs_below = 0.03"), 1.0, &reports), Failed);
    assert_eq!(judged(&format!("{reported}, below = 1"), 1.0, &reports[..1]), Error);
}

#[test]
fn litres_are_counted_while_a_switch_forbids_them() {
    use rowscan_fault_table::sprayer::SprayerFault;
    use rowscan_sprayer::{Trouble, Troubles};

    let folder = tempfile::tempdir().expect("a folder");
    let judged = |expect: &str, troubles: Vec<Trouble>| {
        let SprayerRun { pass, log, .. } = sprayed(&[(2.0, 1.0), (7.0, 0.0)]);
        let bare = rowscan_scenes::Orchard::from_organs(Vec::new(), Vec::new(), f64::INFINITY);
        let sprayer = SprayerRun::judged(pass.with_troubles(Troubles(troubles)), log, bare.into());
        let run = RunRecord {
            sprayer: Some(Ok(sprayer)),
            ended: SimTime(10 * SECOND),
            events: vec![event("end", 10.0)],
            ..record(folder.path())
        };
        verdict(expect, &Runs { all: vec![run], without_faults: None, bless: false }, folder.path()).0
    };
    let off = |from, to| vec![Trouble { fault: SprayerFault::MasterOff, from, to }];
    // A litre a minute, from 4 to 5.2 s: 20 ml.
    for (expect, troubles, found) in [
        ("of = \"master\", between = [0.01999, 0.02001]", off(4.0, Some(5.2)), Passed),
        ("of = \"master\", below = 0.0199", off(4.0, Some(5.2)), Failed),
        ("between = [0.01999, 0.02001]", off(4.0, Some(5.2)), Passed),
        // Half a second to shut is allowed; then 0.7 s are left.
        ("of = \"master\", within_s = 0.5, between = [0.01166, 0.01167]", off(4.0, Some(5.2)), Passed),
        // Shut for its whole time.
        ("of = \"master\", below = 1e-9", off(7.5, None), Passed),
        // Rules that never held say nothing.
        ("of = \"override\", below = 1", off(4.0, None), Error),
        ("of = \"master\", below = 1", Vec::new(), Error),
        ("below = 1e-9", Vec::new(), Error),
    ] {
        assert_eq!(judged(&format!("what = \"forbidden_litres\", {expect}"), troubles), found, "{expect}");
    }
}
