//! What goes wrong on a bus, without I/O: controllers off it, others' frames, nodes that should not be there.
//!
//! Calling order: [`Troubles::begin`] and [`Troubles::end`] as faults come and go; [`Troubles::poll`] at [`Troubles::next`];
//! [`Troubles::carry`] for what the tractor says and what is heard. Each gives what then goes out.

use std::time::Duration;

use rowscan_protocol::can::CanId;
use rowscan_protocol::time::SimTime;
use rowscan_settings::fault_table::bus::BusFault;

use crate::error_frame::ErrorFrame;
use crate::frame::J1939Id;
use crate::name::{Name, NameParts};
use crate::node::Node;
use crate::pgn::TRACTOR_ADDRESS;
use crate::tractor::TractorEcu;
use crate::{CanFrame, Origin};

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
    /// Whoever is behind a port.
    Port(Origin),
    /// The rig's control function with this place, beside the tractor.
    Function(usize),
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
    Node(Box<Node>),
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
                (Some(Ghost::Node(Box::new(thief))), None)
            }
            BusFault::NoTecu => (None, None),
            BusFault::TwoTecu { address, speed_ratio } => {
                let name = NameParts { identity: 3, function_instance: 1, ..Name::tractor_parts() };
                (Some(Ghost::Tractor(Box::new(ecu.twin(name.into(), address, speed_ratio)))), None)
            }
            BusFault::NameClash { address } => {
                (Some(Ghost::Node(Box::new(Node::new(Name::tractor(), address, &[], &[])))), None)
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pgn::tractor::GROUND_SPEED;
    use rowscan_vehicle::Tractor;
    use rowscan_vehicle::gnss::{Gnss, Receiver};
    use rowscan_vehicle::trajectory::Trajectory;

    const MS: u64 = 1_000_000;
    /// When the fault begins and ends.
    const SPAN: (u64, u64) = (2000, 4000);

    /// What goes out in six seconds, with the fault between two and four, by the millisecond.
    fn heard(fault: Option<BusFault>) -> Vec<(u64, Carried)> {
        let tractor = Tractor::new(Trajectory::straight(0.0, 1.0));
        tractor.begin(SimTime::ZERO);
        let mut ecu = TractorEcu::new(tractor, Receiver::new(Gnss::default(), 1));
        let (mut troubles, mut all, mut said) = (Troubles::default(), Vec::new(), Vec::new());
        ecu.open(SimTime::ZERO, &mut said);
        for ms in 0..6000 {
            let at = SimTime(ms * MS);
            let mut out = Vec::new();
            if let Some(fault) = fault.filter(|_| ms == SPAN.0) {
                out.extend(troubles.begin(1, fault, at, &mut ecu));
            }
            if ms == SPAN.1 {
                out.extend(troubles.end(1, at, &mut ecu));
            }
            if troubles.next().is_some_and(|due| due <= at) {
                out.extend(troubles.poll(at, &mut ecu));
            }
            if ecu.next().is_some_and(|due| due <= at) {
                ecu.poll(at, &mut said);
            }
            let frames = said.drain(..).map(|frame| (Speaker::Tractor, frame)).collect();
            out.extend(troubles.carry(at, &mut ecu, frames));
            all.extend(out.into_iter().map(|carried| (ms, carried)));
        }
        all
    }

    /// Ground speeds a second: of the tractor, and of others, m/s each.
    fn speeds(all: &[(u64, Carried)], from_ms: u64) -> (Vec<f64>, Vec<f64>) {
        let (mut ours, mut others) = (Vec::new(), Vec::new());
        for (ms, carried) in all {
            let Carried::Frame(_, frame) = carried else { continue };
            let Some(id) = J1939Id::of(frame.id).filter(|id| id.pgn == GROUND_SPEED.pgn) else { continue };
            let speed = GROUND_SPEED.decode(frame.data()).into_iter().flatten().next().expect("a speed");
            if (from_ms..from_ms + 1000).contains(ms) {
                if id.source == TRACTOR_ADDRESS { ours.push(speed) } else { others.push(speed) }
            }
        }
        (ours, others)
    }

    fn errors(all: &[(u64, Carried)]) -> Vec<(u64, u32)> {
        let error = |(ms, carried): &(u64, Carried)| match carried {
            Carried::Error(error) => Some((*ms, error.class)),
            Carried::Frame(..) => None,
        };
        all.iter().filter_map(error).collect()
    }

    fn claims(all: &[(u64, Carried)]) -> Vec<(u64, u8)> {
        let claim = |(ms, carried): &(u64, Carried)| match carried {
            Carried::Frame(_, frame) => {
                let id = J1939Id::of(frame.id)?;
                (id.pgn == crate::pgn::network::ADDRESS_CLAIMED.pgn).then_some((*ms, id.source))
            }
            Carried::Error(_) => None,
        };
        all.iter().filter_map(claim).collect()
    }

    #[test]
    fn without_a_fault_the_tractor_speaks_all_the_time() {
        let all = heard(None);
        assert_eq!((errors(&all), claims(&all)), (vec![], vec![(0, TRACTOR_ADDRESS)]));
        for from_ms in [1000, 2500, 4500] {
            assert_eq!((speeds(&all, from_ms).0.len(), speeds(&all, from_ms).1.len()), (10, 0));
        }
    }

    #[test]
    fn what_silences_the_tractor_ends_with_a_new_claim_and_its_frames() {
        let (begin, end) = SPAN;
        for (fault, told) in [
            (BusFault::Off { restart: None }, vec![(begin, 0x40), (end, 0x100)]),
            (BusFault::NoTecu, vec![]),
            (BusFault::AddressSteal { address: None }, vec![]),
        ] {
            let all = heard(Some(fault));
            let count = |from_ms| speeds(&all, from_ms).0.len();
            assert_eq!((count(1000), count(2500)), (10, 0), "{fault:?}");
            // It may speak 250 ms after its claim.
            assert!((7..=10).contains(&count(4250)), "{fault:?}: {}", count(4250));
            assert_eq!(errors(&all), told, "{fault:?}");
            assert!(claims(&all).contains(&(end, TRACTOR_ADDRESS)), "{fault:?}: {:?}", claims(&all));
        }
        let stolen = claims(&heard(Some(BusFault::AddressSteal { address: None })));
        assert_eq!(
            stolen.iter().filter(|(ms, _)| *ms == begin).map(|(_, address)| *address).collect::<Vec<_>>(),
            [TRACTOR_ADDRESS, 0xFE]
        );
    }

    #[test]
    fn nobody_acknowledges_and_nothing_is_heard() {
        let all = heard(Some(BusFault::AckNone));
        assert_eq!((speeds(&all, 2500).0.len(), speeds(&all, 4500).0.len()), (0, 10));
        let told = errors(&all);
        assert_eq!((told.len(), told[0]), (20, (SPAN.0, 0x20 | 0x80)));
    }

    #[test]
    fn two_tractors_tell_two_speeds() {
        let all = heard(Some(BusFault::TwoTecu { address: 241, speed_ratio: 1.5 }));
        let (ours, others) = speeds(&all, 2500);
        assert_eq!((ours.len(), others.len()), (10, 10));
        assert!(
            ours.iter().all(|speed| *speed == 1.0) && others.iter().all(|speed| *speed == 1.5),
            "{others:?}"
        );
        assert_eq!(speeds(&all, 4500).1.len(), 0);
    }

    #[test]
    fn a_name_twice_is_claimed_at_another_address() {
        let all = heard(Some(BusFault::NameClash { address: 200 }));
        assert_eq!(claims(&all), [(0, TRACTOR_ADDRESS), (SPAN.0, 200)]);
    }

    #[test]
    fn the_bus_is_filled_by_its_share() {
        let all = heard(Some(BusFault::Load { share: 0.5 }));
        let bits: u32 = all
            .iter()
            .filter_map(|(_, carried)| match carried {
                Carried::Frame(Speaker::Ghost(_), frame) => Some(frame.bits_at_most()),
                _ => None,
            })
            .sum();
        // Half of 250 kbit/s for two seconds.
        assert!((f64::from(bits) - 250_000.0).abs() < 1000.0, "{bits}");
    }

    #[test]
    fn errors_are_told_at_their_rate_and_states_once() {
        let all = heard(Some(BusFault::Error { code: 4, per_s: 5.0 }));
        assert_eq!(errors(&all).len(), 10);
        assert_eq!(speeds(&all, 2500).0.len(), 10, "frames pass");
        let all = heard(Some(BusFault::Passive { counters: (130, 0) }));
        assert_eq!(errors(&all), [(SPAN.0, 0x204), (SPAN.1, 0x004)]);
    }
}
