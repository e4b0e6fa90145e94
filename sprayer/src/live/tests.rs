use proptest::prelude::*;
use rowscan_protocol::time::SimTime;
use rowscan_settings::fault_table::sprayer::{StuckAt, Valves};

use super::*;
use crate::commands::CommandLog;
use crate::pass::valve_flows;
use crate::span::Spans;
use crate::troubles::Trouble;

/// Looks at a boom that lasts this long, seconds.
const END_S: f64 = 12.0;

fn boom(valve: &str, tables: &str) -> Boom {
    let section = |n: u8| {
        format!(
            "[[section]]\nid = \"{n}\"\nside = \"left\"\nz_from_m = {n}\nz_to_m = {}\nnumber = {}\nnozzles = 2\n",
            n + 1,
            n + 7
        )
    };
    let sections: String = (0..3).map(section).collect();
    Boom::read(&format!(
        "version = 1\nwatchdog_s = 3\n[valve]\n{valve}\n{tables}\n[sensors]\npulses_per_l = 300\ntank_l = 2\n{sections}"
    ))
    .expect("a boom")
}

/// What the sensors said each tenth of a second.
fn looks(boom: &Boom, commands: &[Command], troubles: &Troubles) -> Vec<States> {
    let mut live = Live::new(boom.clone(), 5);
    let reader = live.reader();
    let mut next = commands.iter().peekable();
    let ticks = (END_S * 10.0) as u64;
    (1..=ticks)
        .map(|tick| {
            let at_s = tick as f64 / 10.0;
            while let Some(command) = next.next_if(|command| command.at.as_secs_f64() < at_s) {
                live.tell(command);
            }
            // It knows what has gone wrong until now.
            let so_far = troubles.0.iter().filter(|trouble| trouble.from <= at_s);
            let so_far =
                so_far.map(|trouble| Trouble { to: trouble.to.filter(|to| *to <= at_s), ..*trouble });
            live.look(reader, at_s, &Troubles(so_far.collect()), &|_| 1.5)
        })
        .collect()
}

/// What each nozzle gives at the nominal pressure, found afterwards.
fn afterwards(boom: &Boom, commands: &[Command], troubles: &Troubles) -> Vec<Flow> {
    let log: CommandLog = commands.iter().copied().collect();
    valve_flows((boom, &boom.nozzles(), 5), log.duties(boom), troubles, END_S)
}

fn command(s: f64, target: Target, duty: f64) -> Command {
    Command { at: SimTime((s * 1e9) as u64), target, duty }
}

fn valves() -> impl Strategy<Value = &'static str> {
    prop::sample::select(vec![
        "on_ms = 150\noff_ms = 100",
        "kind = \"pwm\"\nhz = 10\non_ms = 12\noff_ms = 6",
        "kind = \"pwm\"\nhz = 15\nphase = \"sync\"\nblended = true",
        "kind = \"proportional\"\ntau_s = 0.05",
    ])
}

fn commands() -> impl Strategy<Value = Vec<Command>> {
    let target = prop_oneof![
        Just(Target::All),
        (6_u16..11).prop_map(Target::Section),
        (0_u16..7).prop_map(Target::Nozzle),
        Just(Target::Regulator)
    ];
    let duty = prop_oneof![Just(0.0), Just(1.0), 0.0..1.0];
    let one = (0_u64..120_000, target, duty);
    prop::collection::vec(one, 0..60).prop_map(|mut all| {
        all.sort_by_key(|(at, ..)| *at);
        let commands = all.into_iter();
        commands.map(|(at, target, duty)| Command { at: SimTime(at * 100_000), target, duty }).collect()
    })
}

fn troubles() -> impl Strategy<Value = Troubles> {
    let fault = prop_oneof![
        Just(SprayerFault::ValveStuck(Valves::Section(8), StuckAt::AsItIs)),
        Just(SprayerFault::ValveSlow(Valves::All, 0.7)),
        Just(SprayerFault::SwappedWires(7, 9)),
        Just(SprayerFault::BlockedNozzle(Valves::Nozzle(1), 0.5)),
        Just(SprayerFault::Drip(Valves::All, 0.02)),
        Just(SprayerFault::Undervoltage),
    ];
    let one = (fault, 0.0..END_S, prop::option::of(0.0..3.0));
    prop::collection::vec(one, 0..3).prop_map(|all| {
        let mut all: Vec<Trouble> = all
            .into_iter()
            .map(|(fault, from, long)| Trouble { fault, from, to: long.map(|long| from + long) })
            .collect();
        all.sort_by(|a, b| a.from.total_cmp(&b.from));
        Troubles(all)
    })
}

/// Found by the property below: what settles to nothing was never shut, and did not drip.
#[test]
fn a_proportional_valve_that_was_shut_long_ago_drips_as_those_that_never_opened() {
    let boom = boom("kind = \"proportional\"\ntau_s = 0.05", "");
    let commands = [command(0.0, Target::Nozzle(0), 1.0), command(5.3, Target::All, 0.0)];
    let shut_again =
        [&commands[..], &[command(6.3, Target::All, 0.0), command(7.2, Target::All, 0.0)]].concat();
    let drip = SprayerFault::Drip(Valves::All, 0.02);
    for from in [7.5, 8.5, 9.0] {
        let troubles = Troubles(vec![Trouble { fault: drip, from, to: None }]);
        for commands in [&commands[..], &shut_again] {
            let flows = afterwards(&boom, commands, &troubles);
            let dripped = |flow: &Flow| flow.litres_in(&Spans::of([Span::new(from, END_S)])) / flow.full_l_s;
            for flow in &flows {
                assert!((dripped(flow) - 0.02 * (END_S - from)).abs() < 1e-12, "{}", dripped(flow));
            }
            let told = looks(&boom, commands, &troubles);
            let full_l_s: f64 = flows.iter().map(|flow| flow.full_l_s).sum();
            let last = told.last().expect("looked at").flow_l_s;
            assert!((last - 0.02 * full_l_s).abs() < 1e-12, "{last}");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]

    /// What is told while the boom runs is what is found afterwards, whatever the valves are, are told and suffer.
    #[test]
    fn sensors_tell_what_is_found_afterwards(valve in valves(), commands in commands(), troubles in troubles()) {
        let boom = boom(valve, "");
        let told = looks(&boom, &commands, &troubles);
        let flows = afterwards(&boom, &commands, &troubles);
        let mut pulses = 0.0;
        for (tick, states) in (0_u32..).zip(&told) {
            let span = Span::new(f64::from(tick) / 10.0, f64::from(tick + 1) / 10.0);
            let times = Spans::of([span]);
            let litres: f64 = flows.iter().map(|flow| flow.litres_in(&times)).sum();
            pulses += litres * 300.0;
            prop_assert!((states.flow_l_s * 0.1 - litres).abs() < 1e-9, "{tick}: {} {}", states.flow_l_s * 0.1, litres);
            prop_assert!((states.pulses - pulses).abs() < 1e-6, "{tick}: {} {pulses}", states.pulses);
            for (place, (number, share)) in states.sections.iter().enumerate() {
                let own = &flows[2 * place..2 * place + 2];
                let full: f64 = own.iter().map(|flow| flow.full_l_s * 0.1).sum();
                let litres: f64 = own.iter().map(|flow| flow.litres_in(&times)).sum();
                prop_assert_eq!(usize::from(*number), place + 7);
                prop_assert!((share - litres / full).abs() < 1e-9, "{tick}, section {number}: {share}");
            }
        }
        let litres: f64 = flows.iter().map(Flow::litres).sum();
        let left_l = told.last().and_then(|states| states.tank_l).expect("a tank");
        prop_assert!((left_l - (2.0 - litres).max(0.0)).abs() < 1e-9);
    }

    /// A tank runs dry when its litres have gone, for whoever looks on the way and for whoever finds out afterwards.
    #[test]
    fn a_tank_runs_dry_once_for_all(valve in valves(), commands in commands(), tank_l in 0.02..0.6f64) {
        let boom = Boom { tank_l: Some(tank_l), ..boom(valve, "") };
        let told = looks(&boom, &commands, &Troubles::default());
        let flows = afterwards(&boom, &commands, &Troubles::default());
        let all: f64 = flows.iter().map(Flow::litres).sum();
        let last = told.last().expect("looks");
        let left_l = last.tank_l.expect("a tank");
        prop_assert!((left_l - (tank_l - all).max(0.0)).abs() < 1e-9, "{left_l} of {tank_l}, {all} wanted");
        prop_assert_eq!(last.tank_empty, all >= tank_l);
        prop_assert!((last.pulses - 300.0 * all.min(tank_l)).abs() < 1e-6, "{}", last.pulses);
        let delivery = pass_of(boom).deliver(&commands.iter().copied().collect());
        let litres: f64 = delivery.flows.iter().map(Flow::litres).sum();
        prop_assert!((litres - all.min(tank_l)).abs() < 1e-9, "{litres}");
        prop_assert_eq!(delivery.dry_s.is_some(), all >= tank_l);
        if let Some(dry_s) = delivery.dry_s {
            prop_assert!(delivery.flows.iter().all(|flow| flow.open.iter().all(|span| span.to <= dry_s)));
        }
    }

    /// The same with hydraulics, where a ramp that a look cuts in two counts as other plateaus than a whole one.
    #[test]
    fn litres_under_changing_pressure_are_those_found_afterwards(valve in valves(), commands in commands()) {
        let boom = boom(valve, "[hydraulics]\npump_l_min = 16\nregulator = \"commanded\"");
        let told = looks(&boom, &commands, &Troubles::default());
        let log: CommandLog = commands.iter().copied().collect();
        let flows = afterwards(&boom, &commands, &Troubles::default());
        let mut node = Node::new(&boom, boom.hydraulics.expect("hydraulics"));
        let signals = Signals { opening: &log.openings(), pump: &[], rate: &|_| 1.0 };
        node.advance(&flows, signals, END_S);
        let litres: f64 = node.flows(flows).iter().map(Flow::litres).sum();
        let last = told.last().expect("looks");
        prop_assert!((last.pulses / 300.0 - litres).abs() < 0.002 * litres + 1e-6, "{} {litres}", last.pulses / 300.0);
        let bar = last.pressure_bar.expect("a pressure");
        prop_assert!((bar - node.sensed_bar(END_S)).abs() < 0.1 * bar, "{bar} {}", node.sensed_bar(END_S));
        prop_assert!((last.opening.expect("a valve") - node.opening()).abs() < 0.011);
    }
}

#[test]
fn a_flow_meter_that_is_off_tells_its_own_flow_and_the_tank_the_true_one() {
    let boom = boom("on_ms = 0\noff_ms = 0\nrise_ms = 0\nfall_ms = 0", "");
    let open = [command(0.5, Target::All, 1.0), command(3.0, Target::All, 1.0)];
    let fault = SprayerFault::FlowMeterOff(0.8);
    let told = looks(&boom, &open, &Troubles(vec![Trouble { fault, from: 1.05, to: Some(2.05) }]));
    // Six nozzles of one litre a minute, and nothing else is wrong.
    assert!((told[9].flow_l_s - 0.1).abs() < 1e-12 && (told[9].pulses - 15.0).abs() < 1e-9);
    assert!((told[10].flow_l_s - 0.1 * (0.5 + 0.5 * 0.8)).abs() < 1e-12, "half a look");
    assert!((told[15].flow_l_s - 0.08).abs() < 1e-12);
    assert!((told[29].pulses - 30.0 * (2.5 - 0.2)).abs() < 1e-9, "{}", told[29].pulses);
    assert!((told[29].tank_l.expect("a tank") - 1.75).abs() < 1e-9);
    // The watchdog closes all after 3 s, and a tank is never below empty.
    assert!(told[59].flow_l_s > 0.0 && told[60].flow_l_s < 1e-12);
    assert_eq!(told[59].pressure_bar, None, "no pressure is modelled");
}

#[test]
fn readers_see_what_was_since_their_own_last_look() {
    let boom = boom("on_ms = 0\noff_ms = 0\nrise_ms = 0\nfall_ms = 0", "");
    let mut live = Live::new(boom, 5);
    let (fast, slow) = (live.reader(), live.reader());
    live.tell(&command(0.25, Target::All, 1.0));
    let mut seen = Vec::new();
    for tick in 1..=5 {
        let look = |live: &mut Live, reader| {
            live.look(reader, f64::from(tick) / 10.0, &Troubles::default(), &|_| 1.5)
        };
        seen.push(look(&mut live, fast).sections[0].1);
        if tick == 5 {
            let states = look(&mut live, slow);
            assert!((states.sections[0].1 - 0.5).abs() < 1e-12 && (states.nozzles[5] - 0.5).abs() < 1e-12);
            assert!((states.flow_l_s - 0.05).abs() < 1e-12 && (states.pulses - 7.5).abs() < 1e-9);
        }
    }
    let expected = [0.0, 0.0, 0.5, 1.0, 1.0];
    assert!(seen.iter().zip(expected).all(|(found, expected)| (found - expected).abs() < 1e-12), "{seen:?}");
}

/// A pass by nothing.
fn pass_of(boom: Boom) -> crate::Pass {
    let drive = crate::Drive::of(
        |at| {
            rowscan_vehicle::Tractor::new(rowscan_vehicle::trajectory::Trajectory::straight(0.0, 1.5))
                .motion(at)
        },
        SimTime::ZERO,
        SimTime((END_S * 1e9) as u64),
    );
    let orchard = rowscan_scenes::Orchard::from_organs(Vec::new(), Vec::new(), f64::INFINITY);
    crate::Pass::new(boom, &orchard, drive, 5)
}

/// Hoses give what they held before, and take nothing from a tank: what the pump gave less what came back is never more than the tank held.
#[test]
fn nobody_takes_more_from_a_tank_than_it_held() {
    let ideal = "on_ms = 0\noff_ms = 0\nrise_ms = 0\nfall_ms = 0";
    let mut dry = 0;
    for hose_l in [0.01, 0.3, 1.0] {
        for tank_l in [0.02, 0.1, 0.25] {
            let boom = Boom {
                tank_l: Some(tank_l),
                ..boom(ideal, &format!("[hydraulics]\npump_l_min = 12\nhose_l = {hose_l}"))
            };
            let commands = [command(0.45, Target::All, 1.0), command(2.05, Target::All, 0.0)];
            let told = looks(&boom, &commands, &Troubles::default());
            assert!(told.windows(2).all(|pair| pair[0].tank_empty <= pair[1].tank_empty), "dry once for all");
            let delivery = pass_of(boom).deliver(&commands.iter().copied().collect());
            let node = delivery.node.as_ref().expect("a node");
            let drawn_l = |to: f64| {
                let balance = node.balance(Span::new(0.0, to));
                balance.pump_l - balance.returned_l
            };
            assert!(
                (1..=30).all(|tick| drawn_l(f64::from(tick) / 10.0) <= tank_l + 1e-9),
                "{hose_l} {tank_l}"
            );
            let last = told.last().expect("looks");
            assert_eq!(last.tank_empty, delivery.dry_s.is_some(), "{hose_l} {tank_l}");
            if let Some(dry_s) = delivery.dry_s {
                dry += 1;
                assert!((drawn_l(dry_s) - tank_l).abs() < 1e-9, "{hose_l} {tank_l}: {}", drawn_l(dry_s));
                assert_eq!(last.tank_l, Some(0.0));
            } else {
                let left_l = last.tank_l.expect("a tank");
                assert!((left_l - (tank_l - drawn_l(END_S))).abs() < 1e-9, "{hose_l} {tank_l}: {left_l}");
            }
        }
    }
    assert!((1..9).contains(&dry), "{dry} of 9 ran dry");
}

/// Six nozzles of one litre a minute, and a tenth of a litre: a second. With a pump, hoses give what they hold, and the pressure goes.
#[test]
fn a_tank_that_runs_dry_is_told_and_gives_nothing_more() {
    let ideal = "on_ms = 0\noff_ms = 0\nrise_ms = 0\nfall_ms = 0";
    for hydraulics in ["", "[hydraulics]\npump_l_min = 16\nhose_l = 0.01"] {
        let boom = Boom { tank_l: Some(0.1), ..boom(ideal, hydraulics) };
        let told = looks(&boom, &[command(1.05, Target::All, 1.0)], &Troubles::default());
        assert!(!told[18].tank_empty && told[18].tank_l.expect("a tank") > 0.0, "{hydraulics}");
        assert!(told[24].tank_empty && told[24].tank_l == Some(0.0), "{hydraulics}: {:?}", told[24]);
        assert!(
            told[29].flow_l_s < 1e-6 && told[29].nozzles.iter().all(|share| *share == 0.0),
            "{hydraulics}"
        );
        assert!(
            told[29].sections.iter().all(|(_, share)| (share - 1.0).abs() < 1e-12),
            "the valves are open"
        );
        if hydraulics.is_empty() {
            assert!((told[29].pulses - 30.0).abs() < 1e-6, "{}", told[29].pulses);
        } else {
            let bar = told[29].pressure_bar.expect("a pressure");
            assert!(bar < 0.1 && told[29].pulses < 33.1, "{bar} bar, {} pulses", told[29].pulses);
        }
    }
}

#[test]
fn switches_and_tank_are_told_while_they_forbid() {
    let faults = [SprayerFault::MasterOff, SprayerFault::HeldShut, SprayerFault::TankEmpty];
    let troubles = faults.iter().zip(1..).map(|(fault, s)| Trouble {
        fault: *fault,
        from: f64::from(s),
        to: Some(f64::from(s) + 0.5),
    });
    let told = looks(&boom("on_ms = 15", ""), &[], &Troubles(troubles.collect()));
    let at = |tick: usize| (told[tick].master_off, told[tick].held_shut, told[tick].tank_empty);
    assert_eq!(at(8), (false, false, false));
    assert_eq!([at(9), at(13), at(14)], [(true, false, false), (true, false, false), (false, false, false)]);
    assert_eq!(
        [at(19), at(24), at(29), at(34)],
        [(false, true, false), (false, false, false), (false, false, true), (false, false, false)]
    );
}

#[test]
fn what_a_look_costs_does_not_grow_with_the_log() {
    let boom = boom("on_ms = 15\noff_ms = 10", "");
    let mut live = Live::new(boom, 1);
    let reader = live.reader();
    for tick in 1..2000_u32 {
        let at = f64::from(tick) / 10.0;
        live.tell(&command(at - 0.05, Target::All, f64::from(tick % 2)));
        live.look(reader, at, &Troubles::default(), &|_| 1.0);
        assert!(
            live.valves.duties.steps.iter().all(|steps| steps.len() < 5),
            "{:?}",
            live.valves.duties.steps[0]
        );
    }
}
