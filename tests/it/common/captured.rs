//! Network captures written for a test.

use rowscan_protocol::frame::{Dialect, encode};

/// Where the scanner sits.
pub const DEVICE: &str = "192.168.0.1:2112";

/// One packet of a capture: when, ns; the client's port; who sent it; what.
pub struct Sent {
    pub at_ns: u64,
    pub port: u16,
    pub from_device: bool,
    pub bytes: Vec<u8>,
}

/// TCP segments of Ethernet packets: each connection's bytes are numbered on from packet to packet.
pub struct Segments {
    /// By port and direction.
    next: std::collections::BTreeMap<(u16, bool), u32>,
}

impl Segments {
    pub fn new() -> Self {
        Self { next: std::collections::BTreeMap::new() }
    }

    /// The Ethernet packet that carries this.
    pub fn packet(&mut self, sent: &Sent) -> Vec<u8> {
        let first = if sent.from_device { 5000 } else { 1000 };
        let next = self.next.entry((sent.port, sent.from_device)).or_insert(first);
        let sequence = *next;
        *next += sent.bytes.len() as u32;
        let ends = [([192, 168, 0, 5], sent.port), ([192, 168, 0, 1], 2112)];
        let (from, to) = (ends[usize::from(sent.from_device)], ends[usize::from(!sent.from_device)]);
        let mut packet = vec![0_u8; 12];
        packet.extend([0x08, 0x00, 0x45, 0]);
        packet.extend((40 + sent.bytes.len() as u16).to_be_bytes());
        packet.extend([0, 0, 0x40, 0, 64, 6, 0, 0]);
        packet.extend([from.0, to.0].concat());
        packet.extend([from.1.to_be_bytes(), to.1.to_be_bytes()].concat());
        packet.extend(sequence.to_be_bytes());
        packet.extend([0, 0, 0, 0, 0x50, 0x18, 0, 0, 0, 0, 0, 0]);
        packet.extend(&sent.bytes);
        packet
    }
}

/// A pcap file of packets with their times, ns.
pub fn pcap(packets: impl IntoIterator<Item = (u64, Vec<u8>)>) -> Vec<u8> {
    pcap_of_part(packets, u32::MAX)
}

/// The same, of packets of which no more than so many bytes were captured.
fn pcap_of_part(packets: impl IntoIterator<Item = (u64, Vec<u8>)>, most: u32) -> Vec<u8> {
    let mut file: Vec<u8> =
        [0xA1B2_C3D4_u32, 0x0002_0004, 0, 0, 65535, 1].iter().flat_map(|word| word.to_be_bytes()).collect();
    for (at_ns, packet) in packets {
        let len = packet.len() as u32;
        let (seconds, micros) = ((at_ns / 1_000_000_000) as u32, (at_ns % 1_000_000_000 / 1000) as u32);
        file.extend([seconds, micros, len.min(most), len].iter().flat_map(|word| word.to_be_bytes()));
        file.extend(packet.into_iter().take(most as usize));
    }
    file
}

/// A scanner at 50 Hz: three beams, counters and clock running on whoever is connected.
pub struct Talk {
    sent: Vec<Sent>,
}

impl Talk {
    pub fn new() -> Self {
        Self { sent: Vec::new() }
    }

    fn say(&mut self, at_ms: u64, port: u16, from_device: bool, body: &str) {
        let mut bytes = Vec::new();
        encode(Dialect::A, body.as_bytes(), &mut bytes);
        self.sent.push(Sent { at_ns: (1_700_000_000_000 + at_ms) * 1_000_000, port, from_device, bytes });
    }

    /// A client subscribes before the scan of this number.
    pub fn connect(&mut self, port: u16, scan: u16) {
        let at_ms = u64::from(scan) * 20;
        self.say(at_ms - 10, port, false, "sEN LMDscandata 1");
        self.say(at_ms - 9, port, true, "sEA LMDscandata 1");
    }

    pub fn scan(&mut self, port: u16, number: u16) {
        self.scan_at(u64::from(number) * 20, port, number);
    }

    /// The same, at another time of the host.
    pub fn scan_at(&mut self, at_ms: u64, port: u16, number: u16) {
        let body = format!(
            "sSN LMDscandata 1 1 16F4C7A 0 0 {number:X} {number:X} {0:X} {0:X} 0 0 4 0 0 1388 168 0 1 DIST1 3F800000 00000000 \
             FFF92230 1388 3 3E8 0 7D0 0 0 0 0 0 0",
            u32::from(number) * 20_000,
        );
        self.say(at_ms, port, true, &body);
    }

    pub fn write(&self, path: &str) {
        self.write_part(path, None, u32::MAX);
    }

    /// The same, but for the packet of this number, and no more than so many bytes of each.
    pub fn write_part(&self, path: &str, lost: Option<usize>, most: u32) {
        let mut segments = Segments::new();
        let packets = self.sent.iter().map(|sent| (sent.at_ns, segments.packet(sent)));
        let packets: Vec<_> = packets.enumerate().filter(|(number, _)| lost != Some(*number)).collect();
        let packets = packets.into_iter().map(|(_, packet)| packet);
        std::fs::write(path, pcap_of_part(packets, most)).expect("written");
    }
}
