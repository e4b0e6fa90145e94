//! `LMPscancfg` and `mLMPsetscancfg`: scan frequency and angular step.

use alloc::vec::Vec;

use super::lmp_output_range::Sector;
use super::wire::fields;
use super::{Method, Variable};

fields! {
    /// Scan configuration in force.
    pub struct ScanConfig {
        /// Mirror turns, 1/100 Hz.
        pub frequency_centihz: u32 ["1/100 Hz"],
        /// One sector on the scanners known here.
        pub sectors: Vec<Sector>,
    }

    /// Asks for a scan configuration. LMS1xx and LMS5xx ignore the angles, but they must be there.
    pub struct SetScanConfig {
        /// What is asked for.
        pub config: ScanConfig,
    }

    /// What became of it.
    pub struct SetScanConfigReply {
        /// One of the codes below.
        pub code: u8,
        /// The values in force.
        pub config: ScanConfig,
    }
}

impl Variable for ScanConfig {
    const NAME: &'static str = "LMPscancfg";
}

impl Method for SetScanConfig {
    const NAME: &'static str = "mLMPsetscancfg";
    type Reply = SetScanConfigReply;
}

/// Done.
pub const OK: u8 = 0;
/// No such frequency.
pub const INVALID_FREQUENCY: u8 = 1;
/// No such resolution, or not at this frequency.
pub const INVALID_RESOLUTION: u8 = 2;
/// Neither.
pub const INVALID_FREQUENCY_AND_RESOLUTION: u8 = 3;
/// Impossible scan area.
pub const INVALID_AREA: u8 = 4;
/// Any other reason.
pub const OTHER_ERROR: u8 = 5;
