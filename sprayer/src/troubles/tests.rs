use super::*;

const SECTION: Valves = Valves::Section(1);

/// Two sections of two nozzles without dead times; the first has section number 1, the second 2.
fn boom(more: &str) -> Boom {
    let section = |n: u8| {
        format!(
            "[[section]]\nid = \"{n}\"\nside = \"left\"\nz_from_m = {n}\nz_to_m = {}\nnozzles = 2\n",
            n + 1
        )
    };
    Boom::read(&format!(
        "version = 1\n[valve]\non_ms = 0\noff_ms = 0\nrise_ms = 0\nfall_ms = 0\n{more}\n{}{}",
        section(0),
        section(1)
    ))
    .expect("a boom")
}

fn troubles(fault: SprayerFault, from: f64, to: Option<f64>) -> Troubles {
    Troubles(vec![Trouble { fault, from, to }])
}

/// Section 1 is open from 1 to 5 and from 7 to 9 s, section 2 from 2 to 3 s.
fn commanded() -> Vec<Vec<Step>> {
    let one = vec![(1.0, 1.0), (5.0, 0.0), (7.0, 1.0), (9.0, 0.0)];
    let two = vec![(2.0, 1.0), (3.0, 0.0)];
    vec![one.clone(), one, two.clone(), two]
}

fn spans(steps: &[Step]) -> Vec<(f64, f64)> {
    steps.chunks(2).map(|pair| (pair[0].0, pair.get(1).map_or(f64::INFINITY, |end| end.0))).collect()
}

#[test]
fn valves_obey_wires_coils_and_what_holds_them() {
    let boom = boom("");
    let found = |fault, from, to| troubles(fault, from, to).duties(&boom, commanded());
    for (fault, to, first, third) in [
        (SprayerFault::ValveStuck(SECTION, StuckAt::AsItIs), Some(8.0), vec![(1.0, 9.0)], vec![(2.0, 3.0)]),
        (
            SprayerFault::ValveStuck(SECTION, StuckAt::Shut),
            Some(8.0),
            vec![(1.0, 4.0), (8.0, 9.0)],
            vec![(2.0, 3.0)],
        ),
        (
            SprayerFault::ValveStuck(Valves::All, StuckAt::Open),
            Some(6.0),
            vec![(1.0, 6.0), (7.0, 9.0)],
            vec![(2.0, 3.0), (4.0, 6.0)],
        ),
        (SprayerFault::CoilOpen(SECTION), None, vec![(1.0, 4.0)], vec![(2.0, 3.0)]),
        (
            SprayerFault::CoilOpen(Valves::Nozzle(2)),
            Some(8.0),
            vec![(1.0, 5.0), (7.0, 9.0)],
            vec![(2.0, 3.0)],
        ),
        (SprayerFault::Undervoltage, Some(4.5), vec![(1.0, 4.0), (4.5, 5.0), (7.0, 9.0)], vec![(2.0, 3.0)]),
        (SprayerFault::ValveSlow(SECTION, 0.25), Some(8.0), vec![(1.0, 5.25), (7.25, 9.0)], vec![(2.0, 3.0)]),
        (SprayerFault::SwappedWires(1, 2), None, vec![(1.0, 4.0)], vec![(2.0, 3.0), (4.0, 5.0), (7.0, 9.0)]),
    ] {
        let duties = found(fault, 4.0, to);
        assert_eq!(spans(&duties[0]), first, "{fault:?}");
        assert_eq!(spans(&duties[3]), third, "{fault:?}");
    }
    // What overtakes a slow command takes its place, and nothing is left of a pulse that is shorter than the delay.
    let slow = found(SprayerFault::ValveSlow(Valves::All, 1.5), 0.0, Some(2.5));
    assert_eq!(spans(&slow[2]), vec![], "{slow:?}");
}

fn flow(duties: &[Step]) -> Flow {
    crate::valve::Valve::IDEAL.flow(duties, (0, 1), 1.0, 10.0)
}

#[test]
fn blocked_nozzles_give_less_and_dripping_ones_some_while_shut() {
    let boom = boom("");
    let flows = |fault| {
        let all = commanded().iter().map(|steps| flow(steps)).collect();
        troubles(fault, 4.0, Some(8.0)).flows(&boom, all, 10.0)
    };
    let blocked = flows(SprayerFault::BlockedNozzle(Valves::Nozzle(0), 0.75));
    // Open from 1 to 5 and from 7 to 9; a quarter is left from 4 to 8.
    assert!((blocked[0].litres() - (3.0 + 0.25 + 0.25 + 1.0)).abs() < 1e-12);
    assert!((blocked[1].litres() - 6.0).abs() < 1e-12);
    assert!(blocked[0].open.has(4.5));
    let shut = flows(SprayerFault::BlockedNozzle(Valves::Nozzle(0), 1.0));
    assert!((shut[0].litres() - 4.0).abs() < 1e-12 && !shut[0].open.has(4.5) && shut[0].open.has(8.5));
    let drips = flows(SprayerFault::Drip(SECTION, 0.02));
    assert!(
        (drips[0].litres() - (6.0 + 0.02 * 2.0)).abs() < 1e-12,
        "shut from 5 to 7: {}",
        drips[0].litres()
    );
    assert_eq!(drips[0].open, blocked[1].open, "a drip opens nothing");
    assert!((drips[2].litres() - 1.0).abs() < 1e-12);
}

#[test]
fn pump_and_switches_are_told_over_time() {
    let all = Troubles(vec![
        Trouble { fault: SprayerFault::PumpLow(0.5), from: 1.0, to: Some(5.0) },
        Trouble { fault: SprayerFault::TankEmpty, from: 3.0, to: None },
        Trouble { fault: SprayerFault::MasterOff, from: 6.0, to: Some(7.0) },
        Trouble { fault: SprayerFault::HeldShut, from: 8.0, to: None },
    ]);
    assert_eq!(all.pump(), [(1.0, 0.5), (3.0, 0.0), (5.0, 0.0)]);
    let switches = all.switches(10.0);
    assert_eq!(switches.master_off, Spans::of([Span::new(6.0, 7.0)]));
    assert_eq!(switches.held_shut, Spans::of([Span::new(8.0, 10.0)]));
    assert_eq!(switches.tank_empty, Spans::of([Span::new(3.0, 10.0)]));
}

#[test]
fn what_the_boom_lacks_is_refused_with_what_it_has() {
    let said = |fault| refusal(&boom(""), &fault).unwrap_or_default();
    assert_eq!(said(SprayerFault::CoilOpen(Valves::Section(7))), "the boom has no section 7; it has 1, 2");
    assert_eq!(said(SprayerFault::Drip(Valves::Nozzle(4), 0.01)), "the boom has no nozzle 4; it has 0 to 3");
    assert!(said(SprayerFault::SwappedWires(1, 3)).contains("no section 3"));
    assert!(said(SprayerFault::PumpLow(0.5)).contains("add `[hydraulics]`"));
    assert_eq!(refusal(&boom("[hydraulics]"), &SprayerFault::PumpLow(0.5)), None);
    assert_eq!(said(SprayerFault::Undervoltage), "");
}

#[test]
fn kept_in_a_file_they_are_the_same() {
    for fault in [
        SprayerFault::ValveStuck(SECTION, StuckAt::AsItIs),
        SprayerFault::ValveStuck(Valves::All, StuckAt::Open),
        SprayerFault::ValveStuck(Valves::Nozzle(3), StuckAt::Shut),
        SprayerFault::ValveSlow(SECTION, 0.25),
        SprayerFault::CoilOpen(Valves::All),
        SprayerFault::Undervoltage,
        SprayerFault::SwappedWires(1, 2),
        SprayerFault::BlockedNozzle(Valves::Nozzle(0), 0.75),
        SprayerFault::Drip(SECTION, 0.02),
        SprayerFault::PumpLow(0.5),
        SprayerFault::MasterOff,
        SprayerFault::HeldShut,
        SprayerFault::TankEmpty,
    ] {
        for to in [None, Some(2.5)] {
            let all = troubles(fault, 1.0, to);
            let text = serde_json::to_string(&all).expect("written");
            assert_eq!(serde_json::from_str::<Troubles>(&text).expect("read"), all, "{text}");
        }
    }
    let wrong = r#"[{"fault":{"drip":["all",-1.0]},"from":1.0,"to":null}]"#;
    assert!(serde_json::from_str::<Troubles>(wrong).is_err());
}
