//! A log in candump's format (`candump -L`): `(1436509052.249713) can0 18FE4980#0011223344556677`.

use std::fmt::Write as _;
use std::fs;
use std::io::{self, BufWriter, Write as _};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use rowscan_files::OutputFile;
use rowscan_protocol::can::CandumpLine;
use rowscan_protocol::time::SimTime;
use tokio::sync::mpsc;

use super::BusError;
use crate::CanFrame;
use crate::error_frame::ErrorFrame;
use crate::port_event::{Outgoing, OutgoingFrame};

/// The interface name that stands in the lines.
const INTERFACE: &str = "can0";

/// Appends one line, its end included.
pub fn write_line(text: &mut String, at: SimTime, frame: &CanFrame) {
    write_text(text, at, &frame.to_text());
}

fn write_text(text: &mut String, at: SimTime, frame: &str) {
    let (seconds, micros) = (at.0 / 1_000_000_000, at.0 / 1000 % 1_000_000);
    let _ = write!(text, "({seconds:010}.{micros:06}) {INTERFACE} {frame}");
    text.push('\n');
}

/// What a line tells of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Logged {
    /// A frame on the bus.
    Frame(CanFrame),
    /// What the controller told its host.
    Error(ErrorFrame),
}

/// Reads one line; `None` if it is none.
pub fn read_line(line: &str) -> Option<(SimTime, Logged)> {
    let CandumpLine { at_ns, frame: text, .. } = CandumpLine::parse(line)?;
    let frame = CanFrame::from_text(text).map(Logged::Frame);
    Some((SimTime(at_ns), frame.or_else(|| ErrorFrame::from_text(text).map(Logged::Error))?))
}

/// Reads the frame of one line; `None` if it is none.
pub fn read_frame(line: &str) -> Option<(SimTime, CanFrame)> {
    match read_line(line)? {
        (at, Logged::Frame(frame)) => Some((at, frame)),
        (_, Logged::Error(_)) => None,
    }
}

/// Whether a log that is written has lost its end.
#[derive(Clone, Debug, Default)]
pub struct LogCut(Arc<AtomicBool>);

impl LogCut {
    /// True once a line could not be written: that and all after it are missing.
    pub fn is_cut(&self) -> bool {
        self.0.load(Ordering::Acquire)
    }
}

/// A log being written.
#[derive(Debug)]
pub struct CandumpLink {
    file: BufWriter<OutputFile>,
    path: PathBuf,
    cut: LogCut,
}

impl CandumpLink {
    pub(super) fn open(path: &Path) -> Result<Self, BusError> {
        let refused = |cause| BusError::Log { path: path.to_owned(), cause };
        // What it holds already, a log or anything else, is not lost by a new one.
        let held = fs::metadata(path).ok().filter(|found| found.is_file() && found.len() > 0);
        if let Some(bytes) = held.map(|found| found.len()) {
            let why = format!("it holds {bytes} bytes already; name a new file");
            return Err(refused(io::Error::new(io::ErrorKind::AlreadyExists, why)));
        }
        let (file, _) = OutputFile::append_to_new(path).map_err(refused)?;
        Ok(Self { file: BufWriter::new(file), path: path.to_owned(), cut: LogCut::default() })
    }

    pub(crate) fn cut(&self) -> LogCut {
        self.cut.clone()
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    pub(super) async fn run(mut self, mut queue: mpsc::Receiver<OutgoingFrame>) {
        let (mut batch, mut text) = (Vec::new(), String::new());
        // Whatever has gathered meanwhile is written at once, so that the file is whole whenever it is looked at.
        while queue.recv_many(&mut batch, 256).await > 0 {
            text.clear();
            for outgoing in &batch {
                match &outgoing.what {
                    Outgoing::Frame(frame) => write_line(&mut text, outgoing.at, frame),
                    Outgoing::Error(error) => write_text(&mut text, outgoing.at, &error.to_text()),
                }
            }
            let written: io::Result<()> =
                self.file.write_all(text.as_bytes()).and_then(|()| self.file.flush());
            if let Err(cause) = written {
                self.cut.0.store(true, Ordering::Release);
                tracing::warn!(%cause, path = %self.path.display(), "the log ends here");
                return;
            }
            batch.clear();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::CanId;

    #[test]
    fn lines_come_back_as_they_went() {
        let extended = CanId::new(0x18FE_4980, true).unwrap();
        let frames = [
            CanFrame::new(extended, &[0, 0x11, 0xFF]).unwrap(),
            CanFrame::new(CanId::new(0x123, false).unwrap(), &[]).unwrap(),
            CanFrame::remote(extended, 8).unwrap(),
        ];
        let mut text = String::new();
        for frame in &frames {
            write_line(&mut text, SimTime(1_500_001_000), frame);
        }
        assert!(text.starts_with("(0000000001.500001) can0 18FE4980#0011FF\n"), "{text}");
        for (line, frame) in text.lines().zip(&frames) {
            assert_eq!(read_frame(line), Some((SimTime(1_500_001_000), *frame)));
            assert_eq!(
                read_frame(&format!("{line} R")),
                Some((SimTime(1_500_001_000), *frame)),
                "python-can's"
            );
        }
    }

    #[test]
    fn error_frames_come_back_too() {
        let mut text = String::new();
        write_text(&mut text, SimTime(2_000), &ErrorFrame::bus_off().to_text());
        assert_eq!(read_line(text.trim_end()), Some((SimTime(2_000), Logged::Error(ErrorFrame::bus_off()))));
        assert_eq!(read_frame(text.trim_end()), None);
    }

    #[test]
    fn other_lines_are_none() {
        for line in [
            "",
            "(1.0) can0",
            "(1.0) can0 123#1",
            "(1.0) can0 FFFFFFFFF#",
            "x",
            "(1.0) can0 123#001122334455667788",
        ] {
            assert_eq!(read_line(line), None, "{line}");
        }
    }
}
