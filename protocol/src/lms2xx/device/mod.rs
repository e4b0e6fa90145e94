//! The LMS2xx scanner, without I/O: one device on one line.
//!
//! A request interrupts what the device is sending. After [`Device::handle_bytes`] ask [`Device::interrupts`]; if it says so, end the
//! transmission behind the byte that is on the line, and say so with [`Device::transmitted`].
//!
//! Calling order: hand in bytes with the time they arrived ([`Device::handle_bytes`]) or time ([`Device::handle_timeout`]); then send what
//! [`Device::poll_transmit`] gives, at [`Device::rate`], and say so ([`Device::transmitted`]): a switch of the rate waits for that. When the line is
//! free, [`Device::plan`] gives the mirror turns of the next scan telegram; once they are over, hand them to [`Device::measure`].

mod answer;
mod evaluation;
mod fields;
mod fill;
mod pace;
mod recorded;
mod saved;
mod status;
mod sweep;

use alloc::collections::VecDeque;
use alloc::string::String;
use alloc::vec::Vec;
use core::time::Duration;

pub use pace::Pace;
pub use recorded::Recorded;
pub use saved::SavedBlockError;
pub(crate) use status::{place, rate_of};
pub use sweep::{Beams, Sweep};

use super::configuration::Configuration;
use super::firmware::Firmware;
use super::frame::{ACK, FROM_DEVICE, FrameCounts, FrameDecoder, Listener, NAK, Received, encode};
use super::model::{LEAST_SPACING, LONGEST_PAUSE, Model};
use super::telegram::{PASSWORD, POWER_ON, Request};
use super::values::{MeasuringMode, Output, Unit};
use super::{Rate, Variant};
use crate::device::Profile;
use crate::time::SimTime;
use evaluation::{Job, Teaching};
use fields::Fields;
use sweep::Collected;

/// Frames and bytes that wait for the line; what is asked beyond that goes unanswered.
const MAX_WAITING: usize = 32;

/// The longest silence inside a telegram on the bench, where bytes are judged by their order: a busy host may take its time.
const BENCH_PAUSE: Duration = Duration::from_millis(500);

/// What can be chosen about a device.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Options {
    /// Boot and EEPROM times, and the least spacing of bytes.
    pub profile: Profile,
    /// The state it is found in.
    pub start: Start,
    /// The rate it keeps over a restart.
    pub stored_rate: Rate,
    /// How much longer than the device's own limit a pause inside a telegram may seem: what the host's scheduling adds.
    pub pause_slack: Duration,
    /// Another firmware than the model's own.
    pub firmware: Option<Firmware>,
    /// From power-up until the power-on text; the model's own time where there is none. `field` profile only.
    pub boot: Option<Duration>,
    /// Dirt on the front window: 0 clean, 1 a warning, 2 an error, 3 an error of both channels.
    pub contamination: u8,
    /// From a write of the configuration block to its reply; the model's own times where there is none. `field` profile only.
    pub save: Option<Duration>,
}

/// The state a device is found in.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Start {
    /// Up, and silent until asked.
    #[default]
    Idle,
    /// Just switched on.
    PowerUp,
    /// A client is gone that let it stream.
    Streaming,
    /// A client is gone that left it in installation mode.
    Installation,
}

impl Start {
    /// As flags and files name them, with what they mean.
    pub const NAMED: &'static [(&'static str, &'static str, Self)] = &[
        ("streaming", "Measuring", Self::Streaming),
        ("power-up", "Just switched on", Self::PowerUp),
        ("stopped", "Stopped by a client that is gone", Self::Idle),
        ("installation", "LMS2xx: a client left it in installation mode", Self::Installation),
    ];

    /// The one of this name.
    pub fn by_name(name: &str) -> Option<Self> {
        Self::NAMED.iter().find(|(known, ..)| *known == name).map(|(.., start)| *start)
    }

    /// The state an LMS2xx of this profile is found in, unless told otherwise.
    pub fn default_of(profile: Profile) -> Self {
        match profile {
            Profile::Bench => Self::Idle,
            Profile::Field => Self::PowerUp,
        }
    }
}

/// What it is doing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Condition {
    /// Restarting; up at this instant.
    Booting(SimTime),
    Up,
}

/// The operating mode, its stream apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum OperatingMode {
    Monitoring,
    Installation,
    Diagnostic,
}

/// Something to be sent.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Waiting {
    bytes: Vec<u8>,
    /// Not before.
    due: SimTime,
    after: Option<After>,
    /// A telegram of values: a request drops it.
    is_values: bool,
}

/// What happens once something was sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum After {
    Rate(Rate),
    Restart,
}

/// One scanner on one line.
#[derive(Clone, Debug)]
pub struct Device {
    model: &'static Model,
    options: Options,
    /// Dirt that came later.
    dirt: u8,
    decoder: FrameDecoder,
    condition: Condition,
    rate: Rate,
    variant: Variant,
    configuration: Configuration,
    /// What it is set to at power-on.
    kept_rate: Rate,
    kept_variant: Variant,
    firmware: Firmware,
    type_text: String,
    mode: OperatingMode,
    password: [u8; 8],
    /// One that waits for its confirmation.
    new_password: Option<[u8; 8]>,
    field_set: u8,
    fields: Fields,
    /// Scans in a row that each field was infringed in.
    infringed: [u8; 3],
    teaching: Option<Teaching>,
    /// What the scan that was asked for is made for, if not for its values.
    job: Option<Job>,
    /// Power-ons and restarts so far.
    power_ons: u16,
    /// Part 2 of the configuration.
    part_2: [u8; answer::PART_2_LENGTH],
    /// What it streams.
    stream: Option<Output>,
    /// One scan that was asked for.
    asked: Option<Output>,
    waiting: VecDeque<Waiting>,
    /// What happens once the current transmission is done.
    after: Option<After>,
    /// What it sends is a telegram of values.
    sends_values: bool,
    /// A request has come that cuts the current transmission off.
    interrupt: bool,
    /// Until then it hears nothing: it is busy with its memory.
    deaf_until: SimTime,
    /// Telegrams of values put on the line.
    telegrams: u8,
    /// Partial scans put on the line.
    partials: u64,
    /// When the last byte was taken.
    last_byte: Option<SimTime>,
    /// The first mirror turn that no telegram has held yet.
    next_turn: u64,
    collected: Collected,
    saves: u32,
    /// Its values come from a recording.
    recorded: Option<Recorded>,
}

impl Device {
    /// A device with factory settings, in the state the options choose, at time zero.
    pub fn new(model: &'static Model, options: Options) -> Self {
        let firmware = options.firmware.unwrap_or(model.firmware);
        let name = model.type_text.rsplit_once(';').map_or("", |(name, _)| name);
        let mut device = Self {
            model,
            firmware,
            type_text: alloc::format!("{name};{}", firmware.text()),
            options,
            dirt: 0,
            decoder: FrameDecoder::new(Listener::Device),
            condition: Condition::Up,
            rate: options.stored_rate,
            variant: model.default_variant,
            kept_rate: options.stored_rate,
            kept_variant: model.default_variant,
            configuration: out_of_the_box(model, firmware),
            mode: match options.start {
                Start::Installation => OperatingMode::Installation,
                _ => OperatingMode::Monitoring,
            },
            password: PASSWORD,
            new_password: None,
            field_set: 1,
            fields: Fields::default(),
            infringed: [0; 3],
            teaching: None,
            job: None,
            power_ons: 0,
            part_2: [0; answer::PART_2_LENGTH],
            sends_values: false,
            interrupt: false,
            deaf_until: SimTime::ZERO,
            telegrams: 0,
            partials: 0,
            stream: (options.start == Start::Streaming).then_some(Output::All),
            asked: None,
            waiting: VecDeque::new(),
            after: None,
            last_byte: None,
            next_turn: 0,
            collected: Collected::default(),
            saves: 0,
            recorded: None,
        };
        if options.start == Start::PowerUp {
            device.restart(SimTime::ZERO);
        }
        device
    }

    /// What it is.
    pub fn model(&self) -> &'static Model {
        self.model
    }

    /// Its type text.
    fn type_text(&self) -> &str {
        let recorded = self.recorded.as_ref().and_then(|recorded| recorded.type_text.as_deref());
        recorded.unwrap_or(&self.type_text)
    }

    /// The rate it receives and sends at.
    pub fn rate(&self) -> Rate {
        self.rate
    }

    /// Its scan angle and resolution.
    pub fn variant(&self) -> Variant {
        self.variant
    }

    /// Chooses the variant that it has from power-on; false if the model does not have it.
    pub fn set_variant(&mut self, variant: Variant) -> bool {
        let known = self.model.variants.contains(&variant);
        if known {
            (self.variant, self.kept_variant) = (variant, variant);
        }
        known
    }

    /// How often the configuration block was saved.
    pub fn saves(&self) -> u32 {
        self.saves
    }

    /// What was received.
    pub fn counts(&self) -> FrameCounts {
        self.decoder.counts()
    }

    /// Takes bytes that arrived from `at` on, one every `spacing`; zero where that is not known.
    pub fn handle_bytes(&mut self, at: SimTime, spacing: Duration, bytes: &[u8]) {
        self.handle_timeout(at);
        if self.condition != Condition::Up || at < self.deaf_until {
            return;
        }
        let longest = match self.options.profile {
            Profile::Bench => BENCH_PAUSE,
            Profile::Field => LONGEST_PAUSE,
        };
        let pause = longest.saturating_add(self.options.pause_slack);
        if self.last_byte.is_some_and(|last| at > last + pause) {
            self.decoder.finish();
            self.listen(at);
        }
        let too_fast =
            self.options.profile == Profile::Field && self.rate == Rate::R500000 && spacing < LEAST_SPACING;
        if too_fast {
            // One byte is taken; the next ones come while it is still at work on it.
            let every = LEAST_SPACING.as_nanos().div_ceil(spacing.as_nanos().max(1));
            let every = usize::try_from(every).unwrap_or(usize::MAX);
            let taken: Vec<u8> = bytes.iter().copied().step_by(every).collect();
            self.decoder.push(&taken);
        } else {
            self.decoder.push(bytes);
        }
        let last = u32::try_from(bytes.len().saturating_sub(1)).unwrap_or(u32::MAX);
        self.last_byte = Some(at + spacing.saturating_mul(last));
        self.listen(at);
        // A request that was cut short, or noise, must not swallow the one behind it.
        if self.decoder.holds_frame() {
            self.decoder.finish();
            self.listen(at);
        }
    }

    /// It is `now`.
    pub fn handle_timeout(&mut self, now: SimTime) {
        if let Condition::Booting(up) = self.condition
            && now >= up
        {
            self.condition = Condition::Up;
            let mut body = alloc::vec![POWER_ON];
            body.extend_from_slice(self.type_text().as_bytes());
            body.push(self.status_byte());
            self.send(now, &body, None);
        }
    }

    /// When [`handle_timeout`](Self::handle_timeout) or [`poll_transmit`](Self::poll_transmit) have something new by themselves.
    pub fn poll_timeout(&self) -> Option<SimTime> {
        match self.condition {
            Condition::Booting(up) => Some(up),
            Condition::Up => self.waiting.front().map(|waiting| waiting.due),
        }
    }

    /// The next bytes to send, if they are due and nothing else is being sent.
    pub fn poll_transmit(&mut self, now: SimTime) -> Option<Vec<u8>> {
        if self.after.is_some() {
            return None;
        }
        if self.waiting.front()?.due > now {
            return None;
        }
        let Waiting { bytes, after, is_values, .. } = self.waiting.pop_front()?;
        self.interrupt = false;
        (self.after, self.sends_values) = (after, is_values);
        Some(bytes)
    }

    /// True if what [`poll_transmit`](Self::poll_transmit) gave last is a telegram of values.
    pub fn sends_values(&self) -> bool {
        self.sends_values
    }

    /// True if what [`poll_transmit`](Self::poll_transmit) gave is to end behind the byte that is on the line, because a request has come.
    pub fn interrupts(&self) -> bool {
        self.interrupt
    }

    /// What [`poll_transmit`](Self::poll_transmit) gave has left the line.
    pub fn transmitted(&mut self, now: SimTime) {
        match self.after.take() {
            Some(After::Rate(rate)) => self.rate = rate,
            Some(After::Restart) => self.restart(now),
            None => {}
        }
    }

    /// The supply fails: from now on nothing is heard, said or measured.
    pub fn power_off(&mut self) {
        self.restart(SimTime(u64::MAX));
        self.after = None;
    }

    /// The supply is back: it boots with what was saved.
    pub fn power_on(&mut self, now: SimTime) {
        self.condition = Condition::Booting(now + self.boots_for());
    }

    /// More dirt on the front window than it was found with: 0 none, 1 a warning, 2 an error, 3 an error of both channels.
    pub fn soil(&mut self, level: u8) {
        self.dirt = level.min(3);
    }

    /// What it reports of its front window.
    fn contamination(&self) -> u8 {
        self.options.contamination.max(self.dirt)
    }

    /// It is found as somebody left it: at this rate, which is kept over a restart, and streaming.
    pub fn leave_as(&mut self, rate: Option<Rate>, streaming: bool) {
        if let Some(rate) = rate {
            (self.rate, self.kept_rate) = (rate, rate);
        }
        if streaming {
            self.stream = Some(Output::All);
        }
    }

    fn boots_for(&self) -> Duration {
        match self.options.profile {
            Profile::Bench => Duration::ZERO,
            Profile::Field => self.options.boot.unwrap_or(self.model.times.boot),
        }
    }

    fn restart(&mut self, now: SimTime) {
        self.condition = Condition::Booting(now + self.boots_for());
        self.rate = self.kept_rate;
        self.variant = self.kept_variant;
        self.mode = OperatingMode::Monitoring;
        self.new_password = None;
        self.interrupt = false;
        self.deaf_until = SimTime::ZERO;
        self.stream = None;
        self.asked = None;
        self.job = None;
        self.teaching = None;
        self.infringed = [0; 3];
        self.power_ons = self.power_ons.saturating_add(1);
        self.waiting.clear();
        self.decoder = FrameDecoder::new(Listener::Device);
        self.last_byte = None;
    }

    /// Answers what is in the decoder.
    fn listen(&mut self, now: SimTime) {
        // Taken out while its frames are answered.
        let mut decoder = core::mem::replace(&mut self.decoder, FrameDecoder::new(Listener::Device));
        while let Some(heard) = decoder.next_received() {
            match heard {
                Received::Frame(frame) => self.answer(now, Request::parse(frame.body)),
                Received::Broken => {
                    self.cut_off();
                    self.queue(now, alloc::vec![NAK], None);
                }
                // A device hears no device.
                Received::CutOff { .. } | Received::Ack | Received::Nak => {}
            }
        }
        self.decoder = decoder;
    }

    fn answer(&mut self, now: SimTime, request: Request<'_>) {
        // A restart that waits for its reply to leave ends the conversation.
        if self.waiting.iter().any(|waiting| waiting.after == Some(After::Restart)) {
            return;
        }
        self.cut_off();
        self.queue(now, alloc::vec![ACK], None);
        let answer = self.carry_out(request);
        if let Some(body) = answer.body {
            let due =
                now + if self.options.profile == Profile::Field { answer.takes } else { Duration::ZERO };
            self.deaf_until = self.deaf_until.max(due);
            self.send(due, &body, answer.after);
        }
    }

    /// A request ends what is being sent, so that it is acknowledged within 60 ms at any rate. Only what is to have an effect once it was
    /// sent is sent to its end.
    fn cut_off(&mut self) {
        self.waiting.retain(|waiting| !waiting.is_values);
        self.asked = None;
        self.job = None;
        self.interrupt = self.after.is_none();
    }

    fn send(&mut self, due: SimTime, body: &[u8], after: Option<After>) {
        let mut bytes = Vec::new();
        encode(FROM_DEVICE, body, &mut bytes);
        self.queue(due, bytes, after);
    }

    fn queue(&mut self, due: SimTime, bytes: Vec<u8>, after: Option<After>) {
        if self.waiting.len() < MAX_WAITING {
            self.waiting.push_back(Waiting { bytes, due, after, is_values: false });
        }
    }

    /// The same for a telegram of values.
    fn queue_values(&mut self, due: SimTime, bytes: Vec<u8>) {
        if self.waiting.len() < MAX_WAITING {
            self.waiting.push_back(Waiting { bytes, due, after: None, is_values: true });
        }
    }
}

/// The configuration block of a new device with this firmware.
fn out_of_the_box(model: &Model, firmware: Firmware) -> Configuration {
    match firmware.block_length() {
        super::configuration::OLD_LENGTH => {
            Configuration::old(MeasuringMode(0), model.configuration.unit().unwrap_or(Unit::Cm))
        }
        _ => model.configuration,
    }
}
