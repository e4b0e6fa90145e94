//! Faults of datagrams.

/// A fault of datagrams.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DatagramFault {
    /// What becomes of a datagram.
    pub fate: Fate,
    /// Bursts (Gilbert and Elliott): the probabilities that one begins, and ends, with a datagram; only datagrams of bursts have the fate.
    pub bursts: Option<(f64, f64)>,
}

/// What becomes of a datagram.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fate {
    /// It does not arrive.
    Lost,
    /// It arrives twice.
    Doubled,
}
