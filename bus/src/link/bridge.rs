//! The CAN bridge of AgOpenGPS's task controller: every frame a datagram of 13 bytes.
//!
//! ```text
//! id: u32 little endian, bit 31 set for an extended one    length: u8    data: 8 bytes
//! ```
//!
//! Facts: `AOGCANBridgePlugin` of AOG-TaskController. It listens, and answers who spoke last; so does a port that listens here.

use std::net::SocketAddr;

use rowscan_ports::Tally;
use tokio::net::UdpSocket;
use tokio::sync::mpsc;

use super::{BusError, PortListener, listen_udp};
use crate::port_event::{OutgoingFrame, PortEvent};
use crate::{CanFrame, CanId};

/// What it is, in messages.
const WHAT: &str = "a CAN bridge by UDP";
/// Bytes of a datagram.
pub const LENGTH: usize = 13;
/// The bit of an identifier that says that it is an extended one.
const EXTENDED: u32 = 1 << 31;
/// The largest datagram looked at: a longer one is refused as a whole.
const LARGEST: usize = 64;

/// The datagram of a frame; none of a remote one, which it cannot say.
pub fn encode(frame: &CanFrame) -> Option<[u8; LENGTH]> {
    if frame.remote {
        return None;
    }
    let id = frame.id.bits() | if frame.id.is_extended() { EXTENDED } else { 0 };
    let mut out = [0; LENGTH];
    let (head, data) = out.split_at_mut(5);
    let [a, b, c, d] = id.to_le_bytes();
    head.copy_from_slice(&[a, b, c, d, frame.len()]);
    data.iter_mut().zip(frame.data()).for_each(|(to, from)| *to = *from);
    Some(out)
}

/// Reads a datagram; none where it is no frame: another length, an identifier or a count of bytes that no frame has.
pub fn decode(datagram: &[u8]) -> Option<CanFrame> {
    let [a, b, c, d, count, data @ ..]: [u8; LENGTH] = datagram.try_into().ok()?;
    let id = u32::from_le_bytes([a, b, c, d]);
    CanFrame::new(CanId::new(id & !EXTENDED, id & EXTENDED != 0)?, data.get(..usize::from(count))?)
}

/// Who is at the other end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Peer {
    /// A bridge that listens at this address.
    At(SocketAddr),
    /// Whoever spoke last, once somebody has.
    Last(Option<SocketAddr>),
}

/// A bridge to a bus elsewhere.
#[derive(Debug)]
pub struct BridgeLink {
    socket: UdpSocket,
    address: SocketAddr,
    peer: Peer,
}

impl BridgeLink {
    /// Speaks to the bridge that listens at `place`.
    pub(super) async fn to(place: &str) -> Result<Self, BusError> {
        let failed = |cause| BusError::Network { what: WHAT, address: place.to_owned(), cause };
        let mut found = tokio::net::lookup_host(place).await.map_err(failed)?;
        let nobody = || std::io::Error::new(std::io::ErrorKind::NotFound, "the name has no address");
        let to = found.next().ok_or_else(|| failed(nobody()))?;
        // A bridge on this machine is spoken to from this machine only.
        let own = match (to.is_ipv4(), to.ip().is_loopback()) {
            (true, true) => "127.0.0.1:0",
            (true, false) => "0.0.0.0:0",
            (false, true) => "[::1]:0",
            (false, false) => "[::]:0",
        };
        let socket = UdpSocket::bind(own).await.map_err(failed)?;
        Ok(Self { socket, address: to, peer: Peer::At(to) })
    }

    /// Listens at `place`.
    pub(super) async fn at(place: &str) -> Result<Self, BusError> {
        let (socket, address) = listen_udp(WHAT, place).await?;
        Ok(Self { socket, address, peer: Peer::Last(None) })
    }

    /// The bridge, or where this one listens.
    pub(super) fn address(&self) -> SocketAddr {
        self.address
    }

    pub(super) async fn run(mut self, mut queue: mpsc::Receiver<OutgoingFrame>, ear: PortListener) {
        let (mut datagram, wrong) = (vec![0; LARGEST], Tally::default());
        loop {
            tokio::select! {
                received = self.socket.recv_from(&mut datagram) => {
                    // A peer that is not there yet is told by an error here.
                    let Ok((count, from)) = received else {
                        rowscan_ports::clock::retry_pause().await;
                        continue;
                    };
                    match &mut self.peer {
                        Peer::At(bridge) if *bridge != from => continue,
                        Peer::At(_) => {}
                        Peer::Last(last) => {
                            if last.replace(from).is_none() {
                                ear.hear(PortEvent::Opened).await;
                            }
                        }
                    }
                    match decode(datagram.get(..count).unwrap_or_default()) {
                        Some(frame) => ear.hear(PortEvent::Frame(frame)).await,
                        None => {
                            if let Some(so_far) = wrong.count() {
                                tracing::warn!("{from}: no CAN frame: expected {LENGTH} bytes with an identifier of 11 or 29 bits and a length of 0 to 8, found {count} bytes ({so_far} so far)");
                            }
                        }
                    }
                }
                frame = queue.recv() => {
                    let Some(OutgoingFrame { what, pending: _pending, .. }) = frame else { return };
                    let (Peer::At(to) | Peer::Last(Some(to))) = self.peer else { continue };
                    let Some(bytes) = what.frame().and_then(encode) else { continue };
                    if let Err(cause) = self.socket.send_to(&bytes, to).await {
                        tracing::debug!(%cause, "a datagram was not sent");
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn a_frame_is_the_sheets_datagram() {
        // Element 2 sends DDI 290, sections 1 and 3 on: from 0x80 to 0xF7.
        let data = [0x23, 0, 0x22, 1, 0x11, 0xFF, 0xFF, 0xFF];
        let bytes = [0x80, 0xF7, 0xCB, 0x8C, 8, 0x23, 0, 0x22, 1, 0x11, 0xFF, 0xFF, 0xFF];
        let frame = CanFrame::new(CanId::new(0x0CCB_F780, true).unwrap(), &data).unwrap();
        assert_eq!((encode(&frame), decode(&bytes)), (Some(bytes), Some(frame)));
        assert_eq!(encode(&CanFrame::remote(frame.id, 3).unwrap()), None);
    }

    proptest! {
        #[test]
        fn frames_come_back_as_they_went(
            id in 0..0x2000_0000_u32,
            is_extended: bool,
            data in prop::collection::vec(any::<u8>(), 0..=8),
        ) {
            let id = CanId::new(if is_extended { id } else { id & 0x7FF }, is_extended).unwrap();
            let frame = CanFrame::new(id, &data).unwrap();
            prop_assert_eq!(encode(&frame).as_ref().and_then(|bytes| decode(bytes)), Some(frame));
        }

        #[test]
        fn only_whole_frames_are_heard(bytes in prop::collection::vec(any::<u8>(), 0..30)) {
            let is_frame = decode(&bytes).is_some();
            prop_assert!(!is_frame || (bytes.len() == LENGTH && bytes[4] <= 8));
        }
    }
}
