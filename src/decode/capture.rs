//! Network captures: pcap and pcapng files, packet by packet.
//!
//! Read by hand and not by the `pcap-file` crate, which takes every pcapng time for nanoseconds and panics on damaged options.

use super::Line;
use super::packet::{LinkType, segment};
use super::tcp::Connections;
use super::{Stream, Verdict};

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
    pub(super) connections: Vec<Vec<Stream>>,
    /// Where it ended too early.
    pub(super) cut: Option<Cut>,
}

/// A capture file that breaks off.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Cut {
    offset: usize,
    expected: &'static str,
    found: String,
}

impl Cut {
    /// As a finding. Its offset counts from the start of the file.
    pub(super) fn line(&self, file_len: usize) -> Line {
        let offset = self.offset as u64;
        Line {
            words: Some("the capture file is broken here".to_owned()),
            error_offset: Some(offset),
            expected: Some(self.expected.to_owned()),
            found: Some(self.found.clone()),
            ..Line::new(&Stream::default(), offset, (file_len - self.offset) as u64, Verdict::Bad)
        }
    }
}

/// The capture in a file; none if it is something else.
pub(super) fn read(file: &[u8]) -> Option<Capture> {
    let magic = file.first_chunk().map(|bytes| u32::from_be_bytes(*bytes))?;
    let mut packets = Packets::default();
    let mut cursor = Cursor { file, at: 0, little: false };
    let cut = match magic {
        SECTION => packets.pcapng(&mut cursor),
        _ if [MICROSECONDS, NANOSECONDS].contains(&magic) => packets.pcap(&mut cursor),
        _ if [MICROSECONDS, NANOSECONDS].contains(&magic.swap_bytes()) => {
            cursor.little = true;
            packets.pcap(&mut cursor)
        }
        _ => return None,
    };
    Some(Capture { connections: packets.connections.streams(), cut: cut.err() })
}

/// Where packets go.
#[derive(Default)]
struct Packets {
    connections: Connections,
    /// Time of the first packet, seconds.
    began: Option<f64>,
}

/// How an interface captures.
#[derive(Clone, Copy)]
struct Interface {
    link: LinkType,
    /// Units of time a second.
    units: f64,
}

impl Packets {
    fn take(&mut self, interface: Interface, time: u64, data: &[u8]) {
        let time_s = time as f64 / interface.units;
        let began = *self.began.get_or_insert(time_s);
        if let Some(segment) = segment(interface.link, data) {
            self.connections.push(&segment, time_s - began);
        }
    }

    fn pcap(&mut self, cursor: &mut Cursor<'_>) -> Result<(), Cut> {
        let units = if cursor.u32()? == NANOSECONDS { 1e9 } else { 1e6 };
        // Version, time zone, accuracy, longest packet.
        cursor.take(16)?;
        let interface = Interface { link: LinkType(cursor.u32()? & 0xFFFF), units };
        while !cursor.ended() {
            let start = cursor.at;
            let (seconds, fraction) = (cursor.u32()?, cursor.u32()?);
            let (len, _) = (cursor.u32()?, cursor.u32()?);
            let data = cursor.take(len as usize).map_err(|cut| Cut { offset: start, ..cut })?;
            let time = u64::from(seconds) * units as u64 + u64::from(fraction);
            self.take(interface, time, data);
        }
        Ok(())
    }

    fn pcapng(&mut self, cursor: &mut Cursor<'_>) -> Result<(), Cut> {
        let mut interfaces = Vec::new();
        while !cursor.ended() {
            let start = cursor.at;
            let kind = cursor.u32()?;
            if kind == SECTION {
                let order = cursor.peek_at(start + 8)?;
                cursor.little = order == BYTE_ORDER.swap_bytes();
                if !cursor.little && order != BYTE_ORDER {
                    let found = format!("{order:08X}");
                    return Err(Cut { offset: start + 8, expected: "a byte order mark", found });
                }
                interfaces.clear();
            }
            let len = cursor.u32()? as usize;
            // Type, length, and the length again at the end.
            let Some(body) = len.checked_sub(12).filter(|body| body.is_multiple_of(4)) else {
                let expected = "a block length, a multiple of 4";
                return Err(Cut { offset: start + 4, expected, found: len.to_string() });
            };
            let body = cursor.take(body).map_err(|cut| Cut { offset: start, ..cut })?;
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
    ) -> Result<(), Cut> {
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
fn time_units(options: &mut Cursor<'_>) -> f64 {
    while let (Ok(code), Ok(len)) = (options.u16(), options.u16()) {
        let Ok(value) = options.take(usize::from(len).next_multiple_of(4)) else { break };
        if let (TIME_RESOLUTION, Some(&resolution)) = (code, value.first()) {
            let power = i32::from(resolution & 0x7F);
            return if resolution & 0x80 == 0 { 10f64.powi(power) } else { 2f64.powi(power) };
        }
    }
    1e6
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

    fn take(&mut self, len: usize) -> Result<&'a [u8], Cut> {
        let taken = self.at.checked_add(len).and_then(|end| self.file.get(self.at..end));
        let taken = taken.ok_or_else(|| Cut {
            offset: self.at.min(self.file.len()),
            expected: "a whole packet",
            found: format!("{} bytes of {len}", self.rest()),
        })?;
        self.at += len;
        Ok(taken)
    }

    fn u16(&mut self) -> Result<u16, Cut> {
        let bytes = self.take(2)?.first_chunk().copied().unwrap_or_default();
        Ok(if self.little { u16::from_le_bytes(bytes) } else { u16::from_be_bytes(bytes) })
    }

    fn u32(&mut self) -> Result<u32, Cut> {
        let bytes = self.take(4)?.first_chunk().copied().unwrap_or_default();
        Ok(if self.little { u32::from_le_bytes(bytes) } else { u32::from_be_bytes(bytes) })
    }

    /// The big-endian number at a place.
    fn peek_at(&self, at: usize) -> Result<u32, Cut> {
        Cursor { file: self.file, at, little: false }.u32()
    }
}
