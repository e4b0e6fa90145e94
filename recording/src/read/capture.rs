//! Network captures: pcap and pcapng files, packet by packet.

use pcap_parser::Linktype;
use pcap_parser::pcap::{LegacyPcapBlock, parse_pcap_frame, parse_pcap_frame_be, parse_pcap_header};
use pcap_parser::pcapng::{Block, InterfaceDescriptionBlock, parse_block_be, parse_block_le};
use pcap_parser::traits::PcapNGPacketBlock;

use rowscan_protocol::compact;

use super::clock_back::{ClockBack, Watch};
use super::datagrams::Datagrams;
use super::fragments::{Fragments, Whole};
use super::segment::{Carried, Datagram, carried};
use super::tcp::{Connections, Flows};
use super::torn::Torn;

/// First bytes of pcapng, in either byte order.
const SECTION: [u8; 4] = [0x0A, 0x0D, 0x0D, 0x0A];
/// In a section header, of a file in the byte order of small computers.
const LITTLE_ENDIAN: [u8; 4] = [0x4D, 0x3C, 0x2B, 0x1A];

/// What a capture holds.
#[derive(Debug, Default)]
pub(super) struct Capture {
    /// Both directions of every TCP connection.
    pub(super) connections: Vec<Flows>,
    /// UDP datagrams of scanners.
    pub(super) datagrams: Datagrams,
    /// When its first packet came, ns since 1970.
    pub(super) began_ns: Option<u64>,
    /// Where it ended too early.
    pub(super) torn: Option<Torn>,
    /// Where its clock was set back.
    pub(super) clock_back: Option<ClockBack>,
    /// How many packets of scanners' connections it holds in part only.
    pub(super) cut_packets: u64,
}

/// The capture in a file; `None` if it is something else.
pub(super) fn read(file: &[u8]) -> Option<Capture> {
    let mut packets = Packets::default();
    let torn = match file.starts_with(&SECTION) {
        true => packets.pcapng(file),
        false => packets.pcap(file)?,
    };
    for lost in packets.fragments.lost() {
        packets.datagrams.lose(lost);
    }
    Some(Capture {
        connections: packets.connections.flows(),
        datagrams: packets.datagrams,
        began_ns: packets.began_ns,
        torn: torn.err(),
        clock_back: packets.clock.found(),
        cut_packets: packets.cut_packets,
    })
}

/// Where packets go.
#[derive(Default)]
struct Packets {
    connections: Connections,
    datagrams: Datagrams,
    fragments: Fragments,
    /// Time of the first packet.
    began_ns: Option<u64>,
    clock: Watch,
    cut_packets: u64,
}

/// How an interface captures.
#[derive(Clone, Copy)]
struct Interface {
    link: Linktype,
    /// Units of time a second.
    units: u64,
}

impl Packets {
    /// A packet that was so many bytes long.
    fn take(&mut self, interface: Interface, time: u64, data: &[u8], bytes: u32) {
        let at_ns = u128::from(time) * 1_000_000_000 / u128::from(interface.units.max(1));
        let at_ns = u64::try_from(at_ns).unwrap_or(u64::MAX);
        self.began_ns.get_or_insert(at_ns);
        // Simple packets have no time.
        self.clock.see(Some(at_ns).filter(|at_ns| *at_ns > 0));
        let carried = carried(interface.link, data);
        let is_scanners = match &carried {
            Some(Carried::Tcp(_)) => true,
            Some(Carried::Udp(datagram)) => compact::begins(datagram.payload),
            _ => false,
        };
        self.cut_packets += u64::from(is_scanners && data.len() < bytes as usize);
        match carried {
            Some(Carried::Tcp(segment)) => self.connections.push(&segment, at_ns),
            Some(Carried::Udp(datagram)) => self.datagrams.push(&datagram, at_ns),
            Some(Carried::Fragment(fragment)) => {
                if let Some(Whole { from, to, payload }) = self.fragments.push(&fragment, at_ns) {
                    self.datagrams.push(&Datagram { from, to, payload: &payload }, at_ns);
                }
            }
            None => {}
        }
    }

    fn pcap(&mut self, file: &[u8]) -> Option<Result<(), Torn>> {
        let (mut rest, header) = match parse_pcap_header(file) {
            Ok(parsed) => parsed,
            Err(pcap_parser::nom::Err::Incomplete(_)) => return Some(Err(torn(file, file))),
            Err(_) => return None,
        };
        let units = if header.is_nanosecond_precision() { 1_000_000_000 } else { 1_000_000 };
        // The upper half may say how long a frame's checksum is.
        let interface = Interface { link: Linktype(header.network.0 & 0xFFFF), units };
        let parse = if header.is_bigendian() { parse_pcap_frame_be } else { parse_pcap_frame };
        while !rest.is_empty() {
            let Ok((after, LegacyPcapBlock { ts_sec, ts_usec, data, origlen, .. })) = parse(rest) else {
                return Some(Err(torn(file, rest)));
            };
            self.take(interface, u64::from(ts_sec) * units + u64::from(ts_usec), data, origlen);
            rest = after;
        }
        Some(Ok(()))
    }

    fn pcapng(&mut self, file: &[u8]) -> Result<(), Torn> {
        let mut interfaces = Vec::new();
        let mut little = true;
        let mut rest = file;
        while !rest.is_empty() {
            if rest.starts_with(&SECTION) {
                little = rest.get(8..12) == Some(&LITTLE_ENDIAN);
            }
            let parsed = if little { parse_block_le(rest) } else { parse_block_be(rest) };
            rest = match parsed {
                Ok((after, block)) => {
                    self.block(&block, &mut interfaces);
                    after
                }
                // A damaged block is skipped, also one whose packet is said to be longer than itself; the next one is where its length says.
                Err(_) => after_block(rest, little).ok_or_else(|| torn(file, rest))?,
            };
        }
        Ok(())
    }

    fn block(&mut self, block: &Block<'_>, interfaces: &mut Vec<Interface>) {
        match block {
            Block::SectionHeader(_) => interfaces.clear(),
            Block::InterfaceDescription(described) => {
                interfaces.push(Interface { link: described.linktype, units: time_units(described) });
            }
            Block::EnhancedPacket(packet) => {
                let time = u64::from(packet.ts_high) << 32 | u64::from(packet.ts_low);
                if let Some(interface) = interfaces.get(packet.if_id as usize) {
                    self.take(*interface, time, packet.packet_data(), packet.origlen);
                }
            }
            Block::SimplePacket(packet) => {
                if let Some(interface) = interfaces.first() {
                    // These have no time.
                    self.take(*interface, 0, packet.packet_data(), packet.origlen);
                }
            }
            _ => {}
        }
    }
}

/// Units of time a second: a power of 10, or of 2 where the highest bit is set.
///
/// Not by `ts_resolution` of pcap-parser 0.17, which refuses every power of 2.
fn time_units(interface: &InterfaceDescriptionBlock<'_>) -> u64 {
    let power = u32::from(interface.if_tsresol & 0x7F);
    let base: u64 = if interface.if_tsresol & 0x80 == 0 { 10 } else { 2 };
    base.saturating_pow(power)
}

/// What follows a block that cannot be read, by its length.
fn after_block(rest: &[u8], little: bool) -> Option<&[u8]> {
    let bytes = *rest.get(4..)?.first_chunk()?;
    let len = if little { u32::from_le_bytes(bytes) } else { u32::from_be_bytes(bytes) };
    if len < 12 || !len.is_multiple_of(4) {
        return None;
    }
    rest.get(len as usize..)
}

fn torn(file: &[u8], rest: &[u8]) -> Torn {
    let offset = file.len().saturating_sub(rest.len()) as u64;
    Torn {
        offset,
        expected: "a whole packet",
        found: format!("{} bytes that make none", rest.len()),
        resumed: None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A block of this type around `body`, padded.
    fn block(kind: u32, body: &[u8], big: bool) -> Vec<u8> {
        let number = |n: u32| if big { n.to_be_bytes() } else { n.to_le_bytes() };
        let padding = body.len().next_multiple_of(4) - body.len();
        let len = number((12 + body.len() + padding) as u32);
        [&number(kind)[..], &len, body, &[0; 3][..padding], &len].concat()
    }

    /// One packet of no known protocol, `time` units after 1970, on an interface of this resolution.
    fn capture(resolution: Option<u8>, time: u64, big: bool) -> Vec<u8> {
        let number = |n: u32| if big { n.to_be_bytes() } else { n.to_le_bytes() };
        let short = |n: u16| if big { n.to_be_bytes() } else { n.to_le_bytes() };
        let section = [&number(0x1A2B_3C4D)[..], &short(1), &short(0), &[0xFF; 8]].concat();
        let mut interface = [&short(1)[..], &short(0), &number(0)].concat();
        if let Some(resolution) = resolution {
            interface.extend([&short(9)[..], &short(1), &[resolution, 0, 0, 0], &[0; 4]].concat());
        }
        let (high, low) = (number((time >> 32) as u32), number(time as u32));
        let packet = [&number(0)[..], &high, &low, &number(2), &number(2), &[1, 2]].concat();
        [block(0x0A0D_0D0A, &section, big), block(1, &interface, big), block(6, &packet, big)].concat()
    }

    #[test]
    fn every_interface_has_its_own_resolution_of_time() {
        for (resolution, time, at_ns) in [
            (None, 1_500_000, 1_500_000_000),
            (Some(6), 1_500_000, 1_500_000_000),
            (Some(9), 1_500_000_000, 1_500_000_000),
            (Some(3), 1500, 1_500_000_000),
            // A power of two: 1/1024 s.
            (Some(0x80 | 10), 1536, 1_500_000_000),
        ] {
            for big in [false, true] {
                let capture = read(&capture(resolution, time, big)).expect("a capture");
                assert_eq!((capture.began_ns, capture.torn), (Some(at_ns), None), "{resolution:?}");
            }
        }
    }

    #[test]
    fn a_cut_file_is_torn_where_its_last_block_begins() {
        let whole = capture(None, 1, false);
        let packet = whole.len() - 36;
        for end in packet + 1..whole.len() {
            let torn = read(&whole[..end]).expect("a capture").torn.expect("torn");
            assert_eq!(torn.offset, packet as u64, "{end} bytes: {torn}");
        }
    }

    #[test]
    fn a_damaged_block_is_skipped() {
        // An interface block that is too short for one.
        let damaged = [capture(None, 7, false), block(1, &[0; 4], false), capture(None, 8, false)].concat();
        let capture = read(&damaged).expect("a capture");
        assert_eq!((capture.began_ns, capture.torn), (Some(7_000), None));
        // A packet of 64 MiB in a block of 36 bytes.
        let mut longer = self::capture(None, 7, false);
        let captured_len = longer.len() - 36 + 20;
        longer[captured_len + 3] = 4;
        longer.extend(self::capture(None, 8, false));
        let capture = read(&longer).expect("a capture");
        assert_eq!((capture.began_ns, capture.torn), (Some(8_000), None));
    }

    #[test]
    fn any_bytes_behind_a_magic_number_are_read_without_panic() {
        let whole = capture(Some(9), 1, false);
        for at in 4..whole.len() {
            for flip in [0x01, 0x80, 0xFF] {
                let mut broken = whole.clone();
                broken[at] ^= flip;
                let _ = read(&broken);
            }
        }
    }
}
