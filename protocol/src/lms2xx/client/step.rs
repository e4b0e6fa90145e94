//! The start-up, step by step.

use crate::lms2xx::Rate;
use crate::lms2xx::Variant;
use crate::lms2xx::configuration::Configuration;
use crate::lms2xx::telegram::{Mode, PASSWORD, REFUSED, Request};
use crate::lms2xx::values::Output;

/// What the client is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Step {
    /// End whatever stream there is; answered at the device's rate only. Also what finds the rate.
    Quiet,
    /// Switch the rate.
    Raise(Rate),
    /// The line changes; nothing is asked meanwhile.
    Settle,
    /// Answer at the new rate.
    Confirm,
    Type,
    Status,
    Installation,
    Read,
    Write(Configuration),
    /// Leave the installation mode.
    Monitor,
    Variant(Variant),
    Stream(Output),
    /// Scans come.
    Streaming,
    /// End the stream, for good.
    Stop,
    /// Back to the rate that every host begins with.
    Lower,
    Listening,
    Done,
}

impl Step {
    /// What is asked.
    pub(super) fn request(&self) -> Option<Request<'_>> {
        Some(match self {
            Self::Quiet | Self::Confirm | Self::Monitor | Self::Stop => Request::Mode(Mode::OnRequest),
            Self::Raise(rate) => Request::Mode(Mode::Rate(*rate)),
            Self::Lower => Request::Mode(Mode::Rate(Rate::R9600)),
            Self::Type => Request::Type,
            Self::Status => Request::Status,
            Self::Installation => Request::Mode(Mode::Installation(PASSWORD)),
            Self::Read => Request::ReadConfiguration,
            Self::Write(configuration) => Request::WriteConfiguration(configuration.bytes()),
            Self::Variant(variant) => Request::Variant(*variant),
            Self::Stream(output) => Request::Mode(Mode::Stream(*output)),
            Self::Settle | Self::Streaming | Self::Listening | Self::Done => return None,
        })
    }

    /// In words.
    pub(super) fn what(&self) -> &'static str {
        match self {
            Self::Quiet | Self::Confirm | Self::Monitor | Self::Stop => "values on request (20 25)",
            Self::Raise(_) | Self::Lower => "another rate (20 4x)",
            Self::Type => "type (3A)",
            Self::Status => "status (31)",
            Self::Installation => "installation mode (20 00)",
            Self::Read => "read the configuration (74)",
            Self::Write(_) => "write the configuration (77)",
            Self::Variant(_) => "angle and resolution (3B)",
            Self::Stream(Output::Parts(_)) => "stream range and reflectivity (20 2B)",
            Self::Stream(Output::Reflectivity(_)) => "stream range and reflectivity (20 50)",
            Self::Stream(_) => "stream all values (20 24)",
            Self::Settle | Self::Streaming | Self::Listening | Self::Done => "",
        }
    }

    /// True while a change of the operating mode is asked for.
    pub(super) fn changes_mode(&self) -> bool {
        matches!(self.request(), Some(Request::Mode(_)))
    }

    /// How often it is asked.
    pub(super) fn tries(&self) -> u32 {
        match self {
            Self::Quiet => 2,
            _ => 3,
        }
    }

    /// True if scans can come without it.
    pub(super) fn is_optional(&self) -> bool {
        match self {
            Self::Raise(_) | Self::Installation | Self::Read | Self::Write(_) | Self::Variant(_) => true,
            Self::Stream(output) => *output != Output::All,
            _ => false,
        }
    }

    /// What `body` says to this step: none if it is no answer to it.
    pub(super) fn verdict(&self, body: &[u8]) -> Option<bool> {
        let request = self.request()?;
        let (command, data) = body.split_first()?;
        if *command == REFUSED {
            return Some(false);
        }
        if *command != request.reply() {
            return None;
        }
        Some(match request {
            Request::Mode(_) => data.first() == Some(&0),
            Request::Variant(_) => data.first() == Some(&1),
            // SICK's Quick Manual prints an F7 that says no and has taken the block.
            Request::WriteConfiguration(block) => match data {
                [done, now @ .., _status] => *done == 1 || now == block,
                _ => false,
            },
            _ => true,
        })
    }
}
