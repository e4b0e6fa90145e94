//! A task controller (ISO 11783-10) for firmware that is itself the client: it takes object pools, activates them, sets sections and rates, and hears
//! what comes of them.
//!
//! Calling order: [`TaskServer::open`] when a bus opens; [`TaskServer::handle`] for every frame received; [`TaskServer::poll`] at [`TaskServer::next`].
//! Each appends the frames to send. [`TaskServer::command`] says what is wanted of all clients; [`TaskServer::take_news`] tells what happened meanwhile.
//!
//! Bytes and answers: AgIsoStack++, `isobus_task_controller_server.cpp`. It knows no tasks, prescriptions or places, and keeps no pool longer than it runs.

mod peer;
#[cfg(test)]
mod tests;
mod wishes;

use std::time::Duration;

use rowscan_protocol::time::SimTime;

use self::peer::{Answer, Peer};
pub use self::wishes::Wishes;
use super::implement::LOCALIZATION;
use super::pool::{MOST_BYTES, Pool, PoolError};
use super::process_data::{self, ProcessData, command, multiplexed, refusal};
use super::transport::{Carried, Transport};
use super::trouble::Trouble;
use crate::frame::{CanFrame, EVERYONE, J1939Id};
use crate::message::{Message, Payload};
use crate::name::{Name, NameParts};
use crate::node::{AddressState, Node};
use crate::pgn::isobus::{LANGUAGE, PROCESS_DATA, WORKING_SET_MASTER};
use crate::pgn::network::{ADDRESS_CLAIMED, REQUEST_ACKNOWLEDGEMENT};

/// Between two of its status messages.
const STATUS: Duration = Duration::from_secs(2);
/// A client that tells no status for so long is lost.
const LOST: Duration = Duration::from_secs(6);
/// Setpoints that a client does not show are said again so often (assumed: the standard's text was not at hand).
const REPEAT: Duration = Duration::from_secs(1);
/// Where it sits, if nobody else does.
const ADDRESS: u8 = 0xF7;
/// The most clients at once; another one is not answered.
pub const MOST_CLIENTS: usize = 8;
/// The most news that are kept until they are taken; older ones are lost.
const MOST_NEWS: usize = 4096;
/// Busy saving, reading and executing a command (AgIsoStack++, `isobus_task_controller_server.hpp`, `ServerStatusBit`).
const BUSY: u8 = 0x02 | 0x04 | 0x08;
/// The longest message: a pool behind its command.
const LONGEST: usize = MOST_BYTES + 1;

/// What happened to a client.
#[derive(Clone, Debug, PartialEq)]
pub struct News {
    /// When.
    pub at: SimTime,
    /// Address of the client.
    pub client: u8,
    /// What.
    pub what: What,
}

/// What happened.
#[derive(Clone, Debug, PartialEq)]
pub enum What {
    /// Its pool is in use.
    Active {
        /// Sections in it.
        sections: usize,
    },
    /// Its pool was refused.
    Refused(PoolError),
    /// It told no status for six seconds, or gave up its pool or its address.
    Lost,
    /// It told a value.
    Told(ProcessData),
    /// It did not take a value, for these reasons (bits of [`refusal`]).
    NotTaken(u16, u16, u8),
}

/// Why nobody has been told what is wanted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Untold {
    /// No client's pool is in use.
    NoClient,
    /// A fault keeps it from being heard.
    Unheard,
    /// A fault keeps it busy.
    Busy,
    /// Pools are in use, and none of them takes a setpoint of it.
    NoSetpoint,
}

/// The task controller on the bus.
#[derive(Clone, Debug)]
pub struct TaskServer {
    node: Node,
    address: Option<u8>,
    transport: Transport,
    peers: Vec<Peer>,
    wishes: Wishes,
    /// A client has been told `wishes`.
    is_told: bool,
    status_due: Option<SimTime>,
    news: Vec<News>,
    trouble: Trouble,
}

impl TaskServer {
    /// One that nobody has turned to yet.
    pub fn new(wishes: Wishes) -> Self {
        Self {
            node: Node::new(Self::name(), ADDRESS, &[&LANGUAGE], &[]),
            address: None,
            transport: Transport::new(LONGEST),
            peers: Vec::new(),
            wishes,
            is_told: false,
            status_due: None,
            news: Vec::new(),
            trouble: Trouble::default(),
        }
    }

    /// The NAME of the virtual task controller: not of a device class, function 130 (AgIsoStack++, `can_NAME.hpp`, `TaskController`).
    pub fn name() -> Name {
        NameParts {
            self_configurable: true,
            industry_group: 2,
            class_instance: 0,
            class: 0,
            function: 130,
            function_instance: 0,
            ecu_instance: 0,
            manufacturer: 2047,
            identity: 5,
        }
        .into()
    }

    /// From now on this is wrong.
    pub fn set_trouble(&mut self, trouble: Trouble) {
        self.trouble = trouble;
    }

    /// What happened since the last call.
    pub fn take_news(&mut self) -> Vec<News> {
        std::mem::take(&mut self.news)
    }

    /// The pool of the client at this address, while it is in use.
    pub fn pool(&self, client: u8) -> Option<&Pool> {
        self.peers.iter().find(|peer| peer.address == client)?.active()
    }

    /// What a client told last of an element's DDI.
    pub fn value(&self, client: u8, element: u16, ddi: u16) -> Option<i32> {
        self.peers.iter().find(|peer| peer.address == client)?.value(element, ddi)
    }

    /// Bytes of pools that it holds.
    pub fn held_bytes(&self) -> usize {
        self.peers.iter().map(Peer::held_bytes).sum()
    }

    /// From now on this is wanted of every client.
    pub fn command(&mut self, at: SimTime, wishes: Wishes, out: &mut Vec<CanFrame>) {
        (self.wishes, self.is_told) = (wishes, false);
        let mut said = Vec::new();
        for place in 0..self.peers.len() {
            self.wish(at, place, &mut said);
        }
        self.let_out(said, out);
    }

    /// Why no client has been told yet what is wanted now; none where one has.
    pub fn untold(&self) -> Option<Untold> {
        let is_served = self.peers.iter().any(|peer| peer.active().is_some());
        match self.trouble {
            _ if self.is_told => None,
            Trouble { is_lost: true, .. } => Some(Untold::Unheard),
            Trouble { is_busy: true, .. } => Some(Untold::Busy),
            _ if is_served => Some(Untold::NoSetpoint),
            _ => Some(Untold::NoClient),
        }
    }

    /// A bus, or another port of it, opens.
    pub fn open(&mut self, at: SimTime, out: &mut Vec<CanFrame>) {
        self.node.open(at, out);
    }

    /// The same where it has sat on the bus for long.
    pub fn open_settled(&mut self, at: SimTime, out: &mut Vec<CanFrame>) {
        self.node.open_settled(at, out);
    }

    /// When [`TaskServer::poll`] has something to do.
    pub fn next(&self) -> Option<SimTime> {
        let peers = self.peers.iter().filter_map(Peer::next).min();
        [self.node.next(), self.transport.next(), self.status_due, peers].into_iter().flatten().min()
    }

    /// Does what is due.
    pub fn poll(&mut self, at: SimTime, out: &mut Vec<CanFrame>) {
        self.node.poll(at, &mut language, out);
        self.settle(at);
        let mut said = Vec::new();
        for carried in self.transport.poll(at, &mut said) {
            self.carried(at, carried, &mut said);
        }
        self.tell_status(at, &mut said);
        for place in 0..self.peers.len() {
            let Some(peer) = self.peers.get_mut(place) else { continue };
            if peer.is_over(at) {
                let client = peer.address;
                peer.forget();
                self.tell(at, client, What::Lost);
            } else if peer.repeats(at) {
                self.wish(at, place, &mut said);
            }
        }
        self.let_out(said, out);
    }

    /// A frame was received.
    pub fn handle(&mut self, at: SimTime, frame: &CanFrame, out: &mut Vec<CanFrame>) {
        self.node.handle(at, frame, &mut language, out);
        self.settle(at);
        let Some(id) = J1939Id::of(frame.id).filter(|_| !frame.remote) else { return };
        let Some(ours) = self.address.filter(|_| !self.trouble.is_lost) else { return };
        let mut said = Vec::new();
        if let Some(carried) = self.transport.handle(at, ours, frame, &mut said) {
            self.carried(at, carried, &mut said);
        }
        match id.pgn {
            pgn if pgn == WORKING_SET_MASTER.pgn && frame.data().len() == 8 => self.introduced(at, id.source),
            pgn if pgn == ADDRESS_CLAIMED.pgn => self.claimed(at, id.source, frame.data()),
            pgn if pgn == PROCESS_DATA.pgn && id.destination == ours => {
                self.process(at, id.source, frame.data(), &mut said);
            }
            pgn if pgn == PROCESS_DATA.pgn && id.destination == EVERYONE => {
                self.heard(at, id.source, frame.data());
            }
            _ => {}
        }
        self.let_out(said, out);
    }

    /// What it says goes out, unless it is not to be heard.
    fn let_out(&self, said: Vec<CanFrame>, out: &mut Vec<CanFrame>) {
        if !self.trouble.is_lost {
            out.extend(said);
        }
    }

    /// Its address may have come or gone.
    fn settle(&mut self, at: SimTime) {
        let address = match self.node.address_state() {
            AddressState::Claimed(address) => Some(address),
            AddressState::Off | AddressState::Claiming(..) | AddressState::Lost(_) => None,
        };
        if address != self.address {
            self.address = address;
            self.transport.forget();
            self.peers.clear();
            self.status_due = address.map(|_| at);
        }
    }

    fn tell(&mut self, at: SimTime, client: u8, what: What) {
        if self.news.len() >= MOST_NEWS {
            self.news.remove(0);
        }
        self.news.push(News { at, client, what });
    }

    fn tell_status(&mut self, at: SimTime, out: &mut Vec<CanFrame>) {
        if self.status_due.is_none_or(|due| due > at) {
            return;
        }
        self.status_due = Some(at + STATUS);
        let Some(ours) = self.address else { return };
        let busy = if self.trouble.is_busy { BUSY } else { 0 };
        let rest = [0xFF, 0xFF, 0xFF, 1 | busy, 0, 0, 0xFF];
        out.extend(process_data::frame((ours, EVERYONE), multiplexed(command::SERVER_STATUS | 0xF0, &rest)));
    }

    /// A client turns to task controllers. Who is here already keeps its pool.
    fn introduced(&mut self, at: SimTime, source: u8) {
        if let Some(peer) = self.peer(source) {
            peer.introduced(at);
            return;
        }
        if self.peers.len() >= MOST_CLIENTS {
            // Who is gone makes room.
            match self.peers.iter().position(Peer::is_gone) {
                Some(place) => drop(self.peers.remove(place)),
                None => return,
            }
        }
        self.peers.push(Peer::new(at, source));
    }

    /// Another control function has a client's address now.
    fn claimed(&mut self, at: SimTime, source: u8, data: &[u8]) {
        let Ok(name) = data.try_into().map(u64::from_le_bytes) else { return };
        if self.peer(source).is_some_and(|peer| peer.is_another(Name(name))) {
            self.peers.retain(|peer| peer.address != source);
            self.tell(at, source, What::Lost);
        }
    }

    fn peer(&mut self, source: u8) -> Option<&mut Peer> {
        self.peers.iter_mut().find(|peer| peer.address == source)
    }

    fn carried(&mut self, at: SimTime, carried: Carried, out: &mut Vec<CanFrame>) {
        if let Carried::Received { pgn, source, is_broadcast: false, bytes } = carried
            && pgn == PROCESS_DATA.pgn
        {
            self.process(at, source, &bytes, out);
        }
    }

    /// Said to everyone: a client's status may be.
    fn heard(&mut self, at: SimTime, source: u8, data: &[u8]) {
        if data.first().is_some_and(|first| first & 0xF == command::CLIENT_STATUS)
            && !self.trouble.is_silent
            && let Some(peer) = self.peer(source)
        {
            peer.heard(at);
        }
    }

    fn process(&mut self, at: SimTime, source: u8, data: &[u8], out: &mut Vec<CanFrame>) {
        let Some(first) = data.first().copied().filter(|_| data.len() >= 8) else { return };
        self.heard(at, source, data);
        // One that is busy says nothing but that.
        if self.trouble.is_busy {
            return;
        }
        let known = self.peers.iter().position(|peer| peer.address == source && !peer.is_gone());
        match (first & 0xF, known) {
            // Whoever asks is told: a client may ask before it introduces itself.
            (command::TECHNICAL, _) if first >> 4 == 0 => {
                let version = [0x10, 4, 0xFF, 0x01 | 0x10, 0, 1, u8::MAX, 0];
                self.send(source, version, out);
                if known.is_some() {
                    self.send(source, multiplexed(command::TECHNICAL, &[]), out);
                }
            }
            (command::TECHNICAL, Some(place)) if first >> 4 == 1 => {
                let told = data.get(1).copied().unwrap_or_default();
                self.peers.iter_mut().skip(place).take(1).for_each(|peer| peer.versioned(told));
            }
            (command::DESCRIPTOR, Some(place)) => self.described(at, place, data, out),
            (command::VALUE | command::SET_AND_ACKNOWLEDGE, Some(place)) => self.valued(at, place, data, out),
            (command::ACKNOWLEDGE, Some(_)) => {
                let told = ProcessData::read(data.get(..8).unwrap_or_default());
                if let (Some(told), Some(bits)) = (told, data.get(4).copied().filter(|bits| *bits != 0)) {
                    self.tell(at, source, What::NotTaken(told.element, told.ddi, bits));
                }
            }
            (4..=9, Some(_)) => {
                if let Some(told) = ProcessData::read(data.get(..8).unwrap_or_default()) {
                    self.send(source, told.acknowledged(refusal::COMMAND), out);
                }
            }
            (
                command::DESCRIPTOR | command::VALUE | command::SET_AND_ACKNOWLEDGE | command::ACKNOWLEDGE,
                None,
            ) => {
                self.unknown(source, out);
            }
            _ => {}
        }
    }

    /// Who did not introduce itself is refused (AgIsoStack++, `nack_process_data_command`).
    fn unknown(&self, source: u8, out: &mut Vec<CanFrame>) {
        let Some(ours) = self.address else { return };
        let [low, middle, high, _] = PROCESS_DATA.pgn.to_le_bytes();
        let id = J1939Id { destination: source, ..REQUEST_ACKNOWLEDGEMENT.id(ours) };
        out.extend(CanFrame::new(id.id(), &[1, 0xFF, 0xFF, 0xFF, source, low, middle, high]));
    }

    /// About its pool.
    fn described(&mut self, at: SimTime, place: usize, data: &[u8], out: &mut Vec<CanFrame>) {
        let refusal = self.trouble.refusal;
        let Some(peer) = self.peers.get_mut(place) else { return };
        let client = peer.address;
        match peer.described(data, refusal) {
            Answer::Nothing => {}
            Answer::Unknown => self.unknown(client, out),
            Answer::Say(bytes) => self.send(client, bytes, out),
            Answer::Refuse(bytes, error) => {
                self.send(client, bytes, out);
                if let Some(error) = error {
                    self.tell(at, client, What::Refused(error));
                }
            }
            Answer::Activate(bytes, sections) => {
                self.send(client, bytes, out);
                self.tell(at, client, What::Active { sections });
                self.wish(at, place, out);
            }
            Answer::Lose(bytes) => {
                self.send(client, bytes, out);
                self.tell(at, client, What::Lost);
            }
        }
    }

    /// It tells a value.
    fn valued(&mut self, at: SimTime, place: usize, data: &[u8], out: &mut Vec<CanFrame>) {
        let Some(told) = ProcessData::read(data.get(..8).unwrap_or_default()) else { return };
        let Some(peer) = self.peers.get_mut(place) else { return };
        let client = peer.address;
        let refusals = peer.told(told);
        if refusals == 0 {
            self.tell(at, client, What::Told(told));
        }
        if refusals != 0 || told.command == command::SET_AND_ACKNOWLEDGE {
            self.send(client, told.acknowledged(refusals), out);
        }
    }

    /// What is wanted of a client is said to it, if its pool is in use.
    fn wish(&mut self, at: SimTime, place: usize, out: &mut Vec<CanFrame>) {
        if self.trouble.is_busy {
            return;
        }
        let (wishes, Some(peer)) = (&self.wishes, self.peers.get_mut(place)) else { return };
        let (client, messages) = (peer.address, peer.wishes(at, wishes));
        self.is_told |=
            !self.trouble.is_lost && messages.iter().any(|message| message.command == command::VALUE);
        for message in messages {
            self.send(client, message.bytes(), out);
        }
    }

    fn send(&self, client: u8, bytes: [u8; 8], out: &mut Vec<CanFrame>) {
        if let Some(ours) = self.address {
            out.extend(process_data::frame((ours, client), bytes));
        }
    }
}

/// Its language: the same as its pools'.
fn language(message: &'static Message, _: SimTime) -> Option<Payload> {
    let [l0, l1, l2, l3, l4, l5, l6] = LOCALIZATION;
    (message.pgn == LANGUAGE.pgn).then(|| Payload::of(&[l0, l1, l2, l3, l4, l5, l6, 0xFF]))
}
