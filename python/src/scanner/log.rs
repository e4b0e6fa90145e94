//! What has happened to a scanner lately, in lines for people: what clients asked, what was answered, what faults did.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};

use rowscan_emulator::clock::SimClock;
use rowscan_recording::{Side, StreamKind, Tap, Taps};

/// Lines that are kept; the oldest go first.
const MOST_LINES: usize = 1000;
/// Bytes of a telegram that are shown.
const SHOWN: usize = 120;
/// Where a scan telegram has its name, at the latest.
const NAME_WITHIN: usize = 32;

/// The lines. Clones share them.
#[derive(Clone, Debug, Default)]
pub(super) struct Log(Arc<Mutex<VecDeque<Entry>>>);

#[derive(Debug)]
enum Entry {
    Line(String),
    /// Scans that went to one taker after each other.
    Scans {
        stream: Arc<str>,
        from_s: f64,
        count: u64,
    },
}

impl Log {
    /// Keeps a line.
    pub(super) fn line(&self, line: String) {
        self.keep(Entry::Line(line));
    }

    /// All lines, the oldest first.
    pub(super) fn lines(&self) -> Vec<String> {
        let kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let told = |entry: &Entry| match entry {
            Entry::Line(line) => line.clone(),
            Entry::Scans { stream, from_s, count } => format!("{from_s:.3} s {stream} > {count} × scan data"),
        };
        kept.iter().map(told).collect()
    }

    /// Taps that write what they see here.
    pub(super) fn taps(&self, clock: Arc<SimClock>) -> Taps {
        let log = self.clone();
        Taps::new(move |name, kind| {
            let (log, clock, stream): (_, _, Arc<str>) = (log.clone(), Arc::clone(&clock), Arc::from(name));
            Tap::new(move |by, bytes| log.said(&stream, kind, (by, bytes), clock.now().as_secs_f64()))
        })
    }

    fn said(&self, stream: &Arc<str>, kind: StreamKind, (by, bytes): (Side, &[u8]), at_s: f64) {
        let by_device = by == Side::Device;
        // An LMS2xx answers in a few bytes, and its scans are longer than that.
        let is_scan = by_device
            && match kind {
                StreamKind::Lms2xx => bytes.len() > SHOWN,
                _ => has(bytes, b"sSN LMDscandata") || has(bytes, b"sRA LMDscandata"),
            };
        if is_scan {
            return self.scan(stream, at_s);
        }
        let arrow = if by_device { '>' } else { '<' };
        let shown = bytes.get(..SHOWN).unwrap_or(bytes);
        let more = if bytes.len() > SHOWN { " …" } else { "" };
        let words: String = match kind {
            StreamKind::Lms2xx => shown.iter().map(|byte| format!("{byte:02X} ")).collect(),
            _ => {
                shown.iter().map(|byte| if (32..127).contains(byte) { *byte as char } else { '.' }).collect()
            }
        };
        self.line(format!("{at_s:.3} s {stream} {arrow} {}{more}", words.trim_end()));
    }

    fn scan(&self, of: &Arc<str>, at_s: f64) {
        {
            let mut kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
            if let Some(Entry::Scans { stream, count, .. }) = kept.back_mut()
                && *stream == *of
            {
                *count += 1;
                return;
            }
        }
        self.keep(Entry::Scans { stream: Arc::clone(of), from_s: at_s, count: 1 });
    }

    fn keep(&self, entry: Entry) {
        let mut kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if kept.len() >= MOST_LINES {
            kept.pop_front();
        }
        kept.push_back(entry);
    }
}

fn has(bytes: &[u8], name: &[u8]) -> bool {
    bytes.get(..NAME_WITHIN).unwrap_or(bytes).windows(name.len()).any(|found| found == name)
}
