//! Whether the scans that are used are of one resolution.

use rowscan_protocol::scan::Scan;

/// The angle between beams, scan by scan.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Resolutions {
    /// Of the first scan that is used, degrees.
    first_deg: Option<f64>,
    /// The first other one.
    other_deg: Option<f64>,
    /// Scans of another one than the first.
    others: u64,
}

/// Scans of several resolutions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct OtherResolution {
    pub(crate) first_deg: f64,
    pub(crate) other_deg: f64,
    pub(crate) scans: u64,
}

impl Resolutions {
    /// Adds a scan that is used.
    pub(crate) fn add(&mut self, scan: &Scan) {
        let step_deg = scan.beams.step_deg();
        if *self.first_deg.get_or_insert(step_deg) != step_deg {
            self.other_deg.get_or_insert(step_deg);
            self.others += 1;
        }
    }

    /// What is told of others than the first.
    pub(crate) fn others(&self) -> Option<OtherResolution> {
        let (first_deg, other_deg) = self.first_deg.zip(self.other_deg)?;
        Some(OtherResolution { first_deg, other_deg, scans: self.others })
    }
}
