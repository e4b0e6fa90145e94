//! Where a run begins and ends says nothing of who commanded: moving either turns no verdict of edges. Where rows end, nothing is wanted; where a rule ends
//! before valves must be shut, nothing is forbidden.

use proptest::prelude::*;
use rowscan_protocol::time::SimTime;
use rowscan_scenes::{Leaf, Orchard, Tree};
use rowscan_sprayer::boom::Zone;
use rowscan_sprayer::edges::{EdgeSummary, MATCH_M};
use rowscan_sprayer::safety::{Forbidden, Rule, Switches};
use rowscan_sprayer::{Boom, Command, CommandLog, Drive, Edge, Edges, Pass, Score, Target, oracle};
use rowscan_vehicle::Tractor;
use rowscan_vehicle::trajectory::{self, Course, SpeedProfile, Trajectory};

/// Where the nozzles are at the start, metres: two behind the scanners.
const NOZZLES_M: f64 = -2.0;

/// One section with two nozzles that act at once.
fn boom() -> Boom {
    let valve = "[valve]\non_ms = 0\noff_ms = 0\nrise_ms = 0\nfall_ms = 0";
    let section = "[[section]]\nid = \"a\"\nside = \"right\"\nz_from_m = 0.5\nz_to_m = 1.5\nnozzles = 2";
    Boom::read(&format!("version = 1\noffset_y_m = 2\nstrip_m = 0\njoin_m = 0\n{valve}\n{section}\n"))
        .expect("a boom")
}

fn row(panels: impl IntoIterator<Item = [f64; 2]>) -> Orchard {
    let panel = |[from, to]: [f64; 2]| {
        Leaf::new([[0.0, from, 0.5], [0.0, to, 0.5], [0.0, to, 1.5], [0.0, from, 1.5]]).expect("a leaf")
    };
    Orchard::from_organs(panels.into_iter().map(panel).collect(), Vec::new(), f64::INFINITY)
}

/// Leaves for 0.7 m, a gap of as much, and so on; the first are `first_m` before the nozzles, or they stand before them where that is negative.
fn comb(first_m: f64) -> Orchard {
    let at = (0..12).map(move |n| NOZZLES_M + first_m + 1.4 * f64::from(n));
    row(at.map(|from| [from, from + 0.7]))
}

fn pass(orchard: &Orchard, profile: SpeedProfile, end_s: f64) -> Pass {
    let tractor = Tractor::new(Trajectory::new(profile, Course::default(), 0.5));
    tractor.begin(SimTime::ZERO);
    let drive = Drive::of(|at| tractor.motion(at), SimTime::ZERO, SimTime((end_s * 1e9) as u64));
    Pass::new(boom(), orchard, drive, 5)
}

fn steady(speed_m_s: f64) -> SpeedProfile {
    SpeedProfile::builder(speed_m_s, 0.0).hold()
}

/// What is wanted in a run that goes on for long, as commands so much later; those after the end have not been given.
fn commands(orchard: &Orchard, speed_m_s: f64, late_s: f64, end_s: f64) -> CommandLog {
    let whole = pass(orchard, steady(speed_m_s), 60.0);
    let spans = whole.section_wanted()[0].iter().flat_map(|span| [(span.from, 1.0), (span.to, 0.0)]);
    let told = spans.map(|(at, duty)| ((at + late_s).max(0.0), duty)).filter(|(at, _)| *at < end_s);
    told.map(|(at, duty)| Command {
        at: SimTime((at * 1e9).round() as u64),
        target: Target::Section(1),
        duty,
    })
    .collect()
}

fn judged(pass: &Pass, log: &CommandLog) -> (EdgeSummary, Option<f64>) {
    let edges = Edges::of(pass, &pass.flows(log));
    (edges.summary(|_| true), edges.p95_with_missed_m(None))
}

proptest! {
    /// Who is late, or too soon, by less than a bound is so wherever the run begins and ends.
    #[test]
    fn no_end_makes_an_edge_missed_or_spurious(speed_m_s in 0.5..2.5f64, late_s in -0.15..0.15f64, first_m in -0.6..1.4f64, end_s in 0.05..9.0f64) {
        // Nobody can be too soon for what is wanted at the beginning.
        let first_m = if late_s < 0.0 { 0.4 + first_m.abs() } else { first_m };
        let orchard = comb(first_m);
        let pass = pass(&orchard, steady(speed_m_s), end_s);
        let (found, p95_m) = judged(&pass, &commands(&orchard, speed_m_s, late_s, end_s));
        prop_assert_eq!((found.missed, found.spurious), (0, 0), "{:?}", found);
        let bound_m = late_s.abs() * speed_m_s + 1e-6;
        prop_assert!(p95_m.is_none_or(|p95_m| p95_m < bound_m), "{:?}: {:?}", p95_m, found);
        // What is left out is told: two at the end at most, and the opening at the beginning.
        prop_assert!(found.cut_off <= 3, "{:?}", found);
    }

    /// Who does nothing misses all that lies so far before the end that it could have been matched.
    #[test]
    fn an_end_hides_no_more_than_its_last_half_metre(speed_m_s in 0.5..2.5f64, end_s in 2.0..9.0f64) {
        let orchard = comb(0.3);
        let pass = pass(&orchard, steady(speed_m_s), end_s);
        let (found, _) = judged(&pass, &CommandLog::default());
        let wanted = pass.section_wanted()[0].iter().flat_map(|span| [span.from, span.to]);
        let end_m = pass.way_m(end_s);
        let far = wanted.filter(|at| end_m - pass.way_m(*at) > MATCH_M).count();
        prop_assert_eq!((found.missed, found.missed + found.cut_off), (far, found.wanted), "{:?}", found);
    }
}

/// Leaves stand before the nozzles for 0.1 m when the run begins: who opens 0.15 s late opened for those, and not too soon for the next ones.
#[test]
fn an_opening_that_was_wanted_before_the_run_is_not_the_next_one() {
    let (speed_m_s, late_s, end_s) = (2.343_815, 0.147_861, 0.464_343);
    let orchard = comb(-0.597_395);
    let pass = pass(&orchard, steady(speed_m_s), end_s);
    let (found, p95_m) = judged(&pass, &commands(&orchard, speed_m_s, late_s, end_s));
    assert_eq!((found.missed, found.spurious, found.lead.edges, found.lag.edges), (0, 0, 0, 1), "{found:?}");
    assert!(p95_m.is_some_and(|p95_m| p95_m < late_s * speed_m_s + 1e-3), "{found:?}");
}

/// The tractor drives 2.5 m at 1 m/s and stands: what is to shut there and does not is cut off only while one that goes could still be within 0.5 m.
#[test]
fn a_stand_before_the_end_decides_who_has_not_shut() {
    let orchard = row([[-1.5, 30.0]]);
    let on: CommandLog =
        [Command { at: SimTime(500_000_000), target: Target::Section(1), duty: 1.0 }].into_iter().collect();
    // The boom's `standstill_m_s` is 0.1: half a metre takes 5 s.
    for (stood_s, missed, cut_off) in [(0.1, 0, 1), (4.9, 0, 1), (5.1, 1, 0), (60.0, 1, 0)] {
        let profile = SpeedProfile::builder(1.0, 0.0).steady(2.5, 1.0, 0.0).leg(0.0, 0.0, 0.0).hold();
        let pass = pass(&orchard, profile, 2.5 + stood_s);
        let edges = Edges::of(&pass, &pass.flows(&on));
        let found = edges.summary(|pair| pair.edge == Edge::Close);
        assert_eq!((found.wanted, found.missed, found.cut_off), (1, missed, cut_off), "{stood_s} s");
    }
}

proptest! {
    /// A drive of several alleys, begun before the row: leaves of the row are wanted, and none that would stand there if it repeated, on the way in, at the
    /// turn, and behind the last alley's end.
    #[test]
    fn beyond_the_ends_of_rows_with_headlands_nothing_is_wanted(alleys in 1u32..4, start_m in -6.0..0.0f64, ahead_m in -2.5..2.5f64, end_s in 15.0..60.0f64) {
        // A row of 12 m with leaf up to its ends but for 0.2 m.
        let leaves = row([[0.2, 5.0], [6.0, 11.8]]).trees().flat_map(|tree| tree.into_owned().leaves).collect();
        let tree = Tree { leaves, ..Tree::default() };
        let rows = trajectory::Drive { alleys: Some(alleys), ..trajectory::Drive::default() };
        let orchard = Orchard::from_trees(vec![tree], 12.0, None, Some(4.0)).beside(&rows);
        let turns = Some((alleys, 12.0));
        let course = Course { start_m, row_spacing_m: 4.0, turns, ..Course::default() };
        let tractor = Tractor::new(Trajectory::new(steady(1.2), course, 0.5));
        tractor.begin(SimTime::ZERO);
        let drive = Drive::of(|at| tractor.motion(at), SimTime::ZERO, SimTime((end_s * 1e9) as u64));
        let pass = Pass::new(Boom { offset_y_m: -ahead_m, ..boom() }, &orchard, drive, 5);
        let flows = pass.flows(&oracle::commands(&pass));
        let found = Score::of(&pass, &flows);
        let phantom_m2 = found.wanted_area_m2 - found.row_area_m2;
        if alleys == 1 {
            // One alley without end: the row repeats, and who has driven more than its length has passed repetitions.
            let is_beyond = start_m + ahead_m < -0.5 || start_m + ahead_m + 1.2 * end_s > 13.0;
            prop_assert_eq!(phantom_m2 > 1e-6, is_beyond, "{:?}", found);
        } else {
            prop_assert!(phantom_m2.abs() < 1e-6, "{:?}", found);
            let at_m = |at: f64| {
                let piece = pass.drive().piece(at).expect("a piece");
                piece.y_m(at) + piece.ahead() * ahead_m
            };
            let middles = pass.section_wanted()[0].iter().map(|span| at_m(span.from.midpoint(span.to)));
            for y_m in middles {
                prop_assert!((0.0..12.0).contains(&y_m), "wanted at {} m", y_m);
            }
        }
    }
}

/// A rule that held for as long as valves are given, to rounding, has judged nothing: no second and no litre of it are left.
#[test]
fn a_rule_that_holds_no_longer_than_valves_are_given_forbids_nothing() {
    let always: CommandLog =
        [Command { at: SimTime::ZERO, target: Target::All, duty: 1.0 }].into_iter().collect();
    for step in 1_u32..40 {
        let (from_m, long_m, speed_m_s) = (0.1 + 0.037 * f64::from(step), 0.05 * f64::from(step), 1.2);
        let zone = Zone { y_from_m: from_m, y_to_m: from_m + long_m, side: None };
        let boom = Boom { no_spray: vec![zone], ..boom() };
        let of_wall = pass(&row([[-9.0, 30.0]]), steady(speed_m_s), 20.0);
        let pass = Pass::new(boom, &row([[-9.0, 30.0]]), of_wall.drive().clone(), 5);
        let forbidden = |grace_s: f64| {
            let flows = pass.flows(&always);
            let forbidden = Forbidden::new(&pass, &flows, &Switches::default(), grace_s);
            let of_zone = forbidden.spilt(Some(Rule::NoSpray));
            (of_zone.forbidden_s, of_zone.litres)
        };
        let held_s = long_m / speed_m_s;
        assert!((forbidden(0.0).0 - held_s).abs() < 1e-6, "{held_s} s");
        assert_eq!(forbidden(forbidden(0.0).0), (0.0, 0.0), "{held_s} s");
        assert!(forbidden(0.9 * held_s).1 > 0.0, "{held_s} s");
    }
}
