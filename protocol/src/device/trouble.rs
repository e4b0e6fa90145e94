//! What a scanner does while something is wrong with it.

use alloc::vec::Vec;

use super::condition::Activity;
use super::state::Device;
use super::troubles::{LeftBehind, Part, RefusedWith, RestTrouble, Trouble};
use crate::telegram::set_access_mode::SetAccessMode;
use crate::telegram::{Kind, Method, SopasError, Telegram, encode};
use crate::time::SimTime;

impl Device {
    /// The supply fails: from now on nothing is heard, said or measured.
    pub fn power_off(&mut self) {
        self.condition.off = true;
        self.condition.silent_until = SimTime(u64::MAX);
        self.condition.initialising_until = SimTime(u64::MAX);
        self.condition.scans_from = SimTime(u64::MAX);
    }

    /// The supply is back: the device boots with what was saved, its counters and its clock at zero.
    pub fn power_on(&mut self, now: SimTime) {
        let reboots = self.condition.reboots;
        self.condition.power_cycles = self.condition.power_cycles.wrapping_add(1);
        self.ticks.restart();
        self.host_dialect = None;
        self.reboot(now);
        self.condition.reboots = reboots;
    }

    /// How often the supply was back: when this number changes, nothing is known of connections, logins and subscriptions any more. TCP
    /// connections are gone without a word.
    pub fn power_cycles(&self) -> u32 {
        self.condition.power_cycles
    }

    /// Something is wrong from now on.
    pub fn begin_trouble(&mut self, key: u64, trouble: Trouble) {
        self.troubles.list.push((key, trouble));
    }

    /// What its REST interface refuses now: where CoLa takes no password, nor does REST.
    pub fn rest_trouble(&self) -> Option<RestTrouble> {
        self.troubles.list.iter().find_map(|(_, trouble)| match trouble {
            Trouble::Rest(trouble) => Some(*trouble),
            Trouble::Refusal { command: Some(command), .. } if command == SetAccessMode::NAME => {
                Some(RestTrouble::Passwords)
            }
            _ => None,
        })
    }

    /// It is over; what needs a restart stays until then. False if there is none of this key.
    pub fn end_trouble(&mut self, key: u64) -> bool {
        let ended = self.troubles.list.iter().position(|(other, _)| *other == key);
        let Some(ended) = ended else { return false };
        if let (_, Trouble::Failure { part, until_reboot: true }) = self.troubles.list.remove(ended) {
            self.troubles.lingering.push(part);
        }
        true
    }

    /// It is found as somebody left it.
    pub fn leave_as(&mut self, left: LeftBehind) {
        if let Some(dialect) = left.dialect {
            self.host_dialect = Some(dialect);
        }
        if left.other_scan_data {
            let settings = &mut self.settings;
            settings.scan_data.remission = 1;
            settings.scan_data.output_rate = 2;
            let range = &mut settings.output_range;
            range.stop = range.start.midpoint(range.stop);
            self.saved = self.settings.clone();
        }
        if left.stopped {
            self.stop_measurement(Activity::Stopped);
        }
    }

    /// Its clock runs so many parts per million faster from `now` on; what it gains stays.
    pub fn drift_clock(&mut self, now: SimTime, more_ppm: f64) {
        self.clock.drift(now, more_ppm);
    }

    /// Sets its clock forward, µs; negative: back.
    pub fn step_clock(&mut self, us: i64) {
        self.clock.step(us);
    }

    /// Sets its clock forward so that its stamps, which are 32 bits wide, are 0 at `at`.
    pub fn wrap_clock(&mut self, at: SimTime) {
        self.clock.wrap(at);
    }

    /// Dirt: the worst there is.
    pub(super) fn contamination(&self) -> u8 {
        let levels = self.troubles.list.iter().map(|(_, trouble)| match trouble {
            Trouble::Dirt { level, .. } => (*level).min(3),
            _ => 0,
        });
        levels.fold(self.condition.contamination, u8::max)
    }

    pub(super) fn motor_fails(&self) -> bool {
        self.troubles.has(Part::Motor)
    }

    pub(super) fn temperature_fails(&self) -> bool {
        self.troubles.has(Part::Temperature)
    }

    /// A device error that scans tell.
    pub(super) fn has_failed(&self) -> bool {
        [Part::Motor, Part::Laser, Part::Temperature].into_iter().any(|part| self.troubles.has(part))
    }

    pub(super) fn is_busy_with_trouble(&self) -> bool {
        self.troubles.list.iter().any(|(_, trouble)| matches!(trouble, Trouble::Refusal { busy: true, .. }))
    }

    /// True if every beam may see something.
    pub(super) fn sees_all(&self) -> bool {
        !self.troubles.has(Part::Laser)
            && !self
                .troubles
                .list
                .iter()
                .any(|(_, trouble)| matches!(trouble, Trouble::Dirt { sector_deg: Some(_), .. }))
    }

    /// Whether a beam at this device angle sees nothing.
    pub(super) fn is_blind_at(&self, angle_deg: f64) -> bool {
        let dirty = |trouble: &Trouble| match trouble {
            Trouble::Dirt { level: 2.., sector_deg: Some((from, to)) } => (*from..=*to).contains(&angle_deg),
            _ => false,
        };
        self.troubles.has(Part::Laser) || self.troubles.list.iter().any(|(_, trouble)| dirty(trouble))
    }

    /// Appends the payload of a refusal that is due to trouble; false if there is none.
    pub(super) fn refuses(&self, telegram: &Telegram<'_>, out: &mut Vec<u8>) -> bool {
        let refusal = self.troubles.list.iter().find_map(|(_, trouble)| match trouble {
            Trouble::Refusal { command, answer, busy } => {
                let changes = matches!(telegram.kind, Kind::Wn | Kind::Mn);
                is_meant(command.as_deref(), telegram, !busy || changes).then_some(*answer)
            }
            _ => None,
        });
        let dialect = telegram.args.dialect;
        match refusal {
            Some(RefusedWith::Code(code)) => {
                encode(dialect, Kind::Fa, "", &SopasError::from_code(code).code(), out);
            }
            Some(RefusedWith::Zero) => encode(dialect, Kind::An, telegram.name, &false, out),
            None => return false,
        }
        true
    }
}

fn is_meant(command: Option<&str>, telegram: &Telegram<'_>, otherwise: bool) -> bool {
    let letters = telegram.kind.letters();
    let Some(command) = command else { return otherwise };
    match command.split_once(' ') {
        Some((kind, name)) => kind == letters && name.trim() == telegram.name,
        None => command == telegram.name || command == letters,
    }
}
