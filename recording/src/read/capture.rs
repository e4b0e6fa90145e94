//! Network captures: pcap and pcapng files, packet by packet.
//!
//! Read by hand and not by the `pcap-file` crate, which takes every pcapng time for nanoseconds and panics on damaged options.

use super::segment::{LinkType, segment};
use super::tcp::{Connections, Flows};
use super::torn::Torn;

/// First bytes of pcapng.
const SECTION: u32 = 0x0A0D_0D0A;
/// In a section header; shows the byte order.
const BYTE_ORDER: u32 = 0x1A2B_3C4D;
const INTERFACE: u32 = 1;
const SIMPLE_PACKET: u32 = 3;
const ENHANCED_PACKET: u32 = 6;
/// Option of an interface: units of its times.
const TIME_RESOLUTION: u16 = 9;
/// Magic numbers of pcap: times in microseconds, in nanoseconds.
const MICROSECONDS: u32 = 0xA1B2_C3D4;
const NANOSECONDS: u32 = 0xA1B2_3C4D;

/// What a capture holds.
#[derive(Debug, Default)]
pub(super) struct Capture {
    /// Both directions of every TCP connection.
    pub(super) connections: Vec<Flows>,
    /// When its first packet came, ns since 1970.
    pub(super) began_ns: Option<u64>,
    /// Where it ended too early.
    pub(super) torn: Option<Torn>,
}

/// The capture in a file; none if it is something else.
pub(super) fn read(file: &[u8]) -> Option<Capture> {
    let magic = file.first_chunk().map(|bytes| u32::from_be_bytes(*bytes))?;
    let mut packets = Packets::default();
    let mut cursor = Cursor { file, at: 0, little: false };
    let torn = match magic {
        SECTION => packets.pcapng(&mut cursor),
        _ if [MICROSECONDS, NANOSECONDS].contains(&magic) => packets.pcap(&mut cursor),
        _ if [MICROSECONDS, NANOSECONDS].contains(&magic.swap_bytes()) => {
            cursor.little = true;
            packets.pcap(&mut cursor)
        }
        _ => return None,
    };
    Some(Capture { connections: packets.connections.flows(), began_ns: packets.began_ns, torn: torn.err() })
}

/// Where packets go.
#[derive(Default)]
struct Packets {
    connections: Connections,
    /// Time of the first packet.
    began_ns: Option<u64>,
}

/// How an interface captures.
#[derive(Clone, Copy)]
struct Interface {
    link: LinkType,
    /// Units of time a second.
    units: u64,
}

impl Packets {
    fn take(&mut self, interface: Interface, time: u64, data: &[u8]) {
        let at_ns = u128::from(time) * 1_000_000_000 / u128::from(interface.units.max(1));
        let at_ns = u64::try_from(at_ns).unwrap_or(u64::MAX);
        self.began_ns.get_or_insert(at_ns);
        if let Some(segment) = segment(interface.link, data) {
            self.connections.push(&segment, at_ns);
        }
    }

    fn pcap(&mut self, cursor: &mut Cursor<'_>) -> Result<(), Torn> {
        let units = if cursor.u32()? == NANOSECONDS { 1_000_000_000 } else { 1_000_000 };
        // Version, time zone, accuracy, longest packet.
        cursor.take(16)?;
        let interface = Interface { link: LinkType(cursor.u32()? & 0xFFFF), units };
        while !cursor.ended() {
            let start = cursor.at;
            let (seconds, fraction) = (cursor.u32()?, cursor.u32()?);
            let (len, _) = (cursor.u32()?, cursor.u32()?);
            let data = cursor.take(len as usize).map_err(|torn| Torn { offset: start as u64, ..torn })?;
            let time = u64::from(seconds) * units + u64::from(fraction);
            self.take(interface, time, data);
        }
        Ok(())
    }

    fn pcapng(&mut self, cursor: &mut Cursor<'_>) -> Result<(), Torn> {
        let mut interfaces = Vec::new();
        while !cursor.ended() {
            let start = cursor.at;
            let kind = cursor.u32()?;
            if kind == SECTION {
                let order = cursor.peek_at(start + 8)?;
                cursor.little = order == BYTE_ORDER.swap_bytes();
                if !cursor.little && order != BYTE_ORDER {
                    let found = format!("{order:08X}");
                    return Err(Torn { offset: start as u64 + 8, expected: "a byte order mark", found });
                }
                interfaces.clear();
            }
            let len = cursor.u32()? as usize;
            // Type, length, and the length again at the end.
            let Some(body) = len.checked_sub(12).filter(|body| body.is_multiple_of(4)) else {
                let expected = "a block length, a multiple of 4";
                return Err(Torn { offset: start as u64 + 4, expected, found: len.to_string() });
            };
            let body = cursor.take(body).map_err(|torn| Torn { offset: start as u64, ..torn })?;
            cursor.take(4)?;
            let mut body = Cursor { file: body, at: 0, little: cursor.little };
            // A block that is shorter than its kind takes nothing; the next one is where the length says.
            let _ = self.block(kind, &mut body, &mut interfaces);
        }
        Ok(())
    }

    fn block(
        &mut self,
        kind: u32,
        body: &mut Cursor<'_>,
        interfaces: &mut Vec<Interface>,
    ) -> Result<(), Torn> {
        match kind {
            INTERFACE => {
                let link = LinkType(u32::from(body.u16()?));
                body.take(6)?;
                interfaces.push(Interface { link, units: time_units(body) });
            }
            ENHANCED_PACKET => {
                let interface = body.u32()? as usize;
                let time = u64::from(body.u32()?) << 32 | u64::from(body.u32()?);
                let (len, _) = (body.u32()?, body.u32()?);
                let data = body.take(len as usize)?;
                if let Some(interface) = interfaces.get(interface) {
                    self.take(*interface, time, data);
                }
            }
            SIMPLE_PACKET => {
                let len = body.u32()? as usize;
                let data = body.take(len.min(body.rest()))?;
                if let Some(interface) = interfaces.first() {
                    // These have no time.
                    self.take(*interface, 0, data);
                }
            }
            _ => {}
        }
        Ok(())
    }
}

/// Units of time a second, from an interface's options; microseconds unless they say otherwise.
fn time_units(options: &mut Cursor<'_>) -> u64 {
    while let (Ok(code), Ok(len)) = (options.u16(), options.u16()) {
        let Ok(value) = options.take(usize::from(len).next_multiple_of(4)) else { break };
        if let (TIME_RESOLUTION, Some(&resolution)) = (code, value.first()) {
            let power = u32::from(resolution & 0x7F);
            let base: u64 = if resolution & 0x80 == 0 { 10 } else { 2 };
            return base.saturating_pow(power);
        }
    }
    1_000_000
}

/// Reads numbers in either byte order.
struct Cursor<'a> {
    file: &'a [u8],
    at: usize,
    little: bool,
}

impl<'a> Cursor<'a> {
    fn ended(&self) -> bool {
        self.rest() == 0
    }

    fn rest(&self) -> usize {
        self.file.len().saturating_sub(self.at)
    }

    fn take(&mut self, len: usize) -> Result<&'a [u8], Torn> {
        let taken = self.at.checked_add(len).and_then(|end| self.file.get(self.at..end));
        let taken = taken.ok_or_else(|| Torn {
            offset: self.at.min(self.file.len()) as u64,
            expected: "a whole packet",
            found: format!("{} bytes of {len}", self.rest()),
        })?;
        self.at += len;
        Ok(taken)
    }

    fn u16(&mut self) -> Result<u16, Torn> {
        let bytes = self.take(2)?.first_chunk().copied().unwrap_or_default();
        Ok(if self.little { u16::from_le_bytes(bytes) } else { u16::from_be_bytes(bytes) })
    }

    fn u32(&mut self) -> Result<u32, Torn> {
        let bytes = self.take(4)?.first_chunk().copied().unwrap_or_default();
        Ok(if self.little { u32::from_le_bytes(bytes) } else { u32::from_be_bytes(bytes) })
    }

    /// The big-endian number at a place.
    fn peek_at(&self, at: usize) -> Result<u32, Torn> {
        Cursor { file: self.file, at, little: false }.u32()
    }
}
