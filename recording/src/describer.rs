//! Tells a recording that is being written what is found out about it meanwhile.

use std::sync::{Arc, Mutex, PoisonError};

use crate::drive::Drive;
use crate::queue::Queue;
use crate::writer::About;

/// Adds to what a recording says of itself. Cheap to clone; all clones are of one recording.
#[derive(Clone, Debug)]
pub struct Describer {
    queue: Arc<Queue>,
    about: Arc<Mutex<About>>,
}

impl Describer {
    pub(crate) fn new(queue: Arc<Queue>, about: About) -> Self {
        Self { queue, about: Arc::new(Mutex::new(about)) }
    }

    /// Takes back which of the rig's scanners this stream is of: it has turned out to be none of that model.
    pub fn not_of_mount(&self, stream: &str) {
        let mut about = self.about.lock().unwrap_or_else(PoisonError::into_inner);
        if about.mounts.remove(stream).is_some() {
            self.queue.describe(about.clone());
        }
    }

    /// Says when the drive began, a log time in nanoseconds.
    pub fn drive_began(&self, at_ns: u64) {
        let mut about = self.about.lock().unwrap_or_else(PoisonError::into_inner);
        about.drive = Some(Drive::Began(at_ns));
        self.queue.describe(about.clone());
    }

    /// Says of which model the scanner of this stream is, of so many that are recorded, or which ones it can be where that is not known; the first word on
    /// a stream stays.
    pub fn of_models(&self, stream: &str, models: &[&str], scanners: usize) {
        // Held until it is queued: what is told last holds all of it.
        let mut about = self.about.lock().unwrap_or_else(PoisonError::into_inner);
        if models.is_empty() || !about.candidates_of(stream).is_empty() {
            return;
        }
        match models {
            [model] => about.models.insert(stream.to_owned(), (*model).to_owned()),
            several => about.candidates.insert(stream.to_owned(), several.join(", ")),
        };
        if about.models.len() == scanners {
            about.model = Some(about.models.values().cloned().collect::<Vec<_>>().join(", "));
        }
        self.queue.describe(about.clone());
    }
}
