//! The client's state machine, one frame at a time.

use alloc::collections::VecDeque;
use alloc::string::ToString;
use alloc::vec::Vec;
use core::time::Duration;

use super::config::ColaConfig;
use super::step::{Plan, STOP, Step, start_up};
use crate::frame::{Dialect, Frame};
use crate::heard_settings::{HeardSettings, first_sent};
use crate::host::{DeviceInfo, HostEvent, Language};
use crate::reading::Reading;
use crate::scan::Scan;
use crate::telegram::inertial_measurement_unit::InertialMeasurementUnit;
use crate::telegram::{Args, Kind, LmdScandata, SopasError, Telegram, Variable, lmd_scandata};
use crate::validity::ScanFault;

/// Telegrams that may come between a request and its reply, as events do.
const MAX_SKIPPED: u32 = 100;

/// What the client is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    /// Waits for the reply of this step of the [start-up](start_up).
    Starting(usize),
    Streaming,
    Stopping,
    Listening,
    Done,
}

/// When a reply is due.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Deadline {
    None,
    /// A request has gone out before the first time was handed in.
    Unset,
    At(Duration),
}

#[derive(Clone, Debug)]
pub(super) struct Machine {
    phase: Phase,
    dialect: Dialect,
    plan: Plan,
    now: Option<Duration>,
    deadline: Deadline,
    skipped: u32,
    /// The request that is out was sent twice: its reply may have been lost or damaged once.
    asked_again: bool,
    transmits: VecDeque<Vec<u8>>,
    events: VecDeque<HostEvent>,
    /// Of a client that only listens: which echo others have asked for.
    heard: HeardSettings,
    telegram: LmdScandata,
    scan: Scan,
}

impl Machine {
    pub(super) fn start(config: ColaConfig, dialect: Dialect) -> Self {
        let mut machine = Self::idle(Phase::Done, dialect, config);
        machine.step_from(0);
        machine
    }

    pub(super) fn listen() -> Self {
        Self::idle(Phase::Listening, Dialect::B, ColaConfig::default())
    }

    fn idle(phase: Phase, dialect: Dialect, config: ColaConfig) -> Self {
        Self {
            phase,
            dialect,
            plan: Plan { config, ..Plan::default() },
            now: None,
            deadline: Deadline::None,
            skipped: 0,
            asked_again: false,
            transmits: VecDeque::new(),
            events: VecDeque::new(),
            heard: HeardSettings::default(),
            telegram: LmdScandata::default(),
            scan: Scan::default(),
        }
    }

    pub(super) fn set_time(&mut self, now: Duration) {
        self.now = Some(now);
        if self.deadline == Deadline::Unset {
            self.arm();
        }
    }

    pub(super) fn deadline(&self) -> Option<Duration> {
        match self.deadline {
            Deadline::None => None,
            // At once: the time-out begins with the first time the client hears of.
            Deadline::Unset => Some(Duration::ZERO),
            Deadline::At(time) => Some(time),
        }
    }

    /// Gives up what is overdue. `is_heard`: frames have come, good or bad, so this dialect is spoken.
    pub(super) fn check_deadline(&mut self, is_heard: bool) {
        if let (Deadline::At(time), Some(now)) = (self.deadline, self.now)
            && now >= time
        {
            self.give_up(is_heard);
        }
    }

    pub(super) fn transmit(&mut self) -> Option<Vec<u8>> {
        self.transmits.pop_front()
    }

    pub(super) fn has_event(&self) -> bool {
        !self.events.is_empty()
    }

    /// True while a scan waits to be taken: there is room for one.
    pub(super) fn has_scan(&self) -> bool {
        self.events.contains(&HostEvent::Scan)
    }

    pub(super) fn next_event(&mut self) -> Option<HostEvent> {
        self.events.pop_front()
    }

    pub(super) fn scan(&self) -> &Scan {
        &self.scan
    }

    pub(super) fn telegram(&self) -> &LmdScandata {
        &self.telegram
    }

    pub(super) fn is_done(&self) -> bool {
        self.phase == Phase::Done
    }

    pub(super) fn stop(&mut self) {
        match self.phase {
            Phase::Streaming => {
                self.phase = Phase::Stopping;
                self.request(&STOP);
            }
            Phase::Starting(_) | Phase::Listening => self.finish(HostEvent::Stopped),
            Phase::Stopping | Phase::Done => {}
        }
    }

    /// Of a client that only listens: what it has heard.
    pub(super) fn heard(&mut self) -> Option<&mut HeardSettings> {
        Some(&mut self.heard).filter(|_| self.phase == Phase::Listening)
    }

    /// Hears what the host says on a tapped line.
    pub(super) fn hear(&mut self, frame: &Frame<'_>) {
        if let Ok(telegram) = Telegram::parse(frame.dialect, frame.payload) {
            self.heard.take(&telegram);
        }
    }

    /// Bytes are missing.
    pub(super) fn forget_requests(&mut self) {
        self.heard.forget_requests();
    }

    /// The code of FREchoFilter in force, if it is known.
    fn echo_code(&self) -> Option<u8> {
        if self.phase == Phase::Listening { self.heard.code() } else { self.plan.echo_filter }
    }

    pub(super) fn handle_frame(&mut self, frame: &Frame<'_>) {
        // A good frame that is no telegram is somebody else's.
        let Ok(telegram) = Telegram::parse(frame.dialect, frame.payload) else { return };
        let awaited = match self.phase {
            Phase::Starting(index) => start_up().nth(index),
            Phase::Stopping => Some(STOP),
            Phase::Streaming | Phase::Listening | Phase::Done => None,
        };
        if self.phase == Phase::Listening {
            self.heard.take(&telegram);
        }
        let is_scan = is_scan(&telegram);
        if is_scan && !matches!(self.phase, Phase::Starting(_) | Phase::Done) {
            self.take_scan(telegram.args);
        }
        if is_imu(&telegram) && !matches!(self.phase, Phase::Starting(_) | Phase::Done) {
            let event = telegram.args.decode::<InertialMeasurementUnit>();
            let reading = event.map_or(Reading::Unreadable, |event| Reading::Imu((&event).into()));
            self.events.push_back(HostEvent::Reading(reading));
        }
        let Some(step) = awaited else { return };
        if let Some(error) = telegram.refusal() {
            self.refused(&step, error);
        } else if telegram.kind == step.reply_kind && telegram.name == step.command {
            match step.take(&mut self.plan, telegram.args) {
                Ok(()) => self.taken(&step),
                Err(error) => self.refused(&step, error),
            }
        } else {
            // Events, receipts (sMA), and replies that came twice.
            self.skipped += 1;
            if self.skipped > MAX_SKIPPED {
                self.give_up(true);
            }
        }
    }

    fn take_scan(&mut self, args: Args<'_>) {
        let (code, leftovers) = (self.echo_code(), self.heard.leftovers());
        let Self { telegram, scan, .. } = self;
        let taken =
            args.decode_into(telegram).map_err(|error| ScanFault::Fields { reason: error.to_string() });
        match taken.and_then(|()| telegram.to_scan_into(scan)) {
            Ok(()) => {
                scan.received = self.now;
                // A mask that leaves the first echo out leaves another one at its place.
                scan.echo = code.filter(|_| telegram.begins_with_first()).and_then(first_sent);
                scan.leftovers = leftovers;
                self.events.push_back(HostEvent::Scan);
            }
            Err(fault) => self.events.push_back(HostEvent::Malformed { fault }),
        }
    }

    fn taken(&mut self, step: &Step) {
        if let Some(setting) = step.was_to_put_right(&mut self.plan) {
            self.events.push_back(HostEvent::Leftover { setting, refused: None });
        }
        self.answered();
    }

    fn answered(&mut self) {
        match self.phase {
            Phase::Starting(index) => self.step_from(index + 1),
            Phase::Stopping => self.finish(HostEvent::Stopped),
            Phase::Streaming | Phase::Listening | Phase::Done => {}
        }
    }

    fn refused(&mut self, step: &Step, error: SopasError) {
        if step.where_known && error == SopasError::UnknownVariable {
            return self.answered();
        }
        if let Some(setting) = step.was_to_put_right(&mut self.plan) {
            self.events.push_back(HostEvent::Leftover { setting, refused: Some(error.into()) });
            return self.answered();
        }
        let fatal = step.required && self.phase != Phase::Stopping;
        let event = HostEvent::Refused { command: step.command, error: Some(error.into()), fatal };
        if fatal {
            self.finish(event);
        } else {
            self.events.push_back(event);
            self.answered();
        }
    }

    /// No reply: once more, of a device that was heard; then it is over.
    fn give_up(&mut self, is_heard: bool) {
        match self.phase {
            Phase::Starting(index) => match start_up().nth(index) {
                Some(step) if is_heard && !self.asked_again => {
                    self.request(&step);
                    self.asked_again = true;
                }
                step => {
                    let command = step.map_or("", |step| step.command);
                    self.finish(HostEvent::NoAnswer { command });
                }
            },
            // It will not answer any more; the connection is closed next anyway.
            Phase::Stopping => self.finish(HostEvent::Stopped),
            Phase::Streaming | Phase::Listening | Phase::Done => self.deadline = Deadline::None,
        }
    }

    /// Sends the first needed step from line `index` on; past the last, scans will come.
    fn step_from(&mut self, index: usize) {
        match start_up().enumerate().skip(index).find(|(_, step)| step.is_needed(&self.plan)) {
            Some((index, step)) => {
                self.phase = Phase::Starting(index);
                self.request(&step);
            }
            None => {
                self.phase = Phase::Streaming;
                self.deadline = Deadline::None;
                self.events.push_back(HostEvent::Ready(self.info()));
            }
        }
    }

    fn info(&self) -> DeviceInfo {
        let Plan { ident, firmware, .. } = &self.plan;
        let language = Language::Cola(self.dialect);
        DeviceInfo { ident: ident.clone(), firmware: firmware.clone(), language }
    }

    fn request(&mut self, step: &Step) {
        let mut frame = Vec::new();
        step.request(&self.plan, self.dialect, &mut frame);
        self.transmits.push_back(frame);
        self.skipped = 0;
        self.asked_again = false;
        self.arm();
    }

    /// Sets the time-out of the request that was sent last.
    fn arm(&mut self) {
        let patience = match self.phase {
            Phase::Starting(index) => start_up().nth(index).map_or(1, |step| step.patience),
            _ => STOP.patience,
        };
        let timeout = self.plan.config.reply_timeout.saturating_mul(patience);
        self.deadline = self.now.map_or(Deadline::Unset, |now| Deadline::At(now.saturating_add(timeout)));
    }

    fn finish(&mut self, event: HostEvent) {
        self.phase = Phase::Done;
        self.deadline = Deadline::None;
        self.events.push_back(event);
    }
}

/// Events of an MRS1000's inertial measurement unit.
fn is_imu(telegram: &Telegram<'_>) -> bool {
    telegram.kind == Kind::Sn && telegram.name == InertialMeasurementUnit::NAME
}

/// Scan events, SOPAS ET's monitor events, and polled scans.
fn is_scan(telegram: &Telegram<'_>) -> bool {
    match telegram.kind {
        Kind::Sn => [LmdScandata::NAME, lmd_scandata::MONITOR].contains(&telegram.name),
        Kind::Ra => telegram.name == LmdScandata::NAME,
        _ => false,
    }
}
