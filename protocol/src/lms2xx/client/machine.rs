//! The client's state machine, one frame at a time.

mod scans;
mod settings;

use alloc::collections::VecDeque;
use alloc::string::String;
use core::time::Duration;

use super::clock::ScanClock;
use super::config::Lms2xxConfig;
use super::step::Step;
use crate::host::{DeviceInfo, HostEvent, Language, Transmit};
use crate::lms2xx::configuration::Configuration;
use crate::lms2xx::frame::{Frame, LONGEST_SCAN, Received};
use crate::lms2xx::likely_mode::LikelyMode;
use crate::lms2xx::model::Model;
use crate::lms2xx::telegram::{POWER_ON, RESET_REPLY};
use crate::lms2xx::values::{MeasuringMode, Output, Values};
use crate::lms2xx::{Rate, Variant};
use crate::scan::Scan;

/// What a device that has refused a telegram wants before the next.
const PAUSE_AFTER_NAK: Duration = Duration::from_millis(30);
/// What a device may take to change its mode.
const MODE_CHANGE: Duration = Duration::from_secs(3);

#[derive(Clone, Debug)]
pub(super) struct Machine {
    config: Lms2xxConfig,
    step: Step,
    /// What follows once the line has settled.
    next: Step,
    tries: u32,
    /// Bytes that were no telegrams, so far and when it asked.
    junk: u64,
    junk_before: u64,
    rate: Rate,
    /// The line's rate is not known to a listener until the device tells it.
    rate_known: bool,
    /// Rates not yet tried.
    untried: VecDeque<Rate>,
    /// The wanted rate did not work out.
    stays: bool,
    now: Option<Duration>,
    deadline: Option<Duration>,
    transmits: VecDeque<Transmit>,
    events: VecDeque<HostEvent>,
    ident: String,
    firmware: String,
    known: Known,
    /// Where no reply tells the measuring mode.
    likely_mode: LikelyMode,
    values: Values,
    clock: ScanClock,
    scan: Scan,
}

/// What is known of the device's settings.
#[derive(Clone, Copy, Debug, Default)]
struct Known {
    variant: Option<Variant>,
    mode: Option<MeasuringMode>,
    configuration: Option<Configuration>,
    model: Option<&'static Model>,
}

impl Machine {
    pub(super) fn start(config: Lms2xxConfig) -> Self {
        let mut untried: VecDeque<Rate> = config.known.into_iter().collect();
        untried.extend(Rate::ALL.into_iter().filter(|rate| config.known != Some(*rate)));
        let mut machine = Self { untried, ..Self::idle(Step::Done, config) };
        machine.try_next_rate();
        machine
    }

    pub(super) fn listen() -> Self {
        Self::idle(Step::Listening, Lms2xxConfig::default())
    }

    fn idle(step: Step, config: Lms2xxConfig) -> Self {
        Self {
            config,
            step,
            next: Step::Done,
            tries: 0,
            junk: 0,
            junk_before: 0,
            rate: Rate::default(),
            rate_known: step != Step::Listening,
            untried: VecDeque::new(),
            stays: false,
            now: None,
            deadline: None,
            transmits: VecDeque::new(),
            events: VecDeque::new(),
            ident: String::new(),
            firmware: String::new(),
            known: Known::default(),
            likely_mode: LikelyMode::default(),
            values: Values::default(),
            clock: ScanClock::default(),
            scan: Scan::default(),
        }
    }

    pub(super) fn set_time(&mut self, now: Duration) {
        let first = self.now.replace(now).is_none();
        if first && self.deadline.is_some() {
            self.arm();
        }
    }

    pub(super) fn deadline(&self) -> Option<Duration> {
        self.deadline
    }

    pub(super) fn is_due(&self) -> bool {
        self.deadline.zip(self.now).is_some_and(|(deadline, now)| now >= deadline)
    }

    pub(super) fn check_deadline(&mut self) {
        if !self.is_due() {
            return;
        }
        match self.step {
            Step::Settle => {
                let next = self.next;
                self.begin(next);
            }
            step if self.tries < step.tries() => self.ask(),
            Step::Quiet if !self.untried.is_empty() => self.try_next_rate(),
            // The device has gone to a rate that does not come through: find it, and stay where it is found.
            Step::Confirm if !self.stays => {
                self.stays = true;
                self.untried = Rate::ALL.into_iter().collect();
                self.try_next_rate();
            }
            Step::Stop | Step::Lower => self.finish(HostEvent::Stopped),
            step => self.finish(HostEvent::NoAnswer { command: step.what() }),
        }
    }

    pub(super) fn transmit(&mut self) -> Option<Transmit> {
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

    pub(super) fn rate(&self) -> Rate {
        self.rate
    }

    pub(super) fn is_done(&self) -> bool {
        self.step == Step::Done
    }

    pub(super) fn stop(&mut self) {
        match self.step {
            Step::Stop | Step::Lower | Step::Done => {}
            Step::Listening => self.finish(HostEvent::Stopped),
            _ => self.begin(Step::Stop),
        }
    }

    /// Takes what the decoder has found; `junk` bytes were none so far.
    pub(super) fn handle(&mut self, heard: &Received<'_>, junk: u64) {
        self.junk = junk;
        match heard {
            Received::Frame(frame) => self.handle_frame(frame),
            // It heard something broken: no need to wait for the time-out, but it wants a pause.
            Received::Nak if self.tries < self.step.tries() && self.step.request().is_some() => {
                self.deadline = self.now.map(|now| now.saturating_add(PAUSE_AFTER_NAK));
            }
            // It has the request, and may take its time over it. Among junk, which is what another rate sounds like, it is just a byte.
            Received::Ack if self.step.changes_mode() && junk == self.junk_before => {
                let patience = MODE_CHANGE.saturating_add(self.line_time());
                self.deadline = self.now.map(|now| now.saturating_add(patience)).max(self.deadline);
            }
            Received::Nak | Received::Ack | Received::Broken | Received::CutOff { .. } => {}
        }
    }

    fn handle_frame(&mut self, frame: &Frame<'_>) {
        if !frame.is_from_device() {
            return;
        }
        let streams = matches!(self.step, Step::Streaming | Step::Listening);
        match *frame.body {
            [0xB0 | 0xB6 | 0xB7 | 0xBF | 0xC4 | 0xF5, ..] => {
                if streams {
                    self.take_scan(frame);
                }
                return;
            }
            // The reply to somebody else's reset, or the text that follows it, if the rate is the same.
            [POWER_ON | RESET_REPLY, ..] if self.step == Step::Streaming => {
                return self.finish(HostEvent::Restarted);
            }
            _ => {}
        }
        self.learn(frame.body);
        match self.step.verdict(frame.body) {
            Some(true) => self.answered(),
            Some(false) => self.refused(),
            None => {}
        }
    }

    fn answered(&mut self) {
        let next = match self.step {
            Step::Quiet if self.rate != self.config.rate && !self.stays => Step::Raise(self.config.rate),
            Step::Raise(rate) => return self.settle(rate, Step::Confirm),
            Step::Quiet | Step::Confirm => Step::Type,
            Step::Type => Step::Status,
            Step::Status => Step::Installation,
            Step::Installation => Step::Read,
            Step::Read => {
                self.tell_limits();
                match self.wanted_configuration() {
                    Some(configuration) => Step::Write(configuration),
                    None => Step::Monitor,
                }
            }
            Step::Write(_) => Step::Monitor,
            Step::Monitor => match self.config.variant.filter(|wanted| self.known.variant != Some(*wanted)) {
                Some(variant) => Step::Variant(variant),
                None => Step::Stream(self.wanted_output()),
            },
            Step::Variant(_) => Step::Stream(self.wanted_output()),
            Step::Stream(_) => {
                self.events.push_back(HostEvent::Ready(DeviceInfo {
                    ident: self.ident.clone(),
                    firmware: self.firmware.clone(),
                    language: Language::Lms2xx(self.rate),
                }));
                Step::Streaming
            }
            Step::Stop if self.rate != Rate::R9600 => Step::Lower,
            Step::Stop | Step::Lower => return self.finish(HostEvent::Stopped),
            Step::Settle | Step::Streaming | Step::Listening | Step::Done => return,
        };
        self.begin(next);
    }

    fn refused(&mut self) {
        let fatal = !self.step.is_optional();
        let event = HostEvent::Refused { command: self.step.what(), error: None, fatal };
        match self.step {
            Step::Stop | Step::Lower => self.finish(HostEvent::Stopped),
            _ if fatal => self.finish(event),
            Step::Raise(_) => {
                self.events.push_back(event);
                self.begin(Step::Type);
            }
            Step::Installation | Step::Read => {
                self.events.push_back(event);
                self.begin(Step::Monitor);
            }
            Step::Stream(_) => {
                self.events.push_back(event);
                self.begin(Step::Stream(Output::All));
            }
            _ => {
                self.events.push_back(event);
                self.answered();
            }
        }
    }

    fn try_next_rate(&mut self) {
        let Some(rate) = self.untried.pop_front() else {
            return self.finish(HostEvent::NoAnswer { command: Step::Quiet.what() });
        };
        self.rate = rate;
        self.transmits.push_back(Transmit::Rate(rate));
        self.begin(Step::Quiet);
    }

    fn settle(&mut self, rate: Rate, next: Step) {
        self.rate = rate;
        self.transmits.push_back(Transmit::Rate(rate));
        self.next = next;
        self.begin(Step::Settle);
    }

    fn begin(&mut self, step: Step) {
        self.step = step;
        self.tries = 0;
        self.ask();
    }

    fn ask(&mut self) {
        self.tries += 1;
        self.junk_before = self.junk;
        if let Some(request) = self.step.request() {
            self.transmits.push_back(Transmit::Frame(request.to_frame()));
        }
        self.arm();
    }

    /// Sets the time-out of what was asked last.
    fn arm(&mut self) {
        let line = self.line_time();
        let patience = match self.step {
            Step::Streaming | Step::Listening | Step::Done => {
                self.deadline = None;
                return;
            }
            Step::Settle => self.config.settle,
            Step::Write(_) => self.config.save_timeout,
            _ => self.config.reply_timeout + line,
        };
        self.deadline = Some(self.now.unwrap_or_default().saturating_add(patience));
    }

    /// The longest telegram may be on the line before the reply, and the request and the reply take their time too.
    fn line_time(&self) -> Duration {
        self.rate.transmission(LONGEST_SCAN + 200)
    }

    fn finish(&mut self, event: HostEvent) {
        self.step = Step::Done;
        self.deadline = None;
        self.events.push_back(event);
    }
}
