//! SICK's device search: a UDP datagram to port 30718, answered by every device that hears it.
//!
//! The form is that of SICK's guide for today's scanners: a request of 24 bytes, and an answer with tags of four letters. Neither an answer nor an LMS that
//! gives one was recorded: the header of the answer, the order and the widths of its tags are not verified.

use alloc::vec::Vec;

/// The port that is asked.
pub const PORT: u16 = 30_718;

/// First bytes of a request: its kind, and the length of what follows its header.
const REQUEST: [u8; 4] = [0x10, 0x00, 0x00, 0x08];
/// First bytes of an answer.
const ANSWER: [u8; 2] = [0x90, 0x00];
/// Whom a request is for: everybody.
const EVERYBODY: [u8; 6] = [0xFF; 6];
/// Stands between the request's number and its contents.
const VERSION: [u8; 2] = [0x01, 0x00];
/// The maker's half of a SICK device's hardware address.
const SICK: [u8; 3] = [0x00, 0x06, 0x77];

/// A request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Search {
    /// Number that the answer repeats.
    pub id: [u8; 4],
}

/// What a device says of its interface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Interface {
    /// Address.
    pub address: [u8; 4],
    /// Network mask.
    pub mask: [u8; 4],
    /// Gateway.
    pub gateway: [u8; 4],
    /// The device's serial number, of which its hardware address is made.
    pub serial_number: u32,
}

impl Search {
    /// Reads a request; none if it is another datagram.
    pub fn parse(datagram: &[u8]) -> Option<Self> {
        let (head, rest) = datagram.split_first_chunk::<4>()?;
        let (whom, rest) = rest.split_first_chunk::<6>()?;
        let (id, rest) = rest.split_first_chunk::<4>()?;
        let is_request =
            *head == REQUEST && *whom == EVERYBODY && rest.len() == 10 && rest.starts_with(&VERSION);
        is_request.then_some(Self { id: *id })
    }

    /// The answer of a device with this interface.
    pub fn answer(self, interface: &Interface) -> Vec<u8> {
        let [_, serial @ ..] = interface.serial_number.to_be_bytes();
        let hardware = [SICK, serial].concat();
        let mut tags = Vec::new();
        for (tag, value) in [
            (b"EIPa", &interface.address[..]),
            (b"ENMa", &interface.mask[..]),
            (b"EDGa", &interface.gateway[..]),
            // No address from a server.
            (b"EDhc", &[0][..]),
            (b"EMAC", &hardware[..]),
        ] {
            tags.extend_from_slice(tag);
            tags.extend_from_slice(value);
        }
        let length = (tags.len() as u16).to_be_bytes();
        [&ANSWER[..], &length, &hardware, &self.id, &VERSION, &tags].concat()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The guide's request, with a number of ours.
    fn request() -> Vec<u8> {
        [&REQUEST[..], &EVERYBODY, &[1, 2, 3, 4], &VERSION, &[127, 0, 0, 1], &[255, 0, 0, 0]].concat()
    }

    #[test]
    fn a_request_is_answered_with_its_number() {
        let request = request();
        assert_eq!(request.len(), 24);
        let search = Search::parse(&request).unwrap();
        let interface = Interface {
            address: [127, 0, 0, 1],
            mask: [255, 255, 255, 0],
            gateway: [0; 4],
            serial_number: 26_110_001,
        };
        let answer = search.answer(&interface);
        assert_eq!(answer[..4], [0x90, 0, 0, 39]);
        assert_eq!(answer.len(), 16 + 39);
        assert_eq!(answer[4..14], [0, 6, 0x77, 0x8E, 0x68, 0x31, 1, 2, 3, 4]);
        assert!(
            answer[16..].starts_with(b"EIPa\x7F\0\0\x01ENMa\xFF\xFF\xFF\0EDGa\0\0\0\0EDhc\0EMAC\0\x06\x77")
        );
    }

    #[test]
    fn other_datagrams_are_none() {
        let request = request();
        for length in 0..request.len() {
            assert_eq!(Search::parse(&request[..length]), None, "{length} bytes");
        }
        assert_eq!(Search::parse(&[&request[..], &[0]].concat()), None, "a byte too many");
        for (place, byte) in [(0, 0x90), (3, 9), (4, 0), (14, 2)] {
            let mut other = request.clone();
            other[place] = byte;
            assert_eq!(Search::parse(&other), None, "{byte} at {place}");
        }
    }
}
