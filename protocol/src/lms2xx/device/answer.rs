//! What each request does, and its reply.

use alloc::vec::Vec;
use core::time::Duration;

use super::{After, Device};
use crate::lms2xx::telegram::{Mode, PASSWORD, REFUSED, Request, STATUS_OK};
use crate::lms2xx::values::Output;

/// A reply being made.
#[derive(Debug, Default)]
pub(super) struct Answer {
    /// Command, data, status; none where values are the answer.
    pub(super) body: Option<Vec<u8>>,
    /// How long a real device takes.
    pub(super) takes: Duration,
    pub(super) after: Option<After>,
}

/// Results in `A0`.
const DONE: u8 = 0;
const NOT_POSSIBLE: u8 = 1;
const WRONG_PASSWORD: u8 = 2;

impl Device {
    pub(super) fn carry_out(&mut self, request: Request<'_>) -> Answer {
        let mut answer = Answer::default();
        let mut body = alloc::vec![request.reply()];
        match request {
            Request::Reset => answer.after = Some(After::Restart),
            Request::Mode(mode) => body.push(self.change_mode(mode, &mut answer)),
            Request::Values(output) if self.can_put_out(output) && !self.installation => {
                self.asked = Some(output);
                return answer;
            }
            Request::Status => self.status(&mut body),
            Request::Errors => {}
            Request::Type => body.extend_from_slice(self.type_text().as_bytes()),
            Request::Variant(variant) => {
                let honoured = self.recorded.as_ref().is_none_or(|recorded| recorded.variant == variant);
                let done = self.model.takes_variants && honoured && self.set_variant(variant);
                body.push(u8::from(done));
                body.extend_from_slice(&self.variant.angle_deg.to_le_bytes());
                body.extend_from_slice(&self.variant.step_centideg.to_le_bytes());
            }
            Request::ReadConfiguration => body.extend_from_slice(&self.configuration.0),
            Request::WriteConfiguration(bytes) => {
                let written = self.configuration.overwritten(bytes).filter(|configuration| {
                    self.installation
                        && configuration.unit().is_some()
                        && configuration.measuring_mode().is_known()
                        && self.recorded.as_ref().is_none_or(|recorded| recorded.honours(configuration))
                });
                if let Some(configuration) = written {
                    self.configuration = configuration;
                    self.saves += 1;
                    answer.takes = self.model.times.save;
                }
                body.push(u8::from(written.is_some()));
                body.extend_from_slice(&self.configuration.0);
            }
            Request::Values(_) | Request::Unknown(_) => body = alloc::vec![REFUSED],
        }
        body.push(STATUS_OK);
        answer.body = Some(body);
        answer
    }

    fn change_mode(&mut self, mode: Mode, answer: &mut Answer) -> u8 {
        match mode {
            Mode::Installation(password) if password != PASSWORD => return WRONG_PASSWORD,
            Mode::Installation(_) => {
                self.installation = true;
                self.stream = None;
            }
            Mode::Diagnostic => self.stream = None,
            Mode::Stream(output) if self.can_put_out(output) => {
                self.installation = false;
                self.stream = Some(output);
            }
            Mode::OnRequest => {
                self.installation = false;
                self.stream = None;
            }
            Mode::Rate(rate) => answer.after = Some(After::Rate(rate)),
            Mode::Stream(_) | Mode::Other(_) => return NOT_POSSIBLE,
        }
        DONE
    }

    fn can_put_out(&self, output: Output) -> bool {
        let reflects = !matches!(output, Output::Reflectivity(_)) || self.model.reflectivity;
        let honoured = self.recorded.as_ref().is_none_or(|recorded| recorded.output == output);
        reflects && honoured && output.is_possible(self.variant.count())
    }

    /// The operating mode, as the status has it.
    pub(super) fn mode_number(&self) -> u8 {
        match self.stream {
            _ if self.installation => Mode::Installation(PASSWORD).number(),
            Some(output) => Mode::Stream(output).number(),
            None => Mode::OnRequest.number(),
        }
    }
}
