//! What the GNSS receiver has said.

use std::sync::{Arc, Mutex, PoisonError};

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
        kept.extend(text.lines().take(room).map(|line| (at, line.to_owned())));
    }

    /// All of them.
    pub(crate) fn close(&self) -> Vec<(SimTime, String)> {
        std::mem::take(&mut *self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}
