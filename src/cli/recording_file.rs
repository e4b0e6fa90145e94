//! Recordings that a command reads.

use std::path::Path;

use rowscan_driver::DriverError;
use rowscan_recording::{Format, Recording, Soundness, StreamKind};

use super::output::say;
use super::{Failure, Outcome};

/// Opens a recording.
pub(super) fn open(file: &Path) -> Result<Recording, Failure> {
    open_stream(file, None)
}

/// Opens a recording of which a stream is wanted, which may be a single connection of a capture.
pub(super) fn open_stream(file: &Path, stream: Option<&str>) -> Result<Recording, Failure> {
    Recording::open_apart(file, stream.as_slice()).map_err(|cause| unreadable(file, cause))
}

/// Tells how many telegrams of a recording of this format, whose scanner speaks so, and that was read to its end cannot be read.
///
/// # Errors
/// None can: any file has bytes.
pub(super) fn tell_damage(
    file: &Path,
    (format, kind): (Format, StreamKind),
    soundness: Soundness,
) -> Result<(), Failure> {
    if soundness.sound == 0 {
        let (path, bytes) = (file.to_owned(), soundness.bytes);
        return Err(DriverError::NotARecording { path, format, kind, bytes }.into());
    }
    if let Some(damage) = soundness.damage() {
        say(format_args!("{}: {damage}", file.display()));
    }
    Ok(())
}

/// Tells where a capture's clock goes back, and what it lacks; the latter is a finding.
pub(super) fn tell_capture(file: &Path, recording: &Recording) -> Outcome {
    if let Some(step) = recording.clock_back() {
        say(format_args!("{}: {step}", file.display()));
    }
    let Some(missing) = recording.missing_bytes() else { return Outcome::Done };
    say(format_args!("{}: {missing}", file.display()));
    Outcome::Finding
}

/// The message of a recording that has no such stream.
pub(super) fn no_stream(file: &Path, wanted: String, found: Vec<String>) -> Failure {
    DriverError::NoStream { path: file.to_owned(), wanted, found }.into()
}

/// The message of a recording that cannot be read.
pub(super) fn unreadable(file: &Path, cause: rowscan_recording::ReadError) -> Failure {
    DriverError::Recording { path: file.to_owned(), cause }.into()
}
