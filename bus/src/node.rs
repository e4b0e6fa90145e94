//! A control function on the bus: claims its address, answers requests, sends what is due. No I/O and no clock: simulated time is handed
//! in, frames come out.
//!
//! Calling order: [`Node::open`] when a bus (or another port of it) opens; [`Node::handle`] for every frame received; [`Node::poll`] at
//! [`Node::next`]. Each appends the frames to send.

use std::time::Duration;

use rowscan_protocol::time::SimTime;

use super::frame::{CanFrame, EVERYONE, J1939Id, NO_ADDRESS};
use super::message::{Message, Payload};
use super::name::Name;
use super::pgn::network::{ADDRESS_CLAIMED, REQUEST, REQUEST_ACKNOWLEDGEMENT};

/// Nothing else is said until an address has been claimed for so long without contradiction (ISO 11783-5).
const CONTENTION: Duration = Duration::from_millis(250);
/// Addresses a self-configurable control function may take.
const FREE_ADDRESSES: std::ops::RangeInclusive<u8> = 128..=247;

/// Gives the bytes of a message at an instant; `None` where there is nothing to say.
pub type Compose<'a> = &'a mut dyn FnMut(&'static Message, SimTime) -> Option<Payload>;

/// The address claim of a control function.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AddressState {
    /// No bus is open.
    Off,
    /// The address has been claimed and may still be contradicted, until then.
    Claiming(u8, SimTime),
    /// It has its address.
    Claimed(u8),
    /// Another with a better NAME has the address; nothing is sent any more.
    Lost(u8),
}

/// One control function.
#[derive(Clone, Debug)]
pub struct Node {
    name: Name,
    preferred: u8,
    address: AddressState,
    /// Addresses of others, by their claims.
    taken: [bool; 256],
    /// The best NAME that claimed the preferred address before this one did.
    earlier: Option<Name>,
    periodic: Vec<Periodic>,
    on_request: &'static [&'static Message],
    /// Sent once when the address is ours.
    at_start: &'static [&'static Message],
    started: bool,
    fast_packets: u8,
}

#[derive(Clone, Copy, Debug)]
struct Periodic {
    message: &'static Message,
    period: Duration,
    due: SimTime,
}

impl Node {
    /// A control function that wants the address `preferred`. It sends of `messages` those with a period by their period, all on
    /// request, and `at_start` once when it has its address.
    pub fn new(
        name: Name,
        preferred: u8,
        messages: &'static [&'static Message],
        at_start: &'static [&'static Message],
    ) -> Self {
        let periodic = messages.iter().filter_map(|message| {
            let period = Duration::from_millis(message.period_ms?.into());
            Some(Periodic { message, period, due: SimTime::ZERO })
        });
        Self {
            name,
            preferred,
            address: AddressState::Off,
            taken: [false; 256],
            earlier: None,
            periodic: periodic.collect(),
            on_request: messages,
            at_start,
            started: false,
            fast_packets: 0,
        }
    }

    /// The state of its address claim.
    pub fn address_state(&self) -> AddressState {
        self.address
    }

    /// A bus opens at `at`: the address is claimed. With a bus already open, whoever is new there hears the claim.
    pub fn open(&mut self, at: SimTime, out: &mut Vec<CanFrame>) {
        match self.address {
            AddressState::Off => {
                self.claim(self.preferred, at, out);
                // Who claimed it before has heard no other claim, and need not repeat its own.
                if let Some(name) = self.earlier.take().filter(|name| *name < self.name) {
                    self.rival(self.preferred, name, at, out);
                }
            }
            _ => self.tell_claim(out),
        }
    }

    /// The same where it has sat on the bus for long: its claim stands, and it speaks from `at` on.
    pub fn open_settled(&mut self, at: SimTime, out: &mut Vec<CanFrame>) {
        self.open(at, out);
        if let AddressState::Claiming(address, _) = self.address {
            self.address = AddressState::Claiming(address, at);
        }
    }

    /// It has been off the bus, or off altogether: it claims anew, and knows of nobody.
    pub fn restart(&mut self, at: SimTime, out: &mut Vec<CanFrame>) {
        if self.address == AddressState::Off {
            return;
        }
        self.taken = [false; 256];
        self.started = false;
        self.claim(self.preferred, at, out);
    }

    /// A frame was received.
    pub fn handle(&mut self, at: SimTime, frame: &CanFrame, compose: Compose<'_>, out: &mut Vec<CanFrame>) {
        let Some(id) = J1939Id::of(frame.id).filter(|_| !frame.remote) else { return };
        if id.pgn == ADDRESS_CLAIMED.pgn {
            let name = frame.data().try_into().map(u64::from_le_bytes).map(Name);
            if let Ok(name) = name {
                self.rival(id.source, name, at, out);
            }
        } else if id.pgn == REQUEST.pgn {
            let &[low, middle, high, ..] = frame.data() else { return };
            self.requested(u32::from_le_bytes([low, middle, high, 0]), id, at, compose, out);
        }
    }

    /// When [`Node::poll`] has something to do.
    pub fn next(&self) -> Option<SimTime> {
        match self.address {
            AddressState::Off | AddressState::Lost(_) => None,
            AddressState::Claiming(_, until) => Some(until),
            AddressState::Claimed(_) => self.periodic.iter().map(|periodic| periodic.due).min(),
        }
    }

    /// Sends what is due at `at`.
    pub fn poll(&mut self, at: SimTime, compose: Compose<'_>, out: &mut Vec<CanFrame>) {
        if let AddressState::Claiming(address, until) = self.address
            && until <= at
        {
            self.address = AddressState::Claimed(address);
            for periodic in &mut self.periodic {
                periodic.due = not_before(until, periodic.period);
            }
        }
        let AddressState::Claimed(address) = self.address else { return };
        if !std::mem::replace(&mut self.started, true) {
            for message in self.at_start {
                self.send(message, address, at, compose, out);
            }
        }
        for index in 0..self.periodic.len() {
            let Some(Periodic { message, period, due }) = self.periodic.get(index).copied() else { continue };
            if due <= at {
                if let Some(periodic) = self.periodic.get_mut(index) {
                    periodic.due = not_before(at + Duration::from_nanos(1), period);
                }
                self.send(message, address, due, compose, out);
            }
        }
    }

    /// Sends a message now, out of turn, if the address is ours.
    pub fn say(&mut self, message: &'static Message, payload: &Payload, out: &mut Vec<CanFrame>) {
        if let AddressState::Claimed(address) = self.address {
            self.pack(message, address, payload, out);
        }
    }

    fn claim(&mut self, address: u8, at: SimTime, out: &mut Vec<CanFrame>) {
        self.address = AddressState::Claiming(address, at + CONTENTION);
        self.tell_claim(out);
    }

    fn tell_claim(&self, out: &mut Vec<CanFrame>) {
        let source = match self.address {
            AddressState::Off => return,
            AddressState::Claiming(address, _) | AddressState::Claimed(address) => address,
            AddressState::Lost(_) => NO_ADDRESS,
        };
        let id = J1939Id { destination: EVERYONE, ..ADDRESS_CLAIMED.id(source) };
        out.extend(CanFrame::new(id.id(), &self.name.0.to_le_bytes()));
    }

    /// Another control function claims `address`.
    fn rival(&mut self, address: u8, name: Name, at: SimTime, out: &mut Vec<CanFrame>) {
        if name == self.name {
            return;
        }
        if let Some(taken) = self.taken.get_mut(usize::from(address)) {
            *taken = true;
        }
        let ours = match self.address {
            AddressState::Claiming(ours, _) | AddressState::Claimed(ours) => ours,
            AddressState::Off if address == self.preferred => {
                self.earlier = Some(self.earlier.map_or(name, |earlier| earlier.min(name)));
                return;
            }
            AddressState::Off | AddressState::Lost(_) => return,
        };
        if ours != address {
            return;
        }
        if self.name < name {
            self.tell_claim(out);
            return;
        }
        let mut free =
            FREE_ADDRESSES.filter(|address| !self.taken.get(usize::from(*address)).is_some_and(|t| *t));
        match free.next().filter(|_| self.name.is_self_configurable()) {
            Some(other) => self.claim(other, at, out),
            None => {
                self.address = AddressState::Lost(address);
                self.tell_claim(out);
            }
        }
    }

    fn requested(
        &mut self,
        pgn: u32,
        by: J1939Id,
        at: SimTime,
        compose: Compose<'_>,
        out: &mut Vec<CanFrame>,
    ) {
        let address = match self.address {
            AddressState::Claimed(address) | AddressState::Claiming(address, _) => Some(address),
            AddressState::Lost(_) => None,
            AddressState::Off => return,
        };
        let for_us = by.destination == EVERYONE || Some(by.destination) == address;
        if for_us && pgn == ADDRESS_CLAIMED.pgn {
            self.tell_claim(out);
            return;
        }
        let AddressState::Claimed(address) = self.address else { return };
        if !for_us {
            return;
        }
        match self.on_request.iter().find(|message| message.pgn == pgn) {
            Some(message) => self.send(message, address, at, compose, out),
            // What was asked of us alone is refused aloud, what was asked of everyone in silence.
            None if by.destination == address => {
                let [low, middle, high, _] = pgn.to_le_bytes();
                let refusal = [1, 0xFF, 0xFF, 0xFF, by.source, low, middle, high];
                let id = J1939Id { destination: EVERYONE, ..REQUEST_ACKNOWLEDGEMENT.id(address) };
                out.extend(CanFrame::new(id.id(), &refusal));
            }
            None => {}
        }
    }

    fn send(
        &mut self,
        message: &'static Message,
        address: u8,
        at: SimTime,
        compose: Compose<'_>,
        out: &mut Vec<CanFrame>,
    ) {
        if let Some(payload) = compose(message, at) {
            self.pack(message, address, &payload, out);
        }
    }

    /// One frame, or an NMEA 2000 fast packet: a sequence number of three bits, a frame number of five, the length in the first frame.
    fn pack(&mut self, message: &Message, address: u8, payload: &Payload, out: &mut Vec<CanFrame>) {
        let (id, bytes) = (message.id(address).id(), payload.bytes());
        if bytes.len() <= 8 {
            out.extend(CanFrame::new(id, bytes));
            return;
        }
        let sequence = self.fast_packets << 5;
        self.fast_packets = self.fast_packets.wrapping_add(1) & 0x07;
        let (first, rest) = bytes.split_at(bytes.len().min(6));
        let mut frame = [0xFF; 8];
        frame[0] = sequence;
        frame[1] = bytes.len() as u8;
        for (place, byte) in frame.iter_mut().skip(2).zip(first) {
            *place = *byte;
        }
        out.extend(CanFrame::new(id, &frame));
        for (number, chunk) in (1u8..).zip(rest.chunks(7)) {
            let mut frame = [0xFF; 8];
            frame[0] = sequence | number & 0x1F;
            for (place, byte) in frame.iter_mut().skip(1).zip(chunk) {
                *place = *byte;
            }
            out.extend(CanFrame::new(id, &frame));
        }
    }
}

/// The first whole multiple of `period` at or after `at`: messages keep step with simulated time, whenever the bus opened.
fn not_before(at: SimTime, period: Duration) -> SimTime {
    let period = (period.as_nanos() as u64).max(1);
    SimTime(at.0.div_ceil(period).saturating_mul(period))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pgn::gnss::POSITION;
    use crate::pgn::tractor::{GROUND_SPEED, WHEEL_SPEED};

    const MS: u64 = 1_000_000;

    fn node(name: Name) -> Node {
        Node::new(name, 0xF0, &[&WHEEL_SPEED, &GROUND_SPEED, &POSITION], &[])
    }

    fn blank(message: &'static Message, _: SimTime) -> Option<Payload> {
        Some(Payload::blank(message.len))
    }

    fn claim_of(name: Name, address: u8) -> CanFrame {
        CanFrame::new(ADDRESS_CLAIMED.id(address).id(), &name.0.to_le_bytes()).unwrap()
    }

    fn request(pgn: u32, destination: u8) -> CanFrame {
        let id = J1939Id { destination, ..REQUEST.id(0x80) };
        CanFrame::new(id.id(), &pgn.to_le_bytes()[..3]).unwrap()
    }

    #[test]
    fn it_claims_waits_a_quarter_second_and_then_keeps_step() {
        let (mut node, mut out) = (node(Name::tractor()), Vec::new());
        node.open(SimTime(30 * MS), &mut out);
        assert_eq!(out, [claim_of(Name::tractor(), 0xF0)]);
        assert_eq!(node.next(), Some(SimTime(280 * MS)));
        out.clear();
        node.poll(SimTime(280 * MS), &mut blank, &mut out);
        assert_eq!((out.len(), node.next()), (0, Some(SimTime(300 * MS))));
        node.poll(SimTime(300 * MS), &mut blank, &mut out);
        assert_eq!((out.len(), node.next()), (2, Some(SimTime(400 * MS))));
    }

    /// Who was on the bus before has heard no other claim, and repeats its own to nobody.
    #[test]
    fn a_claim_that_was_there_before_counts() {
        for (earlier, keeps) in [(Name(u64::MAX), true), (Name(1), false)] {
            let (mut node, mut out) = (node(Name::tractor()), Vec::new());
            node.handle(SimTime::ZERO, &claim_of(earlier, 0xF0), &mut blank, &mut out);
            node.handle(SimTime::ZERO, &claim_of(Name(0), 0x27), &mut blank, &mut out);
            assert_eq!(out, [], "it is not on the bus yet");
            node.open_settled(SimTime(20 * MS), &mut out);
            let last = claim_of(Name::tractor(), if keeps { 0xF0 } else { NO_ADDRESS });
            assert_eq!(out.last(), Some(&last), "{earlier:?}");
            out.clear();
            node.poll(SimTime(1000 * MS), &mut blank, &mut out);
            node.poll(SimTime(1100 * MS), &mut blank, &mut out);
            assert_eq!(!out.is_empty(), keeps, "{earlier:?}");
        }
    }

    #[test]
    fn the_smaller_name_keeps_the_address() {
        let (mut node, mut out) = (node(Name::tractor()), Vec::new());
        node.open(SimTime::ZERO, &mut out);
        out.clear();
        node.handle(SimTime(MS), &claim_of(Name(u64::MAX), 0xF0), &mut blank, &mut out);
        assert_eq!(out, [claim_of(Name::tractor(), 0xF0)]);
        out.clear();
        node.handle(SimTime(2 * MS), &claim_of(Name(1), 0xF0), &mut blank, &mut out);
        assert_eq!(node.address_state(), AddressState::Lost(0xF0));
        assert_eq!(out, [claim_of(Name::tractor(), NO_ADDRESS)], "cannot claim");
        out.clear();
        node.poll(SimTime(1000 * MS), &mut blank, &mut out);
        node.handle(SimTime(1001 * MS), &request(WHEEL_SPEED.pgn, EVERYONE), &mut blank, &mut out);
        assert_eq!((out.len(), node.next()), (0, None), "silent");
        node.handle(SimTime(1002 * MS), &request(ADDRESS_CLAIMED.pgn, EVERYONE), &mut blank, &mut out);
        assert_eq!(out, [claim_of(Name::tractor(), NO_ADDRESS)]);
    }

    #[test]
    fn a_self_configurable_one_takes_the_next_free_address() {
        let mut node = Node::new(Name::canopy(0), 128, &[&WHEEL_SPEED], &[]);
        let mut out = Vec::new();
        node.open(SimTime::ZERO, &mut out);
        node.handle(SimTime(MS), &claim_of(Name(9), 129), &mut blank, &mut out);
        out.clear();
        node.handle(SimTime(2 * MS), &claim_of(Name(1), 128), &mut blank, &mut out);
        assert_eq!(out, [claim_of(Name::canopy(0), 130)]);
        assert_eq!(node.address_state(), AddressState::Claiming(130, SimTime(252 * MS)));
    }

    #[test]
    fn requests_are_answered_refused_or_passed_over() {
        let (mut node, mut out) = (node(Name::tractor()), Vec::new());
        node.open(SimTime::ZERO, &mut out);
        node.poll(SimTime(250 * MS), &mut blank, &mut out);
        out.clear();
        node.handle(SimTime(251 * MS), &request(WHEEL_SPEED.pgn, 0xF0), &mut blank, &mut out);
        assert_eq!(J1939Id::of(out[0].id).unwrap().pgn, WHEEL_SPEED.pgn);
        out.clear();
        node.handle(SimTime(252 * MS), &request(65_260, EVERYONE), &mut blank, &mut out);
        node.handle(SimTime(252 * MS), &request(65_260, 0x33), &mut blank, &mut out);
        assert!(out.is_empty());
        node.handle(SimTime(252 * MS), &request(65_260, 0xF0), &mut blank, &mut out);
        assert_eq!(
            out[0].data(),
            [1, 0xFF, 0xFF, 0xFF, 0x80, 0xEC, 0xFE, 0x00],
            "a negative acknowledgement"
        );
    }

    #[test]
    fn long_messages_go_as_fast_packets() {
        let (mut node, mut out) = (node(Name::tractor()), Vec::new());
        node.open(SimTime::ZERO, &mut out);
        node.poll(SimTime(250 * MS), &mut blank, &mut out);
        out.clear();
        let bytes: Vec<u8> = (0..43).collect();
        let payload = Payload::of(&bytes);
        node.say(&POSITION, &payload, &mut out);
        node.say(&POSITION, &payload, &mut out);
        assert_eq!(out.len(), 14);
        assert_eq!(out[0].data(), [0x00, 43, 0, 1, 2, 3, 4, 5]);
        assert_eq!(out[1].data(), [0x01, 6, 7, 8, 9, 10, 11, 12]);
        assert_eq!(out[6].data(), [0x06, 41, 42, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF]);
        assert_eq!(out[7].data()[0], 0x20, "the next sequence");
    }

    #[test]
    fn frames_of_others_and_nonsense_are_passed_over() {
        let (mut node, mut out) = (node(Name::tractor()), Vec::new());
        let short = CanFrame::new(REQUEST.id(1).id(), &[1]).unwrap();
        let claim = CanFrame::new(ADDRESS_CLAIMED.id(0xF0).id(), &[1, 2, 3]).unwrap();
        node.open(SimTime::ZERO, &mut out);
        out.clear();
        for frame in [short, claim, CanFrame::remote(REQUEST.id(1).id(), 3).unwrap()] {
            node.handle(SimTime::ZERO, &frame, &mut blank, &mut out);
        }
        assert!(out.is_empty());
    }
}
