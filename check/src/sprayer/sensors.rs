//! The boom's sensors on the bus: what its valves, its pressure, its flow meter and its tank do while the run goes on.

use rowscan_bus::CanFrame;
use rowscan_bus::control_function::ControlFunction;
use rowscan_bus::message::{Message, Payload};
use rowscan_bus::name::Name;
use rowscan_bus::node::Node;
use rowscan_bus::pgn::SPRAYER_ADDRESS;
use rowscan_bus::pgn::sprayer::{FLOW_METER, MORE_SECTION_STATES, SECTION_STATES, SPRAYER_STATE};
use rowscan_protocol::time::SimTime;
use rowscan_sprayer::Boom;
use rowscan_sprayer::live::{Reader, States};

use super::machine::Machine;

const MESSAGES: &[&Message] = &[&SECTION_STATES, &SPRAYER_STATE, &FLOW_METER];
/// Of booms with a section 9 or above.
const MORE: &[&Message] = &[&SECTION_STATES, &MORE_SECTION_STATES, &SPRAYER_STATE, &FLOW_METER];
/// The last section that these tell the state of.
const LAST_SECTION: u16 = 16;

/// The sensors of a boom.
#[derive(Debug)]
pub(crate) struct BoomSensors {
    node: Node,
    machine: Machine,
    reader: Reader,
    /// The last look, and when it was.
    seen: Option<(SimTime, States)>,
}

impl BoomSensors {
    /// Those of this boom.
    pub(crate) fn new(machine: Machine, boom: &Boom) -> Self {
        let messages = if boom.numbers().any(|number| number > 8) { MORE } else { MESSAGES };
        let node = Node::new(Name::boom(), SPRAYER_ADDRESS, messages, &[]);
        Self { node, reader: machine.reader(), machine, seen: None }
    }
}

/// What the frames of this boom's sensors cannot tell, in words; nothing where it has none.
pub(crate) fn untold(boom: &Boom) -> Vec<String> {
    let Some(sensors) = boom.sensors else { return Vec::new() };
    let flow_l_s: f64 = boom.nozzles().iter().map(|nozzle| nozzle.flow_l_s).sum();
    let (flow_l_min, pulse_hz) = (60.0 * flow_l_s, flow_l_s * sensors.pulses_per_l);
    let quantities = [
        (&SPRAYER_STATE, "Tank", boom.tank_l, "a full tank"),
        (&SPRAYER_STATE, "Flow", Some(flow_l_min), "all nozzles at full flow"),
        (&FLOW_METER, "PulseRate", Some(pulse_hz), "all nozzles at full flow, by `pulses_per_l`"),
    ];
    let beyond = quantities.into_iter().filter_map(|(message, name, value, of)| {
        let (signal, value) = (message.signal(name)?, value?);
        (!signal.can_say(value)).then(|| {
            let (unit, largest) = (signal.unit, signal.largest());
            format!(
                "boom: `{}.{name}` tells up to {largest} {unit} and is not available above, {of} {value:.1} {unit}",
                message.name
            )
        })
    });
    let sections: Vec<String> =
        boom.numbers().filter(|number| *number > LAST_SECTION).map(|number| number.to_string()).collect();
    let sections = (!sections.is_empty()).then(|| {
        format!(
            "boom: `SectionStates` and `MoreSectionStates` tell sections 1 to {LAST_SECTION}, and nothing of {}",
            sections.join(", ")
        )
    });
    beyond.chain(sections).collect()
}

/// The bytes of a message that tells these states.
fn compose(message: &Message, states: &States) -> Option<Payload> {
    let sections = |first: u16| -> Vec<Option<f64>> {
        let share = |number| states.sections.iter().find(|(known, _)| *known == number);
        (first..first + 8).map(|number| share(number).map(|(_, share)| 100.0 * share)).collect()
    };
    let values = match message.pgn {
        pgn if pgn == SECTION_STATES.pgn => sections(1),
        pgn if pgn == MORE_SECTION_STATES.pgn => sections(9),
        pgn if pgn == SPRAYER_STATE.pgn => vec![
            states.pressure_bar,
            Some(states.flow_l_s * 60.0),
            states.tank_l,
            states.opening.map(|opening| 100.0 * opening),
            Some(f64::from(!states.master_off)),
            Some(f64::from(states.held_shut)),
            Some(f64::from(states.tank_empty)),
        ],
        // The digits of what is whole may fall short of it.
        pgn if pgn == FLOW_METER.pgn => vec![Some((states.pulses + 1e-6).floor()), Some(states.pulse_hz)],
        _ => return None,
    };
    Some(message.encode(&values))
}

impl ControlFunction for BoomSensors {
    fn open(&mut self, at: SimTime, out: &mut Vec<CanFrame>) {
        self.node.open_settled(at, out);
    }

    fn next(&self) -> Option<SimTime> {
        self.node.next()
    }

    fn poll(&mut self, at: SimTime, out: &mut Vec<CanFrame>) {
        let Self { node, machine, reader, seen } = self;
        let mut look = |message: &'static Message, at: SimTime| {
            if seen.as_ref().is_none_or(|(last, _)| *last < at) {
                *seen = Some((at, machine.look(*reader, at)));
            }
            compose(message, &seen.as_ref()?.1)
        };
        node.poll(at, &mut look, out);
    }

    fn handle(&mut self, at: SimTime, frame: &CanFrame, out: &mut Vec<CanFrame>) {
        // Who asks out of turn hears what the last look saw.
        let seen = &self.seen;
        self.node.handle(at, frame, &mut |message, _| compose(message, &seen.as_ref()?.1), out);
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::expect_used, reason = "a test fails by panicking")]

    use super::*;

    fn boom(tables: &str, number: u16) -> Boom {
        let section = "[[section]]\nid = \"a\"\nside = \"left\"\nz_from_m = 1\nz_to_m = 2\nflow_l_min = 60\n";
        Boom::read(&format!("version = 1\n{tables}\n{section}number = {number}\n")).expect("a boom")
    }

    #[test]
    fn what_frames_cannot_tell_of_a_boom_is_said_when_it_is_read() {
        let told = |tables: &str, number| untold(&boom(tables, number));
        for (tables, number, says) in [
            (
                "tank_l = 6426\n[sensors]",
                1,
                "`SprayerState.Tank` tells up to 6425.5 l and is not available above, a full tank 6426.0 l",
            ),
            ("[sensors]\npulses_per_l = 6426", 1, "`FlowMeter.PulseRate` tells up to 6425.5 Hz"),
            ("[sensors]", 17, "sections 1 to 16, and nothing of 17"),
        ] {
            let found = told(tables, number);
            assert!(matches!(&found[..], [one] if one.contains(says)), "{found:?}");
        }
        // Who can be told, and who has no sensors.
        for (tables, number) in [
            ("tank_l = 6425.5\n[sensors]\npulses_per_l = 6425", 16),
            ("tank_l = 100000", 17),
            ("[sensors]\ntank_l = 6000", 1),
        ] {
            assert_eq!(told(tables, number), Vec::<String>::new(), "{tables}");
        }
    }

    /// A tank that is too large for its signal is not told as one that is just not.
    #[test]
    fn a_level_beyond_its_signal_is_not_available() {
        let states = |tank_l| States { tank_l: Some(tank_l), ..States::default() };
        let tank = |tank_l| {
            let payload = compose(&SPRAYER_STATE, &states(tank_l)).expect("a message");
            SPRAYER_STATE.decode(payload.bytes())[2]
        };
        assert_eq!((tank(80_000.0), tank(6425.5), tank(6425.6)), (None, Some(6425.5), None));
    }
}
