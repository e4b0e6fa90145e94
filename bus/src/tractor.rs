//! The virtual tractor's control function: its NAME and address, what it sends, what it obeys.

use rowscan_protocol::time::SimTime;
use rowscan_vehicle::Tractor;
use rowscan_vehicle::gnss::Receiver;

use super::frame::{CanFrame, EVERYONE, J1939Id};
use super::message::{Message, Payload};
use super::name::Name;
use super::node::{AddressState, Node};
use super::pgn::{TRACTOR_ADDRESS, gnss, sprayer, tractor};

const MESSAGES: &[&Message] = &[
    &tractor::WHEEL_SPEED,
    &tractor::GROUND_SPEED,
    &tractor::SELECTED_SPEED,
    &gnss::POSITION_RAPID,
    &gnss::COURSE_RAPID,
    &gnss::POSITION,
    &tractor::FACILITIES,
];

/// A tractor ECU: everything it says is a function of simulated time and of what it was told.
#[derive(Debug)]
pub struct TractorEcu {
    node: Node,
    voice: Voice,
    /// It sits on another bus of the rig: here it hears and says nothing.
    is_elsewhere: bool,
}

#[derive(Debug)]
struct Voice {
    tractor: Tractor,
    receiver: Receiver,
    commanded_m_s: Option<f64>,
    /// Its speeds are so many times the tractor's.
    speed_ratio: f64,
}

impl Voice {
    fn compose(&self, message: &'static Message, at: SimTime) -> Option<Payload> {
        let mut motion = self.tractor.motion(at);
        motion.speed_m_s *= self.speed_ratio;
        motion.wheel_speed_m_s *= self.speed_ratio;
        let fix = || self.tractor.report(&self.receiver, at).fix;
        // NMEA 2000 numbers what belongs together: everything of one second.
        let sequence = (at.0 / 1_000_000_000 % 251) as u8;
        Some(match message.pgn {
            pgn if pgn == tractor::WHEEL_SPEED.pgn => tractor::wheel_speed(&motion),
            pgn if pgn == tractor::GROUND_SPEED.pgn => tractor::ground_speed(&motion),
            pgn if pgn == tractor::SELECTED_SPEED.pgn => tractor::selected_speed(&motion),
            pgn if pgn == tractor::FACILITIES.pgn => tractor::facilities(),
            pgn if pgn == gnss::POSITION_RAPID.pgn => gnss::position_rapid(&fix()),
            pgn if pgn == gnss::COURSE_RAPID.pgn => gnss::course_rapid(&fix(), sequence),
            pgn if pgn == gnss::POSITION.pgn => gnss::position(&fix(), sequence),
            _ => return None,
        })
    }
}

impl TractorEcu {
    /// The control function of `tractor`, whose antenna is `receiver`'s.
    pub fn new(tractor: Tractor, receiver: Receiver) -> Self {
        Self::named(tractor, receiver, (Name::tractor(), TRACTOR_ADDRESS), 1.0)
    }

    fn named(tractor: Tractor, receiver: Receiver, (name, address): (Name, u8), speed_ratio: f64) -> Self {
        let node = Node::new(name, address, MESSAGES, &[&tractor::FACILITIES]);
        let voice = Voice { tractor, receiver, commanded_m_s: None, speed_ratio };
        Self { node, voice, is_elsewhere: false }
    }

    /// The same of a bus that it does not sit on: a rig has one ECU, on its first bus.
    #[must_use]
    pub fn elsewhere(self) -> Self {
        Self { is_elsewhere: true, ..self }
    }

    /// Another control function of the same tractor, which tells other speeds.
    pub(crate) fn twin(&self, name: Name, address: u8, speed_ratio: f64) -> Self {
        let Voice { tractor, receiver, .. } = &self.voice;
        Self::named(tractor.clone(), receiver.clone(), (name, address), speed_ratio)
    }

    /// It has been off the bus, or off altogether: it claims its address anew.
    pub fn restart(&mut self, at: SimTime, out: &mut Vec<CanFrame>) {
        if !self.is_elsewhere {
            self.node.restart(at, out);
        }
    }

    /// A frame was received: answers, and obeys no command.
    pub(crate) fn overhear(&mut self, at: SimTime, frame: &CanFrame, out: &mut Vec<CanFrame>) {
        let Self { node, voice, is_elsewhere } = self;
        if !*is_elsewhere {
            node.handle(at, frame, &mut |message, at| voice.compose(message, at), out);
        }
    }

    /// A bus, or another port of it, opens.
    pub fn open(&mut self, at: SimTime, out: &mut Vec<CanFrame>) {
        if !self.is_elsewhere {
            self.node.open(at, out);
        }
    }

    /// The same where the tractor has stood for long: it has its address already, and speaks from `at` on.
    pub fn open_settled(&mut self, at: SimTime, out: &mut Vec<CanFrame>) {
        if !self.is_elsewhere {
            self.node.open_settled(at, out);
        }
    }

    /// A frame was received: answers, and obeys commands to drive and to spray.
    pub fn handle(&mut self, at: SimTime, frame: &CanFrame, out: &mut Vec<CanFrame>) {
        self.overhear(at, frame, out);
        let Self { node, voice, .. } = self;
        let Some(id) = J1939Id::of(frame.id) else { return };
        let here = matches!(node.address_state(), AddressState::Claimed(_)) && id.destination == EVERYONE;
        if !here {
            return;
        }
        if id.pgn == sprayer::NOZZLE_DUTY.pgn {
            for (nozzle, duty) in sprayer::nozzle_duties(frame.data()) {
                voice.tractor.command_nozzle(at, nozzle, duty);
            }
        }
        let to_drive = id.pgn == tractor::SPEED_COMMAND.pgn;
        let speed_m_s = to_drive.then(|| tractor::commanded_m_s(frame.data())).flatten();
        // A command is repeated as long as it holds; only a new one changes anything.
        if let Some(speed_m_s) = speed_m_s.filter(|speed_m_s| voice.commanded_m_s != Some(*speed_m_s)) {
            voice.commanded_m_s = Some(speed_m_s);
            voice.tractor.command(at, speed_m_s);
        }
    }

    /// When [`TractorEcu::poll`] has something to do.
    pub fn next(&self) -> Option<SimTime> {
        self.node.next()
    }

    /// Sends what is due.
    pub fn poll(&mut self, at: SimTime, out: &mut Vec<CanFrame>) {
        let Self { node, voice, .. } = self;
        node.poll(at, &mut |message, at| voice.compose(message, at), out);
    }

    /// The state of its address claim.
    pub fn address_state(&self) -> AddressState {
        self.node.address_state()
    }
}
