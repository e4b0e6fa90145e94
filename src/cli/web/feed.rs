//! What a page shows of scanners that are read and not emulated.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use rowscan_canopy::Pipeline;
use rowscan_ports::task;
use rowscan_protocol::rig::Mount;
use rowscan_protocol::scan::Scan;
use rowscan_web::{About, Gauges, ScannerGauge, Show};
use tokio::task::JoinSet;

use super::meter::metres;
use super::tape::TapeReader;
use super::{Opened, Talk, Tape, WebArgs};
use crate::cli::{Failure, Format};

/// Scans from one strip to the next.
const EVERY: u32 = 25;

type Counts = Arc<Vec<Mutex<ScannerGauge>>>;

/// A page for scanners that are read. Dropped, it is served no longer.
pub(in super::super) struct Feeds {
    show: Show,
    counts: Counts,
    tape: Option<Tape>,
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
    /// Opens the page. By a `tape` recordings take the time that they took, and whoever looks may stop it and go to a place.
    pub(in super::super) async fn open(
        web: &WebArgs,
        about: About,
        talk: Talk,
        tape: Option<Tape>,
        format: Format,
    ) -> Result<Self, Failure> {
        let counts: Counts = Arc::new(about.scanners.iter().map(|_| Mutex::default()).collect());
        let show = Show::new(about, None, Box::new(FeedGauges(Arc::clone(&counts))));
        let mut tasks = JoinSet::new();
        tasks.spawn(task(talk.tell(show.log())));
        let served = web.open(show.clone(), tape.as_ref().map(Tape::bench), format).await?;
        Ok(Self { show, counts, tape, _web: served, _tasks: tasks })
    }

    /// For the scanner at this place.
    pub(in super::super) fn of(&self, place: usize) -> Feed {
        let (show, counts, tape) = (self.show.clone(), Arc::clone(&self.counts), self.tape.clone());
        Feed { show, counts, place, scans: 0, began: None, tape, read: TapeReader::default() }
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
    tape: Option<Tape>,
    read: TapeReader,
}

impl Feed {
    /// The scanner sits so.
    pub(in super::super) fn sits(&self, mount: Mount) {
        self.show.sits(self.place, mount);
    }

    /// No more scans come.
    pub(in super::super) fn ended(&self, pipeline: &Pipeline) {
        self.show.measured(self.place, metres(&pipeline.estimate()));
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
                lost: progress.scans_lost,
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

    /// Waits until the tape has come to what was recorded then; false if it was sent back to before what was read. Cancel safe.
    pub(in super::super) async fn keep_pace(&mut self, received: Duration) -> bool {
        match &self.tape {
            Some(tape) => tape.reach(received, &mut self.read).await,
            None => true,
        }
    }

    /// True if whoever looks can send it back.
    pub(in super::super) fn can_be_sent_back(&self) -> bool {
        self.tape.is_some()
    }

    /// Waits until the tape is sent back; for ever without one.
    pub(in super::super) async fn sent_back(&mut self) {
        match &self.tape {
            Some(tape) => tape.sent_back(&mut self.read).await,
            None => std::future::pending().await,
        }
    }

    /// The recording is read from its beginning again.
    pub(in super::super) fn begin_anew(&mut self) {
        (self.scans, self.began) = (0, None);
        self.show.begin_anew(self.place);
    }
}

fn lock<T>(of: &Mutex<T>) -> MutexGuard<'_, T> {
    of.lock().unwrap_or_else(PoisonError::into_inner)
}
