//! The scanner's side, without I/O: one [`Device`], many [`Session`]s.

use alloc::string::String;
use alloc::vec::Vec;
use core::time::Duration;

use crate::angle::BeamGrid;
use crate::frame::{Dialect, FrameCounts};
use crate::model::Model;
use crate::telegram::LmdScandata;
use crate::time::SimTime;

/// Who this scanner is.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Identity {
    /// Serial number.
    pub serial_number: u32,
    /// Location name.
    pub location_name: String,
}

/// How this scanner behaves where real ones differ.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Options {
    /// Logging in stops the measurement until `Run` or `LMCstartmeas`.
    pub strict_login: bool,
    /// How long before simulated time zero the scanner was powered up.
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
#[error("{model} has no scan mode {frequency_centihz}/100 Hz with {step}/10000 degree steps")]
pub struct ModeError {
    /// The model.
    pub model: &'static str,
    /// What was asked for, 1/100 Hz.
    pub frequency_centihz: u32,
    /// What was asked for, 1/10000°.
    pub step: u16,
}

/// One mirror turn's raw measurement on the full grid.
#[derive(Clone, Copy, Debug)]
pub struct MeasuredLine<'a> {
    /// First echo first.
    pub echoes: &'a [MeasuredEcho],
}

/// One echo of every beam.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct MeasuredEcho {
    /// Millimetres, 0 where there was none.
    pub range_mm: Vec<u16>,
    /// Remission, 16-bit scale.
    pub remission: Vec<u16>,
}

/// One scanner.
#[derive(Clone, Debug)]
pub struct Device {
    model: &'static Model,
}

impl Device {
    /// A warm scanner, ready and measuring, nobody logged in.
    pub fn new(model: &'static Model, identity: Identity) -> Self {
        let _ = identity;
        Self { model }
    }

    /// The same with other options.
    pub fn with_options(self, options: Options) -> Self {
        let _ = options;
        self
    }

    /// The model.
    pub fn model(&self) -> &'static Model {
        self.model
    }

    /// True while scans are made.
    pub fn is_measuring(&self) -> bool {
        true
    }

    /// What the mirror does.
    pub fn mirror(&self) -> Mirror {
        let mode = self.model.default_mode;
        Mirror { frequency_centihz: mode.frequency_centihz, beams: self.model.beams(mode) }
    }

    /// Sets the scan mode from the host program.
    pub fn set_scan_mode(&mut self, frequency_centihz: u32, step: u16) -> Result<(), ModeError> {
        Err(ModeError { model: self.model.title, frequency_centihz, step })
    }

    /// One mirror turn.
    pub fn measure(&mut self, at: SimTime, line: &MeasuredLine<'_>) -> Option<&LmdScandata> {
        let _ = (at, line);
        None
    }

    /// The last scan made.
    pub fn last_scan(&self) -> Option<&LmdScandata> {
        None
    }
}

/// How a connection decides on its dialect.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DialectPolicy {
    /// The first valid frame decides.
    Auto,
    /// One dialect; silent in the other.
    Strict(Dialect),
}

/// One answer: one frame, to be sent in one write.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Reply {
    /// The frame.
    pub bytes: Vec<u8>,
    /// What happens to the connection afterwards.
    pub after: Option<AfterReply>,
}

/// What happens to a connection after a reply.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AfterReply {
    /// The device drops it.
    Close,
}

/// One connection.
#[derive(Clone, Debug)]
pub struct Session {
    policy: DialectPolicy,
}

impl Session {
    /// A fresh connection.
    pub fn new(policy: DialectPolicy) -> Self {
        Self { policy }
    }

    /// Takes the host's bytes, appends the replies.
    pub fn handle_bytes(&mut self, device: &mut Device, now: SimTime, bytes: &[u8], out: &mut Vec<Reply>) {
        let _ = (device, now, bytes, out);
    }

    /// Subscribed to LMDscandata.
    pub fn subscribed(&self) -> bool {
        false
    }

    /// The dialect to encode events in.
    pub fn dialect(&self) -> Dialect {
        match self.policy {
            DialectPolicy::Auto => Dialect::B,
            DialectPolicy::Strict(dialect) => dialect,
        }
    }

    /// What was received.
    pub fn counts(&self) -> FrameCounts {
        FrameCounts::default()
    }
}

/// Appends the whole frame of a scan event.
pub fn scan_event(dialect: Dialect, scan: &LmdScandata, out: &mut Vec<u8>) {
    let _ = (dialect, scan, out);
}
