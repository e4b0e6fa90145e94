//! The virtual sprayer as client of a task controller (ISO 11783-10).
//!
//! Calling order: [`TaskClient::open`] when a bus opens; [`TaskClient::handle`] for every frame received; [`TaskClient::poll`] at [`TaskClient::next`].
//! Each appends the frames to send. [`TaskClient::take_orders`] gives what sections were told meanwhile.

mod bank;
mod machine;
mod session;
#[cfg(test)]
mod tests;
mod triggers;

use std::time::Duration;

use rowscan_protocol::time::SimTime;

pub use bank::{IdleReason, OnLoss};
pub use machine::{Machine, SectionOrder, Seen};
pub use session::{Connection, Question, Refused};

use self::bank::Bank;
use self::session::{Passed, Say, Session};
use self::triggers::Triggers;
use super::ddi;
use super::implement::{Implement, element};
use super::pool::{Pool, Version, property};
use super::process_data::{self, ProcessData, command, descriptor, descriptor_message, multiplexed, refusal};
use super::transport::{Carried, Transport};
use super::trouble::Trouble;
use crate::frame::{CanFrame, EVERYONE, J1939Id};
use crate::node::{AddressState, Node};
use crate::pgn::isobus::{LANGUAGE, PROCESS_DATA, WORKING_SET_MASTER};
use crate::pgn::network::{REQUEST, REQUEST_ACKNOWLEDGEMENT};
use crate::pgn::{SPRAYER_ADDRESS, TRACTOR_ADDRESS, canopy, tractor};

/// Between two of its status messages.
const STATUS: Duration = Duration::from_secs(2);
/// The longest message that it takes.
const LONGEST: usize = 1785;
/// Where it sits, if nobody else does: beside the boom's sensors.
const ADDRESS: u8 = SPRAYER_ADDRESS + 1;
/// Speed and canopy are not known any more after so long.
const STALE: Duration = Duration::from_millis(500);
/// Place of the height among the signals of the canopy's summary.
const HEIGHT: usize = 4;
/// Setpoints without effect that are kept until they are taken.
const MOST_IDLE: usize = 64;

/// The sprayer on the bus.
#[derive(Debug)]
pub struct TaskClient {
    node: Node,
    /// The address that its connections are of.
    address: Option<u8>,
    transport: Transport,
    session: Session,
    pool: Pool,
    bank: Bank,
    triggers: Triggers,
    on_loss: OnLoss,
    /// Sections, as it tells their number.
    sections: u8,
    status_due: Option<SimTime>,
    /// A task is being carried out, as the task controller has it.
    is_active: bool,
    speed: Option<(SimTime, f64)>,
    canopy: Option<(SimTime, f64)>,
    trouble: Trouble,
    /// It needs no silence before its first step.
    is_settled: bool,
    /// What was set and commanded nothing, until it is taken.
    idle: Vec<IdleSetpoint>,
    /// When it gave a connection up, until that is taken.
    given_up: Vec<SimTime>,
}

/// Whether a command sets a value.
fn is_setpoint(what: u8) -> bool {
    matches!(what, command::VALUE | command::SET_AND_ACKNOWLEDGE)
}

/// A setpoint that commanded nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct IdleSetpoint {
    /// When it came.
    pub at: SimTime,
    /// The element that it was for.
    pub element: u16,
    /// What it was to set.
    pub ddi: u16,
    /// Why.
    pub why: IdleReason,
}

impl TaskClient {
    /// The client of this sprayer.
    pub fn new(implement: Implement, on_loss: OnLoss) -> Self {
        let pool = implement.pool();
        let (structure, localization) =
            pool.device().map_or(([0; 7], [0; 7]), |device| (device.structure, device.localization));
        Self {
            node: Node::new(implement.name, ADDRESS, &[], &[]),
            address: None,
            transport: Transport::new(LONGEST),
            session: Session::new(structure, localization),
            sections: u8::try_from(implement.sections.len()).unwrap_or(u8::MAX),
            pool,
            bank: Bank::new(implement),
            triggers: Triggers::default(),
            on_loss,
            status_due: None,
            is_active: false,
            speed: None,
            canopy: None,
            trouble: Trouble::default(),
            is_settled: false,
            idle: Vec::new(),
            given_up: Vec::new(),
        }
    }

    /// The same, with section control (DDI 160) automatic from the start; before, a task controller has to set it.
    #[must_use]
    pub fn in_automatic(mut self) -> Self {
        self.bank.set_automatic(true);
        self
    }

    /// The same with this machine behind it; before, one whose valves do what they are told after their dead times.
    #[must_use]
    pub fn with_machine(mut self, machine: Box<dyn Machine>) -> Self {
        self.bank.set_machine(machine);
        self
    }

    /// Where it stands.
    pub fn connection(&self) -> Connection {
        self.session.state
    }

    /// The state of its address claim.
    pub fn address_state(&self) -> AddressState {
        self.node.address_state()
    }

    /// What sections were told since the last call.
    pub fn take_orders(&mut self) -> Vec<SectionOrder> {
        self.bank.take_orders()
    }

    /// When it gave a connection up, since the last call: what it told before holds no more.
    pub fn take_given_up(&mut self) -> Vec<SimTime> {
        std::mem::take(&mut self.given_up)
    }

    /// Setpoints since the last call that commanded nothing.
    pub fn take_idle(&mut self) -> Vec<IdleSetpoint> {
        std::mem::take(&mut self.idle)
    }

    /// From now on this is wrong.
    pub fn set_trouble(&mut self, trouble: Trouble) {
        self.trouble = trouble;
    }

    /// A bus, or another port of it, opens.
    pub fn open(&mut self, at: SimTime, out: &mut Vec<CanFrame>) {
        self.node.open(at, out);
    }

    /// The same where it has sat on the bus for long: it has its address already, and its silence is over.
    pub fn open_settled(&mut self, at: SimTime, out: &mut Vec<CanFrame>) {
        self.node.open_settled(at, out);
        self.is_settled = self.address.is_none();
    }

    /// When [`TaskClient::poll`] has something to do.
    pub fn next(&self) -> Option<SimTime> {
        let parts = [
            self.node.next(),
            self.transport.next(),
            self.session.next(),
            self.status_due,
            self.bank.next(),
            self.triggers.next(),
        ];
        parts.into_iter().flatten().min()
    }

    /// Does what is due.
    pub fn poll(&mut self, at: SimTime, out: &mut Vec<CanFrame>) {
        self.node.poll(at, &mut |_, _| None, out);
        self.settle(at);
        for carried in self.transport.poll(at, out) {
            self.carried(at, carried, out);
        }
        match self.session.poll(at) {
            Some(Passed::Lost) => self.lost(at),
            Some(Passed::Say(say)) => self.say(at, say, out),
            None => {}
        }
        self.tell_status(at, out);
        self.refresh(at, out);
    }

    /// A frame was received.
    pub fn handle(&mut self, at: SimTime, frame: &CanFrame, out: &mut Vec<CanFrame>) {
        self.node.handle(at, frame, &mut |_, _| None, out);
        self.settle(at);
        let Some(id) = J1939Id::of(frame.id).filter(|_| !frame.remote) else { return };
        self.overhear(at, id, frame.data());
        let Some(ours) = self.address.filter(|_| !self.trouble.is_lost) else { return };
        if let Some(carried) = self.transport.handle(at, ours, frame, out) {
            self.carried(at, carried, out);
        }
        if id.destination == ours || id.destination == EVERYONE {
            match id.pgn {
                pgn if pgn == PROCESS_DATA.pgn => self.process(at, id, frame.data(), out),
                pgn if pgn == LANGUAGE.pgn && Some(id.source) == self.session.server => {
                    if let Some(say) = self.session.spoken(at) {
                        self.say(at, say, out);
                    }
                }
                pgn if pgn == REQUEST_ACKNOWLEDGEMENT.pgn => self.refused(at, id, frame.data()),
                _ => {}
            }
        }
        self.refresh(at, out);
    }

    /// Its address may have come or gone.
    fn settle(&mut self, at: SimTime) {
        let address = match self.node.address_state() {
            AddressState::Claimed(address) => Some(address),
            AddressState::Off | AddressState::Claiming(..) | AddressState::Lost(_) => None,
        };
        if address == self.address {
            return;
        }
        let had = std::mem::replace(&mut self.address, address).is_some();
        self.transport.forget();
        self.session.reset(at);
        if had {
            self.lost(at);
        }
        match address {
            None => self.session.state = Connection::Off,
            Some(_) if std::mem::take(&mut self.is_settled) => self.session.state = Connection::Alone,
            Some(_) => {}
        }
    }

    /// What others say to everyone: the tractor its speed, the canopy sensor the height. The tractor's address alone counts, in case there are two.
    fn overhear(&mut self, at: SimTime, id: J1939Id, data: &[u8]) {
        if id.pgn == tractor::GROUND_SPEED.pgn && id.source == TRACTOR_ADDRESS {
            self.speed = tractor::ground_speed_m_s(data).map(|speed| (at, speed));
        } else if id.pgn == canopy::SUMMARY.pgn {
            let height = canopy::SUMMARY.decode(data).get(HEIGHT).copied().flatten();
            self.canopy = height.map(|height_m| (at, height_m));
        }
    }

    fn lost(&mut self, at: SimTime) {
        if self.given_up.len() < MOST_IDLE {
            self.given_up.push(at);
        }
        self.triggers.clear();
        self.transport.forget();
        (self.status_due, self.is_active) = (None, false);
        self.bank.lose(at, self.on_loss);
    }

    fn carried(&mut self, at: SimTime, carried: Carried, out: &mut Vec<CanFrame>) {
        match carried {
            Carried::Sent { pgn, .. } if pgn == PROCESS_DATA.pgn => self.session.uploaded(at, true),
            Carried::Failed { pgn, is_ours: true, .. } if pgn == PROCESS_DATA.pgn => {
                self.session.uploaded(at, false);
            }
            Carried::Received { pgn, source, is_broadcast: false, bytes } if pgn == PROCESS_DATA.pgn => {
                // A label with its extension: the first seven bytes are the label.
                if let Some(head) = bytes.get(..8) {
                    let id = J1939Id { source, ..PROCESS_DATA.id(source) };
                    self.process(at, id, head, out);
                }
            }
            _ => {}
        }
    }

    /// A request of ours was refused: it does not know us.
    fn refused(&mut self, at: SimTime, id: J1939Id, data: &[u8]) {
        let &[1, _, _, _, _, p0, p1, p2] = data else { return };
        let is_ours = u32::from_le_bytes([p0, p1, p2, 0]) == PROCESS_DATA.pgn;
        if is_ours && Some(id.source) == self.session.server && Some(id.destination) == self.address {
            self.session.reset(at);
            self.lost(at);
        }
    }

    fn process(&mut self, at: SimTime, id: J1939Id, data: &[u8], out: &mut Vec<CanFrame>) {
        let Some(told) = ProcessData::read(data) else { return };
        let &[first, b1, b2, b3, b4, b5, b6, b7] = data else { return };
        if told.command == command::SERVER_STATUS {
            if let Some(say) = self.session.shown(at, id.source) {
                self.say(at, say, out);
            }
            if self.session.server == Some(id.source) {
                self.is_active = b4 & 1 == 1;
            }
            return;
        }
        // One that is busy says nothing but that.
        let is_server = self.session.server == Some(id.source);
        if is_setpoint(told.command) && Some(id.destination) == self.address {
            match (is_server, self.session.state == Connection::Connected) {
                (true, true) => {}
                (false, true) => self.note_idle(at, told, IdleReason::OtherSender),
                (_, false) => self.note_idle(at, told, IdleReason::NotConnected),
            }
        }
        if !is_server || self.trouble.is_busy {
            return;
        }
        let say = match told.command {
            command::TECHNICAL if first >> 4 == 0 => {
                self.send(self.version(), out);
                None
            }
            command::TECHNICAL if first >> 4 == 1 => self.session.versioned(at, b1),
            command::DESCRIPTOR => {
                let mut rest = [b1, b2, b3, b4, b5, b6, b7];
                if let (Some(code), descriptor::ACTIVATED) = (self.trouble.refusal, first >> 4) {
                    rest[0] = code;
                }
                let was = self.session.state;
                let say = self.session.answered(at, first >> 4, rest);
                if was != Connection::Connected && self.session.state == Connection::Connected {
                    self.connected();
                }
                say
            }
            _ if self.session.state == Connection::Connected => {
                self.obey(at, told, out);
                None
            }
            _ => None,
        };
        if let Some(say) = say {
            self.say(at, say, out);
        }
    }

    /// What its version message holds (AgIsoStack++, `send_request_version_response`): documentation, and section control with one boom.
    fn version(&self) -> [u8; 8] {
        [0x10, Version::Fourth.byte(), 0xFF, 0x01 | 0x10, 0, 1, self.sections, 0]
    }

    /// Work states are told on every change, whether that was asked for or not.
    fn connected(&mut self) {
        self.triggers.clear();
        let always = |ddi: u16| {
            ddi == ddi::ACTUAL_WORK
                || ddi == ddi::SECTION_CONTROL
                || ddi::word(ddi, ddi::ACTUAL_SECTIONS).is_some()
        };
        for (element, ddi, ..) in self.pool.process_data() {
            if element == element::BOOM && always(ddi) {
                self.triggers.on_change((element, ddi), 0);
            }
        }
    }

    /// A setpoint commands nothing.
    fn note_idle(&mut self, at: SimTime, told: ProcessData, why: IdleReason) {
        if self.idle.len() < MOST_IDLE {
            self.idle.push(IdleSetpoint { at, element: told.element, ddi: told.ddi, why });
        }
    }

    /// A task controller that it is connected to commands something.
    fn obey(&mut self, at: SimTime, told: ProcessData, out: &mut Vec<CanFrame>) {
        let ProcessData { command: what, element, ddi, value } = told;
        let known = self.pool.process_data();
        let properties = known.iter().find(|known| (known.0, known.1) == (element, ddi));
        let mut idle = None;
        let refusals = match (properties, what) {
            (None, _) if !self.pool.has_element(element) => refusal::ELEMENT,
            // Properties are read in the pool, and asked for by nobody.
            (None, _) => refusal::DDI,
            (Some(_), command::REQUEST) if ddi == ddi::DEFAULT_SET => {
                for (element, ddi, properties, _) in known {
                    if properties & property::DEFAULT_SET != 0 {
                        self.triggers.on_change((element, ddi), 0);
                    }
                }
                0
            }
            (Some(_), command::REQUEST) => {
                self.freshen(at);
                match self.bank.value(element, ddi) {
                    Some(value) => {
                        self.triggers.told((element, ddi), value);
                        self.tell((element, ddi), value, out);
                        0
                    }
                    // Who asks is answered, also where nothing is known: a value would be a guess.
                    None => refusal::RANGE,
                }
            }
            (Some(known), command::VALUE | command::SET_AND_ACKNOWLEDGE) => {
                let set = match known.2 & property::SETTABLE {
                    0 => Err(IdleReason::Refused(refusal::NOT_SETTABLE)),
                    _ => self.bank.set(at, ddi, value, self.on_loss),
                };
                idle = set.err();
                idle.map_or(0, IdleReason::refusal)
            }
            (Some(_), command::TIME_INTERVAL) => {
                self.triggers.every(at, (element, ddi), value);
                if value < 0 { refusal::INTERVAL } else { 0 }
            }
            (Some(_), command::ON_CHANGE) => {
                self.triggers.on_change((element, ddi), value);
                0
            }
            (Some(_), command::DISTANCE_INTERVAL | command::MINIMUM | command::MAXIMUM) => refusal::TRIGGER,
            // Nobody answers an answer.
            (Some(_), command::ACKNOWLEDGE | command::CLIENT_STATUS) => return,
            (Some(_), _) => refusal::COMMAND,
        };
        if refusals != 0 && is_setpoint(what) {
            idle = idle.or(Some(IdleReason::Refused(refusals)));
        }
        if let Some(why) = idle {
            self.note_idle(at, told, why);
        }
        if refusals != 0 || what == command::SET_AND_ACKNOWLEDGE {
            self.send(told.acknowledged(refusals), out);
        }
    }

    fn say(&mut self, at: SimTime, say: Say, out: &mut Vec<CanFrame>) {
        match say {
            Say::Introduce => {
                self.frame(&WORKING_SET_MASTER.id(0), &multiplexed(1, &[]), out);
                self.status_due = Some(at);
                self.tell_status(at, out);
                let ask = self.session.ask(at, Question::Version);
                self.say(at, ask, out);
            }
            Say::Ask(question) => self.ask(question, out),
            Say::Upload => self.upload(at, out),
        }
    }

    fn ask(&mut self, question: Question, out: &mut Vec<CanFrame>) {
        let bytes = match question {
            Question::Version => multiplexed(command::TECHNICAL, &[]),
            Question::Language => {
                let Some(destination) = self.session.server else { return };
                let [low, middle, high, _] = LANGUAGE.pgn.to_le_bytes();
                let id = J1939Id { destination, ..REQUEST.id(0) };
                self.frame(&id, &[low, middle, high], out);
                return;
            }
            Question::Structure => descriptor_message(descriptor::REQUEST_STRUCTURE, &[]),
            Question::Localization => descriptor_message(descriptor::REQUEST_LOCALIZATION, &[]),
            Question::Delete => descriptor_message(descriptor::DELETE, &[]),
            Question::Transfer => {
                let len = self.pool.bytes(self.session.version).len();
                let len = u32::try_from(len).unwrap_or(u32::MAX);
                descriptor_message(descriptor::REQUEST_TRANSFER, &len.to_le_bytes())
            }
            Question::Activate => descriptor_message(descriptor::ACTIVATE, &[0xFF]),
            // The pool itself was the question.
            Question::Transferred => return,
        };
        self.send(bytes, out);
    }

    fn upload(&mut self, at: SimTime, out: &mut Vec<CanFrame>) {
        let (Some(ours), Some(server)) = (self.address, self.session.server) else { return };
        let mut bytes = vec![command::DESCRIPTOR | descriptor::TRANSFER << 4];
        bytes.extend(self.pool.bytes(self.session.version));
        if self.transport.send(at, (ours, server), PROCESS_DATA.pgn, bytes, out).is_err() {
            self.session.reset(at);
        }
    }

    fn tell_status(&mut self, at: SimTime, out: &mut Vec<CanFrame>) {
        if self.status_due.is_none_or(|due| due > at) {
            return;
        }
        self.status_due = Some(at + STATUS);
        if !self.trouble.is_silent {
            // AgIsoStack++, `send_status`.
            let first = command::CLIENT_STATUS | 0xF0;
            let rest = [0xFF, 0xFF, 0xFF, u8::from(self.is_active), 0, 0, 0];
            self.send(multiplexed(first, &rest), out);
        }
    }

    /// What is known of machine, speed and canopy, at this instant.
    fn freshen(&mut self, at: SimTime) {
        self.bank.poll(at);
        let fresh = |heard: Option<(SimTime, f64)>| heard.filter(|(heard, _)| at < *heard + STALE);
        self.bank.speed_m_s = fresh(self.speed).map(|(_, speed)| speed);
        self.bank.canopy_mm = fresh(self.canopy).map(|(_, height_m)| (height_m * 1000.0).round() as i32);
    }

    /// What is to be told is told.
    fn refresh(&mut self, at: SimTime, out: &mut Vec<CanFrame>) {
        self.freshen(at);
        if self.session.state == Connection::Connected {
            let bank = &self.bank;
            for (key, value) in self.triggers.due(at, |(element, ddi)| bank.value(element, ddi)) {
                self.tell(key, value, out);
            }
        }
    }

    fn tell(&self, (element, ddi): (u16, u16), value: i32, out: &mut Vec<CanFrame>) {
        self.send(ProcessData { command: command::VALUE, element, ddi, value }.bytes(), out);
    }

    /// To its task controller.
    fn send(&self, bytes: [u8; 8], out: &mut Vec<CanFrame>) {
        if let (Some(ours), Some(server)) = (self.address, self.session.server) {
            out.extend(process_data::frame((ours, server), bytes));
        }
    }

    fn frame(&self, id: &J1939Id, data: &[u8], out: &mut Vec<CanFrame>) {
        if let Some(source) = self.address {
            out.extend(CanFrame::new(J1939Id { source, ..*id }.id(), data));
        }
    }
}
