//! What is judged of a sprayer.

use rowscan_sprayer::{Boom, Command, Drive, Pass, Target};

use super::*;
use crate::sprayer::SprayerRun;

const MS: u64 = 1_000_000;

/// A sprayer of one section that drove past 5 m of leaf, from 2 to 7 m at 1 m/s, with nozzles beside the scanner, and heard these commands.
pub(super) fn sprayed(commands: &[(f64, f64)]) -> SprayerRun {
    sprayed_past(1.0, commands)
}

/// The same past a leaf whose lower edge is so high: the section reaches from 1 to 2 m.
pub(super) fn sprayed_past(low_m: f64, commands: &[(f64, f64)]) -> SprayerRun {
    sprayed_until(10_000, low_m, commands)
}

/// The same of a run of so many milliseconds, at 1 m/s.
fn sprayed_until(end_ms: u64, low_m: f64, commands: &[(f64, f64)]) -> SprayerRun {
    let boom = "version = 1\noffset_y_m = 0\nstrip_m = 0\n[valve]\non_ms = 0\noff_ms = 0\nrise_ms = 0\nfall_ms = 0\n\
        [[section]]\nid = \"a\"\nside = \"right\"\nz_from_m = 1\nz_to_m = 2\n";
    let top_m = low_m + 1.0;
    let corners = [[0.0, 2.0, low_m], [0.0, 7.0, low_m], [0.0, 7.0, top_m], [0.0, 2.0, top_m]];
    let leaf = rowscan_scenes::Leaf::new(corners).expect("a leaf");
    let orchard = rowscan_scenes::Orchard::from_organs(vec![leaf], Vec::new(), f64::INFINITY);
    let tractor = rowscan_vehicle::Tractor::new(rowscan_vehicle::trajectory::Trajectory::straight(0.0, 1.0));
    tractor.begin(SimTime::ZERO);
    let drive = Drive::of(|at| tractor.motion(at), SimTime::ZERO, SimTime(end_ms * MS));
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
        // They are that already: it says nothing of what follows.
        ("what = \"valves\", all = \"open\", after = \"early\", within_s = 1", Error),
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

/// A host that pauses takes no time in lockstep: nothing is known of how soon the valves shut then, whether they were open or not.
#[test]
fn how_soon_it_was_safe_is_unknown_of_an_event_without_time() {
    let folder = tempfile::tempdir().expect("a folder");
    let judged = |until_s: f64| {
        let sprayer = Some(Ok(sprayed_past(1.0, &[(2.0, 1.0), (4.5, 0.0)])));
        let events = vec![event("cut", 4.0), event("cut.end", until_s)];
        let run = RunRecord { sprayer, ended: SimTime(10 * SECOND), events, ..record(folder.path()) };
        let expect = "what = \"time_to_safe_s\", after = \"cut\", below = 1";
        verdict(expect, &Runs { all: vec![run], without_faults: None, bless: false }, folder.path())
    };
    let (found, message) = judged(4.0);
    assert!(found == Error && message.contains("no simulated time passed from cut"), "{message}");
    assert_eq!(judged(6.0).0, Passed);
}

/// No edge can be missed where none is wanted; one for nothing can be.
#[test]
fn missed_edges_are_unknown_where_none_was_wanted() {
    let folder = tempfile::tempdir().expect("a folder");
    let judged = |expect: &str, low_m: f64, commands: &[(f64, f64)]| {
        let sprayer = Some(Ok(sprayed_past(low_m, commands)));
        let run = RunRecord { sprayer, ended: SimTime(10 * SECOND), ..record(folder.path()) };
        verdict(expect, &Runs { all: vec![run], without_faults: None, bless: false }, folder.path())
    };
    let (shut, opens) = ([(0.0, 0.0)], [(2.0, 1.0), (7.0, 0.0)]);
    let missed = "what = \"edges\", of = \"missed\", equals = 0";
    assert_eq!(judged(missed, 1.0, &opens).0, Passed);
    for commands in [&shut[..], &opens] {
        let (found, message) = judged(missed, 5.0, commands);
        assert!(found == Error && message.contains("no edge was wanted"), "{message}");
    }
    for both in ["what = \"edges\", equals = 0", "what = \"edges\", of = \"spurious\", equals = 0"] {
        assert_eq!(judged(both, 5.0, &shut).0, Passed, "{both}");
        assert_eq!(judged(both, 5.0, &opens).0, Failed, "{both}");
    }
    // The run ends where the leaf begins: whether its edge came is not known.
    let cut_off = RunRecord {
        sprayer: Some(Ok(sprayed_until(2200, 1.0, &shut))),
        ended: SimTime(2200 * MS),
        ..record(folder.path())
    };
    let cut_off = Runs { all: vec![cut_off], without_faults: None, bless: false };
    for expect in ["what = \"edges\", equals = 0", "what = \"edges\", below = 9, edge = \"open\""] {
        let (found, message) = verdict(expect, &cut_off, folder.path());
        assert!(found == Error && message.contains("could be met"), "{expect}: {message}");
    }
}

#[test]
fn an_edge_at_fault_is_told_with_its_section_its_time_and_its_place() {
    let folder = tempfile::tempdir().expect("a folder");
    let told = |expect: &str, commands: &[(f64, f64)]| {
        let sprayer = Some(Ok(sprayed(commands)));
        let run = RunRecord { sprayer, ended: SimTime(10 * SECOND), ..record(folder.path()) };
        verdict(expect, &Runs { all: vec![run], without_faults: None, bless: false }, folder.path())
    };
    let late = [(2.4, 1.0), (7.4, 0.0)];
    let twice = [(2.0, 1.0), (4.0, 0.0), (5.0, 1.0), (7.0, 0.0)];
    for (expect, commands, first) in [
        (
            "what = \"edges\", equals = 0",
            [(0.0, 0.0)].as_slice(),
            "did not open at 2.000 s, the tractor at 2.00 m",
        ),
        (
            "what = \"edges\", edge = \"close\", equals = 0",
            &[(0.0, 0.0)],
            "was shut already, since the start, when it was to close at 7.000 s, the tractor at 7.00 m",
        ),
        (
            "what = \"latency_error_m\", p95_below = 0.39",
            &[(0.5, 1.0)],
            "was open already, since 0.500 s, when it was to open at 2.000 s, the tractor at 2.00 m",
        ),
        (
            "what = \"edges\", of = \"missed\", edge = \"close\", equals = 0",
            &[(0.5, 1.0)],
            "did not close at 7.000 s, the tractor at 7.00 m",
        ),
        (
            "what = \"edges\", of = \"spurious\", equals = 0",
            &twice,
            "closed for nothing at 4.000 s, the tractor at 4.00 m",
        ),
        (
            "what = \"latency_error_m\", p95_below = 0.39",
            &late,
            "opened 0.400 m too late, due at 2.000 s, the tractor at 2.00 m",
        ),
    ] {
        let (found, message) = told(expect, commands);
        assert_eq!(found, Failed, "{message}");
        let first = format!("the first: section \"a\" {first}");
        assert!(message.ends_with(&first), "{message}");
    }
    // What passes names none.
    let (found, message) = told("what = \"edges\", equals = 0", &late);
    assert!(found == Passed && !message.contains("the first"), "{message}");
}

#[test]
fn a_rule_that_held_no_longer_than_within_s_is_told_with_how_long_it_held() {
    let folder = tempfile::tempdir().expect("a folder");
    // Open all the time, past 2 m that must not be sprayed, at 1 m/s; the drive never stands.
    let told = |of: &str, within_s: f64| {
        let open = sprayed(&[(0.0, 1.0)]);
        let zone = rowscan_sprayer::boom::Zone { y_from_m: 3.0, y_to_m: 5.0, side: None };
        let boom = Boom { no_spray: vec![zone], ..open.pass.boom().clone() };
        let orchard = rowscan_scenes::Orchard::from_organs(Vec::new(), Vec::new(), f64::INFINITY);
        let pass = Pass::new(boom, &orchard, open.pass.drive().clone(), 1);
        let sprayer = Some(Ok(SprayerRun::judged(pass, open.log, orchard.into())));
        let run = RunRecord { sprayer, ended: SimTime(10 * SECOND), ..record(folder.path()) };
        let expect =
            format!("what = \"forbidden_litres\", of = \"{of}\", within_s = {within_s}, below = 0.001");
        verdict(&expect, &Runs { all: vec![run], without_faults: None, bless: false }, folder.path())
    };
    for (of, within_s, found, words) in [
        ("no_spray", 1.0, Failed, "in 1.000 s"),
        ("no_spray", 2.0, Error, "it forbade spraying for 2.000 s, and `within_s` is 2 s; lower it"),
        ("no_spray", 3.0, Error, "it forbade spraying for 2.000 s, and `within_s` is 3 s; lower it"),
        ("reverse", 3.0, Error, "it never forbade spraying in this run"),
    ] {
        let (verdict, message) = told(of, within_s);
        assert!(verdict == found && message.contains(words), "{of}, {within_s} s: {verdict:?}, {message}");
    }
}

#[test]
fn a_rate_is_judged_beside_the_speed_and_reported_litres_beside_the_true_ones() {
    let folder = tempfile::tempdir().expect("a folder");
    let told = |expect: &str, at_m_s: f64, reports: &[(f64, f64)], commands: &[(f64, f64)]| {
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
        verdict(expect, &Runs { all: vec![run], without_faults: None, bless: false }, folder.path())
    };
    let judged_of = |expect: &str, at_m_s: f64, reports: &[(f64, f64)], commands: &[(f64, f64)]| {
        told(expect, at_m_s, reports, commands).0
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
    // A step after which the rate had not settled has taken longer than any number.
    let expect = "what = \"rate_error\", of = \"settling_s\", below = 99";
    let (found, message) = told(expect, 1.25, &[], &[(2.0, 1.0), (7.0, 0.0)]);
    assert!(found == Failed && message.contains("found not settled;"), "{message}");
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
    use rowscan_settings::fault_table::sprayer::SprayerFault;
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
    let held = vec![Trouble { fault: SprayerFault::HeldShut, from: 4.6, to: Some(5.2) }];
    // A litre a minute, from 4 to 5.2 s: 20 ml.
    for (expect, troubles, found) in [
        ("of = \"master\", between = [0.01999, 0.02001]", off(4.0, Some(5.2)), Passed),
        ("of = \"master\", below = 0.0199", off(4.0, Some(5.2)), Failed),
        ("between = [0.01999, 0.02001]", off(4.0, Some(5.2)), Passed),
        // Two rules that overlap spill it once.
        ("between = [0.01999, 0.02001]", [off(4.0, Some(5.2)), held.clone()].concat(), Passed),
        ("of = \"override\", between = [0.00999, 0.01001]", held, Passed),
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
