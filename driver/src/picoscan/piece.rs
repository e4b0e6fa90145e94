//! What a stream of datagrams and answers hands over with one read: a mark, and then all of one of them.

/// A datagram.
pub(super) const DATAGRAM: u8 = 0;
/// An answer to the request before.
pub(super) const ANSWER: u8 = 1;
