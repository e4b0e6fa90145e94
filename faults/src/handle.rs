//! What the control and every stream share, and one stream's part of it.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use rowscan_ports::in_flight::InFlight;
use tokio::sync::watch;

use crate::clock::Clock;
use crate::fault::Door;
use crate::in_lane::ScanCounts;
use crate::part::Part;
use crate::plan::{Ended, Plan};
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
    pub(crate) scans: ScanCounts,
}

impl StreamFaults {
    pub(crate) fn new(shared: Arc<Shared>, stream: usize) -> Self {
        Self { shared, stream, scans: ScanCounts::default() }
    }

    /// Scans on their way to clients that faults hold back. Whoever has handed them over has done so: no one else counts them.
    pub fn held(&self) -> &InFlight {
        self.scans.held()
    }

    /// Scans that faults have kept from clients for good: they were handed over, and count as sent there.
    pub fn lost(&self) -> u64 {
        self.scans.lost()
    }

    /// No more telegrams come: what waits for others to pass leaves, and the rest when it is due.
    pub fn end(&self) {
        self.shared.plan().end_stream(self.stream, Ended::Leaves);
    }

    /// Gives up what is held back: it is lost, and no part of [`Self::lost`]. How many scans are.
    pub fn give_up(&self) -> u64 {
        let mut plan = self.shared.plan();
        plan.end_stream(self.stream, Ended::Lost);
        self.scans.give_up();
        self.scans.held().pending()
    }

    /// When the first of what is held back may leave. It goes on as long as something leaves.
    pub fn first_due(&self) -> Option<Duration> {
        self.shared.plan().first_due(self.stream)
    }

    /// When something that is held back may leave, or a fault that holds it may end; time may have come to it already. None where nothing is held, or nobody
    /// knows.
    pub fn next_due(&self) -> Option<Duration> {
        let now = self.shared.clock.now();
        let plan = self.shared.plan();
        [plan.first_due(self.stream), plan.next_due(now)].into_iter().flatten().min()
    }

    /// When the first of what is held back, either way, may leave; none where nothing is, or not by time. Time that waits for whoever takes the bytes must
    /// not wait for these.
    pub fn needs_time(&self) -> Option<Duration> {
        self.shared.plan().needs_time(self.stream)
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
