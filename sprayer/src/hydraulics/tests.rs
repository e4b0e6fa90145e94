use proptest::prelude::*;

use super::*;
use crate::boom::Boom;
use crate::flow::Flow;
use crate::span::Span;
use crate::valve::Step;

/// Four nozzles of 6 l/min at 9 bar and a pump of 48 l/min: half of it goes back to the tank while all are open.
fn boom(valve: &str, hydraulics: &str) -> Boom {
    let section = |n: u8| {
        format!(
            "[[section]]\nid = \"{n}\"\nside = \"left\"\nz_from_m = {n}\nz_to_m = {}\nflow_l_min = 6\nat_bar = 9\n",
            n + 1
        )
    };
    let sections: String = (0..4).map(section).collect();
    let text = format!(
        "version = 1\npressure_bar = 9\n[valve]\n{valve}\n[rate]\nat_m_s = 2\n[hydraulics]\npump_l_min = 48\nhose_l = 0.03\nsensor_s = 0\n{hydraulics}\n{sections}"
    );
    Boom::read(&text).expect("a boom")
}

const IDEAL: &str = "on_ms = 0\noff_ms = 0\nrise_ms = 0\nfall_ms = 0";

fn nothing(_: f64) -> f64 {
    1.0
}

/// The node and what comes out, for duties by nozzle.
fn run(boom: &Boom, steps: &[Vec<Step>], signals: Signals<'_>, until_s: f64) -> (Node, Vec<Flow>) {
    let nozzles = boom.nozzles();
    let flow = |(nozzle, steps): (&crate::boom::Nozzle, &Vec<Step>)| {
        nozzle.valve.flow(steps, (nozzle.number, 3), nozzle.flow_l_s, until_s)
    };
    let flows: Vec<Flow> = nozzles.iter().zip(steps).map(flow).collect();
    let mut node = Node::new(boom, boom.hydraulics.expect("hydraulics"));
    node.advance(&flows, signals, until_s);
    let flows = node.flows(flows);
    (node, flows)
}

const REST: Signals<'static> = Signals { opening: &[], pump: &[], rate: &nothing };

fn bar(node: &Node, at: f64) -> f64 {
    node.segment(at).expect("a segment").pressure_bar(at)
}

#[test]
fn all_open_gives_the_nominal_pressure_and_flow() {
    let open = vec![vec![(1.0, 1.0)]; 4];
    let (node, flows) = run(&boom(IDEAL, ""), &open, REST, 30.0);
    assert!((bar(&node, 29.9) - 9.0).abs() < 1e-9, "{}", bar(&node, 29.9));
    for flow in &flows {
        assert!((flow.share(29.9) - 1.0).abs() < 1e-9);
    }
    // All shut, 48 l/min go through a valve that takes 24 at 9 bar: twice the root, four times the pressure, were it not for the relief valve.
    assert!((bar(&node, 0.5) - 25.0).abs() < 1e-9);
}

#[test]
fn a_section_that_closes_lifts_the_pressure_by_the_formula() {
    // With n of four nozzles the root is 48 / (6 n + 24) of 3, and the time constant the hoses' 0.03 l by the flow of all ways at 9 bar.
    let mut steps = vec![vec![(0.0, 1.0)]; 4];
    steps[3].push((10.0, 0.0));
    let (node, flows) = run(&boom(IDEAL, ""), &steps, REST, 20.0);
    let (root, tau_s) = (3.0 * 48.0 / 42.0, 0.03 / (42.0 / 60.0));
    for after in [0.0, 0.01, tau_s, 3.0 * tau_s, 1.0, 9.9] {
        let expected = root + (3.0 - root) * libm::exp(-after / tau_s);
        assert!((bar(&node, 10.0 + after) - expected * expected).abs() < 1e-9, "{after}");
        let share = flows[0].share(10.0 + after);
        assert!((share - expected / 3.0).abs() < 1e-9, "{after}: {share}");
    }
    assert_eq!(flows[3].share(10.0), 0.0);
    // 63.2 % of the way after a time constant.
    let way = (bar(&node, 10.0 + tau_s).sqrt() - 3.0) / (root - 3.0);
    assert!((way - 0.632_120_558_8).abs() < 1e-9);
}

#[test]
fn the_regulating_valve_moves_as_fast_as_its_travel_allows() {
    let boom = boom(IDEAL, "regulator = \"commanded\"\ntravel_s = 5\nopening = 0.5");
    let open = vec![vec![(0.0, 1.0)]; 4];
    let opening = [(10.0, 0.255), (12.0, 0.5)];
    let (node, _) = run(&boom, &open, Signals { opening: &opening, ..REST }, 20.0);
    let found = |at| node.segment(at).expect("a segment").opening;
    // A notch of 0.01 each 50 ms; the last is half a one.
    for (at, expected) in
        [(10.04, 0.5), (10.06, 0.49), (10.51, 0.4), (11.3, 0.255), (11.9, 0.255), (12.06, 0.265), (15.0, 0.5)]
    {
        assert!((found(at) - expected).abs() < 1e-9, "{at}: {}", found(at));
    }
    assert!(bar(&node, 11.9) > bar(&node, 9.9));
}

#[test]
fn its_own_loop_brings_the_pressure_back_within_its_dead_band() {
    let mut steps = vec![vec![(0.0, 1.0)]; 4];
    steps[2].push((10.0, 0.0));
    steps[3].push((10.0, 0.0));
    let text = "regulator = \"pressure\"\ntravel_s = 6\nreturn_l_min = 60";
    let (node, _) = run(&boom(IDEAL, text), &steps, REST, 30.0);
    assert!((bar(&node, 9.9) / 9.0 - 1.0).abs() < 0.06);
    // Without the valve's move it would stay at (48 / 36)² of it.
    assert!(bar(&node, 10.3) / 9.0 > 1.5, "{}", bar(&node, 10.3));
    assert!((bar(&node, 29.9) / 9.0 - 1.0).abs() < 0.06, "{}", bar(&node, 29.9));
    // 12 l/min more through a valve of 60: a fifth of its travel.
    let way = node.segment(29.9).expect("a segment").opening - node.segment(9.9).expect("a segment").opening;
    assert!((way - 0.2).abs() < 0.03, "{way}");
}

#[test]
fn the_loop_follows_the_speed_with_the_square() {
    let open = vec![vec![(0.0, 1.0)]; 4];
    let half = |at: f64| if at < 10.0 { 1.0 } else { 0.7 };
    let text = "regulator = \"rate\"\ntravel_s = 6\nreturn_l_min = 60";
    let (node, _) = run(&boom(IDEAL, text), &open, Signals { rate: &half, ..REST }, 40.0);
    assert!((bar(&node, 9.9) / 9.0 - 1.0).abs() < 0.06);
    assert!((bar(&node, 39.9) / (9.0 * 0.49) - 1.0).abs() < 0.06, "{}", bar(&node, 39.9));
}

#[test]
fn a_weak_pump_lowers_the_pressure_and_none_empties_the_hoses() {
    let open = vec![vec![(0.0, 1.0)]; 4];
    let pump = [(10.0, 0.5), (20.0, 0.0)];
    let (node, flows) = run(&boom(IDEAL, ""), &open, Signals { pump: &pump, ..REST }, 40.0);
    assert!((bar(&node, 19.9) - 9.0 / 4.0).abs() < 1e-9);
    assert!(bar(&node, 39.9) < 1e-12);
    // What the hoses held leaves through nozzles and return, by their shares.
    let rest: f64 =
        flows.iter().map(|flow| flow.litres_in(&crate::span::Spans::of([Span::new(20.0, 40.0)]))).sum();
    assert!((rest - 0.03 / 2.0 / 2.0).abs() < 1e-9, "{rest}");
}

#[test]
fn the_sensor_follows_in_closed_form() {
    let mut steps = vec![vec![(0.0, 1.0)]; 4];
    steps[3].push((10.0, 0.0));
    for sensor_s in [0.003, 0.03 / (42.0 / 60.0), 0.03 / (42.0 / 60.0) / 2.0, 0.2] {
        let mut boom = boom(IDEAL, "");
        boom.hydraulics = boom.hydraulics.map(|keys| Hydraulics { sensor_s, ..keys });
        let (node, _) = run(&boom, &steps, REST, 20.0);
        let sensed = |at| node.segment(at).expect("a segment").sensed_bar(at, sensor_s);
        // Small steps find the same.
        let (mut value, step_s) = (sensed(10.0), 2e-6);
        for number in 0..100_000_u32 {
            let at = 10.0 + (f64::from(number) + 0.5) * step_s;
            value += (bar(&node, at) - value) * step_s / sensor_s;
        }
        assert!((value - sensed(10.2)).abs() < 2e-3, "{sensor_s}: {value} {}", sensed(10.2));
        assert!((sensed(19.9) - bar(&node, 19.9)).abs() < 1e-9);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn what_the_pump_gives_leaves_or_stays_in_the_hoses(
        valve in prop::sample::select(vec![
            IDEAL, "rise_ms = 40\nfall_ms = 30", "kind = \"pwm\"\nhz = 12", "kind = \"proportional\"\ntau_s = 0.4",
        ]),
        regulator in prop::sample::select(vec!["fixed", "pressure", "rate", "commanded"]),
        hose_l in 0.0005..0.5,
        steps in prop::collection::vec(prop::collection::vec((0.0..8.0, 0.0..1.0), 0..6), 4..5),
        opening in prop::collection::vec((0.0..8.0, 0.0..1.0), 0..4),
        pump in prop::collection::vec((0.0..8.0, 0.0..1.2), 0..3),
        breaks in prop::collection::vec(0.0..8.0, 0..6),
    ) {
        let sorted = |mut steps: Vec<Step>| { steps.sort_by(|a, b| a.0.total_cmp(&b.0)); steps };
        let mut boom = boom(valve, &format!("regulator = \"{regulator}\""));
        boom.hydraulics = boom.hydraulics.map(|keys| Hydraulics { hose_l, sensor_s: 0.05, ..keys });
        let steps: Vec<Vec<Step>> = steps.into_iter().map(sorted).collect();
        let (opening, pump, breaks) = (sorted(opening), sorted(pump), { let mut b = breaks; b.sort_by(f64::total_cmp); b });
        let signals = Signals { opening: &opening, pump: &pump, rate: &nothing };
        let (node, flows) = run(&boom, &steps, signals, 8.0);
        let balance = node.balance(Span::new(0.0, 8.0));
        let scale = balance.pump_l.max(1.0);
        prop_assert!((balance.pump_l - balance.nozzles_l - balance.returned_l - balance.hoses_l).abs() < 1e-9 * scale, "{balance:?}");
        // The nozzles' own litres are those of the balance.
        let litres: f64 = flows.iter().map(Flow::litres).sum();
        prop_assert!((litres - balance.nozzles_l).abs() < 1e-9 * scale, "{litres} {balance:?}");
        let most = boom.hydraulics.expect("hydraulics").relief_bar + 1e-9;
        prop_assert!(node.segments().iter().all(|segment| segment.pressure_bar(segment.span.to) <= most));
        // In portions, of which each knows its past only, it does the same.
        let mut parts = Node::new(&boom, boom.hydraulics.expect("hydraulics"));
        for until_s in breaks.into_iter().chain([8.0]) {
            let known: Vec<Flow> = boom.nozzles().iter().zip(&steps).map(|(nozzle, steps)| {
                let known: Vec<Step> = steps.iter().copied().filter(|(at, _)| *at <= until_s).collect();
                nozzle.valve.flow(&known, (nozzle.number, 3), nozzle.flow_l_s, until_s + 1.0)
            }).collect();
            parts.advance(&known, signals, until_s);
        }
        let found = parts.balance(Span::new(0.0, 8.0));
        prop_assert!((found.nozzles_l - balance.nozzles_l).abs() < 1e-9 * scale, "{found:?} {balance:?}");
        prop_assert!((bar(&parts, 7.999) - bar(&node, 7.999)).abs() < 1e-7);
    }
}
