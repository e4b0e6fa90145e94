//! Scans from before a recorded run's drive: the tractor stood, and what it saw again and again is no row driven past.

use std::path::Path;

use rowscan_recording::{Drive, Format, Recording};

/// Leaves them out.
#[derive(Debug, Default)]
pub(crate) struct BeforeDrive {
    drive: Option<Drive>,
    left_out: u64,
    /// How long after the drive began the first scan came, ns.
    late_ns: Option<u64>,
}

/// A first scan so long after the drive's beginning comes of another place: ns.
const LATE_NS: u64 = 500_000_000;

impl BeforeDrive {
    /// Of this file of this format; only MCAP knows of a drive. A run says only at its end when its drive began, so such a file is read ahead; not what is no
    /// file, as a pipe, which is read only once.
    pub(crate) fn of(path: &Path, format: Format) -> Self {
        let may_tell = format == Format::Mcap && path.is_file();
        // What is wrong with a file is told by who reads it.
        let Some(mut recording) = may_tell.then(|| Recording::open(path).ok()).flatten() else {
            return Self::default();
        };
        while matches!(recording.next_packet(), Ok(Some(_))) && recording.about().drive.is_some() {}
        Self { drive: recording.about().drive, left_out: 0, late_ns: None }
    }

    /// Whether a scan that came then, a log time in nanoseconds, is left out.
    pub(crate) fn leaves_out(&mut self, at_ns: Option<u64>) -> bool {
        let (Some(Drive::Began(began)), Some(at)) = (self.drive, at_ns) else { return false };
        let is_before = at < began;
        if !is_before {
            self.late_ns.get_or_insert(at - began);
        }
        self.left_out += u64::from(is_before);
        is_before
    }

    /// What the user should know of it, at the file's end.
    pub(crate) fn told(&self) -> Option<String> {
        match self.drive? {
            Drive::Awaited => Some(
                "does not say when the drive began, for the run was broken off: what the scanner saw before, while the tractor stood, counts as driven"
                    .to_owned(),
            ),
            Drive::Began(_) if self.left_out > 0 => {
                Some(format!("{} scans from before the drive are left out: the tractor stood", self.left_out))
            }
            Drive::Began(_) => self.late_ns.filter(|late_ns| *late_ns > LATE_NS).map(|late_ns| {
                format!(
                    "the first scan came {:.2} s after the drive began: places count from there, and not from the row's start; say where that is (`start_m` of the rig)",
                    late_ns as f64 * 1e-9
                )
            }),
        }
    }
}
