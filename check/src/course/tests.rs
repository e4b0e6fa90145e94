#![allow(clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

use std::path::Path;

use super::*;
use crate::judge::tests::record;
use crate::runner::ChildRecord;
use crate::verdict::Verdict;
use crate::witness::Unheard;

fn scenario(folder: &Path, faults: &str, expects: &str) -> Scenario {
    let text = format!(
        "version = 1\nscene = \"spindle\"\nend = {{ row_m = 3 }}\ndevice = [{{ id = \"left\", model = \"lms111\" }}]\n\
         run = [{{ id = \"sut\", command = [\"x\"] }}, {{ id = \"other\", command = [\"x\"] }}]\n\
         fault = [{faults}]\nexpect = [{expects}]\n"
    );
    let path = folder.join("scenario.toml");
    std::fs::write(&path, text).expect("written");
    Scenario::load(&path).unwrap_or_else(|error| panic!("{faults} {expects}: {error}"))
}

/// What is told of a run with the events `early` and `late`, changed by `change`.
fn told(faults: &str, expects: &str, change: impl Fn(&mut RunRecord)) -> Vec<(String, String)> {
    let folder = tempfile::tempdir().expect("a folder");
    let scenario = scenario(folder.path(), faults, expects);
    let mut run = record(folder.path());
    change(&mut run);
    let shortfalls = shortfalls(&scenario, &Runs { all: vec![run], without_faults: None, bless: false });
    assert!(shortfalls.iter().all(|shortfall| shortfall.judged.verdict == Verdict::Error));
    shortfalls.into_iter().map(|shortfall| (shortfall.name, shortfall.judged.message)).collect()
}

const NONE_LOST: &str = "{ what = \"scans_lost\", equals = 0 }";

#[test]
fn a_fault_that_never_began_is_told_unless_that_is_expected() {
    let early = "{ id = \"early\", name = \"stall\" }, ";
    let never = |at: &str| format!("{early}{{ id = \"never\", name = \"drop\", {at} }}");
    let short = |faults: &str, expects: &str| told(faults, expects, |_| {});
    assert_eq!(short(early, NONE_LOST), []);
    for (at, before) in [
        ("at = { scan = 100 }", "scan 100 of a connection"),
        ("at = { row_m = 2.5 }", "row 2.5 m"),
        ("at = { s = 9 }", "9 s"),
        ("at = { tree = 4 }", "tree 4"),
        ("at = { after = \"early.end\", plus_s = 2 }", "`early.end` and 2 s more"),
    ] {
        let message = format!(
            "fault `never` never began: the run ended at 1.000 s, before {before}; move `end` or `at`, or expect `fault_acts` of `never` to equal 0"
        );
        assert_eq!(short(&never(at), NONE_LOST), [("fault never begins".to_owned(), message)]);
    }
    let never = never("at = { scan = 100 }");
    let acts = |of: &str, bound: &str| {
        short(&never, &format!("{{ what = \"fault_acts\", of = \"{of}\", {bound} }}")).len()
    };
    assert_eq!((acts("never", "equals = 0"), acts("never", "below = 1")), (0, 0));
    assert_eq!(
        (acts("never", "below = 5"), acts("never", "equals = 1"), acts("early", "equals = 0")),
        (1, 1, 1)
    );
    // Its dice may say no.
    assert_eq!(short(&never.replace("100 }", "100 }, p = 0.1"), NONE_LOST), []);
    // Why a run broke off is told by every expectation.
    assert_eq!(told(&never, NONE_LOST, |run| run.error = Some("no acknowledgement".to_owned())), []);
}

#[test]
fn a_run_at_whose_end_nobody_listens_is_told_unless_that_is_expected() {
    let silent = |seconds: u64| {
        move |run: &mut RunRecord| {
            let at_end = std::time::Duration::from_secs(seconds);
            run.streams.get_mut("left").expect("there").unheard = Some(Unheard { all: at_end, at_end });
        }
    };
    let message = "the run ended at 1.000 s without a taker: nobody had taken scans of `left` for 2.000 s; expect its `unheard_s` if that is right";
    assert_eq!(
        told("", NONE_LOST, silent(2)),
        [("somebody listens at the end".to_owned(), message.to_owned())]
    );
    assert_eq!(told("", NONE_LOST, silent(0)), []);
    assert_eq!(told("", "{ what = \"unheard_s\", equals = 2 }", silent(2)), []);
}

#[test]
fn a_client_that_reads_nothing_is_told_unless_its_exit_is_expected() {
    let unread = |run: &mut RunRecord| run.unread = [("left".to_owned(), 40_000)].into();
    let message = "the run ended at 1.000 s with 40000 bytes of `left` unread, a second of scans and more: its client reads no more, or slower than scans come; \
                   let it read them, or hang up";
    let expected = [("somebody listens at the end".to_owned(), message.to_owned())];
    assert_eq!(told("", NONE_LOST, unread), expected);
    assert_eq!(told("", "{ what = \"unheard_s\", equals = 0 }", unread), expected, "it has asked for them");
    let left = |run: &mut RunRecord| {
        unread(run);
        run.left = Some("sut".to_owned());
        run.children.insert("sut".to_owned(), ChildRecord { exit_code: Some(0), ..ChildRecord::default() });
    };
    assert_eq!(told("", "{ what = \"exit_code\", of = \"sut\", equals = 0 }", left), []);
}

#[test]
fn a_run_that_its_last_child_ended_is_told_unless_its_exit_is_expected() {
    let left = |run: &mut RunRecord| {
        run.left = Some("sut".to_owned());
        run.children.insert("sut".to_owned(), ChildRecord { exit_code: Some(0), ..ChildRecord::default() });
    };
    let message = "the run ended at 1.000 s, before its end, row 3 m: `sut` had left with code 0";
    let expected = (
        "the end is reached".to_owned(),
        format!("{message}; move `end`, or expect the `exit_code` of `sut`"),
    );
    let expected = [expected];
    assert_eq!(told("", NONE_LOST, left), expected);
    assert_eq!(told("", "{ what = \"exit_code\", of = \"other\" }", left), expected);
    assert_eq!(told("", "{ what = \"exit_code\", of = \"sut\", equals = 0 }", left), []);
    assert_eq!(told("", NONE_LOST, |_| {}), []);
}
