//! Faults of the machine: a perfect controller on a machine that is not, and the score that tells it, by its formula.

use rowscan_protocol::time::SimTime;
use rowscan_scenes::{Leaf, Orchard};
use rowscan_settings::fault_table::sprayer::{SprayerFault, StuckAt, Valves};
use rowscan_sprayer::safety::{Forbidden, Rule, time_to_safe_s};
use rowscan_sprayer::{
    Boom, Command, CommandLog, Drive, Edges, Flow, Pass, Rate, Score, Span, Spans, Target, Trouble, Troubles,
};
use rowscan_vehicle::Tractor;
use rowscan_vehicle::trajectory::Trajectory;

/// Driven, metres; at this speed.
const WAY_M: f64 = 14.0;
const SPEED_M_S: f64 = 1.5;

/// Panels of leaf: along the row, and in height.
fn row(panels: &[([f64; 2], [f64; 2])]) -> Orchard {
    let leaf = |([from, to], [low, high]): &([f64; 2], [f64; 2])| {
        Leaf::new([[0.0, *from, *low], [0.0, *to, *low], [0.0, *to, *high], [0.0, *from, *high]])
            .expect("a leaf")
    };
    Orchard::from_organs(panels.iter().map(leaf).collect(), Vec::new(), f64::INFINITY)
}

/// 5 m of wall before all sections.
fn wall() -> Orchard {
    row(&[([3.0, 5.0], [0.5, 2.5]), ([6.0, 9.0], [0.5, 2.5])])
}

/// Four sections of two nozzles each, 2 m behind, with ideal valves.
fn pass(orchard: &Orchard, more: &str, fault: Option<(SprayerFault, f64, Option<f64>)>) -> Pass {
    let sections = (0..4).map(|n| {
        let z = 0.5 + 0.5 * f64::from(n);
        format!(
            "[[section]]\nid = \"s{n}\"\nside = \"right\"\nz_from_m = {z}\nz_to_m = {}\nnozzles = 2\n",
            z + 0.5
        )
    });
    let boom = Boom::read(&format!(
        "version = 1\noffset_y_m = 2\nstrip_m = 0\njoin_m = 0\n[valve]\non_ms = 0\noff_ms = 0\nrise_ms = 0\nfall_ms = 0\n{more}\n{}",
        sections.collect::<String>()
    ))
    .expect("a boom");
    let tractor = Tractor::new(Trajectory::straight(0.0, SPEED_M_S));
    tractor.begin(SimTime::ZERO);
    let end = SimTime((WAY_M / SPEED_M_S * 1e9) as u64);
    let drive = Drive::of(|at| tractor.motion(at), SimTime::ZERO, end);
    let troubles = fault.map(|(fault, from, to)| Trouble { fault, from, to });
    Pass::new(boom, orchard, drive, 5).with_troubles(Troubles(troubles.into_iter().collect()))
}

/// What is wanted, as commands.
fn truth(pass: &Pass) -> CommandLog {
    let numbers: Vec<u16> = pass.boom().numbers().collect();
    let each = numbers.iter().zip(pass.section_wanted()).flat_map(|(number, wanted)| {
        let target = Target::Section(*number);
        wanted
            .iter()
            .flat_map(move |span| [(span.from, 1.0), (span.to, 0.0)])
            .map(move |(at, duty)| Command { at: SimTime((at * 1e9).round() as u64), target, duty })
    });
    each.collect()
}

struct Found {
    pass: Pass,
    flows: Vec<Flow>,
    score: Score,
}

fn run(orchard: &Orchard, more: &str, fault: SprayerFault, from: f64, to: Option<f64>) -> Found {
    let pass = pass(orchard, more, Some((fault, from, to)));
    let flows = pass.flows(&truth(&pass));
    let score = Score::of(&pass, &flows);
    Found { pass, flows, score }
}

fn is_near(found: Option<f64>, expected: f64, what: &str) {
    let found = found.expect("it is known");
    assert!((found - expected).abs() < 1e-6, "{what}: {found}, expected {expected}");
}

#[test]
fn a_sound_machine_has_nothing_of_it() {
    let pass = pass(&wall(), "", None);
    let score = Score::of(&pass, &pass.flows(&truth(&pass)));
    is_near(score.recall, 1.0, "recall");
    is_near(score.waste, 0.0, "waste");
}

#[test]
fn coils_and_valves_that_do_not_open_miss_their_share_of_the_leaves() {
    // When the nozzles are half a metre in the second panel, and 2 m.
    let (from, to) = ((6.5 + 2.0) / SPEED_M_S, (8.0 + 2.0) / SPEED_M_S);
    for (fault, from, to, recall) in [
        (SprayerFault::CoilOpen(Valves::Section(2)), 0.0, None, 0.75),
        (SprayerFault::CoilOpen(Valves::Nozzle(7)), 0.0, None, 7.0 / 8.0),
        (SprayerFault::ValveStuck(Valves::Nozzle(0), StuckAt::Shut), 0.0, None, 7.0 / 8.0),
        (SprayerFault::ValveStuck(Valves::All, StuckAt::AsItIs), 0.0, None, 0.0),
        (SprayerFault::BlockedNozzle(Valves::Nozzle(3), 1.0), 0.0, None, 7.0 / 8.0),
        (SprayerFault::Undervoltage, from, Some(to), 1.0 - 1.5 / 5.0),
    ] {
        let found = run(&wall(), "", fault, from, to);
        is_near(found.score.recall, recall, &format!("{fault:?}"));
        assert!(found.score.waste.is_none_or(|waste| waste < 1e-6), "{fault:?}");
    }
}

#[test]
fn a_section_that_does_not_open_misses_its_four_edges() {
    let found = run(&wall(), "", SprayerFault::CoilOpen(Valves::Section(2)), 0.0, None);
    let summary = Edges::of(&found.pass, &found.flows).summary(|_| true);
    assert_eq!((summary.wanted, summary.missed, summary.spurious), (16, 4, 0));
}

#[test]
fn valves_that_stay_open_or_drip_waste_by_the_metre() {
    let open = run(&wall(), "", SprayerFault::ValveStuck(Valves::Section(1), StuckAt::Open), 0.0, None);
    // Two of eight nozzles for 14 m, the others for 5.
    is_near(open.score.waste, 2.0 * 9.0 / (2.0 * 14.0 + 6.0 * 5.0), "stuck open");
    is_near(open.score.recall, 1.0, "stuck open");
    assert_eq!(time_to_safe_s(&open.flows, 1.0, open.pass.time().to), None, "it is never safe");
    let drip = run(&wall(), "", SprayerFault::Drip(Valves::All, 0.02), 0.0, None);
    is_near(drip.score.waste, 0.02 * 9.0 / (5.0 + 0.02 * 9.0), "drip");
}

#[test]
fn undervoltage_is_safe_at_once_until_the_voltage_is_back() {
    let (from, to) = ((6.5 + 2.0) / SPEED_M_S, (8.0 + 2.0) / SPEED_M_S);
    let found = run(&wall(), "", SprayerFault::Undervoltage, from, Some(to));
    is_near(time_to_safe_s(&found.flows, from, to), 0.0, "time to safe");
    assert!(found.flows.iter().all(|flow| flow.open.has(to + 0.01)), "open again as told");
}

#[test]
fn a_slow_valve_is_late_by_its_delay() {
    let found = run(&wall(), "", SprayerFault::ValveSlow(Valves::Section(1), 0.2), 0.0, None);
    let edges = Edges::of(&found.pass, &found.flows);
    let late = edges.summary(|pair| pair.section == 0);
    is_near(late.p50_s, 0.2, "late");
    is_near(late.p50_m, 0.3, "late, m");
    is_near(edges.summary(|pair| pair.section != 0).worst_m, 0.0, "the others");
    // Two of eight nozzles miss 0.3 m of each of two panels.
    is_near(found.score.recall, 1.0 - 2.0 * 0.6 / (8.0 * 5.0), "recall");
}

#[test]
fn swapped_wires_spray_beside_the_leaves() {
    let orchard = row(&[([3.0, 5.0], [0.5, 1.0]), ([6.0, 9.0], [1.0, 1.5])]);
    let found = run(&orchard, "", SprayerFault::SwappedWires(1, 2), 0.0, None);
    is_near(found.score.recall, 0.0, "recall");
    is_near(found.score.waste, 1.0, "waste");
    // Of sections that want the same nobody can tell.
    is_near(run(&wall(), "", SprayerFault::SwappedWires(1, 2), 0.0, None).score.recall, 1.0, "recall");
}

/// Pump and regulating valve of which nobody moves anything; the rate is right at the speed of the drive.
const PUMP: &str = "[hydraulics]\npump_l_min = 16\nhose_l = 0.001\n[rate]\nat_m_s = 1.5";

#[test]
fn a_blocked_nozzle_and_a_weak_pump_are_off_the_rate() {
    let rate = |fault, more: &str| {
        let found = run(&wall(), more, fault, 0.0, None);
        let keys = found.pass.boom().rate.expect("a rate");
        Rate::of(&found.pass, &keys, &found.flows, 0.0)
    };
    let blocked = rate(SprayerFault::BlockedNozzle(Valves::Nozzle(0), 0.75), "[rate]\nat_m_s = 1.5");
    is_near(blocked.mean, -0.75 / 8.0, "blocked");
    let low = rate(SprayerFault::PumpLow(0.5), PUMP);
    assert!((low.mean.expect("it sprays") + 0.5).abs() < 0.02, "{low:?}");
    let sound = rate(SprayerFault::PumpLow(1.0), PUMP);
    assert!(sound.mean.expect("it sprays").abs() < 0.02, "{sound:?}");
}

/// Whatever keeps liquid from nozzles: what passes then is missed, the rate is as far off as can be, nothing is saved by it, and who opens over an empty tank sprays
/// against the rule.
#[test]
fn what_gives_no_liquid_sprays_no_leaf_keeps_no_rate_and_saves_nothing() {
    let rate = "[rate]\nat_m_s = 1.5";
    // Never full of liquid: 0.05 l are gone after about a second.
    let dry = "[sensors]\ntank_l = 0.05";
    let from = (6.5 + 2.0) / SPEED_M_S;
    for (more, fault) in [
        (PUMP, Some(SprayerFault::PumpLow(0.0))),
        (PUMP, Some(SprayerFault::PumpLow(0.002))),
        (PUMP, Some(SprayerFault::TankEmpty)),
        (&format!("{PUMP}\n{dry}"), None),
        (&format!("{rate}\n{dry}"), None),
        (rate, Some(SprayerFault::BlockedNozzle(Valves::All, 1.0))),
        (rate, Some(SprayerFault::BlockedNozzle(Valves::All, 0.97))),
    ] {
        let case = format!("{fault:?} {more}");
        let pass = pass(&wall(), more, fault.map(|fault| (fault, from, None)));
        let all_open: CommandLog =
            [Command { at: SimTime::ZERO, target: Target::All, duty: 1.0 }].into_iter().collect();
        let delivery = pass.deliver(&all_open);
        let score = Score::of(&pass, &delivery.flows).beside_sound(&pass.deliver_sound(&all_open).flows);
        let late_s = from.max(delivery.dry_s.unwrap_or_default()) + 0.2;
        let late = Spans::of([Span::new(late_s, pass.time().to)]);
        for (nozzle, flow) in delivery.flows.iter().enumerate() {
            assert_eq!(pass.area(nozzle, &flow.open.and(&late)).all_m2, 0.0, "{case}: nozzle {nozzle}");
        }
        assert!(score.recall.is_some_and(|recall| recall < 0.51), "{case}: {score:?}");
        let keys = pass.boom().rate.expect("a rate");
        let found = Rate::of(&pass, &keys, &delivery.flows, late_s);
        assert!(found.mean.is_some_and(|mean| mean < -0.94), "{case}: {found:?}");
        assert!(found.p95.is_some_and(|p95| p95 > 0.94), "{case}: {found:?}");
        let saved = score.saved_litres.expect("it was told to open");
        assert!(saved.abs() < 0.03 * score.constant_litres, "{case}: {score:?}");
        let against = Forbidden::new(&pass, &delivery.flows, &pass.switches(delivery.dry_s), 0.0);
        let litres = against.spilt(Some(Rule::TankEmpty)).litres;
        let is_empty = delivery.dry_s.is_some() || fault == Some(SprayerFault::TankEmpty);
        assert_eq!(litres > 0.1, is_empty, "{case}: {litres}");
    }
    // From the start on there is nothing of which a share could be wasted.
    for (more, fault) in [
        (PUMP, SprayerFault::PumpLow(0.0)),
        (PUMP, SprayerFault::TankEmpty),
        (rate, SprayerFault::BlockedNozzle(Valves::All, 1.0)),
        (rate, SprayerFault::BlockedNozzle(Valves::All, 0.995)),
    ] {
        let pass = pass(&wall(), more, Some((fault, 0.0, None)));
        let log = truth(&pass);
        let score = Score::of(&pass, &pass.flows(&log)).beside_sound(&pass.deliver_sound(&log).flows);
        assert_eq!((score.waste, score.score), (None, Some(0.0)), "{fault:?}: {score:?}");
    }
    // One that opens nothing has saved nothing, and one without leaves before it has.
    let of = |orchard: &Orchard| {
        let pass = pass(orchard, "", None);
        let shut: CommandLog =
            [Command { at: SimTime::ZERO, target: Target::All, duty: 0.0 }].into_iter().collect();
        let flows = pass.flows(&shut);
        Score::of(&pass, &flows).beside_sound(&flows).saved_litres
    };
    assert_eq!(of(&wall()), None);
    assert!(of(&row(&[])).is_some_and(|saved| saved > 0.1));
}

/// An empty tank and a blocked nozzle shut no valve: who leaves them open is not safe, whatever flows.
#[test]
fn an_open_boom_without_liquid_is_not_safe() {
    let from = (6.5 + 2.0) / SPEED_M_S;
    let dry = |more: &str, fault: Option<SprayerFault>, shuts: bool| {
        let pass = pass(&wall(), more, fault.map(|fault| (fault, from, None)));
        let end_s = pass.time().to;
        let at = |s: f64| SimTime((s * 1e9) as u64);
        let each = pass.boom().numbers().flat_map(|number| {
            let target = Target::Section(number);
            let open = Command { at: at(0.0), target, duty: 1.0 };
            let shut = Command { at: at(from + 0.2), target, duty: 0.0 };
            if shuts { vec![open, shut] } else { vec![open] }
        });
        let log: CommandLog = each.collect();
        time_to_safe_s(&pass.flows(&log), from, end_s)
    };
    for (more, fault) in [
        ("", Some(SprayerFault::BlockedNozzle(Valves::All, 1.0))),
        (PUMP, Some(SprayerFault::TankEmpty)),
        ("[sensors]\ntank_l = 0.5", None),
    ] {
        assert_eq!(dry(more, fault, false), None, "{fault:?}: its valves stand open");
        let shut_s = dry(more, fault, true).expect("they shut");
        assert!((shut_s - 0.2).abs() < 1e-6, "{fault:?}: {shut_s}");
    }
}

#[test]
fn switches_and_an_empty_tank_forbid_what_flows_all_the_same() {
    // From half a metre in the second panel on, 2.5 m of leaf are left.
    let from = (6.5 + 2.0) / SPEED_M_S;
    let litres = 8.0 / 60.0 * 2.5 / SPEED_M_S;
    for (fault, rule) in [
        (SprayerFault::MasterOff, Rule::Master),
        (SprayerFault::HeldShut, Rule::Override),
        (SprayerFault::TankEmpty, Rule::TankEmpty),
    ] {
        let found = run(&wall(), "", fault, from, None);
        let switches = found.pass.troubles().switches(found.pass.time().to);
        let forbidden = Forbidden::new(&found.pass, &found.flows, &switches, 0.0);
        for breach in forbidden.breaches() {
            let expected = if breach.rule == rule { litres } else { 0.0 };
            assert!((breach.spilt.litres - expected).abs() < 1e-6, "{rule:?}: {breach:?}");
        }
        assert!((forbidden.spilt(None).litres - litres).abs() < 1e-6, "{rule:?}");
        is_near(found.score.recall, 1.0, "a switch shuts nothing");
    }
    // What the hoses held still comes; against the rule is what open valves would let through.
    let empty = run(&wall(), PUMP, SprayerFault::TankEmpty, from, None);
    let switches = empty.pass.troubles().switches(empty.pass.time().to);
    let against = Forbidden::new(&empty.pass, &empty.flows, &switches, 0.0).spilt(Some(Rule::TankEmpty));
    let left = empty.flows.iter().map(|flow| flow.litres_in(&switches.tank_empty)).sum::<f64>();
    assert!(left > 0.0 && left < 0.001, "{left}");
    assert!((against.litres - litres).abs() < 1e-6, "{against:?}");
    let (missed, wanted) = (empty.score.missed_area_m2, empty.score.wanted_area_m2);
    assert!((missed / wanted - 0.5).abs() < 1e-6, "2.5 m of 5 m: {missed} of {wanted}");
}
