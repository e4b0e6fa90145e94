//! Faults of datagrams.

use std::time::Duration;

/// A fault of datagrams.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DatagramFault {
    /// What becomes of a datagram.
    pub fate: Fate,
    /// Bursts (Gilbert and Elliott): the probabilities that one begins, and ends, with a datagram; only datagrams of bursts have the fate.
    pub bursts: Option<(f64, f64)>,
}

impl Fate {
    /// True if what receives the datagrams must be a scanner's client: other senders let them go at once.
    pub fn needs_a_scanner(self) -> bool {
        !matches!(self, Self::Lost | Self::Doubled)
    }
}

/// What becomes of a datagram.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fate {
    /// It does not arrive.
    Lost,
    /// It arrives twice.
    Doubled,
    /// It arrives so much later, behind those that were sent meanwhile.
    Late(Duration),
    /// So many that are sent after it arrive before it.
    Overtaken(u32),
    /// One of the fragments that it is sent in is lost, and so it is: each fragment is drawn for. One that needs none arrives.
    InFragments {
        /// Bytes that a packet of the network holds, with its headers.
        mtu: u32,
    },
}
