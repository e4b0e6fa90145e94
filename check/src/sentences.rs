//! What the GNSS receiver has said.

use std::sync::{Arc, Mutex, PoisonError};

use rowscan_protocol::nmea;
use rowscan_protocol::time::SimTime;
use rowscan_recording::{Side, Tap, Taps};

use crate::journal::Journal;

/// Sentences that are kept.
const KEPT: usize = 1_000_000;

/// The receiver's sentences with their times. Clones share them.
#[derive(Clone, Debug, Default)]
pub(crate) struct Sentences(Arc<Mutex<Vec<(SimTime, String)>>>);

impl Sentences {
    /// Taps that keep them.
    pub(crate) fn taps(&self, journal: &Journal) -> Taps {
        let (sentences, journal) = (self.clone(), journal.clone());
        Taps::new(move |_, _| {
            let (sentences, journal) = (sentences.clone(), journal.clone());
            Tap::new(move |from, bytes| {
                if from == Side::Device {
                    sentences.take(journal.now(), bytes);
                }
            })
        })
    }

    fn take(&self, at: SimTime, bytes: &[u8]) {
        let mut kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let text = String::from_utf8_lossy(bytes);
        let room = KEPT.saturating_sub(kept.len());
        // One with a wrong checksum is none: no receiver takes its values.
        let lines = text.lines().filter(|line| nmea::sentence(line).is_some());
        kept.extend(lines.take(room).map(|line| (at, line.to_owned())));
    }

    /// All of them.
    pub(crate) fn close(&self) -> Vec<(SimTime, String)> {
        std::mem::take(&mut *self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sentence_with_a_wrong_checksum_is_not_heard() {
        let sentences = Sentences::default();
        let body = "GPGGA,1,2,N,3,E,4,9";
        let sum = nmea::checksum(body);
        let line = |sum: u8| format!("${body}*{sum:02X}\r\n");
        sentences.take(SimTime(1), line(sum).as_bytes());
        sentences.take(SimTime(2), line(sum ^ 1).as_bytes());
        sentences.take(SimTime(3), line(sum).as_bytes());
        let heard: Vec<u64> = sentences.close().into_iter().map(|(at, _)| at.0).collect();
        assert_eq!(heard, [1, 3]);
    }
}
