//! A machine module of AgOpenGPS: section states in its UDP frames, as duties on the bus.
//!
//! ```text
//! 80 81 SOURCE GROUP LENGTH payload CHECKSUM    checksum: low byte of the sum from SOURCE to the payload's end
//! ```
//!
//! Facts: AgOpenGPS 81ed098b and its Boards a03b2c6. Modules of that firmware do not look at the checksum, so a frame with a wrong one is obeyed here,
//! too, and told.

use std::net::SocketAddr;

use rowscan_ports::Tally;
use tokio::net::UdpSocket;
use tokio::sync::mpsc;

use super::{BusError, PortListener, listen_udp};
use crate::CanFrame;
use crate::pgn::sprayer::{SECTION_DUTIES, SECTIONS};
use crate::port_event::{OutgoingFrame, PortEvent};

/// Largest datagram looked at.
const LARGEST: usize = 512;
/// What a frame begins with.
const MARK: [u8; 2] = [0x80, 0x81];
/// Bytes before the payload.
const HEAD: usize = 5;

/// Groups that are heard, with where their section states begin in the payload.
const STEER: u8 = 254;
const MACHINE: u8 = 239;
const SECTIONS_64: u8 = 229;
const HELLO: u8 = 200;

/// Bytes of section states that have a place in a message on the bus: sections 1 to 16.
const CARRIED: usize = SECTION_DUTIES.len();

/// Why a datagram is no frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum FrameError {
    /// It begins otherwise.
    #[error("expected a frame that begins with 80 81")]
    Mark,
    /// It ends before its payload.
    #[error("expected {expected} bytes of payload, found {found}")]
    Cut {
        /// By its own length, or as many as the group has.
        expected: usize,
        /// Those that came.
        found: usize,
    },
}

/// A frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Frame<'a> {
    /// What it is about.
    pub group: u8,
    /// What it says.
    pub payload: &'a [u8],
    /// True if its checksum is right.
    pub is_summed: bool,
}

impl<'a> Frame<'a> {
    /// Reads a datagram.
    ///
    /// # Errors
    /// Another beginning, or less payload than it says.
    pub fn read(datagram: &'a [u8]) -> Result<Self, FrameError> {
        let [m0, m1, _, group, length] = datagram.first_chunk::<HEAD>().ok_or(FrameError::Mark)?;
        if [*m0, *m1] != MARK {
            return Err(FrameError::Mark);
        }
        let (expected, rest) = (usize::from(*length), datagram.get(HEAD..).unwrap_or_default());
        let payload = rest.get(..expected).ok_or(FrameError::Cut { expected, found: rest.len() })?;
        let summed = datagram.get(MARK.len()..HEAD + expected).unwrap_or_default();
        let sum = summed.iter().fold(0_u8, |sum, byte| sum.wrapping_add(*byte));
        Ok(Self { group: *group, payload, is_summed: rest.get(expected) == Some(&sum) })
    }

    /// Its section states, section 1 in the lowest bit of the first byte; none of a group that has none.
    fn sections(&self) -> Option<Result<&'a [u8], FrameError>> {
        let (from, count) = match self.group {
            STEER | MACHINE => (6, 2),
            // Eight bytes; one description says that the group ends with them, the program adds two of speeds.
            SECTIONS_64 => (0, 8),
            _ => return None,
        };
        let (expected, found) = (from + count, self.payload.len());
        Some(self.payload.get(from..expected).ok_or(FrameError::Cut { expected, found }))
    }
}

/// What a module makes of the frames that it hears.
#[derive(Clone, Debug, Default)]
pub struct Module {
    /// States of sections 1 to 16.
    relays: [u8; CARRIED],
    /// A group for machine modules was heard: the states for steering modules do not count any more.
    hears_machine: bool,
}

/// What there is to tell of a frame that was obeyed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Remarks {
    /// Its checksum is wrong: the program would not have taken it.
    pub is_unsummed: bool,
    /// It opens a section above 16, which no message on the bus carries.
    pub is_beyond: bool,
}

impl Module {
    /// Takes a datagram; appends the frames for the bus, and the answer.
    ///
    /// # Errors
    /// It is no frame, or cut short.
    pub fn take(
        &mut self,
        datagram: &[u8],
        answer: &mut Vec<u8>,
        out: &mut Vec<CanFrame>,
    ) -> Result<Remarks, FrameError> {
        let frame = Frame::read(datagram)?;
        if frame.group == HELLO {
            let [low, high] = self.relays;
            // Its last byte is no checksum.
            answer.extend_from_slice(&[0x80, 0x81, 0x7B, 0x7B, 5, low, high, 0, 0, 0, 0x47]);
            return Ok(Remarks::default());
        }
        let Some(states) = frame.sections() else { return Ok(Remarks::default()) };
        let states = states?;
        if frame.group == STEER && self.hears_machine {
            return Ok(Remarks::default());
        }
        self.hears_machine |= frame.group != STEER;
        let (own, beyond) = states.split_at(CARRIED.min(states.len()));
        self.relays.iter_mut().zip(own).for_each(|(relay, state)| *relay = *state);
        for (state, (_, message)) in own.iter().zip(SECTION_DUTIES) {
            let duty = |bit: usize| Some(if state >> bit & 1 == 1 { 100.0 } else { 0.0 });
            let duties: Vec<Option<f64>> = (0..SECTIONS).map(duty).collect();
            out.extend(CanFrame::new(message.id(message.source).id(), message.encode(&duties).bytes()));
        }
        Ok(Remarks { is_unsummed: !frame.is_summed, is_beyond: beyond.iter().any(|state| *state != 0) })
    }
}

/// A module on the network.
#[derive(Debug)]
pub struct AgopengpsLink {
    socket: UdpSocket,
    address: SocketAddr,
}

impl AgopengpsLink {
    pub(super) async fn open(place: &str) -> Result<Self, BusError> {
        let (socket, address) = listen_udp("a module of AgOpenGPS", place).await?;
        Ok(Self { socket, address })
    }

    pub(super) fn address(&self) -> SocketAddr {
        self.address
    }

    pub(super) async fn run(self, mut queue: mpsc::Receiver<OutgoingFrame>, ear: PortListener) {
        let (mut module, mut datagram) = (Module::default(), vec![0; LARGEST]);
        let (wrong, unsummed, beyond) = (Tally::default(), Tally::default(), Tally::default());
        loop {
            let (count, from) = tokio::select! {
                received = self.socket.recv_from(&mut datagram) => match received {
                    Ok(received) => received,
                    Err(_) => {
                        rowscan_ports::clock::retry_pause().await;
                        continue;
                    }
                },
                // What is said on the bus has no frame there.
                frame = queue.recv() => {
                    if frame.is_none() {
                        return;
                    }
                    continue;
                }
            };
            let (mut answer, mut out) = (Vec::new(), Vec::new());
            match module.take(datagram.get(..count).unwrap_or_default(), &mut answer, &mut out) {
                Ok(remarks) => {
                    if let Some(so_far) = remarks.is_unsummed.then(|| unsummed.count()).flatten() {
                        tracing::warn!(
                            "{from}: a frame of AgOpenGPS with a wrong checksum is obeyed, as its modules do ({so_far} so far)"
                        );
                    }
                    if let Some(so_far) = remarks.is_beyond.then(|| beyond.count()).flatten() {
                        tracing::warn!(
                            "{from}: sections above {} have no message on the bus; they stay shut ({so_far} so far)",
                            8 * CARRIED
                        );
                    }
                }
                Err(why) => {
                    if let Some(so_far) = wrong.count() {
                        tracing::warn!("{from}: no frame of AgOpenGPS: {why} ({so_far} so far)");
                    }
                }
            }
            for frame in out {
                ear.hear(PortEvent::Frame(frame)).await;
            }
            if !answer.is_empty() {
                let _ = self.socket.send_to(&answer, from).await;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::J1939Id;
    use crate::pgn::sprayer::section_duties;

    /// Sections that a datagram opens, the answer, and what there is to tell.
    fn told(module: &mut Module, datagram: &[u8]) -> (Vec<u16>, Vec<u8>, Result<Remarks, FrameError>) {
        let (mut answer, mut out) = (Vec::new(), Vec::new());
        let remarks = module.take(datagram, &mut answer, &mut out);
        let open = out.iter().flat_map(|frame| {
            let pgn = J1939Id::of(frame.id).map(|id| id.pgn).unwrap();
            section_duties(pgn, frame.data()).collect::<Vec<_>>()
        });
        (open.filter(|(_, duty)| *duty == 1.0).map(|(number, _)| number).collect(), answer, remarks)
    }

    /// A frame from the program with its checksum.
    fn frame(group: u8, payload: &[u8]) -> Vec<u8> {
        let mut out = vec![0x80, 0x81, 0x7F, group, payload.len() as u8];
        out.extend_from_slice(payload);
        let sum = out[2..].iter().fold(0_u8, |sum, byte| sum.wrapping_add(*byte));
        out.push(sum);
        out
    }

    // The sheet's vectors: sections 1 and 3.
    const MACHINE_FRAME: [u8; 14] = [0x80, 0x81, 0x7F, 0xEF, 8, 0, 0x36, 0, 0, 0, 0, 5, 0, 0xB1];
    const STEER_FRAME: [u8; 14] = [0x80, 0x81, 0x7F, 0xFE, 8, 0x36, 0, 1, 0xC8, 0, 0x7F, 5, 0, 8];
    const SECTIONS_FRAME: [u8; 16] = [0x80, 0x81, 0x7F, 0xE5, 10, 5, 0, 0, 0, 0, 0, 0, 0, 0x36, 0x36, 0xDF];

    #[test]
    fn each_group_opens_its_sections() {
        for datagram in [&MACHINE_FRAME[..], &STEER_FRAME, &SECTIONS_FRAME] {
            let (open, answer, remarks) = told(&mut Module::default(), datagram);
            assert_eq!(
                (open, answer.len(), remarks),
                (vec![1, 3], 0, Ok(Remarks::default())),
                "{datagram:?}"
            );
        }
        // Without the two speeds, and with every section of 16.
        let (open, _, remarks) =
            told(&mut Module::default(), &frame(SECTIONS_64, &[0xFF, 0xFF, 0, 0, 0, 0, 0, 0]));
        assert_eq!((open, remarks), ((1..=16).collect(), Ok(Remarks::default())));
    }

    #[test]
    fn what_steering_modules_are_told_does_not_count_beside_a_group_for_machines() {
        let mut module = Module::default();
        assert_eq!(told(&mut module, &STEER_FRAME).0, [1, 3]);
        assert_eq!(told(&mut module, &frame(MACHINE, &[0, 0, 0, 0, 0, 0, 2, 1])).0, [2, 9]);
        assert_eq!(told(&mut module, &STEER_FRAME), (vec![], vec![], Ok(Remarks::default())));
        // The answer to a hello has the relays as they are.
        let hello = [0x80, 0x81, 0x7F, 0xC8, 3, 0x38, 0, 0, 0x47];
        let answer = [0x80, 0x81, 0x7B, 0x7B, 5, 2, 1, 0, 0, 0, 0x47];
        assert_eq!(told(&mut module, &hello), (vec![], answer.to_vec(), Ok(Remarks::default())));
    }

    #[test]
    fn a_wrong_checksum_is_obeyed_and_told_and_a_cut_frame_is_not_obeyed() {
        let mut bent = MACHINE_FRAME;
        bent[13] ^= 1;
        let (open, _, remarks) = told(&mut Module::default(), &bent);
        assert_eq!((open, remarks), (vec![1, 3], Ok(Remarks { is_unsummed: true, is_beyond: false })));
        for count in 0..MACHINE_FRAME.len() - 1 {
            let (open, _, remarks) = told(&mut Module::default(), &MACHINE_FRAME[..count]);
            assert!(open.is_empty() && remarks.is_err(), "{count}: {remarks:?}");
        }
        let short = told(&mut Module::default(), &frame(MACHINE, &[0; 7]));
        assert_eq!(short.2, Err(FrameError::Cut { expected: 8, found: 7 }));
        let beyond = frame(SECTIONS_64, &[1, 0, 1, 0, 0, 0, 0, 0]);
        let (open, _, remarks) = told(&mut Module::default(), &beyond);
        assert_eq!((open, remarks), (vec![1], Ok(Remarks { is_unsummed: false, is_beyond: true })));
    }

    proptest! {
        #[test]
        fn every_state_of_sixteen_sections_arrives(low: u8, high: u8, group in prop::sample::select(vec![MACHINE, STEER])) {
            let (open, ..) = told(&mut Module::default(), &frame(group, &[9, 9, 9, 9, 9, 9, low, high]));
            let states = u16::from_le_bytes([low, high]);
            prop_assert_eq!(open, (1..=16).filter(|number| states >> (number - 1) & 1 == 1).collect::<Vec<u16>>());
        }

        #[test]
        fn no_datagram_is_trusted(bytes in prop::collection::vec(any::<u8>(), 0..40), is_marked: bool) {
            let mut bytes = bytes;
            if is_marked {
                bytes.iter_mut().zip(MARK).for_each(|(byte, mark)| *byte = mark);
            }
            let _ = told(&mut Module::default(), &bytes);
        }
    }
}
