//! Later conversations with a scanner whose earlier one has ended: a client that came again, and whose scans follow on those from before.

use std::collections::{BTreeSet, VecDeque};

use rowscan_recording::{Packet, Side};

/// After so many packets of another conversation, and none of the one that is read, that one is over. Two clients that read at the same time alternate, so
/// neither is over.
const OVER: usize = 32;
/// Packets kept of a conversation at most.
const MOST: usize = 1024;

/// What is said in other conversations since the one that is read was heard last.
#[derive(Debug, Default)]
pub(crate) struct Later {
    /// In the order in which they began.
    said: Vec<Said>,
    /// Streams of clients that read at the same time as the one that is read.
    beside: BTreeSet<usize>,
    packets: u64,
}

/// What is said in one of them.
#[derive(Debug)]
struct Said {
    stream: usize,
    /// The numbers of its first and its last packet, of all that are heard here.
    first: u64,
    last: u64,
    of_device: usize,
    kept: Vec<Packet>,
}

impl Later {
    /// Hears a packet of another conversation; true if the one that is read is over, and this one is to be read.
    pub(crate) fn hear(&mut self, packet: &Packet) -> bool {
        self.packets += 1;
        let (stream, number) = (packet.stream, self.packets);
        let known = self.said.iter().position(|said| said.stream == stream).unwrap_or_else(|| {
            self.said.push(Said { stream, first: number, last: number, of_device: 0, kept: Vec::new() });
            self.said.len() - 1
        });
        let Some(said) = self.said.get_mut(known) else { return false };
        said.last = number;
        said.of_device += usize::from(packet.from != Some(Side::Host));
        if said.kept.len() < MOST {
            said.kept.push(packet.clone());
        }
        said.of_device >= OVER
    }

    /// The one that is read is heard: it is not over, and the others read at the same time.
    pub(crate) fn forget(&mut self) {
        self.beside.extend(self.said.drain(..).map(|said| said.stream));
    }

    /// What is to be read from now on: this conversation, behind those that began and ended before it.
    pub(crate) fn take(&mut self, stream: usize) -> VecDeque<Packet> {
        let last = self.said.iter().position(|said| said.stream == stream);
        let Some(last) = last.map(|place| self.said.remove(place)) else { return VecDeque::new() };
        let mut packets = self.in_turn(last.first);
        packets.extend(last.kept);
        packets
    }

    /// What is to be read at the file's end: the conversations that began behind the one that is read, one behind the other.
    pub(crate) fn take_rest(&mut self) -> VecDeque<Packet> {
        self.in_turn(u64::MAX)
    }

    /// The packets of the conversations that ended before packet `before`, one behind the other.
    fn in_turn(&mut self, before: u64) -> VecDeque<Packet> {
        let (mut packets, mut behind) = (VecDeque::new(), 0);
        for said in std::mem::take(&mut self.said) {
            if said.last < before && said.first > behind && !self.beside.contains(&said.stream) {
                behind = said.last;
                packets.extend(said.kept);
            }
        }
        packets
    }
}
