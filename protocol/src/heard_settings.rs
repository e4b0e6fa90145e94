//! Which echo a scanner sends, and which settings take something from its scans, as what was said to it and answered tells: of a recording nothing can be
//! asked any more.

use alloc::collections::VecDeque;
use alloc::string::String;

use crate::echo::EchoChoice;
use crate::leftover::Leftover;
use crate::leftover_set::LeftoverSet;
use crate::telegram::device_ident::{self, DeviceIdent};
use crate::telegram::ee_writeall::WriteAll;
use crate::telegram::fr_echo_filter::{self, EchoFilter};
use crate::telegram::sc_reboot::Reboot;
use crate::telegram::{Kind, Method, Telegram, Variable};

/// Requests without an answer that are kept: no client has more of them open.
const MOST_OPEN: usize = 64;

/// Follows a conversation, telegram by telegram, and knows the code of FREchoFilter that is in force, and the settings that take something away.
///
/// An accepted write (`sWN`, `sWA`) and an answer to a reading (`sRA`) hold until the next of them. A refused write (`sFA`) changes nothing. Where only the
/// scanner's side is recorded, an accepted write leaves the code unknown, and a setting as it was. A restart brings back what was saved; what that is may not be
/// known.
///
/// The setting is the device's, whoever sets it: what one conversation tells goes on in the next one to the same device
/// ([`set_in_force`](Self::set_in_force)).
#[derive(Clone, Debug, Default)]
pub struct HeardSettings {
    /// Requests without an answer so far, in their order: refusals do not say what they refuse.
    open: VecDeque<Asked>,
    in_force: SettingsInForce,
    /// What the scanner says it is.
    ident: Option<DeviceIdent>,
}

/// What is known of a device's FREchoFilter, and of what it takes away.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SettingsInForce {
    /// The code that its scans are made with, if it is known.
    pub code: Option<u8>,
    /// The code that it has after a restart, if it is known.
    pub saved: Option<u8>,
    /// Settings that are known to take something away.
    pub leftovers: LeftoverSet,
    /// Those that do after a restart.
    pub saved_leftovers: LeftoverSet,
}

/// A request.
#[derive(Clone, Debug)]
struct Asked {
    name: String,
    /// The code that it writes, if it is a write of FREchoFilter.
    code: Option<u8>,
    /// Whether what it writes takes something away, if it is a write of a setting that can.
    takes: Option<bool>,
}

impl HeardSettings {
    /// Takes the next telegram of either side.
    pub fn take(&mut self, telegram: &Telegram<'_>) {
        let &Telegram { kind, name, args } = telegram;
        match kind {
            Kind::Sn => {}
            Kind::Rn | Kind::Ri | Kind::Wn | Kind::Mn | Kind::En => {
                let writes = kind == Kind::Wn && name == EchoFilter::NAME;
                let code = writes.then(|| args.decode::<EchoFilter>().ok()).flatten().map(|it| it.code);
                let takes =
                    Some(args).filter(|_| kind == Kind::Wn).and_then(|args| Leftover::takes(name, args));
                if self.open.len() == MOST_OPEN {
                    self.open.pop_front();
                }
                self.open.push_back(Asked { name: name.into(), code, takes });
            }
            Kind::Fa => {
                self.open.pop_front();
            }
            // A receipt: the answer follows.
            Kind::Ma => {}
            Kind::Ra | Kind::Wa | Kind::An | Kind::Ea => {
                let asked = self.answered(name);
                self.answer(telegram, asked);
            }
        }
    }

    /// Bytes are missing: what was asked before may have been answered meanwhile.
    pub fn forget_requests(&mut self) {
        self.open.clear();
    }

    /// The code in force, if it is known.
    pub fn code(&self) -> Option<u8> {
        self.in_force.code
    }

    /// What the scanner has said that it is, the last time; none where that was not heard.
    pub fn ident(&self) -> Option<&DeviceIdent> {
        self.ident.as_ref()
    }

    /// The settings that are known to take something away.
    pub fn leftovers(&self) -> LeftoverSet {
        self.in_force.leftovers
    }

    /// What is known by now.
    pub fn in_force(&self) -> SettingsInForce {
        self.in_force
    }

    /// Goes on from what another conversation with the same device told.
    pub fn set_in_force(&mut self, in_force: SettingsInForce) {
        self.in_force = in_force;
    }

    /// The first request that this answers. Those before it have lost their answers.
    fn answered(&mut self, name: &str) -> Option<Asked> {
        let place = self.open.iter().position(|asked| asked.name == name)?;
        self.open.drain(..=place).next_back()
    }

    fn answer(&mut self, telegram: &Telegram<'_>, asked: Option<Asked>) {
        let SettingsInForce { code, saved, leftovers, saved_leftovers } = &mut self.in_force;
        match (telegram.kind, telegram.name) {
            (Kind::Wa, EchoFilter::NAME) => *code = asked.and_then(|asked| asked.code),
            (Kind::Ra, EchoFilter::NAME) => {
                *code = telegram.args.decode::<EchoFilter>().ok().map(|it| it.code);
            }
            (Kind::Ra, DeviceIdent::NAME | device_ident::INDEX) => {
                self.ident = telegram.args.decode().ok().or(self.ident.take());
            }
            (Kind::Wa, name) => {
                let takes = asked.and_then(|asked| asked.takes);
                takes.into_iter().for_each(|takes| leftovers.set(name, takes));
            }
            (Kind::Ra, name) => {
                let takes = Leftover::takes(name, telegram.args);
                takes.into_iter().for_each(|takes| leftovers.set(name, takes));
            }
            (Kind::An, WriteAll::NAME) => (*saved, *saved_leftovers) = (*code, *leftovers),
            (Kind::An, Reboot::NAME) => (*code, *leftovers) = (*saved, *saved_leftovers),
            _ => {}
        }
    }
}

/// The echo that stands first in the scans of a device whose FREchoFilter has this code; none of a code that no device has.
pub fn first_sent(code: u8) -> Option<EchoChoice> {
    match code {
        fr_echo_filter::FIRST | fr_echo_filter::ALL => Some(EchoChoice::First),
        fr_echo_filter::LAST => Some(EchoChoice::Last),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::Dialect;
    use alloc::vec::Vec;

    /// The code after each of these telegrams.
    fn after(told: &[&str]) -> Vec<Option<u8>> {
        let mut heard = HeardSettings::default();
        let mut after = Vec::new();
        for told in told {
            heard.take(&Telegram::parse(Dialect::A, told.as_bytes()).unwrap());
            after.push(heard.code());
        }
        after
    }

    #[test]
    fn what_the_scanner_says_it_is_is_heard_by_name_and_by_index() {
        for (told, expected) in [
            (&["sRN DeviceIdent", "sRA DeviceIdent 6 LMS511 5 V1.80"][..], Some("LMS511")),
            (&["sRI 0", "sRA 0 6 LMS511 5 V1.80"], Some("LMS511")),
            // Damage takes nothing back, and a question is no answer.
            (&["sRA DeviceIdent 6 LMS511 5 V1.80", "sRA DeviceIdent 9 LMS"], Some("LMS511")),
            (&["sRN DeviceIdent", "sRA FREchoFilter 1"], None),
        ] {
            let mut heard = HeardSettings::default();
            told.iter().for_each(|told| heard.take(&Telegram::parse(Dialect::A, told.as_bytes()).unwrap()));
            let name = heard.ident().map(|ident| ident.name.0.as_str());
            assert_eq!(name, expected, "{told:?}");
        }
    }

    #[test]
    fn the_last_accepted_write_wins_and_a_refused_one_changes_nothing() {
        let (first, last) = ("sWN FREchoFilter 0", "sWN FREchoFilter 2");
        let (accepted, refused) = ("sWA FREchoFilter", "sFA 5");
        for (told, expected) in [
            (&[][..], None),
            (&[first][..], None),
            (&[first, accepted], Some(0)),
            (&[last, accepted], Some(2)),
            (&[first, accepted, last, accepted], Some(2)),
            (&[last, accepted, first, accepted], Some(0)),
            (&[first, refused], None),
            (&[last, accepted, first, refused], Some(2)),
            (&["sRN DeviceIdent", last, refused, accepted], Some(2)),
            (&["sRN DeviceIdent", last, "sRA DeviceIdent 1 A 1 B", refused], None),
            (&["sRN FREchoFilter", "sRA FREchoFilter 1"], Some(1)),
            (&["sRA FREchoFilter 2"], Some(2)),
            (&[first, accepted, "sRN FREchoFilter", "sFA 3"], Some(0)),
            // Only the scanner's side: it took something.
            (&["sRA FREchoFilter 2", accepted], None),
            // Pipelined.
            (&[first, last, accepted, refused], Some(0)),
            (&[first, last, refused, accepted], Some(2)),
            (&[first, accepted, last, accepted, "sMN mSCreboot", "sAN mSCreboot"], None),
            (
                &[
                    first,
                    accepted,
                    "sMN mEEwriteall",
                    "sAN mEEwriteall 1",
                    last,
                    accepted,
                    "sMN mSCreboot",
                    "sAN mSCreboot",
                ],
                Some(0),
            ),
        ] {
            assert_eq!(after(told).last().copied().flatten(), expected, "{told:?}");
        }
    }

    #[test]
    fn what_takes_something_away_is_known_while_it_does() {
        let after = |told: &[&str]| {
            let mut heard = HeardSettings::default();
            told.iter().for_each(|told| heard.take(&Telegram::parse(Dialect::A, told.as_bytes()).unwrap()));
            heard.leftovers().iter().map(|(_, setting)| setting.name).collect::<Vec<_>>()
        };
        let (on, off) = ("sWN LFPmeanfilter 1 +5 0", "sWN LFPmeanfilter 0 +5 0");
        let accepted = "sWA LFPmeanfilter";
        for (told, expected) in [
            (&[on][..], &[][..]),
            (&[on, accepted], &["LFPmeanfilter"]),
            (&[on, "sFA 5"], &[]),
            (&[on, accepted, off, accepted], &[]),
            (&[on, accepted, off, "sFA 5"], &["LFPmeanfilter"]),
            (&["sRN LFPmeanfilter", "sRA LFPmeanfilter 1 5 0"], &["LFPmeanfilter"]),
            (&["sRN LFPmeanfilter", "sRA LFPmeanfilter 0 5 0"], &[]),
            (&["sRA LFPparticle 1 +500", "sRA LFPmeanfilter 1 5 0"], &["LFPmeanfilter", "LFPparticle"]),
            (&[on, accepted, "sMN mSCreboot", "sAN mSCreboot"], &[]),
            (
                &[on, accepted, "sMN mEEwriteall", "sAN mEEwriteall 1", "sMN mSCreboot", "sAN mSCreboot"],
                &["LFPmeanfilter"],
            ),
        ] {
            assert_eq!(after(told), expected, "{told:?}");
        }
    }

    #[test]
    fn a_second_conversation_goes_on_with_what_the_first_one_told() {
        let take = |heard: &mut HeardSettings, told: &[&str]| {
            told.iter().for_each(|told| {
                heard.take(&Telegram::parse(Dialect::A, told.as_bytes()).unwrap());
            });
        };
        let (mut first, mut second) = (HeardSettings::default(), HeardSettings::default());
        take(&mut first, &["sWN FREchoFilter 2", "sWA FREchoFilter", "sMN mEEwriteall", "sAN mEEwriteall 1"]);
        second.set_in_force(first.in_force());
        assert_eq!(second.code(), Some(2));
        // What the first one asked last is not answered in the second one.
        take(&mut first, &["sWN FREchoFilter 0"]);
        take(&mut second, &["sWA FREchoFilter"]);
        assert_eq!(second.code(), None);
        take(&mut second, &["sMN mSCreboot", "sAN mSCreboot"]);
        assert_eq!(second.code(), Some(2));
    }

    #[test]
    fn what_was_asked_before_a_gap_is_not_answered_behind_it() {
        let mut heard = HeardSettings::default();
        heard.take(&Telegram::parse(Dialect::A, b"sWN FREchoFilter 0").unwrap());
        heard.forget_requests();
        heard.take(&Telegram::parse(Dialect::A, b"sWA FREchoFilter").unwrap());
        assert_eq!(heard.code(), None);
    }
}
