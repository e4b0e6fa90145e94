//! A later conversation with a scanner whose earlier one has ended: a client that came again, and whose scans follow on those from before.

use std::collections::BTreeMap;

use rowscan_recording::{Packet, Side};

/// After so many packets of another conversation, and none of the one that is read, that one is over. Two clients that read at the same time alternate, so
/// neither is over.
const OVER: usize = 32;
/// Packets kept of a conversation at most.
const MOST: usize = 1024;

/// What is said in other conversations since the one that is read was heard last, by stream.
#[derive(Debug, Default)]
pub(crate) struct Later(BTreeMap<usize, Vec<Packet>>);

impl Later {
    /// Hears a packet of another conversation; true if that is the one to be read from now on.
    pub(crate) fn hear(&mut self, packet: &Packet) -> bool {
        let packets = self.0.entry(packet.stream).or_default();
        if packets.len() < MOST {
            packets.push(packet.clone());
        }
        packets.iter().filter(|packet| packet.from != Some(Side::Host)).count() >= OVER
    }

    /// The one that is read is heard: it is not over.
    pub(crate) fn forget(&mut self) {
        self.0.clear();
    }

    /// What was heard of the conversation that is read from now on.
    pub(crate) fn take(&mut self, stream: usize) -> Vec<Packet> {
        std::mem::take(&mut self.0).remove(&stream).unwrap_or_default()
    }
}
