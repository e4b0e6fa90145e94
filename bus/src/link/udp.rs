//! python-can's `udp_multicast`: every frame a datagram, a MessagePack map of the message's attributes.

use std::collections::HashMap;
use std::io;
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr};

use rowscan_protocol::time::SimTime;
use socket2::{Domain, Protocol, Socket, Type};
use tokio::net::UdpSocket;
use tokio::sync::mpsc;

use super::{BusError, PortListener};
use crate::port_event::{OutgoingFrame, PortEvent};
use crate::{CanFrame, CanId};

/// Largest datagram looked at.
const LARGEST: usize = 2048;
/// Keys of a message, at most; python-can sends eleven.
const MOST_KEYS: usize = 32;

/// The datagram of a frame.
pub fn encode(at: SimTime, frame: &CanFrame) -> Vec<u8> {
    let mut out = vec![0x80 | 11];
    let key = |out: &mut Vec<u8>, name: &str| {
        out.push(0xA0 | name.len() as u8);
        out.extend_from_slice(name.as_bytes());
    };
    let flag = |value: bool| if value { 0xC3 } else { 0xC2 };
    key(&mut out, "timestamp");
    out.push(0xCB);
    out.extend_from_slice(&at.as_secs_f64().to_be_bytes());
    key(&mut out, "arbitration_id");
    out.push(0xCE);
    out.extend_from_slice(&frame.id.bits().to_be_bytes());
    for (name, value) in [
        ("is_extended_id", frame.id.is_extended()),
        ("is_remote_frame", frame.remote),
        ("is_error_frame", false),
        ("is_fd", false),
        ("bitrate_switch", false),
        ("error_state_indicator", false),
    ] {
        key(&mut out, name);
        out.push(flag(value));
    }
    key(&mut out, "channel");
    out.push(0xC0);
    key(&mut out, "dlc");
    out.push(frame.len());
    key(&mut out, "data");
    out.extend_from_slice(&[0xC4, frame.data().len() as u8]);
    out.extend_from_slice(frame.data());
    out
}

/// A value of the map, as far as a message needs it.
#[derive(Clone, Debug, PartialEq)]
enum Value<'a> {
    Unsigned(u64),
    Flag(bool),
    Bytes(&'a [u8]),
    Other,
}

/// Reads the datagram of a classic CAN frame; `None` for anything else: errors, CAN FD, nonsense.
pub fn decode(datagram: &[u8]) -> Option<CanFrame> {
    let mut at = datagram;
    let keys = match take::<1>(&mut at)?[0] {
        head @ 0x80..=0x8F => usize::from(head & 0x0F),
        0xDE => usize::from(u16::from_be_bytes(take(&mut at)?)),
        _ => return None,
    };
    let mut found = HashMap::new();
    for _ in 0..keys.min(MOST_KEYS) {
        let Value::Bytes(key) = value(&mut at)? else { return None };
        found.insert(key, value(&mut at)?);
    }
    let flag = |key: &str| found.get(key.as_bytes()) == Some(&Value::Flag(true));
    if flag("is_error_frame") || flag("is_fd") {
        return None;
    }
    let Some(Value::Unsigned(id)) = found.get("arbitration_id".as_bytes()) else { return None };
    let id = CanId::new(u32::try_from(*id).ok()?, flag("is_extended_id"))?;
    if flag("is_remote_frame") {
        let Some(Value::Unsigned(len)) = found.get("dlc".as_bytes()) else { return None };
        return CanFrame::remote(id, u8::try_from(*len).ok()?);
    }
    let Some(Value::Bytes(data)) = found.get("data".as_bytes()) else { return None };
    CanFrame::new(id, data)
}

fn take<const N: usize>(at: &mut &[u8]) -> Option<[u8; N]> {
    let (head, rest) = at.split_first_chunk::<N>()?;
    *at = rest;
    Some(*head)
}

fn bytes<'a>(at: &mut &'a [u8], count: usize) -> Option<&'a [u8]> {
    let (head, rest) = at.split_at_checked(count)?;
    *at = rest;
    Some(head)
}

/// One value: no maps and no arrays, which no message holds.
fn value<'a>(at: &mut &'a [u8]) -> Option<Value<'a>> {
    Some(match take::<1>(at)?[0] {
        small @ 0x00..=0x7F => Value::Unsigned(small.into()),
        text @ 0xA0..=0xBF => Value::Bytes(bytes(at, usize::from(text & 0x1F))?),
        0xC0 => Value::Other,
        flag @ (0xC2 | 0xC3) => Value::Flag(flag == 0xC3),
        0xC4 | 0xD9 => {
            let [count] = take(at)?;
            Value::Bytes(bytes(at, count.into())?)
        }
        0xCA => take::<4>(at).map(|_| Value::Other)?,
        0xCB | 0xD3 => take::<8>(at).map(|_| Value::Other)?,
        0xCC => Value::Unsigned(take::<1>(at)?[0].into()),
        0xCD => Value::Unsigned(u16::from_be_bytes(take(at)?).into()),
        0xCE => Value::Unsigned(u32::from_be_bytes(take(at)?).into()),
        0xCF => Value::Unsigned(u64::from_be_bytes(take(at)?)),
        0xD0 => take::<1>(at).map(|_| Value::Other)?,
        0xD1 => take::<2>(at).map(|_| Value::Other)?,
        0xD2 => take::<4>(at).map(|_| Value::Other)?,
        0xE0..=0xFF => Value::Other,
        _ => return None,
    })
}

/// A member of the group.
#[derive(Debug)]
pub struct UdpLink {
    group: SocketAddr,
    listening: UdpSocket,
    sending: UdpSocket,
}

impl UdpLink {
    pub(super) fn open(group: SocketAddr) -> Result<Self, BusError> {
        let failed =
            |cause| BusError::Network { what: "the multicast group", address: group.to_string(), cause };
        let listening = member(group).map_err(failed)?;
        let sending = speaker(group).map_err(failed)?;
        Ok(Self { group, listening, sending })
    }

    pub(super) fn group(&self) -> SocketAddr {
        self.group
    }

    pub(super) async fn run(self, mut queue: mpsc::Receiver<OutgoingFrame>, ear: PortListener) {
        let ours = self.sending.local_addr().map(|address| address.port()).ok();
        let mut datagram = vec![0; LARGEST];
        loop {
            tokio::select! {
                received = self.listening.recv_from(&mut datagram) => {
                    let Ok((count, from)) = received else {
                        rowscan_ports::clock::retry_pause().await;
                        continue;
                    };
                    // The group echoes what we say.
                    let frame = datagram.get(..count).filter(|_| Some(from.port()) != ours).and_then(decode);
                    if let Some(frame) = frame {
                        ear.hear(PortEvent::Frame(frame)).await;
                    }
                }
                frame = queue.recv() => {
                    let Some(OutgoingFrame { at, what, pending: _pending, .. }) = frame else { return };
                    let Some(frame) = what.frame() else { continue };
                    if let Err(cause) = self.sending.send_to(&encode(at, frame), self.group).await {
                        tracing::debug!(%cause, "a datagram was not sent");
                    }
                }
            }
        }
    }
}

fn socket(group: SocketAddr) -> io::Result<Socket> {
    let socket = Socket::new(Domain::for_address(group), Type::DGRAM, Some(Protocol::UDP))?;
    socket.set_nonblocking(true)?;
    Ok(socket)
}

/// Hears the group. Several programs on this machine may.
fn member(group: SocketAddr) -> io::Result<UdpSocket> {
    let socket = socket(group)?;
    socket.set_reuse_address(true)?;
    #[cfg(unix)]
    socket.set_reuse_port(true)?;
    match group.ip() {
        IpAddr::V4(ip) => {
            socket.bind(&SocketAddr::from((Ipv4Addr::UNSPECIFIED, group.port())).into())?;
            // Without a route for multicast there is still this machine.
            socket
                .join_multicast_v4(&ip, &Ipv4Addr::UNSPECIFIED)
                .or_else(|_| socket.join_multicast_v4(&ip, &Ipv4Addr::LOCALHOST))?;
        }
        IpAddr::V6(ip) => {
            socket.bind(&SocketAddr::from((Ipv6Addr::UNSPECIFIED, group.port())).into())?;
            socket.join_multicast_v6(&ip, 0)?;
        }
    }
    UdpSocket::from_std(socket.into())
}

/// Speaks to the group, no farther than the next machine.
fn speaker(group: SocketAddr) -> io::Result<UdpSocket> {
    let socket = socket(group)?;
    match group.ip() {
        IpAddr::V4(_) => {
            socket.set_multicast_ttl_v4(1)?;
            socket.set_multicast_loop_v4(true)?;
            socket.bind(&SocketAddr::from((Ipv4Addr::UNSPECIFIED, 0)).into())?;
        }
        IpAddr::V6(_) => {
            socket.set_multicast_hops_v6(1)?;
            socket.set_multicast_loop_v6(true)?;
            socket.bind(&SocketAddr::from((Ipv6Addr::UNSPECIFIED, 0)).into())?;
        }
    }
    UdpSocket::from_std(socket.into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_come_back_as_they_went() {
        let extended = CanId::new(0x18FE_4980, true).unwrap();
        for frame in [
            CanFrame::new(extended, &[1, 2, 3]).unwrap(),
            CanFrame::new(CanId::new(0x7FF, false).unwrap(), &[]).unwrap(),
            CanFrame::remote(extended, 5).unwrap(),
        ] {
            assert_eq!(decode(&encode(SimTime(1), &frame)), Some(frame));
        }
    }

    #[test]
    fn no_datagram_is_trusted() {
        let whole = encode(SimTime(1), &CanFrame::new(CanId::Standard(1), &[1, 2]).unwrap());
        for cut in 0..whole.len() {
            assert_eq!(decode(&whole[..cut]), None, "{cut}");
        }
        for byte in 0..=255u8 {
            for at in 0..whole.len() {
                let mut bent = whole.clone();
                bent[at] = byte;
                let _ = decode(&bent);
            }
        }
    }
}
