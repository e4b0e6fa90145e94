//! Whose telegrams are taken where several scanners send to one place. A scanner says its serial number in each telegram of scans and of the encoder.
//!
//! Readings of the inertial measurement unit hold no number. They go by the socket address that they come from, where one is known: those from where the
//! followed scanner's segments come are its own, and so are those of another port of that host, unless another scanner sends from there, too. From which port a
//! device sends is not published.

use alloc::vec::Vec;
use core::net::SocketAddr;

use crate::host::OtherSender;

/// Others that are told by their numbers; more are counted together.
const MAX_OTHERS: usize = 16;
/// So many telegrams of others, and none of the scanner that was asked for: it calls itself otherwise in its telegrams. More than a second of them.
const PATIENCE: u64 = 200;

/// What is done with a telegram.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Sender {
    /// It is taken.
    Own,
    /// It is of another scanner, and left out; the first of it, if so.
    Other { first: bool },
}

/// Follows one scanner: the one that is asked for, else the first one that is heard.
#[derive(Clone, Debug, Default)]
pub(super) struct Senders {
    asked: Option<u32>,
    followed: Option<u32>,
    others: Vec<OtherSender>,
    /// Where segments of the followed scanner came from last.
    place: Option<SocketAddr>,
    /// Where telegrams of others came from.
    elsewhere: Vec<(SocketAddr, u32)>,
    /// Telegrams of scans that were left out while none was followed.
    waited: u64,
}

impl Senders {
    /// Of several scanners, that with this number.
    pub(super) fn ask(&mut self, serial_number: u32) {
        self.asked = Some(serial_number);
    }

    /// The scanner that is listened to.
    pub(super) fn followed(&self) -> Option<u32> {
        self.followed.or(self.asked)
    }

    pub(super) fn others(&self) -> &[OtherSender] {
        &self.others
    }

    /// Takes note of a telegram of scans, and where it came from, where that is known.
    pub(super) fn take(&mut self, sender: u32, from: Option<SocketAddr>) -> Sender {
        let is_asked_for = self.asked.is_none_or(|asked| asked == sender);
        if self.followed.is_none() && (is_asked_for || self.waited >= PATIENCE) {
            self.followed = Some(sender);
            self.others.retain(|other| other.serial_number != Some(sender));
            self.elsewhere.retain(|(_, other)| *other != sender);
        }
        if self.followed == Some(sender) {
            self.place = from.or(self.place);
            return Sender::Own;
        }
        self.waited += u64::from(self.followed.is_none());
        if let Some(from) = from {
            self.elsewhere.retain(|(place, other)| *place != from && *other != sender);
            self.elsewhere.truncate(MAX_OTHERS - 1);
            self.elsewhere.push((from, sender));
        }
        self.leave_out(Some(sender))
    }

    /// Whose a reading is that came from `from`; `sender` 0 tells no number. None before it can be known: no scanner is asked for or followed, or, without a number,
    /// no segment of the followed one has come.
    pub(super) fn take_reading(&mut self, sender: u32, from: Option<SocketAddr>) -> Option<Sender> {
        if sender != 0 {
            let is_other = sender != self.followed()?;
            return Some(if is_other { self.leave_out(Some(sender)) } else { Sender::Own });
        }
        let Some(from) = from else { return Some(Sender::Own) };
        let place = self.place?;
        let at =
            |place: SocketAddr| self.elsewhere.iter().find(|(other, _)| *other == place).map(|found| found.1);
        let is_shared = self.elsewhere.iter().any(|(other, _)| other.ip() == place.ip());
        let is_own = from == place || from.ip() == place.ip() && !is_shared;
        Some(if is_own { Sender::Own } else { self.leave_out(at(from)) })
    }

    /// Counts a telegram of another scanner.
    fn leave_out(&mut self, sender: Option<u32>) -> Sender {
        let is_full = self.others.len() >= MAX_OTHERS;
        let known = |other: &&mut OtherSender| {
            other.serial_number == sender || is_full && other.serial_number.is_none()
        };
        let first = match self.others.iter_mut().find(known) {
            Some(other) => {
                other.telegrams += 1;
                false
            }
            None => {
                let serial_number = sender.filter(|_| self.others.len() + 1 < MAX_OTHERS);
                self.others.push(OtherSender { serial_number, telegrams: 1 });
                true
            }
        };
        Sender::Other { first }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_one_is_followed_and_each_other_is_told_once() {
        let mut senders = Senders::default();
        let told: Vec<Sender> =
            [7, 9, 7, 9, 8].into_iter().map(|sender| senders.take(sender, None)).collect();
        let (own, first, again) =
            (Sender::Own, Sender::Other { first: true }, Sender::Other { first: false });
        assert_eq!(told, [own, first, own, again, first]);
        assert_eq!(OtherSender::telegrams_of(senders.others()), 3);
        assert_eq!(
            [9, 7, 0].map(|sender| senders.take_reading(sender, None)),
            [Some(again), Some(own), Some(own)]
        );
        assert_eq!(OtherSender::telegrams_of(senders.others()), 4);
    }

    #[test]
    fn the_one_that_is_asked_for_is_waited_for_and_not_for_ever() {
        let mut senders = Senders::default();
        senders.ask(7);
        assert_eq!(senders.take(9, None), Sender::Other { first: true });
        assert_eq!(senders.take(7, None), Sender::Own);
        let mut senders = Senders::default();
        senders.ask(7);
        let left_out = (0..1000).take_while(|_| senders.take(9, None) != Sender::Own).count() as u64;
        assert_eq!((left_out, senders.followed(), senders.others()), (PATIENCE, Some(9), &[][..]));
    }

    #[test]
    fn memory_is_bounded_and_none_is_uncounted() {
        let mut senders = Senders::default();
        (0..1000).for_each(|sender| {
            senders.take(sender, None);
        });
        assert_eq!(senders.others().len(), MAX_OTHERS);
        assert_eq!(OtherSender::telegrams_of(senders.others()), 999);
    }

    #[test]
    fn a_reading_without_a_number_goes_by_where_it_comes_from() {
        let at = |place: &str| -> Option<SocketAddr> { Some(place.parse().unwrap()) };
        let (own, neighbour, port) = (at("10.0.0.1:2115"), at("10.0.0.2:2115"), at("10.0.0.1:7503"));
        let mut senders = Senders::default();
        senders.ask(7);
        assert_eq!(senders.take_reading(0, own), None, "nobody knows yet");
        assert_eq!(senders.take(9, neighbour), Sender::Other { first: true });
        assert_eq!(senders.take_reading(0, own), None);
        assert_eq!(senders.take(7, own), Sender::Own);
        let mut whose = |from| senders.take_reading(0, from);
        // Of a host that sends nothing else, and of a scanner whose scans are known.
        assert_eq!([own, port, None].map(&mut whose), [Some(Sender::Own); 3]);
        assert_eq!(whose(neighbour), Some(Sender::Other { first: false }));
        assert_eq!(whose(at("10.0.0.3:2115")), Some(Sender::Other { first: true }));
        assert_eq!(
            senders.others(),
            [
                OtherSender { serial_number: Some(9), telegrams: 2 },
                OtherSender { serial_number: None, telegrams: 1 }
            ]
        );
        // Behind one address, as through a tunnel, only the port tells them apart.
        assert_eq!(senders.take(8, at("10.0.0.1:2116")), Sender::Other { first: true });
        assert_eq!(senders.take_reading(0, own), Some(Sender::Own));
        assert_eq!(senders.take_reading(0, port), Some(Sender::Other { first: false }));
        // A scanner that comes back elsewhere.
        assert_eq!(senders.take(7, at("10.0.0.4:2115")), Sender::Own);
        assert_eq!(senders.take_reading(0, at("10.0.0.4:2115")), Some(Sender::Own));
    }

    #[test]
    fn readings_of_others_are_no_reason_to_follow_one() {
        let mut senders = Senders::default();
        assert_eq!(senders.take_reading(9, None), None, "whose scans come is not known yet");
        senders.ask(7);
        (0..2 * PATIENCE).for_each(|_| {
            senders.take_reading(9, None);
        });
        assert_eq!(
            (senders.take(9, None), senders.take(7, None)),
            (Sender::Other { first: false }, Sender::Own)
        );
    }
}
