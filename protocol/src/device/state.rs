//! One scanner: identity, condition and settings.

use alloc::string::String;
use alloc::vec::Vec;

use super::clock::Clock;
use super::condition::Condition;
use super::filter::Filters;
use super::lines::{Field, Lines};
use super::options::{Options, Profile};
use super::recorded::Recorded;
use super::settings::Settings;
use super::ticks::TickCounter;
use super::troubles::Troubles;
use crate::angle::BeamGrid;
use crate::frame::Dialect;
use crate::model::{self, Model, Password, ScanMode};
use crate::optics::FactoryEcho;
use crate::telegram::{DateTime, LmdScandata, fr_echo_filter, ms_suppmode};
use crate::time::SimTime;

/// Serial number of the first LMS111 of a bench.
const FIRST_SERIAL_NUMBER: u32 = 26_110_001;
/// How far apart the serial numbers of two models begin.
const SERIAL_NUMBERS_A_MODEL: u32 = 100;
/// How far apart those of two runs do: more than all models have.
const SERIAL_NUMBERS_A_RUN: u32 = 10_000;
/// Runs that are told apart: serial numbers have eight digits, the first of them no 0.
const RUNS: u64 = 9000;
/// The seed of a run that names none.
const FIRST_RUN: u64 = 1;
/// By what the operating hours of two scanners of a bench differ, tenths of an hour.
const HOURS_APART: u32 = 137;
/// By what the counts of power-ons do.
const POWER_ONS_APART: u32 = 5;

/// What differs between two scanners of one model.
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
    /// Comment in scan telegrams, where LMDscandatacfg asks for it.
    pub comment: String,
    /// Name and version in DeviceIdent; the model's where absent.
    pub ident: Option<(String, String)>,
    /// FirmwareVersion; the model's where absent.
    pub firmware: Option<String>,
    /// Key of what its maker has measured of this unit: the elevations of its layers.
    pub unit: u64,
}

impl Default for Identity {
    fn default() -> Self {
        Self {
            serial_number: 24_070_042,
            location_name: String::from("not defined"),
            operating_hours: 1234,
            power_on_count: 56,
            comment: String::new(),
            ident: None,
            firmware: None,
            unit: 0,
        }
    }
}

impl Identity {
    /// Of scanner number `index` of a bench, from 0: no two scanners of one bench, and no two models, have all in common.
    pub fn of(model: &Model, index: usize) -> Self {
        let place = model::all().position(|other| other.name == model.name).unwrap_or_default();
        let number = |count: usize| u32::try_from(count).unwrap_or(u32::MAX);
        let (place, index) = (number(place), number(index));
        Self {
            serial_number: FIRST_SERIAL_NUMBER
                .wrapping_add(index)
                .wrapping_add(place.wrapping_mul(SERIAL_NUMBERS_A_MODEL)),
            operating_hours: model.operating_hours.wrapping_add(index.wrapping_mul(HOURS_APART)),
            power_on_count: model.power_on_count.wrapping_add(index.wrapping_mul(POWER_ONS_APART)),
            ..Self::default()
        }
    }

    /// The same scanner in a run with this seed: runs have other scanners, those of one seed the same ones. Runs of seeds that follow on each other have none in
    /// common.
    #[must_use]
    pub fn of_run(self, seed: u64) -> Self {
        let (first, own) =
            (self.serial_number / SERIAL_NUMBERS_A_RUN, self.serial_number % SERIAL_NUMBERS_A_RUN);
        // The first run's numbers are those of `of`.
        let least = 1000;
        let place = u64::from(first.saturating_sub(least)) + seed % RUNS + RUNS - FIRST_RUN;
        let run = least + (place % RUNS) as u32;
        Self { serial_number: run * SERIAL_NUMBERS_A_RUN + own, ..self }
    }
}

/// What the mirror does now.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Mirror {
    /// Mirror turns, 1/100 Hz.
    pub frequency_centihz: u32,
    /// How much longer than its nominal period a turn takes, parts per million of the period.
    pub period_ppm: i32,
    /// The full grid of the scan mode, before the output range is cut.
    pub beams: BeamGrid,
    /// The receiver suppresses fog, as a client has set it with MSsuppmode.
    pub suppresses_fog: bool,
    /// The layer that the next turn is of, [`Scan::layer_centideg`](crate::scan::Scan::layer_centideg).
    pub layer_centideg: i16,
}

impl Mirror {
    /// How long a turn takes, seconds.
    pub fn turn_s(&self) -> f64 {
        100.0 / f64::from(self.frequency_centihz.max(1)) * (1.0 + f64::from(self.period_ppm) * 1e-6)
    }
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

/// One scanner. Sessions share it.
#[derive(Clone, Debug)]
pub struct Device {
    pub(super) model: &'static Model,
    pub(super) identity: Identity,
    pub(super) options: Options,
    pub(super) settings: Settings,
    /// What a restart brings back.
    pub(super) saved: Settings,
    pub(super) condition: Condition,
    /// Dialect of the host interface, once EIHstCola has set it.
    pub(super) host_dialect: Option<Dialect>,
    pub(super) clock: Clock,
    pub(super) lines: Lines,
    /// One for the turns of each start: beams of others lie elsewhere.
    pub(super) filters: Vec<Filters>,
    pub(super) ticks: TickCounter,
    /// How often mEEwriteall has saved.
    pub(super) saves: u32,
    pub(super) counters: Counters,
    pub(super) last_scan: LmdScandata,
    pub(super) has_scan: bool,
    /// Of one whose scans and events come from a recording: what the recorded one was set to.
    pub(super) recorded: Option<Recorded>,
    /// Settings refused because of that.
    pub(super) fixed: u32,
    /// Logins it takes besides its model's.
    pub(super) more_logins: Vec<Password>,
    /// What is wrong with it.
    pub(super) troubles: Troubles,
}

/// What the device counts.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Counters {
    /// Mirror turns since power-up.
    pub(super) turns: u64,
    /// Lines made while measuring, after the filters.
    pub(super) lines: u64,
    /// What the next turn carries.
    pub(super) scan: u16,
    /// What the next telegram carries.
    pub(super) telegram: u16,
    /// Scans still to be marked as the first after LMCstartmeas.
    pub(super) start_up_scans: u32,
    /// Compact scan telegrams sent since power-up.
    pub(super) scan_telegrams: u64,
    /// The same of the encoder's.
    pub(super) encoder_telegrams: u64,
    /// Ticks in the last of those, and when they were read, µs.
    pub(super) encoder_before: (u32, u64),
}

impl Device {
    /// A warm scanner, ready and measuring, nobody logged in.
    pub fn new(model: &'static Model, identity: Identity) -> Self {
        let settings = Settings::new(model, &identity.location_name);
        let counters =
            Counters { scan: model.scan_counter_restart.unwrap_or_default(), ..Counters::default() };
        Self {
            model,
            options: Options::default(),
            saved: settings.clone(),
            settings,
            condition: Condition::default(),
            host_dialect: None,
            clock: Clock::new(&Options::default(), model),
            lines: Lines::new(model),
            filters: Vec::new(),
            ticks: TickCounter::default(),
            saves: 0,
            counters,
            last_scan: LmdScandata::default(),
            has_scan: false,
            recorded: None,
            fixed: 0,
            more_logins: Vec::new(),
            troubles: Troubles::default(),
            identity,
        }
    }

    /// Sets the echo that a new device reports: [`Device::new`] reports all of them. Of no effect where it tells one echo apart.
    pub fn set_factory_echo(&mut self, echo: FactoryEcho) {
        if self.model.echoes > 1 {
            let code = match echo {
                FactoryEcho::First => fr_echo_filter::FIRST,
                FactoryEcho::All => fr_echo_filter::ALL,
                FactoryEcho::Last => fr_echo_filter::LAST,
            };
            (self.settings.echo_filter, self.saved.echo_filter) = (code, code);
        }
    }

    /// The same with other options, as it is at simulated time zero.
    pub fn with_options(mut self, options: Options) -> Self {
        self.options = options;
        self.clock = Clock::new(&options, self.model);
        self.begin(options.start);
        self
    }

    /// Sets the comment of scan telegrams, which LMDscandatacfg asks for.
    pub fn set_comment(&mut self, comment: &str) {
        self.identity.comment = comment.into();
    }

    /// Sets what DeviceIdent says: name and version.
    pub fn set_ident(&mut self, name: &str, version: &str) {
        self.identity.ident = Some((name.into(), version.into()));
    }

    /// Sets what FirmwareVersion says.
    pub fn set_firmware(&mut self, text: &str) {
        self.identity.firmware = Some(text.into());
    }

    /// Takes this login, too: of a recorded scanner it may not be known which of several models it is.
    pub fn take_login(&mut self, login: Password) {
        if !self.model.logins.contains(&login) && !self.more_logins.contains(&login) {
            self.more_logins.push(login);
        }
    }

    /// Sets its serial number.
    pub fn set_serial_number(&mut self, serial_number: u32) {
        self.identity.serial_number = serial_number;
    }

    /// Its serial number.
    pub fn serial_number(&self) -> u32 {
        self.identity.serial_number
    }

    /// What it is.
    pub fn model(&self) -> &'static Model {
        self.model
    }

    /// What the mirror does.
    pub fn mirror(&self) -> Mirror {
        let mode = self.settings.mode;
        let period_ppm = match self.options.profile {
            Profile::Bench => 0,
            Profile::Field => self.model.period_ppm,
        };
        Mirror {
            frequency_centihz: self.model.turn_of(mode).frequency_centihz,
            period_ppm,
            beams: self.model.beams_of_turn(mode, self.counters.turns),
            suppresses_fog: self.settings.suppression.code == ms_suppmode::FOG,
            layer_centideg: self.layer_of_turn(self.counters.turns),
        }
    }

    /// Sets the scan mode, as the host program finds it in a rig file. It is kept over restarts.
    pub fn set_scan_mode(&mut self, frequency_centihz: u32, step: u16) -> Result<(), ModeError> {
        let mode = ScanMode { frequency_centihz, step };
        self.check_mode(mode)?;
        for settings in [&mut self.settings, &mut self.saved] {
            settings.mode = mode;
            settings.written_step = None;
        }
        Ok(())
    }

    /// The last scan made; it stays while the device does not measure.
    pub fn last_scan(&self) -> Option<&LmdScandata> {
        self.has_scan.then_some(&self.last_scan)
    }

    pub(super) fn check_mode(&self, mode: ScanMode) -> Result<(), ModeError> {
        let ScanMode { frequency_centihz, step } = mode;
        let legal = self.legal_modes().contains(&mode);
        if legal { Ok(()) } else { Err(ModeError { model: self.model.title, frequency_centihz, step }) }
    }

    /// The modes it can be set to: of a recorded scanner, the recorded one.
    pub(super) fn legal_modes(&self) -> &[ScanMode] {
        if self.recorded.is_some() { core::slice::from_ref(&self.settings.mode) } else { self.model.modes }
    }

    /// How many settings were refused because the recorded scans would have to be others.
    pub fn fixed_by_recording(&self) -> u32 {
        self.fixed
    }

    /// How often mEEwriteall has been called: when this number changes, [`Self::saved_settings`] has changed.
    pub fn saves(&self) -> u32 {
        self.saves
    }

    /// Keeps the settings over restarts.
    pub(super) fn save(&mut self) {
        self.saved = self.settings.clone();
        self.saves = self.saves.wrapping_add(1);
    }

    /// The settings of a new device.
    pub(super) fn as_delivered(&self) -> Settings {
        Settings::new(self.model, &self.identity.location_name)
    }

    /// A restart: saved settings are restored, counters and clocks start at zero.
    pub(super) fn reboot(&mut self, now: SimTime) {
        let identity = Identity {
            power_on_count: self.identity.power_on_count.wrapping_add(1),
            ..self.identity.clone()
        };
        let mut fresh = Self::new(self.model, identity);
        fresh.condition = self.condition;
        fresh.lines.inputs = self.lines.inputs;
        fresh.lines.fields = self.lines.fields.iter().map(|field| Field::new(field.radius_mm)).collect();
        fresh.lines.changes = self.lines.changes.since_power_up();
        *self = Self {
            options: self.options,
            settings: self.saved.clone(),
            saved: self.saved.clone(),
            saves: self.saves,
            host_dialect: self.host_dialect,
            clock: self.clock.restarted(now),
            ticks: self.ticks,
            recorded: self.recorded.take(),
            fixed: self.fixed,
            more_logins: core::mem::take(&mut self.more_logins),
            troubles: self.troubles.after_restart(),
            ..fresh
        };
        self.condition.reboots = self.condition.reboots.wrapping_add(1);
        self.power_up(now);
    }

    /// µs since power-up.
    pub(super) fn uptime_us(&self, now: SimTime) -> u64 {
        self.clock.uptime_us(now)
    }

    pub(super) fn date_time(&self, now: SimTime) -> DateTime {
        self.date_time_at(self.uptime_us(now))
    }

    /// The calendar at an instant of the device's own clock.
    pub(super) fn date_time_at(&self, uptime_us: u64) -> DateTime {
        self.clock.date_time_at(uptime_us)
    }
}
