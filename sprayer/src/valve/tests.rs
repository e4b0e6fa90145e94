use proptest::prelude::*;

use super::*;

/// Flow that ends on its own, of one litre a second.
fn flow(valve: Valve, steps: &[Step]) -> Flow {
    valve.flow(steps, (0, 1), 1.0, 20.0)
}

#[test]
fn the_duty_that_comes_out_of_a_pulsed_valve_is_that_of_the_table() {
    let valve = Valve { kind: Kind::Pwm, on_ms: 12.0, off_ms: 6.0, ..Valve::IDEAL };
    for (duty, found) in
        [(0.1, 0.04), (0.2, 0.14), (0.3, 0.24), (0.5, 0.44), (0.8, 0.74), (1.0, 1.0), (0.05, 0.0)]
    {
        for phase in [Phase::Free, Phase::Sync] {
            // A hundred whole periods, well after the beginning.
            let litres =
                flow(Valve { phase, ..valve }, &[(0.0, duty)]).litres_in(&Spans::of([Span::new(5.0, 15.0)]));
            assert!((litres / 10.0 - found).abs() < 1e-9, "{duty} {phase:?}: {}", litres / 10.0);
        }
    }
}

#[test]
fn dead_times_are_a_transport_delay() {
    let valve = Valve { on_ms: 30.0, off_ms: 10.0, ..Valve::IDEAL };
    let open =
        |steps: &[Step]| flow(valve, steps).open.iter().map(|span| (span.from, span.to)).collect::<Vec<_>>();
    let near = |found: &[(f64, f64)], wanted: &[(f64, f64)]| {
        assert_eq!(found.len(), wanted.len(), "{found:?}");
        for (a, b) in found.iter().zip(wanted) {
            assert!((a.0 - b.0).abs() < 1e-12 && (a.1 - b.1).abs() < 1e-12, "{found:?}");
        }
    };
    // It flows for pulse + off - on.
    near(&open(&[(1.0, 1.0), (1.1, 0.0)]), &[(1.03, 1.11)]);
    // None where that is not above 0.
    near(&open(&[(1.0, 1.0), (1.02, 0.0)]), &[]);
    // A pause of 5 ms becomes one of 25 ms.
    near(&open(&[(1.0, 1.0), (2.0, 0.0), (2.005, 1.0), (3.0, 0.0)]), &[(1.03, 2.01), (2.035, 3.01)]);
    // The other way round short pauses are swallowed, and short pulses grow.
    let slow_off = Valve { on_ms: 10.0, off_ms: 30.0, ..Valve::IDEAL };
    let flow_of = flow(slow_off, &[(1.0, 1.0), (1.005, 0.0), (1.02, 1.0), (2.0, 0.0)]);
    near(&flow_of.open.iter().map(|span| (span.from, span.to)).collect::<Vec<_>>(), &[(1.01, 2.03)]);
    // Pulses below the least do nothing.
    let dull = Valve { min_pulse_ms: 6.0, ..slow_off };
    assert!(flow(dull, &[(1.0, 1.0), (1.005, 0.0)]).open.is_empty());
    assert_eq!(flow(dull, &[(1.0, 1.0), (1.007, 0.0)]).open.len(), 1);
}

#[test]
fn ramps_are_trapezia_and_a_short_pulse_a_triangle() {
    let valve = Valve { rise_ms: 40.0, fall_ms: 20.0, ..Valve::IDEAL };
    // 0.04/2 up, full for 0.06, 0.02/2 down.
    assert!((flow(valve, &[(1.0, 1.0), (1.1, 0.0)]).litres() - (0.02 + 0.06 + 0.01)).abs() < 1e-12);
    // Half way up in 20 ms, down again in 10 ms.
    let short = flow(valve, &[(1.0, 1.0), (1.02, 0.0)]);
    assert!((short.litres() - (0.02 + 0.01) * 0.5 / 2.0).abs() < 1e-12);
    assert!((short.open.length() - 0.03).abs() < 1e-12, "open until the last of it has come");
}

#[test]
fn a_proportional_valve_is_of_first_order() {
    let valve = Valve { kind: Kind::Proportional, tau_s: 0.5, on_ms: 100.0, off_ms: 100.0, ..Valve::IDEAL };
    let flow_of = flow(valve, &[(1.0, 0.8), (3.0, 0.0)]);
    assert!((flow_of.share(1.1 + 0.5) - 0.8 * (1.0 - (-1.0f64).exp())).abs() < 1e-12);
    // All that it lacks on the way up comes on the way down: 2 s at 0.8.
    assert!((flow_of.litres() - 1.6).abs() < 1e-9, "{}", flow_of.litres());
    assert_eq!(flow(valve, &[(1.0, 0.09)]).litres(), 0.0, "below the least duty it is shut");
}

#[test]
fn a_free_valve_waits_for_its_period_and_blended_ones_take_turns() {
    let valve = Valve { kind: Kind::Pwm, ..Valve::IDEAL };
    let starts: Vec<f64> = (0..50)
        .map(|number| {
            let flow = valve.flow(&[(1.0, 1.0)], (number, 7), 1.0, 20.0);
            flow.open.iter().next().expect("it opens").from
        })
        .collect();
    assert!(starts.iter().all(|start| (1.0..1.1).contains(start)), "{starts:?}");
    let mean = starts.iter().sum::<f64>() / 50.0 - 1.05;
    assert!(mean.abs() < 4.0 * 0.1 / 12.0f64.sqrt() / 50.0f64.sqrt(), "{mean}");
    let blended = Valve { blended: true, ..valve };
    let sum = |at: f64| {
        [0, 1].map(|number| blended.flow(&[(0.0, 0.5)], (number, 7), 1.0, 20.0).share(at)).iter().sum::<f64>()
    };
    assert!((0..100).all(|step| (sum(2.0 + f64::from(step) * 0.0101) - 1.0).abs() < 1e-12));
}

fn any_valve() -> impl Strategy<Value = Valve> {
    let kinds = prop::sample::select(vec![Kind::OnOff, Kind::Pwm, Kind::Proportional]);
    let phases = prop::sample::select(vec![Phase::Free, Phase::Sync]);
    (
        kinds,
        phases,
        0.0..60.0f64,
        0.0..60.0f64,
        0.0..30.0f64,
        0.0..30.0f64,
        0.0..20.0f64,
        2.0..50.0f64,
        any::<bool>(),
    )
        .prop_map(|(kind, phase, on_ms, off_ms, rise_ms, fall_ms, min_pulse_ms, hz, blended)| Valve {
            kind,
            phase,
            on_ms,
            off_ms,
            rise_ms,
            fall_ms,
            min_pulse_ms,
            hz,
            blended,
            tau_s: 0.2,
            least: 0.1,
        })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]

    /// The closed forms are the integral of the course, and no part is lost between two windows.
    #[test]
    fn litres_are_the_integral_of_the_flow(valve in any_valve(), steps in prop::collection::vec((0.001..0.5f64, 0.0..1.3f64), 1..12), cut in 0.0..4.0f64) {
        let mut at = 0.0;
        let steps: Vec<Step> = steps.iter().map(|(wait, duty)| { at += wait; (at, duty.min(1.0)) }).collect();
        let flow = valve.flow(&steps, (1, 3), 1.0, 4.0);
        const COUNT: u32 = 400_000;
        let step_s = 4.0 / f64::from(COUNT);
        let numeric: f64 = (0..COUNT).map(|i| flow.share((f64::from(i) + 0.5) * step_s)).sum::<f64>() * step_s;
        // Every edge may be off by half a step.
        let most = step_s * (2 * flow.pieces.len() + 2) as f64;
        prop_assert!((flow.litres() - numeric).abs() < most, "{} {}", flow.litres(), numeric);
        let part = |from, to| flow.litres_in(&Spans::of([Span::new(from, to)]));
        prop_assert!((part(0.0, cut) + part(cut, 4.0) - flow.litres()).abs() < 1e-9);
        prop_assert!(flow.pieces.iter().all(|piece| (-1e-9..=1.0 + 1e-9).contains(&piece.share(piece.span.from))));
        // Nothing flows while it does not count as open, but for a proportional valve's last drops.
        if valve.kind != Kind::Proportional {
            let shut = flow.open.gaps(Span::new(0.0, 4.0));
            prop_assert!(flow.litres_in(&shut).abs() < 1e-9);
        }
    }
}
