//! Whose telegrams are taken where several scanners send to one place. A scanner says its serial number in each telegram of scans and of the encoder.

use alloc::vec::Vec;

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

    /// True for a telegram of another scanner than the one that is listened to; 0 tells no number.
    pub(super) fn is_other(&self, sender: u32) -> bool {
        self.followed().is_some_and(|followed| sender != followed && sender != 0)
    }

    /// Takes note of a telegram of scans.
    pub(super) fn take(&mut self, sender: u32) -> Sender {
        let waited = OtherSender::telegrams_of(&self.others) >= PATIENCE;
        if self.followed.is_none() && (self.asked.is_none_or(|asked| asked == sender) || waited) {
            self.followed = Some(sender);
            self.others.retain(|other| other.serial_number != Some(sender));
        }
        if self.followed == Some(sender) {
            return Sender::Own;
        }
        let is_full = self.others.len() >= MAX_OTHERS;
        let known = |other: &&mut OtherSender| {
            other.serial_number == Some(sender) || is_full && other.serial_number.is_none()
        };
        let first = match self.others.iter_mut().find(known) {
            Some(other) => {
                other.telegrams += 1;
                false
            }
            None => {
                let serial_number = (self.others.len() + 1 < MAX_OTHERS).then_some(sender);
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
        let told: Vec<Sender> = [7, 9, 7, 9, 8].into_iter().map(|sender| senders.take(sender)).collect();
        let (own, first, again) =
            (Sender::Own, Sender::Other { first: true }, Sender::Other { first: false });
        assert_eq!(told, [own, first, own, again, first]);
        assert_eq!(OtherSender::telegrams_of(senders.others()), 3);
        assert!(senders.is_other(9) && !senders.is_other(7) && !senders.is_other(0));
    }

    #[test]
    fn the_one_that_is_asked_for_is_waited_for_and_not_for_ever() {
        let mut senders = Senders::default();
        senders.ask(7);
        assert_eq!(senders.take(9), Sender::Other { first: true });
        assert_eq!(senders.take(7), Sender::Own);
        let mut senders = Senders::default();
        senders.ask(7);
        let left_out = (0..1000).take_while(|_| senders.take(9) != Sender::Own).count() as u64;
        assert_eq!((left_out, senders.followed(), senders.others()), (PATIENCE, Some(9), &[][..]));
    }

    #[test]
    fn memory_is_bounded_and_none_is_uncounted() {
        let mut senders = Senders::default();
        (0..1000).for_each(|sender| {
            senders.take(sender);
        });
        assert_eq!(senders.others().len(), MAX_OTHERS);
        assert_eq!(OtherSender::telegrams_of(senders.others()), 999);
    }
}
