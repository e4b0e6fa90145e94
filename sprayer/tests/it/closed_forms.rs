//! Passes whose scores are formulas: a wall, a comb, a bare row; delayed, reversed, dead and best commands.

use proptest::prelude::*;
use rowscan_protocol::time::SimTime;
use rowscan_scenes::{Leaf, Orchard};
use rowscan_sprayer::rate::Settling;
use rowscan_sprayer::safety::{Forbidden, Rule, Spilt, Switches, time_to_safe_s};
use rowscan_sprayer::{
    Boom, Command, CommandLog, Drive, Edge, Edges, Pass, Rate, Score, Span, Spans, Target, oracle,
};
use rowscan_vehicle::Tractor;
use rowscan_vehicle::trajectory::{Course, SpeedProfile, Trajectory};

/// A wall of leaf between these places along the row, from 0.5 to 2.5 m.
fn panel([from, to]: [f64; 2], z: [f64; 2]) -> Leaf {
    Leaf::new([[0.0, from, z[0]], [0.0, to, z[0]], [0.0, to, z[1]], [0.0, from, z[1]]]).expect("a leaf")
}

fn row(panels: &[[f64; 2]]) -> Orchard {
    Orchard::from_organs(
        panels.iter().map(|along| panel(*along, [0.5, 2.5])).collect(),
        Vec::new(),
        f64::INFINITY,
    )
}

/// Four sections on the right, two nozzles each; the second of a section is staggered.
fn boom(valve: &str) -> Boom {
    boom_with("", valve)
}

/// The same with keys of the boom.
fn boom_with(keys: &str, valve: &str) -> Boom {
    let sections = (0..4).map(|n| {
        let z = 0.5 + 0.5 * f64::from(n);
        format!(
            "[[section]]\nid = \"s{n}\"\nside = \"right\"\nz_from_m = {z}\nz_to_m = {}\nnozzles = 2\n",
            z + 0.5
        )
    });
    let text = format!(
        "version = 1\noffset_y_m = 2\nstrip_m = 0\njoin_m = 0\n{keys}\n[valve]\n{valve}\n{}",
        sections.collect::<String>()
    );
    Boom::read(&text).expect("a boom")
}

const IDEAL: &str = "on_ms = 0\noff_ms = 0\nrise_ms = 0\nfall_ms = 0";

fn straight(speed_m_s: f64, until_s: f64) -> Drive {
    let tractor = Tractor::new(Trajectory::straight(0.0, speed_m_s));
    tractor.begin(SimTime::ZERO);
    Drive::of(|at| tractor.motion(at), SimTime::ZERO, SimTime((until_s * 1e9) as u64))
}

fn pass(valve: &str, orchard: &Orchard, speed_m_s: f64) -> Pass {
    Pass::new(boom(valve), orchard, straight(speed_m_s, 14.0 / speed_m_s), 5)
}

fn score(pass: &Pass, log: &CommandLog) -> Score {
    Score::of(pass, &pass.flows(log))
}

/// What is wanted, as commands so much later.
fn truth(pass: &Pass, late_s: f64, order: impl Fn(u16) -> u16) -> CommandLog {
    let numbers: Vec<u16> = pass.boom().numbers().collect();
    let each = numbers.iter().zip(pass.section_wanted()).flat_map(|(number, wanted)| {
        let target = Target::Section(order(*number));
        wanted.iter().flat_map(move |span| [(span.from, 1.0), (span.to, 0.0)]).map(move |(at, duty)| {
            Command { at: SimTime(((at + late_s) * 1e9).round().max(0.0) as u64), target, duty }
        })
    });
    each.collect()
}

#[test]
fn a_perfect_controller_with_ideal_valves_wastes_nothing() {
    let orchard = row(&[[3.0, 5.0], [6.0, 9.0]]);
    let pass = pass(IDEAL, &orchard, 1.5);
    let found = score(&pass, &truth(&pass, 0.0, |n| n));
    assert!((found.recall.expect("leaves pass") - 1.0).abs() < 1e-8, "{found:?}");
    assert!(found.waste.expect("it sprays") < 1e-8, "{found:?}");
    // 5 m of wall, 2 m high; eight nozzles of 1 l/min for 5 m at 1.5 m/s.
    assert!((found.wanted_area_m2 - 10.0).abs() < 1e-9);
    assert!((found.litres - 8.0 / 60.0 * 5.0 / 1.5).abs() < 1e-8);
    assert!((found.constant_litres - 8.0 / 60.0 * 14.0 / 1.5).abs() < 1e-6);
}

#[test]
fn a_delay_of_160_ms_at_one_and_a_half_metres_a_second_is_0_24_m() {
    let orchard = row(&[[3.0, 5.0], [6.0, 9.0], [10.0, 11.0]]);
    let pass = pass(IDEAL, &orchard, 1.5);
    let edges = Edges::of(&pass, &pass.flows(&truth(&pass, 0.16, |n| n)));
    for edge in Edge::ALL {
        let summary = edges.summary(|pair| pair.edge == edge);
        assert_eq!((summary.wanted, summary.missed, summary.spurious), (12, 0, 0));
        for found in [summary.p50_m, summary.p95_m, summary.worst_m] {
            assert!((found.expect("matched") - 0.240).abs() < 0.005, "{summary:?}");
        }
        assert!((summary.p50_s.expect("matched") - 0.16).abs() < 1e-6);
        assert!((edges.p95_with_missed_m(Some(edge)).expect("wanted") - 0.24).abs() < 0.005);
    }
    // Too soon has the other sign; the distance grows with speed, the time does not.
    let fast = self::pass(IDEAL, &orchard, 3.0);
    let soon = Edges::of(&fast, &fast.flows(&truth(&fast, -0.1, |n| n))).summary(|_| true);
    assert!(
        (soon.p50_m.expect("matched") + 0.3).abs() < 1e-6
            && (soon.p50_s.expect("matched") + 0.1).abs() < 1e-6
    );
}

#[test]
fn an_edge_before_any_command_could_act_is_wanted_and_neither_missed_nor_late() {
    // A short wall that the nozzles pass from 0.1 s to 0.2 s, and a long one later.
    let orchard = row(&[[-1.9, -1.8], [3.0, 5.0]]);
    // By the dead time: which of the short wall's two edges nobody could have met.
    for (on_ms, unmeetable) in [(0, [0, 0]), (99, [0, 0]), (150, [1, 0]), (199, [1, 0]), (300, [1, 1])] {
        let valve = format!("on_ms = {on_ms}\noff_ms = {on_ms}\nrise_ms = 0\nfall_ms = 0");
        let pass = pass(&valve, &orchard, 1.0);
        let first = pass.section_wanted()[0].iter().next().expect("leaves pass");
        assert!((first.from - 0.1).abs() < 1e-6 && (first.to - 0.2).abs() < 1e-6, "{first:?}");
        for log in [oracle::commands(&pass), CommandLog::default()] {
            let is_dead = log.all().is_empty();
            let edges = Edges::of(&pass, &pass.flows(&log));
            for (edge, unmeetable) in Edge::ALL.into_iter().zip(unmeetable) {
                let found = edges.summary(|pair| pair.edge == edge);
                let each = (found.wanted, found.unmeetable, found.missed, found.spurious);
                let missed = if is_dead { 8 - 4 * unmeetable } else { 0 };
                assert_eq!(each, (8, 4 * unmeetable, missed, 0), "{on_ms} ms, {edge:?}, dead: {is_dead}");
                let worst_s = found.worst_s.unwrap_or_default();
                assert!(worst_s < 1e-6, "{on_ms} ms: {edge:?} off by {worst_s} s");
            }
        }
    }
}

#[test]
fn gaps_of_75_mm_need_a_fast_valve_and_not_one_that_waits_for_its_period() {
    // A comb: leaf for 0.5 m, nothing for 75 mm.
    let teeth: Vec<[f64; 2]> =
        (0..20).map(|n| 3.0 + 0.575 * f64::from(n)).map(|from| [from, from + 0.5]).collect();
    let orchard = row(&teeth);
    let gaps = |valve: &str, log: &dyn Fn(&Pass) -> CommandLog| {
        let pass = pass(valve, &orchard, 1.5);
        let flows = pass.flows(&log(&pass));
        let resolved = pass.nozzles().iter().map(|nozzle| {
            let wanted: Vec<Span> = pass.wanted()[nozzle.number].iter().copied().collect();
            let middles = wanted.windows(2).map(|pair| {
                // Half and more of the gap's middle half is shut.
                let (from, long) = (pair[0].to, pair[1].from - pair[0].to);
                let middle = Span::new(from + long / 4.0, from + long * 0.75);
                flows[nozzle.number].open.within(middle).length() < 0.5 * middle.length()
            });
            middles.filter(|resolved| *resolved).count()
        });
        let gaps = pass.wanted()[0].len() - 1;
        (resolved.sum::<usize>() as f64 / (gaps * pass.nozzles().len()) as f64, score(&pass, &log(&pass)))
    };
    let quick = "on_ms = 1.3\noff_ms = 1.3\nrise_ms = 0\nfall_ms = 0\nmin_pulse_ms = 1.3";
    let (fast, best) = gaps(quick, &oracle::commands);
    assert_eq!(fast, 1.0);
    assert!(
        best.waste.expect("it sprays") < 1e-6 && best.recall.expect("leaves pass") > 1.0 - 1e-6,
        "{best:?}"
    );
    // 10 Hz, each nozzle by its own clock: even who knows the truth cannot; who misses no leaf resolves no gap.
    let slow = "kind = \"pwm\"\nhz = 10\nphase = \"free\"\non_ms = 0\noff_ms = 0\nrise_ms = 0\nfall_ms = 0";
    let (told_truth, _) = gaps(slow, &|pass| truth(pass, 0.0, |n| n));
    let (at_best, best) = gaps(slow, &oracle::commands);
    assert!(told_truth < 0.6, "{told_truth}");
    assert_eq!(at_best, 0.0);
    assert!(best.recall.expect("leaves pass") > 1.0 - 1e-6, "{best:?}");
}

#[test]
fn of_a_bare_row_nothing_is_wanted_and_all_is_waste() {
    let pass = pass(IDEAL, &row(&[]), 1.5);
    let always: CommandLog =
        [Command { at: SimTime::ZERO, target: Target::All, duty: 1.0 }].into_iter().collect();
    let found = score(&pass, &always);
    assert_eq!((found.recall, found.score), (None, None), "no leaf: unknown, and not 0");
    assert!(
        (found.waste.expect("it sprays") - 1.0).abs() < 1e-12
            && found.saved_litres.is_some_and(|litres| litres.abs() < 1e-6)
    );
    let silent = score(&pass, &CommandLog::default());
    assert_eq!((silent.waste, silent.litres), (None, 0.0));
}

/// A crown: low and wide, so that sections want different things.
fn crowns() -> Orchard {
    let leaves = (0..4).flat_map(|tree| {
        let middle = 3.5 + 2.2 * f64::from(tree);
        [(0.9, [0.5, 1.0]), (0.7, [1.0, 1.5]), (0.45, [1.5, 2.0]), (0.2, [2.0, 2.5])]
            .map(|(half, z)| panel([middle - half, middle + half], z))
    });
    Orchard::from_organs(leaves.collect(), Vec::new(), f64::INFINITY)
}

#[test]
fn scores_order_controllers_and_none_is_better_than_the_oracle() {
    let valve = "on_ms = 60\noff_ms = 30\nrise_ms = 10\nfall_ms = 20";
    let pass = pass(valve, &crowns(), 1.5);
    let scores = [
        score(&pass, &oracle::commands(&pass)),
        score(&pass, &truth(&pass, -0.05, |n| n)),
        score(&pass, &truth(&pass, 0.16, |n| n)),
        score(&pass, &truth(&pass, 0.0, |n| 5 - n)),
        score(&pass, &CommandLog::default()),
    ];
    let told: Vec<f64> = scores.iter().map(|score| score.score.expect("leaves pass")).collect();
    assert!(
        told.windows(2).all(|pair| pair[0] > pair[1]),
        "best, good, no compensation, reversed, dead: {told:?}"
    );
    assert_eq!(told[4], 0.0);
    assert!(
        (scores[0].recall.expect("leaves pass") - 1.0).abs() < 1e-6 && told[0] > 0.999,
        "{:?}",
        scores[0]
    );
}

#[test]
fn speed_that_changes_and_turns_are_compensated_by_the_oracle() {
    let leg = SpeedProfile::builder(1.0, 0.0);
    let profile = leg
        .leg(2.0, 2.0, 0.0)
        .steady(3.0, 2.0, 0.0)
        .leg(2.0, 0.0, 0.0)
        .steady(1.0, 0.0, 0.0)
        .leg(2.0, 1.5, 0.0)
        .hold();
    let course = Course { start_m: 0.6, row_spacing_m: 4.0, turns: Some((2, 12.0)), ..Course::default() };
    let tractor = Tractor::new(Trajectory::new(profile, course, 0.5));
    tractor.begin(SimTime::ZERO);
    let drive = Drive::of(|at| tractor.motion(at), SimTime::ZERO, SimTime(25_000_000_000));
    // A row that repeats every 4 m, between both alleys.
    let orchard = Orchard::from_trees(
        vec![rowscan_scenes::Tree {
            leaves: vec![panel([1.0, 2.5], [0.5, 2.5])],
            wood: Vec::new(),
            facets: Vec::new(),
        }],
        4.0,
        None,
        Some(4.0),
    );
    let pass = Pass::new(boom("on_ms = 20\noff_ms = 20\nrise_ms = 0\nfall_ms = 0"), &orchard, drive, 1);
    let log = oracle::commands(&pass);
    let found = score(&pass, &log);
    assert!(
        found.recall.expect("leaves pass") > 1.0 - 1e-6 && found.waste.expect("it sprays") < 1e-6,
        "{found:?}"
    );
    // Row 0 is on the right in the first alley and again in the second, which is driven the other way.
    let both = pass.section_wanted()[0].iter().filter(|span| span.from > 14.0).count();
    assert!(both > 1, "{:?}", pass.section_wanted()[0]);
    let flows = pass.flows(&log);
    let broken = Forbidden::new(&pass, &flows, &Switches::default(), 0.0).breaches();
    assert!(broken.iter().all(|breach| breach.spilt.litres < 1e-6), "{broken:?}");
    // Who leaves all open sprays on the headland and at standstill.
    let always: CommandLog =
        [Command { at: SimTime::ZERO, target: Target::All, duty: 1.0 }].into_iter().collect();
    let flows = pass.flows(&always);
    let broken = Forbidden::new(&pass, &flows, &Switches::default(), 0.0);
    for rule in [Rule::Headland, Rule::Standstill] {
        let Spilt { litres, forbidden_s } = broken.spilt(Some(rule));
        assert!(
            forbidden_s > 0.9 && (litres - 8.0 / 60.0 * forbidden_s).abs() < 1e-3,
            "{rule:?}: {litres} {forbidden_s}"
        );
    }
    assert_eq!(broken.spilt(Some(Rule::Reverse)), Spilt::default());
}

#[test]
fn zones_and_switches_are_rules_and_safe_is_when_the_last_valve_has_shut() {
    let mut boom = boom("on_ms = 0\noff_ms = 50\nrise_ms = 0\nfall_ms = 40");
    boom.no_spray.push(rowscan_sprayer::boom::Zone { y_from_m: 2.0, y_to_m: 3.5, side: None });
    let pass = Pass::new(boom, &row(&[[0.0, 20.0]]), straight(1.5, 10.0), 1);
    let command = |s: f64, duty| Command { at: SimTime((s * 1e9) as u64), target: Target::All, duty };
    let log: CommandLog = [command(0.0, 1.0), command(6.0, 0.0)].into_iter().collect();
    let flows = pass.flows(&log);
    let switches = Switches { master_off: Spans::of([Span::new(5.0, 9.0)]), ..Switches::default() };
    let broken = Forbidden::new(&pass, &flows, &switches, 0.0);
    let litres = |rule| broken.spilt(Some(rule)).litres;
    let full_l_s = 8.0 / 60.0;
    assert!((litres(Rule::NoSpray) - full_l_s * 1.0).abs() < 1e-6, "1.5 m at 1.5 m/s");
    assert!((litres(Rule::Master) - full_l_s * (1.05 + 0.02)).abs() < 1e-9);
    assert!((time_to_safe_s(&flows, 6.0, 9.0).expect("safe") - 0.09).abs() < 1e-9);
    assert_eq!(time_to_safe_s(&flows, 7.0, 9.0), Some(0.0));
    assert_eq!(time_to_safe_s(&flows, 3.0, 5.0), None);
}

/// A litre is spilt once, however many rules forbid it: switches that overlap, and a stretch that each nozzle reaches at a time of its own.
#[test]
fn what_several_rules_forbid_is_counted_once() {
    let mut boom = boom(IDEAL);
    boom.no_spray.push(rowscan_sprayer::boom::Zone { y_from_m: 6.0, y_to_m: 12.0, side: None });
    let pass = Pass::new(boom, &row(&[[0.0, 20.0]]), straight(1.5, 10.0), 1);
    let all_open = [Command { at: SimTime::ZERO, target: Target::All, duty: 1.0 }].into_iter().collect();
    let flows = pass.flows(&all_open);
    let times = |from, to| Spans::of([Span::new(from, to)]);
    let switches =
        Switches { master_off: times(1.0, 4.0), held_shut: times(3.0, 5.0), ..Switches::default() };
    for grace_s in [0.0, 0.5] {
        let forbidden = Forbidden::new(&pass, &flows, &switches, grace_s);
        // Nozzle by nozzle, instants a millisecond apart.
        let by_steps = pass.nozzles().iter().map(|nozzle| {
            let zone = [6.0, 12.0].map(|y_m| (y_m - nozzle.ahead_m) / 1.5);
            let rules = [[1.0, 4.0], [3.0, 5.0], zone];
            let holds = |s: f64| rules.iter().any(|[from, to]| (from + grace_s..*to).contains(&s));
            let steps = (0..10_000).filter(|ms| holds((f64::from(*ms) + 0.5) * 1e-3));
            (steps.count() as f64 * 1e-3, nozzle.flow_l_s)
        });
        let by_steps: Vec<(f64, f64)> = by_steps.collect();
        let litres: f64 = by_steps.iter().map(|(s, flow_l_s)| s * flow_l_s).sum();
        let longest_s = by_steps.iter().map(|(s, _)| *s).fold(0.0, f64::max);
        let any = forbidden.spilt(None);
        assert!((any.litres - litres).abs() < 1e-3 * litres, "{any:?}, {litres} l by steps");
        assert!((any.forbidden_s - longest_s).abs() < 3e-3, "{any:?}, {longest_s} s by steps");
        let one_by_one: f64 = forbidden.breaches().iter().map(|breach| breach.spilt.litres).sum();
        assert!(one_by_one > 1.05 * any.litres, "they overlap: {one_by_one} and {any:?}");
    }
}

/// Who keeps out of a stretch that must not be sprayed, and opens elsewhere, has done all that was wanted; so does the oracle.
#[test]
fn what_must_not_be_sprayed_is_not_wanted() {
    let mut boom = boom(IDEAL);
    boom.no_spray.push(rowscan_sprayer::boom::Zone { y_from_m: 2.0, y_to_m: 3.5, side: None });
    let pass = Pass::new(boom, &row(&[[-20.0, 40.0]]), straight(1.5, 10.0), 1);
    let best = oracle::commands(&pass);
    let flows = pass.flows(&best);
    let no_spray = Forbidden::new(&pass, &flows, &Switches::default(), 0.0).spilt(Some(Rule::NoSpray));
    assert!((no_spray.forbidden_s - 1.0).abs() < 1e-6 && no_spray.litres < 1e-9, "{no_spray:?}");
    let found = score(&pass, &best);
    assert!(found.recall > Some(1.0 - 1e-8) && found.waste < Some(1e-8), "{found:?}");
    // 8 nozzles for 10 s, less a second: 0.5 m of height each, at 1.5 m/s.
    assert!((found.wanted_area_m2 - 4.0 * 2.0 * 0.5 * 1.5 * 9.0 / 2.0).abs() < 1e-3, "{found:?}");
    let always: CommandLog =
        [Command { at: SimTime::ZERO, target: Target::All, duty: 1.0 }].into_iter().collect();
    let wastes = score(&pass, &always).waste.expect("it sprays");
    assert!((wastes - 0.1).abs() < 1e-6, "a second of ten: {wastes}");
}

/// Every drive begins from a stand, which tells nothing of a controller that must shut when the tractor stops, unless it sprays there.
#[test]
fn the_stand_before_a_drive_is_no_stop_and_what_is_sprayed_in_it_is_forbidden() {
    let tractor = Tractor::new(Trajectory::straight(0.0, 1.5));
    tractor.begin(SimTime(500_000_000));
    let drive = Drive::of(|at| tractor.motion(at), SimTime::ZERO, SimTime(5_000_000_000));
    let pass = Pass::new(boom(IDEAL), &crowns(), drive, 5);
    let stood = |log: &[Command]| {
        let flows = pass.flows(&log.iter().copied().collect());
        Forbidden::new(&pass, &flows, &Switches::default(), 0.0).spilt(Some(Rule::Standstill))
    };
    let never = stood(&[]);
    assert_eq!((never.forbidden_s, never.litres), (0.0, 0.0));
    let always = stood(&[Command { at: SimTime::ZERO, target: Target::All, duty: 1.0 }]);
    let full_l_s: f64 = pass.nozzles().iter().map(|nozzle| nozzle.flow_l_s).sum();
    assert!(
        (always.forbidden_s - 0.5).abs() < 1e-6 && (always.litres - 0.5 * full_l_s).abs() < 1e-3 * full_l_s,
        "{always:?}"
    );
}

fn any_log() -> impl Strategy<Value = Vec<(f64, u16, bool)>> {
    prop::collection::vec((0.0..9.0f64, 1u16..5, any::<bool>()), 0..40)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]

    /// Nobody misses less than the oracle, and who misses as little sprays as much. Also those who nearly do what it does.
    #[test]
    fn the_oracle_dominates(on_ms in 0.0..120.0f64, off_ms in 0.0..120.0f64, min_pulse_ms in 0.0..40.0f64, rise_ms in 0.0..30.0f64, fall_ms in 0.0..30.0f64, pulsed: bool, noise in any_log(), shift_s in -0.03..0.03f64) {
        let kind = if pulsed { "kind = \"pwm\"\nhz = 15\n" } else { "" };
        let valve = format!("{kind}on_ms = {on_ms}\noff_ms = {off_ms}\nmin_pulse_ms = {min_pulse_ms}\nrise_ms = {rise_ms}\nfall_ms = {fall_ms}");
        let pass = pass(&valve, &crowns(), 1.5);
        let best_log = oracle::commands(&pass);
        let best = score(&pass, &best_log);
        prop_assert!(best.missed_area_m2 < 1e-6, "{:?}", best);
        let random: CommandLog = noise.iter().map(|(at, number, open)| Command {
            at: SimTime((at * 1e9) as u64), target: Target::Section(*number), duty: f64::from(*open),
        }).collect();
        let shifted: CommandLog = best_log.all().iter().map(|command| Command {
            at: SimTime((command.at.as_secs_f64() + shift_s).max(0.0).mul_add(1e9, 0.0) as u64), ..*command
        }).collect();
        for other in [random, shifted] {
            let found = score(&pass, &other);
            prop_assert!(found.missed_area_m2 >= best.missed_area_m2 - 1e-6);
            if found.missed_area_m2 <= best.missed_area_m2 + 1e-9 {
                prop_assert!(found.litres >= best.litres - 1e-6, "{:?} {:?}", found, best);
            }
        }
    }

    /// The oracle speaks often enough for any watchdog, and no command that it repeats costs anything.
    #[test]
    fn a_watchdog_costs_the_oracle_nothing(watchdog_s in 0.005..4.0f64, on_ms in 0.0..120.0f64, fall_ms in 0.0..30.0f64, pulsed: bool) {
        let kind = if pulsed { "kind = \"pwm\"\nhz = 15\n" } else { "" };
        let valve = format!("{kind}on_ms = {on_ms}\noff_ms = 20\nfall_ms = {fall_ms}");
        let scored = |keys: &str| {
            let pass = Pass::new(boom_with(keys, &valve), &crowns(), straight(1.5, 14.0 / 1.5), 5);
            score(&pass, &oracle::commands(&pass))
        };
        prop_assert_eq!(scored(&format!("watchdog_s = {watchdog_s}")), scored(""));
    }
}

/// A step of sections, a ramp of speed and the run's end, each `gap_s` behind the other, with a constant flow that is right at 1 m/s.
#[test]
fn every_step_is_counted_in_its_own_word() {
    let told = |shut_s: f64, ramp_s: f64, speeds: [f64; 2], end_s: f64| {
        let profile = SpeedProfile::builder(0.0, speeds[0])
            .steady(ramp_s, speeds[0], 0.0)
            .leg(1.0, speeds[1], 0.0)
            .hold();
        let tractor = Tractor::new(Trajectory::new(profile, Course::default(), 0.5));
        tractor.begin(SimTime::ZERO);
        let drive = Drive::of(|at| tractor.motion(at), SimTime::ZERO, SimTime((end_s * 1e9) as u64));
        let boom = boom_with("[rate]\nat_m_s = 1\nband = 0.1", IDEAL);
        let keys = boom.rate.expect("a rate");
        let pass = Pass::new(boom, &row(&[]), drive, 5);
        let command = |s: f64, number, duty| Command {
            at: SimTime((s * 1e9) as u64),
            target: Target::Section(number),
            duty,
        };
        let log: CommandLog =
            [command(0.0, 1, 1.0), command(0.0, 2, 1.0), command(shut_s, 2, 0.0)].into_iter().collect();
        Rate::of(&pass, &keys, &pass.flows(&log), 0.0)
    };
    let counts = |rate: &Rate| (rate.steps, rate.unsettled, rate.unsettled_at_end, rate.unjudged);
    // At the right speed until the ramp: openings, a section that shuts, and a ramp behind which the rate is a third too low for good.
    for (shut_s, why) in [(4.0, "far from the ramp"), (5.9, "shortly before it"), (6.5, "within it")] {
        let rate = told(shut_s, 6.0, [1.0, 1.5], 12.0);
        assert_eq!(rate.steps + rate.unjudged, 3, "{why}: {rate:?}");
        assert_eq!((rate.settling, rate.settling_s), (Settling::RunEnded, None), "{why}: {rate:?}");
    }
    assert_eq!(counts(&told(4.0, 6.0, [1.0, 1.5], 12.0)), (3, 0, 1, 0));
    // The run ends right behind the ramp: it says nothing, and the steps before it have settled.
    let short = told(4.0, 6.0, [1.0, 1.5], 7.3);
    assert_eq!((counts(&short), short.settling), ((2, 0, 0, 1), Settling::Settled), "{short:?}");
    assert_eq!(short.settling_s, Some(0.0));
    // Too fast from the beginning: not settled when the next step came.
    let fast = told(4.0, 6.0, [1.5, 1.5], 12.0);
    assert_eq!((fast.settling, fast.settling_s, fast.unsettled), (Settling::NotSettled, None, 1), "{fast:?}");
    // Nothing is ever open for a whole window: no step can be judged, which is not the same.
    let none = told(4.0, 6.0, [1.0, 1.0], 0.05);
    assert_eq!((none.settling, none.settling_s, none.steps), (Settling::NoStep, None, 0), "{none:?}");
}

/// The same with a pump, and a rate that is right at 1.5 m/s.
fn with_pump(regulator: &str) -> Boom {
    let keys = format!(
        "[hydraulics]\npump_l_min = 16\nregulator = \"{regulator}\"\ntravel_s = 6\n[rate]\nat_m_s = 1.5\n"
    );
    let text = (0..4).map(|n| {
        let z = 0.5 + 0.5 * f64::from(n);
        format!(
            "[[section]]\nid = \"s{n}\"\nside = \"right\"\nz_from_m = {z}\nz_to_m = {}\nnozzles = 2\n",
            z + 0.5
        )
    });
    Boom::read(&format!("version = 1\n[valve]\n{IDEAL}\n{keys}{}", text.collect::<String>())).expect("a boom")
}

#[test]
fn a_rate_is_off_by_the_roots_of_the_pressures_until_a_loop_brings_it_back() {
    let open = |log: &mut Vec<Command>, s: u64, number, duty| {
        log.push(Command { at: SimTime(s * 1_000_000_000), target: Target::Section(number), duty });
    };
    let mut log = Vec::new();
    (1..=4).for_each(|number| open(&mut log, 0, number, 1.0));
    // Half of the boom shuts: 16 of 16 l/min become 16 of 12, by the root.
    [1, 2].into_iter().for_each(|number| open(&mut log, 10, number, 0.0));
    let log: CommandLog = log.into_iter().collect();
    let rate_of = |regulator: &str, speed_m_s: f64| {
        let boom = with_pump(regulator);
        let keys = boom.rate.expect("a rate");
        let pass = Pass::new(boom, &row(&[]), straight(speed_m_s, 30.0), 5);
        let flows = pass.flows(&log);
        let own = Rate::of(&pass, &keys, &flows, 20.0);
        (Rate::of(&pass, &keys, &flows, 0.0), own)
    };
    let (whole, late) = rate_of("fixed", 1.5);
    assert!((late.mean.expect("it sprays") - 1.0 / 3.0).abs() < 1e-6, "{late:?}");
    assert!((late.p95.expect("it sprays") - 1.0 / 3.0).abs() < 1e-6);
    // No step came behind the one that did not settle: the run ended, 20 s later.
    assert_eq!((whole.steps, whole.unsettled, whole.unsettled_at_end), (2, 0, 1), "{whole:?}");
    assert!(whole.at_least_s.is_some_and(|s| (s - 20.0).abs() < 0.11), "{whole:?}");
    assert_eq!((whole.settling, whole.settling_s), (Settling::RunEnded, None), "{whole:?}");
    // Twice as fast, the same flow is half of what is wanted.
    let (_, fast) = rate_of("fixed", 3.0);
    assert!((fast.mean.expect("it sprays") - (2.0 / 3.0 - 1.0)).abs() < 1e-6, "{fast:?}");
    for (regulator, speed_m_s) in [("pressure", 1.5), ("rate", 1.5), ("rate", 1.2)] {
        let (whole, late) = rate_of(regulator, speed_m_s);
        assert!(late.p95.expect("it sprays") < 0.04, "{regulator}: {late:?}");
        let settling_s = whole.settling_s.expect("it settles");
        assert!((0.2..6.0).contains(&settling_s), "{regulator}: {whole:?}");
        // It comes from above, and goes by a notch or two to the other side.
        assert!(whole.overshoot.is_some_and(|share| share < 0.1), "{regulator}: {whole:?}");
    }
}

#[test]
fn a_boom_without_hydraulics_keeps_its_numbers() {
    let orchard = row(&[[3.0, 5.0]]);
    let pass = pass("kind = \"pwm\"", &orchard, 1.5);
    let delivery = pass.deliver(&truth(&pass, 0.0, |n| n));
    assert!(delivery.node.is_none());
    let duties = truth(&pass, 0.0, |n| n).duties(pass.boom());
    for ((nozzle, steps), flow) in pass.nozzles().iter().zip(duties).zip(&delivery.flows) {
        let alone = nozzle.valve.flow(&steps, (nozzle.number, 5), nozzle.flow_l_s, pass.time().to);
        assert_eq!(*flow, alone);
    }
}

#[test]
fn the_oracle_of_proportional_valves_opens_and_shuts_them_exactly_at_the_leaves() {
    // Gaps that are long, and short beside the time constant: it is told to close long before, and passes its twentieth where the leaves end.
    let orchard = row(&[[3.0, 3.4], [3.9, 5.0], [5.3, 7.0], [7.02, 8.0], [10.0, 10.2]]);
    // With a dead time of 2 s it cannot be told to open again in time, but after the gap of 2 m.
    for (on_ms, joined_s) in [(20, 0.0), (2000, 1.0)] {
        let valve = format!("kind = \"proportional\"\ntau_s = 0.3\non_ms = {on_ms}\noff_ms = 10");
        opens_and_shuts_at(&pass(&valve, &orchard, 1.0), joined_s);
    }
}

/// The oracle's valves are open exactly while leaves are wanted, and in gaps below `joined_s`.
fn opens_and_shuts_at(pass: &Pass, joined_s: f64) {
    let flows = pass.flows(&oracle::commands(pass));
    for (flow, wanted) in flows.iter().zip(pass.wanted()) {
        assert!(wanted.and(&flow.open).length() > wanted.length() - 1e-8);
        let ends = |spans: &Spans| spans.iter().flat_map(|span| [span.from, span.to]).collect::<Vec<_>>();
        let expected = ends(&wanted.joined(joined_s));
        let found = ends(&flow.open);
        assert_eq!(found.len(), expected.len(), "{found:?} {expected:?}");
        for (found, expected) in found.iter().zip(&expected) {
            assert!((found - expected).abs() < 1e-7, "{found} {expected}");
        }
    }
}
