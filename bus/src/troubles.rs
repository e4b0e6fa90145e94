//! What goes wrong on a bus, without I/O: controllers off it, others' frames, nodes that should not be there.
//!
//! Calling order: [`Troubles::begin`] and [`Troubles::end`] as faults come and go; [`Troubles::poll`] at [`Troubles::next`];
//! [`Troubles::carry`] for what the tractor says and what is heard. Each gives what then goes out.

use std::time::Duration;

use rowscan_fault_table::bus::BusFault;
use rowscan_protocol::can::CanId;
use rowscan_protocol::time::SimTime;

use crate::CanFrame;
use crate::error_frame::ErrorFrame;
use crate::frame::J1939Id;
use crate::name::{Name, NameParts};
use crate::node::Node;
use crate::pgn::TRACTOR_ADDRESS;
use crate::tractor::TractorEcu;

/// The machine's bus, bits a second.
const BITS_S: f64 = 250_000.0;
/// Error frames a second while nobody acknowledges.
const ACK_ERRORS_S: f64 = 10.0;
/// Frames that nodes answer one another with at one instant; more is a quarrel without end.
const MOST_ANSWERS: usize = 64;
/// What fills the bus: proprietary, lowest priority, an address that nobody has here.
const FILLER: J1939Id =
    J1939Id { priority: 7, pgn: 0xFF00, source: 0xFB, destination: crate::frame::EVERYONE };

/// Who says something.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Speaker {
    /// Our tractor.
    Tractor,
    /// Whoever is behind this port.
    Port(usize),
    /// A node that only a fault has brought.
    Ghost(u64),
}

/// What goes out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Carried {
    /// A frame, and who said it.
    Frame(Speaker, CanFrame),
    /// What controllers tell their hosts.
    Error(ErrorFrame),
}

/// A node that should not be there.
#[derive(Debug)]
enum Ghost {
    Tractor(Box<TractorEcu>),
    Node(Node),
}

impl Ghost {
    fn next(&self) -> Option<SimTime> {
        match self {
            Self::Tractor(ecu) => ecu.next(),
            Self::Node(node) => node.next(),
        }
    }

    fn open(&mut self, at: SimTime, out: &mut Vec<CanFrame>) {
        match self {
            Self::Tractor(ecu) => ecu.open(at, out),
            Self::Node(node) => node.open(at, out),
        }
    }

    fn handle(&mut self, at: SimTime, frame: &CanFrame, out: &mut Vec<CanFrame>) {
        match self {
            // It obeys nobody: commands would be carried out twice.
            Self::Tractor(ecu) => ecu.overhear(at, frame, out),
            Self::Node(node) => node.handle(at, frame, &mut |_, _| None, out),
        }
    }

    fn poll(&mut self, at: SimTime, out: &mut Vec<CanFrame>) {
        match self {
            Self::Tractor(ecu) => ecu.poll(at, out),
            Self::Node(node) => node.poll(at, &mut |_, _| None, out),
        }
    }
}

#[derive(Debug)]
struct Trouble {
    key: u64,
    fault: BusFault,
    ghost: Option<Ghost>,
    /// When it tells or sends something by itself next, and how often.
    beat: Option<(SimTime, Duration)>,
}

/// All that is wrong with one bus.
#[derive(Debug, Default)]
pub struct Troubles(Vec<Trouble>);

impl Troubles {
    /// A fault begins; what it changes about our tractor is done.
    pub fn begin(&mut self, key: u64, fault: BusFault, at: SimTime, ecu: &mut TractorEcu) -> Vec<Carried> {
        let mut out = Vec::new();
        let beats = |per_s: f64| Some((at, Duration::from_secs_f64(1.0 / per_s)));
        let (ghost, beat) = match fault {
            BusFault::Off { .. } => {
                out.push(Carried::Error(ErrorFrame::bus_off()));
                (None, None)
            }
            BusFault::Passive { counters: (tx, rx) } => {
                out.push(Carried::Error(ErrorFrame::counters(tx, rx)));
                (None, None)
            }
            BusFault::Load { share } => {
                let bits = f64::from(filler(0).map_or(1, |frame| frame.bits_at_most()));
                (None, beats(share * BITS_S / bits))
            }
            BusFault::Error { per_s, .. } => (None, beats(per_s)),
            BusFault::AckNone => (None, beats(ACK_ERRORS_S)),
            BusFault::AddressSteal { address } => {
                let thief = Node::new(Name(0), address.unwrap_or(TRACTOR_ADDRESS), &[], &[]);
                (Some(Ghost::Node(thief)), None)
            }
            BusFault::NoTecu => (None, None),
            BusFault::TwoTecu { address, speed_ratio } => {
                let name = NameParts { identity: 3, function_instance: 1, ..Name::tractor_parts() };
                (Some(Ghost::Tractor(Box::new(ecu.twin(name.into(), address, speed_ratio)))), None)
            }
            BusFault::NameClash { address } => {
                (Some(Ghost::Node(Node::new(Name::tractor(), address, &[], &[]))), None)
            }
        };
        let mut claims = Vec::new();
        let ghost = ghost.map(|mut ghost| {
            ghost.open(at, &mut claims);
            ghost
        });
        self.0.push(Trouble { key, fault, ghost, beat });
        out.extend(self.carry(
            at,
            ecu,
            claims.into_iter().map(|frame| (Speaker::Ghost(key), frame)).collect(),
        ));
        out
    }

    /// The fault of this key is over.
    pub fn end(&mut self, key: u64, at: SimTime, ecu: &mut TractorEcu) -> Vec<Carried> {
        let Some(number) = self.0.iter().position(|trouble| trouble.key == key) else { return Vec::new() };
        let ended = self.0.remove(number);
        let mut out = Vec::new();
        let mut claims = Vec::new();
        match ended.fault {
            BusFault::Off { .. } => {
                out.push(Carried::Error(ErrorFrame::restarted()));
                ecu.restart(at, &mut claims);
            }
            BusFault::Passive { .. } => out.push(Carried::Error(ErrorFrame::active())),
            BusFault::NoTecu | BusFault::AddressSteal { .. } => ecu.restart(at, &mut claims),
            _ => {}
        }
        out.extend(self.carry(at, ecu, claims.into_iter().map(|frame| (Speaker::Tractor, frame)).collect()));
        out
    }

    /// When [`Troubles::poll`] has something to do.
    pub fn next(&self) -> Option<SimTime> {
        let due = |trouble: &Trouble| {
            let ghost = trouble.ghost.as_ref().and_then(Ghost::next);
            ghost.into_iter().chain(trouble.beat.map(|(at, _)| at)).min()
        };
        self.0.iter().filter_map(due).min()
    }

    /// Does what is due at `at`.
    pub fn poll(&mut self, at: SimTime, ecu: &mut TractorEcu) -> Vec<Carried> {
        let (mut said, mut out) = (Vec::new(), Vec::new());
        for trouble in &mut self.0 {
            let key = trouble.key;
            while let Some((due, every)) = trouble.beat.filter(|(due, _)| *due <= at) {
                trouble.beat = Some((due + every, every));
                match trouble.fault {
                    BusFault::Load { .. } => {
                        said.extend(filler(due.0).map(|frame| (Speaker::Ghost(key), frame)));
                    }
                    BusFault::Error { code, .. } => out.push(Carried::Error(ErrorFrame::protocol(code))),
                    _ => out.push(Carried::Error(ErrorFrame::not_acknowledged())),
                }
            }
            if let Some(ghost) =
                trouble.ghost.as_mut().filter(|ghost| ghost.next().is_some_and(|due| due <= at))
            {
                let mut frames = Vec::new();
                ghost.poll(at, &mut frames);
                said.extend(frames.into_iter().map(|frame| (Speaker::Ghost(key), frame)));
            }
        }
        out.extend(self.carry(at, ecu, said));
        out
    }

    /// What of `said` passes, and what our tractor and those who should not be there answer.
    pub fn carry(
        &mut self,
        at: SimTime,
        ecu: &mut TractorEcu,
        said: Vec<(Speaker, CanFrame)>,
    ) -> Vec<Carried> {
        let mut said = said;
        let (mut next, mut out) = (0, Vec::new());
        while let Some(&(speaker, frame)) = said.get(next) {
            next += 1;
            if self.is_off() || (speaker == Speaker::Tractor && self.silences_tractor()) {
                continue;
            }
            out.push(Carried::Frame(speaker, frame));
            if said.len() > MOST_ANSWERS + next {
                continue;
            }
            let mut answers = Vec::new();
            if speaker != Speaker::Tractor && !self.is(|fault| matches!(fault, BusFault::NoTecu)) {
                ecu.handle(at, &frame, &mut answers);
            }
            said.extend(answers.drain(..).map(|frame| (Speaker::Tractor, frame)));
            for trouble in &mut self.0 {
                let Some(ghost) = trouble.ghost.as_mut().filter(|_| speaker != Speaker::Ghost(trouble.key))
                else {
                    continue;
                };
                ghost.handle(at, &frame, &mut answers);
                said.extend(answers.drain(..).map(|frame| (Speaker::Ghost(trouble.key), frame)));
            }
        }
        out
    }

    fn is(&self, which: impl Fn(&BusFault) -> bool) -> bool {
        self.0.iter().any(|trouble| which(&trouble.fault))
    }

    fn is_off(&self) -> bool {
        self.is(|fault| matches!(fault, BusFault::Off { .. }))
    }

    fn silences_tractor(&self) -> bool {
        self.is(|fault| matches!(fault, BusFault::NoTecu | BusFault::AckNone))
    }
}

/// A frame that nobody needs.
fn filler(number: u64) -> Option<CanFrame> {
    let id: CanId = FILLER.id();
    CanFrame::new(id, &number.to_le_bytes())
}
