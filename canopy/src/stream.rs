//! The streaming pipeline.

use rowscan_protocol::rig::Rig;
use rowscan_protocol::scan::Scan;

use crate::calibration::Calibration;
use crate::error::PipelineError;
use crate::estimate::{Estimate, Progress};
use crate::parameters::Parameters;

/// Scans in, an [`Estimate`] out, at any time.
#[derive(Clone, Debug)]
pub struct Pipeline {
    scans: u64,
}

impl Pipeline {
    /// A pipeline for the rig's scanner number `mount_index` (from 0).
    pub fn new(
        rig: Option<&Rig>,
        mount_index: usize,
        calibration: Option<Calibration>,
    ) -> Result<Self, PipelineError> {
        Self::with_parameters(rig, mount_index, calibration, Parameters::default())
    }

    /// A pipeline with other settings than the default ones.
    pub fn with_parameters(
        rig: Option<&Rig>,
        mount_index: usize,
        calibration: Option<Calibration>,
        parameters: Parameters,
    ) -> Result<Self, PipelineError> {
        parameters.validate()?;
        if let Some(calibration) = &calibration {
            calibration.validate()?;
        }
        if let Some(rig) = rig {
            rig.validate()?;
            rig.scanners
                .get(mount_index)
                .ok_or(PipelineError::NoSuchMount { index: mount_index, mounts: rig.scanners.len() })?;
        }
        Ok(Self { scans: 0 })
    }

    /// Takes the next scan.
    pub fn push(&mut self, _scan: &Scan) {
        self.scans += 1;
    }

    /// The estimate as if the stream ended here.
    pub fn estimate(&self) -> Estimate {
        self.clone().finish()
    }

    /// Ends the stream: closes the last line and slice.
    pub fn finish(&mut self) -> Estimate {
        Estimate { scans: self.scans, ..Estimate::default() }
    }

    /// How far the stream has come.
    pub fn progress(&self) -> Progress {
        Progress { scans: self.scans, ..Progress::default() }
    }
}
