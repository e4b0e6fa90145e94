//! How a scanner changes from one condition to another, and how it reports that.

use core::time::Duration;

use super::condition::{Activity, Condition};
use super::options::{Profile, Start};
use super::state::Device;
use crate::model::Times;
use crate::telegram::{scdevicestate, stlms};
use crate::time::SimTime;

impl Device {
    /// True while turns give scans, or will as soon as the mirror is up to speed.
    pub fn is_measuring(&self) -> bool {
        let Condition { activity, held_by_login, .. } = self.condition;
        activity == Activity::Measuring
            && !held_by_login
            && self.settings.applications.ranging
            && !self.motor_fails()
    }

    /// True where a request keeps it from measuring: a stop, a standby, a login that has not ended, or an application that was switched off.
    pub fn is_stopped(&self) -> bool {
        let Condition { activity, held_by_login, .. } = self.condition;
        matches!(activity, Activity::Standby | Activity::Stopped)
            || held_by_login
            || !self.settings.applications.ranging
    }

    /// True while it starts up after power-up and answers nothing.
    pub fn is_silent(&self, now: SimTime) -> bool {
        now < self.condition.silent_until
    }

    /// True while it starts up, speeds up or settles in a new scan mode.
    pub fn is_settling(&self, now: SimTime) -> bool {
        let Condition { silent_until, scans_from, busy_until, .. } = self.condition;
        now < silent_until.max(scans_from).max(busy_until)
    }

    /// How often it has restarted: when this number changes, all connections are gone.
    pub fn reboots(&self) -> u32 {
        self.condition.reboots
    }

    /// Dirt on the front screen: 0 clean, 1 warning, 2 error, 3 serious error.
    pub fn set_contamination(&mut self, level: u8) {
        self.condition.contamination = level.min(3);
    }

    /// The state it is found in at simulated time zero.
    pub(super) fn begin(&mut self, start: Start) {
        // Its window is as it was.
        self.condition = Condition { contamination: self.condition.contamination, ..Condition::default() };
        match start {
            Start::Streaming => {}
            Start::PowerUp => self.power_up(SimTime::ZERO),
            Start::Standby => self.condition.activity = Activity::Standby,
            Start::Stopped => self.condition.activity = Activity::Stopped,
            Start::LoggedIn => self.condition.held_by_login = true,
            Start::Error => self.condition.activity = Activity::Error,
            Start::Stored(dialect) => self.host_dialect = Some(dialect),
        }
    }

    pub(super) fn power_up(&mut self, now: SimTime) {
        let silent_until = now + self.takes(self.times().boot);
        let initialising_until = silent_until + self.takes(self.times().initialisation);
        self.condition = Condition {
            silent_until,
            initialising_until,
            reboots: self.condition.reboots,
            power_cycles: self.condition.power_cycles,
            contamination: self.condition.contamination,
            ..Condition::default()
        };
        self.speed_up(initialising_until, self.takes(self.times().spin_up));
        self.condition.busy_until = self.condition.scans_from;
    }

    /// `LMCstartmeas`. A scanner that measures already goes on measuring: some clients ask STlms once, straight after it, and give up for
    /// ever if it is not 7. Spinning up takes time where the motor stands, and settling where the scan mode is a new one.
    pub(super) fn start_measurement(&mut self, now: SimTime) {
        let mode_changed = core::mem::take(&mut self.condition.mode_changed);
        let from = now.max(self.condition.initialising_until);
        match self.condition.activity {
            // Only a new device leaves this state.
            Activity::Error => return,
            Activity::Stopped => self.speed_up(from, self.takes(self.times().spin_up)),
            Activity::Standby => self.speed_up(from, Duration::ZERO),
            // A motor that still speeds up goes on doing so.
            Activity::Measuring if mode_changed => {
                self.speed_up(from.max(self.condition.rotating_until), Duration::ZERO);
            }
            // Its counter starts afresh and the first scan takes its time, as recorded; STlms stays.
            Activity::Measuring => {
                let first_scan = from + self.takes(self.times().first_scan);
                self.condition.scans_from = self.condition.scans_from.max(first_scan);
            }
        }
        self.condition.activity = Activity::Measuring;
        self.condition.held_by_login = false;
        let busy = if mode_changed { self.times().busy_after_new_mode } else { Duration::ZERO };
        self.condition.busy_until = self.condition.scans_from.max(now + self.takes(busy));
        self.counters.start_up_scans = self.model.start_up.scans;
        if let Some(restart) = self.model.scan_counter_restart {
            self.counters.scan = restart;
        }
        self.switch_outputs(now, false);
    }

    /// `Run`: logs out.
    pub(super) fn release(&mut self) {
        self.condition.held_by_login = false;
    }

    pub(super) fn stop_measurement(&mut self, activity: Activity) {
        if self.condition.activity != Activity::Error {
            self.condition.activity = activity;
        }
    }

    /// True if the turn at `at` gives a scan.
    pub(super) fn makes_scans(&self, at: SimTime) -> bool {
        self.is_measuring() && !self.condition.off && at >= self.condition.scans_from
    }

    /// True if a client may expect scans.
    pub(super) fn device_state(&self, now: SimTime, logged_in: bool) -> u8 {
        match self.condition.activity {
            Activity::Error => scdevicestate::ERROR,
            _ if self.motor_fails() => scdevicestate::ERROR,
            _ if self.is_busy_with_trouble() => scdevicestate::BUSY,
            Activity::Standby => scdevicestate::STANDBY,
            Activity::Measuring if !logged_in && self.is_measuring() && now >= self.condition.busy_until => {
                scdevicestate::READY
            }
            Activity::Measuring | Activity::Stopped => scdevicestate::BUSY,
        }
    }

    /// STlms' state.
    pub(super) fn status(&self, now: SimTime) -> u16 {
        match self.condition.activity {
            _ if now < self.condition.initialising_until => stlms::INITIALISATION,
            Activity::Error => stlms::UNDEFINED,
            _ if self.motor_fails() => stlms::UNDEFINED,
            Activity::Standby => stlms::ROTATING,
            Activity::Stopped => stlms::IDLE,
            Activity::Measuring if now < self.condition.rotating_until => stlms::ROTATING,
            Activity::Measuring if now < self.condition.preparing_until => stlms::PREPARING,
            Activity::Measuring if self.is_measuring() => stlms::MEASURING,
            Activity::Measuring => stlms::READY,
        }
    }

    /// A scan's device status, in the places that [`DeviceStatus::of_scandata`](crate::validity::DeviceStatus::of_scandata) names.
    pub(super) fn scan_status(&self, starting: bool) -> [u8; 2] {
        let laser_off = if starting { self.model.start_up.status } else { 0 };
        let contamination = match self.contamination() {
            0 => 0,
            1 => 2,
            _ => 4,
        };
        let failed = u8::from(self.has_failed());
        [laser_off, failed | contamination]
    }

    /// How long things take: the model's times, with what the options say otherwise.
    pub fn times(&self) -> Times {
        let mut times = self.model.times;
        if let Some(boot) = self.options.boot {
            times.boot = boot;
        }
        if let Some(save) = self.options.save {
            times.save_reply = save;
        }
        times
    }

    /// A time real devices need; none in the bench profile.
    pub(super) fn takes(&self, time: Duration) -> Duration {
        match self.options.profile {
            Profile::Bench => Duration::ZERO,
            Profile::Field => time,
        }
    }

    fn speed_up(&mut self, from: SimTime, spin_up: Duration) {
        self.condition.rotating_until = from + spin_up;
        self.condition.scans_from = self.condition.rotating_until + self.takes(self.times().first_scan);
        self.condition.preparing_until = self.condition.scans_from;
    }
}
