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
