//! What a child writes: kept in files with times, its tail in memory, searched line by line.

use std::fs::File;
use std::io::{self, Write};
use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use regex_lite::Regex;
use rowscan_protocol::time::SimTime;
use tokio::io::{AsyncRead, AsyncReadExt};

use crate::journal::Journal;

/// Bytes of output kept for the report.
const TAIL: usize = 64 * 1024;
/// The longest line; longer ones are cut.
const LONGEST: usize = 64 * 1024;

/// A child's output.
#[derive(Debug)]
pub(crate) struct Output {
    journal: Journal,
    patterns: Vec<(usize, Regex)>,
    kept: Mutex<Kept>,
}

#[derive(Debug)]
struct Kept {
    log: File,
    tail: String,
    /// When a pattern has matched, by its number.
    matches: Vec<(usize, Match)>,
}

/// A line that matched a pattern.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Match {
    pub(crate) at: SimTime,
    /// The number in the pattern's first parentheses, if it has one.
    pub(crate) value: Option<f64>,
}

impl Output {
    /// Keeps the lines of the child `id` in a file of `folder`.
    pub(crate) fn create(
        folder: &Path,
        id: &str,
        patterns: Vec<(usize, Regex)>,
        journal: Journal,
    ) -> io::Result<Self> {
        let log = File::create(folder.join(format!("{id}.log")))?;
        let kept = Mutex::new(Kept { log, tail: String::new(), matches: Vec::new() });
        Ok(Self { journal, patterns, kept })
    }

    /// Reads one of its pipes to the end.
    pub(crate) async fn follow(self: Arc<Self>, pipe: &'static str, mut reader: impl AsyncRead + Unpin) {
        let mut line = Vec::new();
        let mut chunk = vec![0; 4096];
        while let Ok(read @ 1..) = reader.read(&mut chunk).await {
            for byte in &chunk[..read] {
                match byte {
                    b'\n' => {
                        self.take(pipe, &line);
                        line.clear();
                    }
                    _ if line.len() < LONGEST => line.push(*byte),
                    _ => {}
                }
            }
        }
        if !line.is_empty() {
            self.take(pipe, &line);
        }
    }

    fn take(&self, pipe: &str, line: &[u8]) {
        let line = String::from_utf8_lossy(line);
        let (at, wall_s) = (self.journal.now(), self.journal.wall_s());
        let mut kept = self.lock();
        let text = format!("{:.6}\t{wall_s:.3}\t{pipe}\t{line}\n", at.as_secs_f64());
        // A full disk must not end the run; the tail is still there.
        let _ = kept.log.write_all(text.as_bytes());
        kept.tail += &format!("{line}\n");
        if kept.tail.len() > 2 * TAIL {
            kept.tail = tail(&kept.tail).to_owned();
        }
        for (number, pattern) in &self.patterns {
            if let Some(found) = pattern.captures(&line) {
                let value = found.get(1).and_then(|number| number.as_str().parse().ok());
                kept.matches.push((*number, Match { at, value }));
            }
        }
    }

    /// When pattern number `number` has matched.
    pub(crate) fn matches(&self, number: usize) -> Vec<Match> {
        let kept = self.lock();
        kept.matches.iter().filter(|(of, _)| *of == number).map(|(_, found)| *found).collect()
    }

    /// The last of it.
    pub(crate) fn tail(&self) -> String {
        tail(&self.lock().tail).to_owned()
    }

    fn lock(&self) -> MutexGuard<'_, Kept> {
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The last bytes of a text, from the beginning of a character on.
fn tail(text: &str) -> &str {
    let from = text.len().saturating_sub(TAIL);
    let from = (from..=text.len()).find(|at| text.is_char_boundary(*at)).unwrap_or(text.len());
    &text[from..]
}
