#![allow(clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

use std::path::Path;

use rowscan_bus::{CanFrame, CanId};
use rowscan_protocol::time::SimTime;

use crate::frames::{BusRecord, Carried};
use crate::judge::tests::{journal, record};
use crate::judge::{Runs, judge};
use crate::output::Match;
use crate::runner::RunRecord;
use crate::scenario::Scenario;
use crate::verdict::Verdict::{self, Error, Failed, Passed};

const MS: u64 = 1_000_000;

const DBC: &str = "VERSION \"\"\n\nNS_ :\n\nBS_:\n\nBU_: A\n\nBO_ 2566852736 Nozzles: 8 A\n SG_ Section1 : 0|2@1+ (1,0) [0|3] \"\" A\n\
    SG_ Rate : 8|8@1+ (0.5,0) [0|125] \"l/min\" A\n\nBA_DEF_ BO_ \"VFrameFormat\" ENUM \"StandardCAN\",\"ExtendedCAN\",\"reserved\",\"J1939PG\";\n\
    BA_ \"VFrameFormat\" BO_ 2566852736 3;\n\nVAL_ 2566852736 Section1 0 \"closed\" 1 \"open\" ;\n";

/// A scenario with these keys of its one expectation; `frames` or why it is refused.
fn scenario(folder: &Path, expect: &str) -> Result<Scenario, String> {
    std::fs::write(folder.join("nozzles.dbc"), DBC).expect("written");
    let faults = ["early", "late"].map(|id| format!("{{ id = \"{id}\", name = \"stall\" }}"));
    let text = format!(
        "version = 1\nscene = \"spindle\"\nend = {{ s = 1 }}\ndevice = [{{ id = \"left\", model = \"lms111\" }}]\n\
         clock = {{ mode = \"lockstep\" }}\nbus = [{{ id = \"can0\", port = \"socketcand:127.0.0.1:0\", dbc = \"nozzles.dbc\" }}]\n\
         nmea = [{{ id = \"gnss\", port = \"tcp:127.0.0.1:0\" }}]\nrun = [{{ id = \"sut\", command = [\"x\"] }}]\n\
         fault = [{}]\nexpect = [{{ what = \"signal\", {expect} }}]\n",
        faults.join(", ")
    );
    let path = folder.join("scenario.toml");
    std::fs::write(&path, text).expect("written");
    Scenario::load(&path).map_err(|error| error.to_string())
}

/// A frame of the nozzles from address 0x21 at `ms`: the section's state and the rate's raw value.
fn nozzles(ms: u64, section: u8, rate: u8) -> Carried {
    let frame = CanFrame::new(CanId::Extended(0x0CFF_1021), &[section, rate, 0xFF]).expect("a frame");
    Carried { at: SimTime(ms * MS), from_others: true, frame }
}

/// Frames each 100 ms: open until the second event at 0.7 s, closed from 0.8 s on.
fn usual() -> Vec<Carried> {
    (0..10).map(|n| nozzles(n * 100, u8::from(n < 8), 20 + n as u8)).collect()
}

fn run(folder: &Path, frames: Vec<Carried>) -> RunRecord {
    let mut run = record(folder);
    run.frames.insert("can0".to_owned(), BusRecord { all: frames, lost: 0 });
    let found = |ms: u64, value: f64| Match { at: SimTime(ms * MS), value: Some(value) };
    run.children.get_mut("sut").expect("there").matches.insert(0, vec![found(200, 1.5), found(600, 2.5)]);
    run.sentences = [(100, "$GPGGA,1,2,N,3,E,4,9*00\r\n"), (600, "$GPGGA,1,2,N,3,E,0,0*00\r\n")]
        .map(|(ms, text)| (SimTime(ms * MS), text.to_owned()))
        .to_vec();
    run
}

fn verdict(expect: &str, frames: Vec<Carried>) -> (Verdict, String) {
    let folder = tempfile::tempdir().expect("a folder");
    let scenario = scenario(folder.path(), expect).unwrap_or_else(|why| panic!("{expect}: {why}"));
    let tried = Runs {
        all: vec![run(folder.path(), frames)],
        without_faults: Some(run(folder.path(), usual())),
        bless: false,
    };
    let judged = judge(&scenario, 0, &scenario.expects[0], &tried);
    (judged.verdict, judged.message)
}

/// Each of these, of the usual frames.
fn holds(cases: &[(&str, Verdict)]) {
    for (expect, expected) in cases {
        let (found, message) = verdict(expect, usual());
        assert_eq!(found, *expected, "{expect}: {message}");
    }
}

const SECTION: &str = "signal = \"can0:Nozzles.Section1\"";

fn section(cases: &[(&str, Verdict)]) {
    for (keys, expected) in cases {
        holds(&[(&format!("{SECTION}, {keys}"), *expected)]);
    }
}

#[test]
fn without_an_event_a_message_before_the_drive_is_in_time_and_seconds_count_from_its_start() {
    let judged = |keys: &str, at_ms: &[u64]| {
        let folder = tempfile::tempdir().expect("a folder");
        let keys = format!("{SECTION}, {keys}");
        let scenario = scenario(folder.path(), &keys).unwrap_or_else(|why| panic!("{keys}: {why}"));
        let frames = at_ms.iter().map(|ms| nozzles(*ms, 0, 20)).collect();
        let mut run = run(folder.path(), frames);
        (run.journal, run.ended) = (Some(journal(Some(9))), SimTime(20_000 * MS));
        let tried = Runs { all: vec![run], without_faults: None, bless: false };
        judge(&scenario, 0, &scenario.expects[0], &tried).verdict
    };
    let comes = [100, 8900, 10_900, 11_100].map(|ms| judged("within_s = 2", &[ms]));
    assert_eq!(comes, [Passed, Passed, Passed, Failed]);
    let is_so = [100, 10_900, 11_100].map(|ms| judged("equals = 0, within_s = 2", &[ms]));
    assert_eq!(is_so, [Passed, Passed, Failed]);
    // What is heard until 9 s after the start of time is no noise of the drive.
    let silent = [8900, 10_900, 11_100].map(|ms| judged("silent = true, within_s = 2", &[ms]));
    assert_eq!(silent, [Passed, Passed, Failed]);
}

#[test]
fn a_value_within_a_time_for_a_time_always_and_never() {
    section(&[
        ("equals = 0, after = \"late\", within_s = 0.15", Passed),
        ("equals = \"closed\", after = \"late\", within_s = 0.15", Passed),
        ("equals = 0, after = \"late\", within_s = 0.05", Failed),
        ("equals = 0, after = \"early\", within_s = 0.3", Failed),
        // It holds already.
        ("equals = 1, after = \"late\", within_s = 0.01", Passed),
        ("equals = 0, after = \"late\", within_s = 5", Passed),
        ("equals = 2, after = \"late\", within_s = 5", Error),
        ("equals = 1, after = \"early\", for_s = 0.6", Passed),
        ("equals = 1, after = \"early\", for_s = 0.75", Failed),
        ("equals = 1, after = \"early\", for_s = 2", Failed),
        ("equals = 0, after = \"late\", within_s = 0.15, for_s = 2", Error),
        ("equals = 0, after = \"late\", within_s = 0.2, for_s = 0.15", Passed),
        ("equals = 0, after = \"late\", within_s = 0.2, for_s = 0.5", Error),
        // It begins too late, or does not last.
        ("equals = 0, after = \"late\", within_s = 0.05, for_s = 0.5", Failed),
        ("equals = 1, after = \"early\", within_s = 0.1, for_s = 0.75", Failed),
        ("equals = 0, after = \"late\"", Failed),
        ("above = -1", Passed),
        ("equals = 0, never = true, after = \"early\"", Failed),
        ("above = 1, never = true", Passed),
    ]);
    holds(&[
        ("signal = \"can0:Nozzles.Rate\", between = [10, 14.5]", Passed),
        ("signal = \"can0:Nozzles.Rate\", between = [10, 14]", Failed),
        ("signal = \"can0\", pgn = 65296, bytes = [1, 1], equals = 27, within_s = 0.75", Passed),
    ]);
}

#[test]
fn changes_silence_and_pace() {
    section(&[
        ("changes = true, after = \"late\", within_s = 0.15", Passed),
        ("changes = true, after = \"late\", within_s = 0.05", Failed),
        ("changes = true, never = true", Failed),
        ("silent = true, after = \"late\"", Failed),
        ("every_s = 0.1", Passed),
        ("every_s = 0.1, tolerance = 0.001", Passed),
        ("every_s = 0.2", Failed),
        ("every_s = 0.1, for_s = 7", Error),
        ("every_s = 0.5, for_s = 0.2", Error),
        // What is decided as false is so, however far the window reaches.
        ("silent = true, after = \"early\", for_s = 7", Failed),
        ("equals = 0, after = \"early\", for_s = 7", Failed),
        ("within_s = 0.05, after = \"late\"", Passed),
    ]);
    let quiet = || usual().into_iter().take(8).collect::<Vec<_>>();
    let of = |keys: &str, frames: Vec<Carried>| verdict(&format!("{SECTION}, {keys}"), frames);
    assert_eq!(of("silent = true, after = \"late\"", quiet()).0, Passed, "the last comes at 0.7 s");
    assert_eq!(of("silent = true, after = \"early\"", quiet()).0, Failed);
    assert_eq!(of("silent = true, after = \"early\", within_s = 0.65", quiet()).0, Passed);
    assert_eq!(of("every_s = 0.1", quiet()).0, Failed, "it stops at 0.7 s");
    let mut uneven = usual();
    uneven[5].at.0 += 20 * MS;
    assert_eq!(of("every_s = 0.1, tolerance = 0.025", uneven.clone()).0, Passed);
    let (found, message) = of("every_s = 0.1", uneven);
    assert_eq!(
        (found, message.contains("0.1200 s between 0.4000 s and 0.5200 s")),
        (Failed, true),
        "{message}"
    );
}

#[test]
fn what_was_never_heard_is_no_verdict() {
    let of = |keys: &str| verdict(&format!("{SECTION}, {keys}"), Vec::new()).0;
    for keys in [
        "equals = 0",
        "equals = 0, never = true",
        "silent = true",
        "changes = true, never = true",
        "equals_run_without = \"faults\"",
    ] {
        assert_eq!(of(keys), Error, "{keys}");
    }
    // What must come and does not has failed.
    assert_eq!(
        (of("equals = 0, within_s = 0.5"), of("within_s = 0.5"), of("every_s = 0.1")),
        (Failed, Failed, Failed)
    );
}

/// A value that is said again each tenth of a second is known from its first one on; so far as its longest pause goes, a window may begin before.
#[test]
fn what_was_not_heard_yet_is_unknown() {
    let late = |first: u64| (first..10).map(|n| nozzles(n * 100, 1, 20)).collect::<Vec<_>>();
    let of = |keys: &str, first: u64| verdict(&format!("{SECTION}, {keys}"), late(first));
    for keys in
        ["equals = 1", "equals = 1, for_s = 0.8", "equals = 0, never = true", "changes = true, never = true"]
    {
        assert_eq!([0, 1].map(|first| of(keys, first).0), [Passed; 2], "{keys}");
        let (found, message) = of(keys, 5);
        assert_eq!((found, message.contains("heard first at 0.500 s")), (Error, true), "{keys}: {message}");
        assert_eq!(
            of(&format!("{keys}, after = \"late\""), 5).0,
            if keys.contains("for_s") { Error } else { Passed }
        );
        // One that was said once.
        assert_eq!(verdict(&format!("{SECTION}, {keys}"), vec![nozzles(300, 1, 20)]).0, Error, "{keys}");
    }
    // What is wrong once has failed, and what may come in time need not be known before.
    assert_eq!(of("equals = 0", 5).0, Failed);
    assert_eq!(
        (of("equals = 1, never = true", 5).0, of("equals = 1, within_s = 0.6", 5).0),
        (Failed, Passed)
    );
}

#[test]
fn not_available_is_no_value() {
    let frames = || vec![nozzles(0, 1, 20), nozzles(500, 3, 20)];
    let of = |keys: &str| verdict(&format!("{SECTION}, {keys}"), frames()).0;
    assert_eq!(
        (of("equals = 1"), of("changes = true"), of("changes = true, never = true")),
        (Failed, Passed, Failed)
    );
    // Nobody knows what it is meanwhile; what it was before and must not be is known.
    assert_eq!((of("above = 1, never = true"), of("above = 0, never = true")), (Error, Failed));
    let of =
        |keys: &str| verdict(&format!("{SECTION}, {keys}"), vec![nozzles(0, 3, 20), nozzles(500, 3, 20)]).0;
    assert_eq!((of("above = 1, never = true"), of("changes = true, never = true")), (Error, Error));
}

#[test]
fn a_run_without_faults_is_the_measure() {
    let of = |keys: &str, frames: Vec<Carried>| {
        verdict(&format!("{SECTION}, equals_run_without = \"faults\"{keys}"), frames).0
    };
    let late = || {
        usual()
            .into_iter()
            .map(|frame| Carried { at: SimTime(frame.at.0 + 30 * MS), ..frame })
            .collect::<Vec<_>>()
    };
    assert_eq!(
        (of("", usual()), of("", late()), of(", within_s = 0.05", late()), of(", within_s = 0.02", late())),
        (Passed, Passed, Passed, Failed)
    );
    let mut other = usual();
    other[3] = nozzles(300, 0, 23);
    assert_eq!(of("", other), Failed);
}

#[test]
fn sentences_and_logs_tell_numbers() {
    holds(&[
        ("signal = \"gnss:GGA.6\", equals = 0, after = \"early\", within_s = 0.55", Passed),
        ("signal = \"gnss:GGA.6\", equals = 0, after = \"early\", within_s = 0.4", Failed),
        ("signal = \"gnss:VTG.6\", equals = 0", Error),
        ("signal = \"sut\", matches = \"rate ([0-9.]+)\", above = 2, within_s = 0.65", Passed),
        ("signal = \"sut\", matches = \"rate ([0-9.]+)\", above = 2", Failed),
    ]);
}

#[test]
fn what_names_no_signal_is_refused_with_what_is_there() {
    let folder = tempfile::tempdir().expect("a folder");
    let why = |keys: &str| scenario(folder.path(), keys).map(|_| ()).expect_err(keys);
    for (keys, part) in [
        ("signal = \"can0:Nozzles.Sektion1\", equals = 0", "did you mean `Section1`"),
        ("signal = \"can1:Nozzles.Section1\", equals = 0", "did you mean `can0`"),
        ("signal = \"can0:Nozzles.Section1\", equals = \"ajar\"", "no value is called \"ajar\""),
        ("signal = \"can0:Nozzles.Rate\", equals = \"full\"", "names no value"),
        ("signal = \"can0:Nozzles.Section1\"", "expects nothing yet"),
        ("signal = \"can0:Nozzles.Section1\", equals = 0, silent = true", "two expectations"),
        ("signal = \"can0:Nozzles.Section1\", never = true", "`never` goes with"),
        ("signal = \"can0\", bytes = [0, 1], equals = 0", "add `pgn`"),
        ("signal = \"can0\", above = 0", "has no value to be bound"),
        ("signal = \"can0\", pgn = 65296, above = 0", "has no value to be bound"),
        ("signal = \"can0\", pgn = 419373095, within_s = 1", "up to 0x3FFFF, found 0x18FF2027"),
        ("signal = \"can0:Nozzles.Rate\", matches = \"3\", above = 0", "`can0` is none"),
        ("signal = \"gnss:GGA.6\", matches = \"3\", above = 0", "`gnss` is none"),
        ("signal = \"can0\", pgn = 65296, bytes = [0, 9], equals = 0", "1 to 8 bytes"),
        ("signal = \"gnss:GGA\", equals = 0", "gnss:GGA.6"),
        ("signal = \"sut\", equals = 0", "add `matches`"),
        ("equals = 0", "add `signal`"),
    ] {
        let found = why(keys);
        assert!(found.contains(part), "{keys}: {found}");
    }
    std::fs::write(folder.path().join("broken.dbc"), "BO_ nonsense").expect("written");
    let text = std::fs::read_to_string(folder.path().join("scenario.toml"))
        .expect("there")
        .replace("nozzles.dbc", "broken.dbc");
    std::fs::write(
        folder.path().join("other.toml"),
        text.replace("equals = 0", "signal = \"can0:Nozzles.Section1\", equals = 0"),
    )
    .expect("written");
    let found =
        Scenario::load(&folder.path().join("other.toml")).map(|_| ()).expect_err("broken").to_string();
    assert!(found.contains("broken.dbc: line 1: expected a DBC file"), "{found}");
}

#[test]
fn the_load_of_a_bus_is_that_of_its_fullest_second() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut scenario = scenario(folder.path(), &format!("{SECTION}, equals = 0")).expect("sound");
    let bus_load = crate::what::by_name("bus_load").expect("known");
    let mut of = |below: f64, frames: Vec<Carried>| {
        let expect = &mut scenario.expects[0];
        expect.what = bus_load;
        expect.bounds = crate::scenario::Bounds { below: Some(below), ..Default::default() };
        let expect = expect.clone();
        judge(
            &scenario,
            0,
            &expect,
            &Runs { all: vec![run(folder.path(), frames)], without_faults: None, bless: false },
        )
        .verdict
    };
    // 10 frames of 3 bytes in a second: at most 110 bits each, 0.0044 of 250 kbit/s.
    assert_eq!((of(0.005, usual()), of(0.004, usual()), of(0.5, Vec::new())), (Passed, Failed, Error));
}

#[test]
fn a_failed_verdict_shows_its_signal() {
    let folder = tempfile::tempdir().expect("a folder");
    let scenario = scenario(folder.path(), &format!("{SECTION}, equals = 1")).expect("sound");
    let run = run(folder.path(), usual());
    let expect = &scenario.expects[0];
    let judged = super::judge(0, expect, &run, None).expect("judged");
    let path = super::picture(0, expect, &judged, &run).expect("drawn");
    let svg = std::fs::read_to_string(path).expect("there");
    // Its title, an event, and eight times open before it closes.
    assert!(svg.contains("can0:Nozzles.Section1") && svg.contains(">late<"), "{svg}");
    assert_eq!(svg.matches("<circle").count(), 10);
}

#[test]
fn a_time_out_that_was_rounded_up_is_in_time_and_no_later_one_is() {
    // The section closes 100 ms after the second event, and so much later.
    let closing = |late_ns: u64| {
        let mut frames = usual();
        let closed = frames.get_mut(8).expect("the first that says so");
        closed.at = SimTime(closed.at.0 + late_ns);
        verdict(
            "signal = \"can0:Nozzles.Section1\", equals = \"closed\", after = \"late\", within_s = 0.1",
            frames,
        )
        .0
    };
    assert_eq!([0, 1, 1000, 1001, 1_000_000].map(closing), [Passed, Passed, Passed, Failed, Failed]);
}
