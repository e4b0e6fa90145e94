//! One scanner: what it is, what it does, how it is set.

use alloc::string::String;
use core::time::Duration;

use super::calendar;
use super::settings::Settings;
use crate::angle::BeamGrid;
use crate::frame::Dialect;
use crate::model::{Model, ScanMode};
use crate::telegram::{DateTime, LmdScandata};
use crate::time::SimTime;

/// Who this scanner is: what differs between two of one model.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Identity {
    /// Serial number.
    pub serial_number: u32,
    /// Location name out of the box.
    pub location_name: String,
    /// Operating hours, tenths of an hour.
    pub operating_hours: u32,
    /// How often it was switched on.
    pub power_on_count: u32,
}

impl Default for Identity {
    fn default() -> Self {
        Self {
            serial_number: 24_070_042,
            location_name: String::from("not defined"),
            operating_hours: 1234,
            power_on_count: 56,
        }
    }
}

/// How this scanner behaves where real ones differ.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Options {
    /// Logging in stops the measurement until `Run` or `LMCstartmeas`, as the manual has it. Without it scans go on, as clients
    /// that never send `Run` rely on.
    pub strict_login: bool,
    /// How long before simulated time zero the scanner was powered up: where its 32-bit clock stands.
    pub power_up_before: Duration,
}

/// What the mirror does now.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Mirror {
    /// Mirror turns, 1/100 Hz.
    pub frequency_centihz: u32,
    /// The full grid of the scan mode, before the output range is cut.
    pub beams: BeamGrid,
}

/// A scan mode the model does not have.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "{model} has no scan mode of {} Hz with {} degree steps; `rowscan models` lists its modes",
    f64::from(*.frequency_centihz) / 100.0,
    f64::from(*.step) / 10_000.0
)]
pub struct ModeError {
    /// The model.
    pub model: &'static str,
    /// What was asked for, 1/100 Hz.
    pub frequency_centihz: u32,
    /// What was asked for, 1/10000°.
    pub step: u16,
}

/// What laser and motor do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Activity {
    Measuring,
    /// Laser off, the mirror turns.
    Standby,
    /// Laser and motor off.
    Stopped,
}

/// One scanner. Sessions share it.
#[derive(Clone, Debug)]
pub struct Device {
    pub(super) model: &'static Model,
    pub(super) identity: Identity,
    pub(super) options: Options,
    pub(super) settings: Settings,
    /// What a restart brings back.
    pub(super) saved: Settings,
    pub(super) activity: Activity,
    /// A login has stopped the scans (strict login).
    pub(super) held_by_login: bool,
    /// Dialect of the host interface, once EIHstCola has set it.
    pub(super) host_dialect: Option<Dialect>,
    /// Power-up time = simulated time + this, µs; wraps.
    power_up_offset_us: u64,
    /// Calendar = power-up time + this, µs; wraps. Zero until LSPsetdatetime: the calendar starts at 1970 with power-up.
    calendar_offset_us: u64,
    pub(super) counters: Counters,
    pub(super) last_scan: LmdScandata,
    pub(super) has_scan: bool,
}

/// What the device counts.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Counters {
    /// Mirror turns since power-up.
    pub(super) turns: u64,
    /// What the next turn carries.
    pub(super) scan: u16,
    /// What the next telegram carries.
    pub(super) telegram: u16,
    /// Scans still to be marked as the first after LMCstartmeas.
    pub(super) start_up_scans: u32,
}

impl Device {
    /// A warm scanner, ready and measuring, nobody logged in.
    pub fn new(model: &'static Model, identity: Identity) -> Self {
        let settings = Settings::new(model, &identity.location_name);
        let counters =
            Counters { scan: model.scan_counter_restart.unwrap_or_default(), ..Counters::default() };
        Self {
            model,
            identity,
            options: Options::default(),
            saved: settings.clone(),
            settings,
            activity: Activity::Measuring,
            held_by_login: false,
            host_dialect: None,
            power_up_offset_us: 0,
            calendar_offset_us: 0,
            counters,
            last_scan: LmdScandata::default(),
            has_scan: false,
        }
    }

    /// The same with other options.
    pub fn with_options(mut self, options: Options) -> Self {
        self.options = options;
        self.power_up_offset_us = options.power_up_before.as_micros() as u64;
        self
    }

    /// What it is.
    pub fn model(&self) -> &'static Model {
        self.model
    }

    /// True while turns give scans.
    pub fn is_measuring(&self) -> bool {
        self.activity == Activity::Measuring && !self.held_by_login
    }

    /// What the mirror does.
    pub fn mirror(&self) -> Mirror {
        let mode = self.settings.mode;
        Mirror { frequency_centihz: mode.frequency_centihz, beams: self.model.beams(mode) }
    }

    /// Sets the scan mode, as the host program finds it in a rig file. It is kept over restarts.
    pub fn set_scan_mode(&mut self, frequency_centihz: u32, step: u16) -> Result<(), ModeError> {
        let mode = ScanMode { frequency_centihz, step };
        self.check_mode(mode)?;
        self.settings.mode = mode;
        self.saved.mode = mode;
        Ok(())
    }

    /// The last scan made, also while nobody measures.
    pub fn last_scan(&self) -> Option<&LmdScandata> {
        self.has_scan.then_some(&self.last_scan)
    }

    pub(super) fn check_mode(&self, mode: ScanMode) -> Result<(), ModeError> {
        let ScanMode { frequency_centihz, step } = mode;
        let legal = self.model.modes.contains(&mode);
        if legal { Ok(()) } else { Err(ModeError { model: self.model.title, frequency_centihz, step }) }
    }

    pub(super) fn start_measurement(&mut self) {
        self.activity = Activity::Measuring;
        self.held_by_login = false;
        self.counters.start_up_scans = self.model.start_up.scans;
        if let Some(restart) = self.model.scan_counter_restart {
            self.counters.scan = restart;
        }
    }

    /// A restart: saved settings come back, counters and clocks begin anew.
    pub(super) fn reboot(&mut self, now: SimTime) {
        let fresh = Self::new(self.model, self.identity.clone());
        *self = Self {
            options: self.options,
            settings: self.saved.clone(),
            saved: self.saved.clone(),
            host_dialect: self.host_dialect,
            power_up_offset_us: 0u64.wrapping_sub(now.0 / 1000),
            ..fresh
        };
    }

    /// µs since power-up.
    pub(super) fn uptime_us(&self, now: SimTime) -> u64 {
        (now.0 / 1000).wrapping_add(self.power_up_offset_us)
    }

    pub(super) fn date_time(&self, now: SimTime) -> DateTime {
        calendar::date_time(self.uptime_us(now).wrapping_add(self.calendar_offset_us))
    }

    /// False for a date that does not exist.
    pub(super) fn set_date_time(&mut self, now: SimTime, date_time: &DateTime) -> bool {
        let Some(us) = calendar::microseconds(date_time) else { return false };
        self.calendar_offset_us = us.wrapping_sub(self.uptime_us(now));
        true
    }
}
