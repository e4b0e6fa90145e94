//! A device that plays a recording: it answers as usual, and its values come from the recording.

use alloc::string::String;
use alloc::vec::Vec;

use super::Device;
use crate::lms2xx::Variant;
use crate::lms2xx::configuration::Configuration;
use crate::lms2xx::values::Output;
use crate::time::SimTime;

/// What the recorded values were measured with. A setting that would change them is refused.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Recorded {
    /// Its type text, where that was recorded.
    pub type_text: Option<String>,
    /// Angle and resolution.
    pub variant: Variant,
    /// The form in which the values were sent.
    pub output: Output,
    /// The configuration block it had before the host wrote any.
    pub found: Configuration,
    /// The one it had while it measured.
    pub measured: Configuration,
}

impl Recorded {
    /// True if values measured with `configuration` mean the same as the recorded ones.
    pub(super) fn honours(&self, configuration: &Configuration) -> bool {
        let means = |of: &Configuration| (of.unit(), of.measuring_mode(), of.real_time_index());
        means(configuration) == means(&self.measured)
    }
}

impl Device {
    /// Becomes the recorded device, as it was found.
    pub fn play_back(&mut self, recorded: Recorded) {
        self.variant = recorded.variant;
        self.configuration = recorded.found;
        self.recorded = Some(recorded);
    }

    /// True while a telegram of values is wanted.
    pub fn wants_values(&self) -> bool {
        let is_up = self.condition == super::Condition::Up;
        is_up && (self.asked.is_some() || self.stream.is_some())
    }

    /// True if nothing waits for the line.
    pub fn is_silent(&self) -> bool {
        self.waiting.is_empty()
    }

    /// Puts a recorded telegram of values on the line.
    pub fn play(&mut self, now: SimTime, frame: Vec<u8>) {
        self.asked = None;
        self.queue_values(now, frame);
    }
}
