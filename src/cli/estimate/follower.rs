//! One scanner, followed until it ends or enough has been seen.

use std::time::Duration;

use indicatif::ProgressBar;
use rowscan_canopy::{Enough, Estimate, Pipeline, Reached, UNREADABLE, Warning};
use rowscan_driver::{Arrival, DriverConfig, Scanner, Source};
use rowscan_ports::clock;
use rowscan_protocol::model::AnyModel;
use tokio::sync::watch;
use tokio::task::JoinSet;

use super::super::Failure;
use super::super::interrupt::Interrupt;
use super::super::link_events::LinkTeller;
use super::super::link_options::STOP_TIMEOUT;
use super::super::output::say;
use super::super::recorder::ModelTeller;
use super::super::sensor::Sensor;
use super::super::web::Feed;
use super::ONE_STREAM;
use super::on_earth::Way;

/// While nothing arrives, it is asked so often whether that is enough, and the bus tells so often that it has nothing: half a second after the last scan for
/// the first time, as the canopy is stale then.
const SILENT_AFTER: Duration = Duration::from_millis(500);
const SILENT_EVERY: Duration = Duration::from_millis(100);

/// A scanner to be followed.
pub(super) struct Follower {
    /// Which of the sources.
    pub(super) place: usize,
    pub(super) source: Source,
    /// What it is called, if there are several.
    pub(super) name: Option<String>,
    /// The model that it is taken for, if any.
    pub(super) taken_for: Option<AnyModel>,
    /// Tells the recording that is made what it is.
    pub(super) models: ModelTeller,
    /// What is to be told of its recording beside the rig.
    pub(super) notes: Vec<Warning>,
    pub(super) config: DriverConfig,
    pub(super) pipeline: Pipeline,
    pub(super) sensor: Sensor,
    pub(super) enough: Enough,
    pub(super) bar: ProgressBar,
    /// Its part of the page, if there is one.
    pub(super) feed: Option<Feed>,
    /// Where it was, if a map asks for it.
    pub(super) way: Option<Way>,
}

/// Why no more is taken.
enum Taken {
    /// That is all, or enough.
    All,
    /// The recording is to be seen from an earlier place on.
    SentBack,
}

/// What came of it.
pub(super) struct Followed {
    pub(super) place: usize,
    /// None if it never was there, or failed before the first scan.
    pub(super) estimate: Option<Estimate>,
    pub(super) sensor: Sensor,
    /// Where it was, if a map asks for it.
    pub(super) way: Option<Way>,
    pub(super) ended: Result<(), Failure>,
}

impl Follower {
    /// Follows it until `stopped` turns true, at most. A recording on a page that can be sent back is followed again from there on.
    pub(super) async fn follow(mut self, mut stopped: watch::Receiver<bool>) -> Followed {
        let empty = self.pipeline.clone();
        loop {
            let opened = tokio::select! {
                opened = Scanner::open(&self.source, self.config.clone()) => opened,
                _ = stopped.wait_for(|stopped| *stopped) => return self.ended(None, Ok(())),
            };
            let mut scanner = match opened {
                Ok(scanner) => scanner,
                Err(cause) => return self.ended(None, Err(cause.into())),
            };
            let stream = self.name.as_deref().unwrap_or(ONE_STREAM);
            self.models.tell(stream, &scanner.models(), self.taken_for);
            self.pipeline.set_up(&scanner.settings());
            let telling = LinkTeller::start(&scanner, self.name.clone(), self.taken_for);
            let taken = tokio::select! {
                taken = self.take(&mut scanner) => taken,
                _ = stopped.wait_for(|stopped| *stopped) => Ok(Taken::All),
            };
            let again = match &taken {
                Ok(Taken::All) => tokio::select! {
                    again = self.shown() => again,
                    _ = stopped.wait_for(|stopped| *stopped) => false,
                },
                Ok(Taken::SentBack) => true,
                Err(_) => false,
            };
            let (broken_off, models) = (scanner.broken_off(), scanner.models());
            let (settings, left_out) = (scanner.settings(), scanner.streams_left_out());
            let counts = scanner.stop(STOP_TIMEOUT).await;
            drop(telling);
            if let Some(feed) = self.feed.as_mut().filter(|_| again) {
                feed.begin_anew();
                self.pipeline = empty.clone();
                continue;
            }
            let mut estimate = self.pipeline.finish();
            estimate.heard_over(counts.telegrams_bad, counts.segments);
            estimate.set_up(settings);
            if let Some(place) = broken_off {
                estimate.broken_off(place);
            }
            if let Some(others) = left_out {
                estimate.streams_left_out(others.read, others.left_out);
            }
            estimate.warnings.append(&mut self.notes);
            if let Some(taken_for) = self.taken_for {
                estimate.named(&models, taken_for);
            }
            // What was seen before a failure is not lost by it.
            let seen = taken.is_ok() || estimate.scans > 0 || estimate.telegrams_bad > 0;
            return self.ended(seen.then_some(estimate), taken.map(drop));
        }
    }

    /// All has been shown: waits to be sent back, where that can be; false elsewhere.
    async fn shown(&mut self) -> bool {
        let Some(feed) = &mut self.feed else { return false };
        feed.ended(&self.pipeline);
        if !feed.can_be_sent_back() {
            return false;
        }
        let name = self.name.as_ref().map_or_else(String::new, |name| format!("{name}: "));
        say(format_args!("{name}all has been shown; Ctrl-C closes the page"));
        feed.sent_back().await;
        true
    }

    fn ended(self, estimate: Option<Estimate>, ended: Result<(), Failure>) -> Followed {
        Followed { place: self.place, estimate, sensor: self.sensor, way: self.way, ended }
    }

    /// Feeds the pipeline until the source ends, enough has been seen, or nothing it sends makes a scan.
    async fn take(&mut self, scanner: &mut Scanner) -> Result<Taken, Failure> {
        let (mut before, mut patience) = (0, SILENT_AFTER);
        loop {
            // Frames that fail their checksum do not arrive: what they mean is looked at from time to time.
            let arrived = clock::within(patience, scanner.arrival()).await;
            patience = if arrived.is_some() { SILENT_AFTER } else { SILENT_EVERY };
            match arrived {
                None => self.sensor.silent(&self.pipeline, scanner.now().0).await,
                Some(arrived) => match arrived? {
                    None => return Ok(Taken::All),
                    Some(Arrival::Unreadable { fault, received }) => {
                        self.sensor.unreadable(&mut self.pipeline, &fault, received.0).await;
                    }
                    // The rig says how the scanner moves: nothing is made of its own word yet.
                    Some(Arrival::Reading { .. }) => {}
                    Some(Arrival::Scan(record)) => {
                        let received = record.received;
                        if let Some(feed) = &mut self.feed {
                            feed.scan(received.0, record.scan);
                            if !feed.keep_pace(received.0).await {
                                return Ok(Taken::SentBack);
                            }
                        }
                        self.sensor.push(&mut self.pipeline, record).await;
                        if let Some(way) = &mut self.way {
                            way.push(received.0, self.pipeline.progress().y_m);
                        }
                        self.sensor.written().await;
                        self.sensor.measured(scanner.now().0.saturating_sub(received.0));
                    }
                },
            }
            if let Some(feed) = &mut self.feed {
                feed.measured(&self.pipeline, scanner.counts().telegrams_bad);
            }
            // A recording never waits by itself.
            tokio::task::coop::consume_budget().await;
            let scans = self.pipeline.progress().scans;
            self.bar.inc(scans - before);
            before = scans;
            match self.enough.reached(&self.pipeline, scanner.counts().telegrams_bad, scanner.now().0) {
                None => {}
                Some(Reached::Enough) => return Ok(Taken::All),
                Some(Reached::NothingValid) => {
                    say(format_args!(
                        "telegrams came for {UNREADABLE:?}, and none held a valid scan: that is all there is to tell"
                    ));
                    return Ok(Taken::All);
                }
            }
        }
    }
}

/// Waits for all scanners, in the order of their sources, and by which signal the user ended them, if so. One that fails ends the others, which would go on half blind; so does the user.
pub(super) async fn follow_all(
    mut following: JoinSet<Followed>,
    stop: watch::Sender<bool>,
    interrupt: &mut Interrupt,
) -> Result<(Vec<Followed>, Option<u8>), Failure> {
    let (mut all, mut interrupted): (Vec<Followed>, Option<u8>) = (Vec::new(), None);
    loop {
        tokio::select! {
            followed = following.join_next() => match followed {
                Some(Ok(followed)) => {
                    if followed.ended.is_err() {
                        stop.send_replace(true);
                    }
                    all.push(followed);
                }
                Some(Err(cause)) => {
                    let cause = std::io::Error::other(cause);
                    return Err(Failure::System { what: "follow a scanner", cause });
                }
                None => break,
            },
            signal = interrupt.signal(), if interrupted.is_none() => {
                interrupted = Some(signal);
                stop.send_replace(true);
            }
        }
    }
    all.sort_by_key(|followed| followed.place);
    Ok((all, interrupted))
}
