//! What each request does, and its reply.
//!
//! What the device refuses is `92`, unless the command's own reply has a code for it: the listing names both.

use alloc::vec::Vec;
use core::time::Duration;

use super::{After, Device, OperatingMode};
use crate::lms2xx::Variant;
use crate::lms2xx::configuration::Configuration;
use crate::lms2xx::telegram::{Mode, REFUSED, Request};
use crate::lms2xx::values::Output;
use crate::lms2xx::words::put_words;

/// A reply being made.
#[derive(Debug, Default)]
pub(super) struct Answer {
    /// Command, data, status; none where values are the answer.
    pub(super) body: Option<Vec<u8>>,
    /// How long a real device takes. It ignores what is sent meanwhile.
    pub(super) takes: Duration,
    pub(super) after: Option<After>,
    /// A scan is to be made for the reply first.
    pub(super) later: bool,
}

/// Results in `A0`; a fault in the device would be 2.
const DONE: u8 = 0;
const WRONG_PASSWORD: u8 = 1;

/// Results in most other replies.
const REFUSED_AS_IT_IS: u8 = 0;
const TAKEN: u8 = 1;
/// In `C2`: the same password once more, please.
const TO_BE_CONFIRMED: u8 = 2;

/// Bytes of part 2 of the configuration.
pub(super) const PART_2_LENGTH: usize = 84;
/// Operating hours in units of two hours, and power-ons before this run: those of a device that has worked for a while.
const OPERATING_HOURS: u16 = 617;
const POWER_ONS: u16 = 56;
/// Resolutions that the positioning aid has, 1/100°.
const POSITIONING_STEPS: [u8; 3] = [25, 50, 100];

impl Device {
    pub(super) fn carry_out(&mut self, request: Request<'_>) -> Answer {
        let mut answer = Answer::default();
        if let Request::Values(output) = request
            && self.can_put_out(output)
        {
            self.asked = Some(output);
            self.partials = 0;
            return answer;
        }
        let mut body = alloc::vec![request.reply()];
        if self.reply_to(request, &mut body, &mut answer).is_none() {
            body = alloc::vec![REFUSED];
        }
        body.push(self.status_byte());
        answer.body = Some(body).filter(|_| !answer.later);
        answer
    }

    /// Appends the reply's data; `None` where the device refuses.
    fn reply_to(&mut self, request: Request<'_>, body: &mut Vec<u8>, answer: &mut Answer) -> Option<()> {
        match request {
            Request::Reset => answer.after = Some(After::Restart),
            Request::Mode(mode) => body.push(self.change_mode(mode, answer)?),
            Request::Status => self.status(body),
            Request::Errors => self.errors(body),
            Request::Counters if self.model.outdoor => {
                put_words(&[OPERATING_HOURS, POWER_ONS + self.power_ons], body);
            }
            Request::Type => body.extend_from_slice(self.type_text().as_bytes()),
            Request::Variant(variant) => self.choose_variant(variant, body),
            Request::FieldSet(set @ 0..=2) if !self.is_fast() => {
                if set > 0 {
                    self.field_set = set;
                }
                body.push(self.field_set);
            }
            Request::Password(step @ 0..=1, level @ 0..=1, password) if self.is_set_up() => {
                body.extend_from_slice(&[self.set_password(step, password), level]);
            }
            Request::SetField(data) if self.is_set_up() && !self.is_fast() => {
                self.configure_field(data, body)
            }
            Request::ReadField(set, field) if !self.is_fast() => self.read_field(set, field, body)?,
            Request::Teach(data) if self.is_set_up() && !self.is_fast() => self.teach(data, body, answer)?,
            Request::Outputs => self.ask_outputs(body, answer),
            Request::Positioning(step, span) => {
                let fits = POSITIONING_STEPS.contains(&step) && span.first < span.last && span.last <= 180;
                body.extend_from_slice(&[u8::from(fits), step]);
                put_words(&span.words(), body);
            }
            Request::Permanent(what @ 0..=2) if self.is_set_up() => {
                match what {
                    0 => self.kept_rate = crate::lms2xx::Rate::R9600,
                    1 => self.kept_rate = self.rate,
                    _ => self.kept_variant = self.variant,
                }
                body.extend_from_slice(&[TAKEN, what]);
            }
            Request::ReadConfiguration => body.extend_from_slice(self.configuration.bytes()),
            Request::WriteConfiguration(bytes) if self.is_set_up() => {
                self.write_configuration(bytes, body, answer);
            }
            Request::ReadPart2 => body.extend_from_slice(&self.part_2),
            Request::WritePart2(bytes) if self.is_set_up() => self.write_part_2(bytes, body),
            _ => return None,
        }
        Some(())
    }

    fn choose_variant(&mut self, variant: Variant, body: &mut Vec<u8>) {
        let honoured = self.recorded.as_ref().is_none_or(|recorded| recorded.variant == variant);
        let known = self.model.takes_variants && self.model.variants.contains(&variant);
        if known && honoured {
            self.variant = variant;
        }
        body.push(u8::from(known && honoured));
        put_words(&[self.variant.angle_deg, self.variant.step_centideg], body);
    }

    fn write_configuration(&mut self, bytes: &[u8], body: &mut Vec<u8>, answer: &mut Answer) {
        let written = Some(self.configuration.overwritten(bytes)).filter(|configuration| {
            configuration.is_listed()
                && evaluations_fit(configuration, &self.part_2)
                && self.recorded.as_ref().is_none_or(|recorded| recorded.honours(configuration))
        });
        if let Some(configuration) = written {
            let times = self.model.times;
            let new_unit = configuration.unit() != self.configuration.unit();
            answer.takes = self.options.save.unwrap_or(if new_unit { times.new_unit } else { times.save });
            self.configuration = configuration;
            self.saves += 1;
        }
        body.push(if written.is_some() { TAKEN } else { REFUSED_AS_IT_IS });
        body.extend_from_slice(self.configuration.bytes());
    }

    fn write_part_2(&mut self, bytes: &[u8], body: &mut Vec<u8>) {
        let mut written = self.part_2;
        written.iter_mut().zip(bytes).for_each(|(to, from)| *to = *from);
        let [plane, pitches @ ..] = *written.first_chunk::<4>().unwrap_or(&[0; 4]);
        let pitched = pitches.iter().all(|pitch| (-90..=90).contains(&(*pitch as i8)));
        // An LMS200 and LMS220 have no plane and no pitch.
        let fits = self.model.outdoor || (plane == 0 && pitches == [0; 3]);
        let taken = plane <= 1 && pitched && fits && evaluations_fit(&self.configuration, &written);
        if taken {
            self.part_2 = written;
        }
        body.push(u8::from(taken));
        body.extend_from_slice(&self.part_2);
    }

    /// A new password is sent twice.
    fn set_password(&mut self, step: u8, password: [u8; 8]) -> u8 {
        let legal = password.iter().all(|c| c.is_ascii_alphanumeric() || *c == b'_');
        match (step, self.new_password.take()) {
            (0, _) if legal => {
                self.new_password = Some(password);
                TO_BE_CONFIRMED
            }
            (1, Some(new)) if new == password => {
                self.password = password;
                TAKEN
            }
            _ => REFUSED_AS_IT_IS,
        }
    }

    /// The result for `A0`; `None` for a mode that the device does not have.
    fn change_mode(&mut self, mode: Mode, answer: &mut Answer) -> Option<u8> {
        match mode {
            Mode::Installation(password) | Mode::PasswordTest(password) if password != self.password => {
                return Some(WRONG_PASSWORD);
            }
            Mode::PasswordTest(_) => {}
            Mode::Installation(_) => self.enter(OperatingMode::Installation, None),
            Mode::Diagnostic => self.enter(OperatingMode::Diagnostic, None),
            Mode::Stream(output) if self.can_put_out(output) => {
                self.enter(OperatingMode::Monitoring, Some(output));
            }
            Mode::OnRequest => self.enter(OperatingMode::Monitoring, None),
            Mode::Rate(rate) => answer.after = Some(After::Rate(rate)),
            Mode::Stream(_) | Mode::Other(_) => return None,
        }
        Some(DONE)
    }

    fn enter(&mut self, mode: OperatingMode, stream: Option<Output>) {
        self.mode = mode;
        self.stream = stream;
        self.partials = 0;
    }

    /// True where the settings of the installation may be changed.
    fn is_set_up(&self) -> bool {
        self.mode == OperatingMode::Installation
    }

    /// True for an S14, whose variant is fixed.
    pub(super) fn is_fast(&self) -> bool {
        !self.model.takes_variants
    }

    fn can_put_out(&self, output: Output) -> bool {
        let has = match output {
            Output::Reflectivity(_) => self.model.reflectivity,
            Output::Parts(_) | Output::Fields(_) | Output::Cartesian(_) => !self.is_fast(),
            Output::Taught => self.active_fields()[0].taught_mm().is_some(),
            _ => true,
        };
        let honoured = self.recorded.as_ref().is_none_or(|recorded| recorded.output == output);
        has && honoured && output.is_possible(self.variant.count())
    }

    /// The operating mode, as the status has it.
    pub(super) fn mode_number(&self) -> u8 {
        match (self.mode, self.stream) {
            (OperatingMode::Installation, _) => Mode::Installation(self.password).number(),
            (OperatingMode::Diagnostic, _) => Mode::Diagnostic.number(),
            (OperatingMode::Monitoring, Some(output)) => Mode::Stream(output).number(),
            (OperatingMode::Monitoring, None) => Mode::OnRequest.number(),
        }
    }
}

/// Evaluations until a field of set 2 counts are those of the configuration and the signed offset in its part 2.
fn evaluations_fit(configuration: &Configuration, part_2: &[u8; PART_2_LENGTH]) -> bool {
    let offset = part_2.get(4).copied().unwrap_or_default() as i8;
    (1..=125).contains(&(i16::from(configuration.evaluations()) + i16::from(offset)))
}
