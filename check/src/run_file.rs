//! A run as a recording: all bytes, both ways, of its scanners, buses and GNSS lines, with simulated time.

use std::path::Path;
use std::sync::Arc;

use rowscan_emulator::clock::SimClock;
use rowscan_protocol::time::SimTime;
use rowscan_recording::foxglove::Language;
use rowscan_recording::{About, Decoded, Drive, RecordError, Recorder, RecorderOptions, Taps, WallClock};

/// The file in the run's folder.
pub(crate) const NAME: &str = "run.mcap";

/// A recording that is being written.
#[derive(Debug)]
pub(crate) struct RunFile(Recorder);

impl RunFile {
    /// Makes it in `folder`; what is recorded gets the time on `clock`, from 1970 on. The run waits for the disk.
    pub(crate) fn start(folder: &Path, clock: Arc<SimClock>, about: About) -> Result<Self, RecordError> {
        let decoded = Decoded { scans: true, points: false, beside: true, language: Language::Json };
        let about = About { drive: Some(Drive::Awaited), ..about };
        let options = RecorderOptions { decoded, waits: true, about };
        // Why it failed is told at the end.
        let recorder =
            Recorder::start(&folder.join(NAME), options, WallClock::new(move || clock.now().0), |_| {})?;
        Ok(Self(recorder))
    }

    /// What it hears by.
    pub(crate) fn taps(&self) -> Taps {
        self.0.taps()
    }

    /// Ends the file of a run whose drive began then, if it did.
    pub(crate) fn finish(self, began: Option<SimTime>) -> Result<(), RecordError> {
        if let Some(SimTime(at_ns)) = began {
            self.0.describer().drive_began(at_ns);
        }
        self.0.finish().map(|_| ())
    }
}
