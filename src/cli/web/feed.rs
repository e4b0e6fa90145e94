//! What a page shows of scanners that are read and not emulated.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use rowscan_canopy::Pipeline;
use rowscan_ports::clock::{self, Stopwatch};
use rowscan_ports::task;
use rowscan_protocol::rig::Mount;
use rowscan_protocol::scan::Scan;
use rowscan_web::{About, Gauges, ScannerGauge, Show};
use tokio::task::JoinSet;

use super::meter::metres;
use super::{Opened, Talk, WebArgs};
use crate::cli::{Failure, Format};

/// Scans from one strip to the next.
const EVERY: u32 = 25;

type Counts = Arc<Vec<Mutex<ScannerGauge>>>;

/// A page for scanners that are read. Dropped, it is served no longer.
pub(in super::super) struct Feeds {
    show: Show,
    counts: Counts,
    is_paced: bool,
    _web: Opened,
    _tasks: JoinSet<()>,
}

struct FeedGauges(Counts);

impl Gauges for FeedGauges {
    fn scanners(&self) -> Vec<ScannerGauge> {
        self.0.iter().map(|counts| *lock(counts)).collect()
    }
}

impl Feeds {
    /// Opens the page. `is_paced`: recordings take the time that they took.
    pub(in super::super) async fn open(
        web: &WebArgs,
        about: About,
        talk: Talk,
        is_paced: bool,
        format: Format,
    ) -> Result<Self, Failure> {
        let counts: Counts = Arc::new(about.scanners.iter().map(|_| Mutex::default()).collect());
        let show = Show::new(about, None, Box::new(FeedGauges(Arc::clone(&counts))));
        let mut tasks = JoinSet::new();
        tasks.spawn(task(talk.tell(show.log())));
        let served = web.open(show.clone(), None, format).await?;
        Ok(Self { show, counts, is_paced, _web: served, _tasks: tasks })
    }

    /// For the scanner at this place.
    pub(in super::super) fn of(&self, place: usize) -> Feed {
        let pace = self.is_paced.then(Stopwatch::start);
        Feed { show: self.show.clone(), counts: Arc::clone(&self.counts), place, scans: 0, began: None, pace }
    }
}

/// One scanner's part of the page.
pub(in super::super) struct Feed {
    show: Show,
    counts: Counts,
    place: usize,
    scans: u32,
    /// When the first scan was received.
    began: Option<Duration>,
    pace: Option<Stopwatch>,
}

impl Feed {
    /// The scanner sits so.
    pub(in super::super) fn sits(&self, mount: Mount) {
        self.show.sits(self.place, mount);
    }

    /// No more scans come.
    pub(in super::super) fn ended(&self) {
        self.show.ended(self.place);
    }

    /// A scan has come.
    pub(in super::super) fn scan(&mut self, received: Duration, scan: &Scan) {
        let passed = received.saturating_sub(*self.began.get_or_insert(received));
        self.show.scan(self.place, passed.as_secs_f64(), scan);
    }

    /// What came of it.
    pub(in super::super) fn measured(&mut self, pipeline: &Pipeline, telegrams_bad: u64) {
        let progress = pipeline.progress();
        if let Some(counts) = self.counts.get(self.place) {
            *lock(counts) = ScannerGauge {
                scans: Some(progress.scans),
                lost: Some(progress.scans_lost),
                repeated: Some(progress.scans_repeated),
                missed: Some(progress.turns_left_out),
                bad: Some(telegrams_bad),
                ..ScannerGauge::default()
            };
        }
        self.scans += 1;
        if self.scans.is_multiple_of(EVERY) {
            self.show.measured(self.place, metres(&pipeline.estimate()));
        }
    }

    /// Waits until as much time has passed as when the scan was recorded. Cancel safe.
    pub(in super::super) async fn keep_pace(&self, received: Duration) {
        let (Some(watch), Some(began)) = (&self.pace, self.began) else { return };
        let ahead = received.saturating_sub(began).saturating_sub(watch.elapsed());
        if !ahead.is_zero() {
            let _ = clock::within(ahead, std::future::pending::<()>()).await;
        }
    }
}

fn lock<T>(of: &Mutex<T>) -> MutexGuard<'_, T> {
    of.lock().unwrap_or_else(PoisonError::into_inner)
}
