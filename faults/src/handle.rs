//! What the control and every stream share, and one stream's part of it.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use tokio::sync::watch;

use crate::clock::Clock;
use crate::control::FaultControl;
use crate::fault::Door;
use crate::part::Part;
use crate::plan::Plan;
use crate::telegram::Language;

#[derive(Debug)]
pub(crate) struct Shared {
    plan: Mutex<Plan>,
    pub(crate) clock: Arc<dyn Clock>,
    pub(crate) seed: u64,
    /// The plan's `changes`, for whoever awaits them.
    pub(crate) changed: watch::Sender<u64>,
}

impl Shared {
    pub(crate) fn new(seed: u64, clock: Arc<dyn Clock>, plan: Plan) -> Arc<Self> {
        Arc::new(Self { plan: Mutex::new(plan), clock, seed, changed: watch::Sender::default() })
    }

    pub(crate) fn plan(&self) -> MutexGuard<'_, Plan> {
        self.plan.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Begins and ends what is due; when to look again.
    pub(crate) fn advance(&self) -> Option<Duration> {
        let now = self.clock.now();
        let mut plan = self.plan();
        plan.advance(now);
        let next = plan.next_due(now);
        drop(plan);
        self.spread();
        next
    }

    /// Tells whoever awaits changes.
    pub(crate) fn spread(&self) {
        let changes = self.plan().changes;
        self.changed.send_if_modified(|known| std::mem::replace(known, changes) != changes);
    }
}

/// One stream's part of the plan.
#[derive(Clone, Debug)]
pub struct StreamFaults {
    pub(crate) shared: Arc<Shared>,
    pub(crate) stream: usize,
}

impl StreamFaults {
    /// The control of all faults, this stream's among them.
    pub fn control(&self) -> FaultControl {
        FaultControl { shared: Arc::clone(&self.shared) }
    }

    /// Names the part that sends and receives on this stream; faults of that part then act on it by the stream's name.
    pub fn part(&self, part: Arc<dyn Part>) {
        if let Some(stream) = self.shared.plan().streams.get_mut(self.stream) {
            stream.part = Some(part);
        }
    }

    pub(crate) fn refuses(&self) -> bool {
        self.shared.plan().refuses(self.stream, self.shared.clock.now())
    }

    pub(crate) fn admit(&self) -> Option<Door> {
        let door = self.shared.plan().admit(self.stream, self.shared.clock.now());
        self.shared.spread();
        door
    }

    pub(crate) fn language(&self) -> Language {
        let plan = self.shared.plan();
        plan.streams.get(self.stream).map_or(Language::Cola, |stream| stream.language)
    }

    pub(crate) fn changes(&self) -> watch::Receiver<u64> {
        self.shared.changed.subscribe()
    }
}
