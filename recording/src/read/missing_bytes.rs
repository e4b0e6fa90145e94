//! What a capture lacks: bytes that passed and that it does not hold.

use std::fmt;

use crate::{Joint, Packet};

/// Bytes of connections that a capture does not hold, though it holds later ones.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MissingBytes {
    /// How many, over all connections and both directions.
    pub bytes: u64,
    /// In how many places.
    pub places: u64,
    /// Packets of which the capture holds a part only.
    pub cut_packets: u64,
}

impl MissingBytes {
    /// Of the packets that a capture became, of which so many were cut.
    pub(super) fn of(packets: &[Packet], cut_packets: u64) -> Option<Self> {
        let of_packet = |packet: &Packet| match packet.joint {
            Joint::Gap { bytes, .. } => bytes,
            _ => 0,
        };
        let gaps = packets.iter().map(of_packet).filter(|bytes| *bytes > 0);
        let (bytes, places) = gaps.fold((0, 0), |(bytes, places), gap| (bytes + gap, places + 1));
        (places > 0 || cut_packets > 0).then_some(Self { bytes, places, cut_packets })
    }
}

impl fmt::Display for MissingBytes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { bytes, places, cut_packets } = self;
        if *places > 0 {
            let place = if *places == 1 { "place" } else { "places" };
            write!(f, "{bytes} bytes are missing from the capture, in {places} {place}")?;
        }
        if *cut_packets > 0 {
            let packets = if *cut_packets == 1 { "packet was" } else { "packets were" };
            let joined = if *places > 0 { "; " } else { "" };
            write!(
                f,
                "{joined}{cut_packets} {packets} captured in part: capture whole packets (`tcpdump -s 0`)"
            )?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gaps_and_cut_packets_are_counted_and_lost_datagrams_are_not() {
        let packet = |joint| Packet { joint, ..Packet::default() };
        let gap = |bytes, packets| packet(Joint::Gap { bytes, packets });
        let sound = [packet(Joint::Anew), packet(Joint::Seamless), gap(0, 3)];
        assert_eq!(MissingBytes::of(&sound, 0), None);
        let found =
            MissingBytes::of(&[sound.to_vec(), vec![gap(7, 0), gap(1400, 0)]].concat(), 0).expect("gaps");
        assert_eq!((found.bytes, found.places), (1407, 2));
        assert_eq!(found.to_string(), "1407 bytes are missing from the capture, in 2 places");
        let cut = MissingBytes::of(&sound, 1).expect("cut").to_string();
        assert_eq!(cut, "1 packet was captured in part: capture whole packets (`tcpdump -s 0`)");
    }
}
