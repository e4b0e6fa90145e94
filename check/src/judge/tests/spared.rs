//! Who does nothing spares everything: what a dead controller, a dead pump and a dead meter must not pass.

use rowscan_settings::fault_table::sprayer::SprayerFault;
use rowscan_sprayer::{Trouble, Troubles};

use super::sprayer::{sprayed, sprayed_past};
use super::*;
use crate::sprayer::SprayerRun;

/// What a good controller keeps, one of each kind and more. The master switch is off from 8 s on.
const KEPT: [&str; 12] = [
    "what = \"recall\", above = 0.9",
    "what = \"waste\", below = 0.1",
    "what = \"saved_litres\", above = 0.05",
    "what = \"saved_litres\", between = [0, 99]",
    "what = \"latency_error_m\", p95_below = 0.1",
    "what = \"edges\", equals = 0",
    "what = \"edges\", of = \"missed\", equals = 0",
    "what = \"edges\", of = \"spurious\", equals = 0",
    "what = \"off_target_share\", below = 0.7",
    "what = \"forbidden_litres\", below = 0.001",
    "what = \"forbidden_litres\", of = \"master\", equals = 0",
    "what = \"valves\", all = \"closed\", after = \"early\", within_s = 1.5",
];

fn judged(sprayer: SprayerRun, expect: &str, folder: &Path) -> (Verdict, String) {
    let run = RunRecord {
        sprayer: Some(Ok(sprayer)),
        ended: SimTime(10 * SECOND),
        events: vec![event("early", 6.0), event("end", 10.0)],
        ..record(folder)
    };
    verdict(expect, &Runs { all: vec![run], without_faults: None, bless: false }, folder)
}

/// The run again with the master switch off from `from` on.
fn with_master_off(run: SprayerRun, from: f64) -> SprayerRun {
    let off = Trouble { fault: SprayerFault::MasterOff, from, to: None };
    let corners = [[0.0, 2.0, 1.0], [0.0, 7.0, 1.0], [0.0, 7.0, 2.0], [0.0, 2.0, 2.0]];
    let leaf = rowscan_scenes::Leaf::new(corners).expect("a leaf");
    let orchard = rowscan_scenes::Orchard::from_organs(vec![leaf], Vec::new(), f64::INFINITY);
    SprayerRun::judged(run.pass.with_troubles(Troubles(vec![off])), run.log, orchard.into())
}

#[test]
fn a_controller_that_opens_nothing_passes_nothing_that_a_good_one_passes() {
    let folder = tempfile::tempdir().expect("a folder");
    let good = || with_master_off(sprayed(&[(2.0, 1.0), (7.0, 0.0)]), 8.0);
    let dead = || with_master_off(sprayed(&[(0.0, 0.0)]), 8.0);
    for expect in KEPT {
        let (found, message) = judged(good(), expect, folder.path());
        assert_eq!(found, Passed, "{expect}: {message}");
        let (found, message) = judged(dead(), expect, folder.path());
        assert_ne!(found, Passed, "{expect}: {message}");
    }
    // It was free to spray for no second, or no leaf passed: who opens nothing did right.
    for (expect, right) in [
        (KEPT[10], with_master_off(sprayed(&[(0.0, 0.0)]), 2.5)),
        (KEPT[7], sprayed_past(5.0, &[(0.0, 0.0)])),
        (KEPT[2], sprayed_past(5.0, &[(0.0, 0.0)])),
    ] {
        let (found, message) = judged(right, expect, folder.path());
        assert_eq!(found, Passed, "{expect}: {message}");
    }
}

#[test]
fn who_stops_to_report_litres_is_judged_to_the_end() {
    let folder = tempfile::tempdir().expect("a folder");
    let told = |reports: &[(f64, f64)], expect: &str| {
        let mut run = sprayed(&[(2.0, 1.0), (10.0, 0.0)]);
        run.reports = reports.to_vec();
        judged(run, &format!("what = \"rate_error\", of = \"reported\", {expect}"), folder.path())
    };
    // A litre a minute from 2 to 10 s. Every second until the end, and until 4 s only.
    let all: Vec<(f64, f64)> = (0..=9).map(|s| (f64::from(s), f64::from((s - 2).max(0)) / 60.0)).collect();
    assert_eq!(told(&all, "abs_below = 0.001").0, Passed);
    // The last one is not yet overdue.
    assert_eq!(told(&all[..9], "abs_below = 0.001").0, Passed);
    let (found, message) = told(&all[..5], "between = [-0.751, -0.749]");
    assert!(
        found == Passed && message.contains("its last report came 6.000 s before the run's end"),
        "{message}"
    );
    assert_eq!(told(&all[..5], "abs_below = 0.05").0, Failed);
    // Nothing was sprayed since: there was nothing to report.
    let mut shut = sprayed(&[(2.0, 1.0), (4.0, 0.0)]);
    shut.reports = all[..5].to_vec();
    let expect = "what = \"rate_error\", of = \"reported\", abs_below = 0.001";
    assert_eq!(judged(shut, expect, folder.path()).0, Passed);
}
