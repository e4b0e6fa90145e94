//! When the drive of a recorded run began: what its scanners saw before, they saw of a tractor that stood.

use rowscan_emulator::replay::Survey;
use rowscan_recording::Drive;

/// When the drive of a recorded run began, if it says so.
pub(super) fn drive_began_ns(survey: &Survey) -> Option<u64> {
    match survey.about.drive {
        Some(Drive::Began(at_ns)) => Some(at_ns),
        _ => None,
    }
}
