//! The timeline: everything of one rig that acts at instants of simulated time, on one queue with one pacer.
//!
//! Calling order of a [`Source`]: [`Source::next`] says when it acts next; [`Source::prepare`] may be called any number of times with that
//! instant while the pacer still waits; [`Source::fire`] acts. [`Source::poll_input`] takes what its peers send and, once it is ready,
//! [`Source::respond`] answers. Sources due at the same instant fire in the order of the rig: faults, line changes, scanners, CAN, GNSS.

use std::io;
use std::pin::pin;
use std::sync::Arc;
use std::task::{Context, Poll};
use std::time::Duration;

use rowscan_ports::in_flight::InFlight;
use rowscan_ports::{Delivery, Untaken};
use rowscan_protocol::time::SimTime;
use rowscan_vehicle::Tractor;
use tokio::sync::Notify;

use crate::bus_output::BusOutput;
use crate::clock::{Pacer, SimClock, Timer, yield_once};
use crate::end::EndWhen;
use crate::fault_source::FaultSource;
use crate::firing::{Claim, Firing};
use crate::gnss_output::GnssOutput;
use crate::hold::Hold;
use crate::line_changes::LineChanges;
use crate::lms2xx::Lms2xxScanner;
use crate::lockstep::{Lockstep, LockstepError};
use crate::mirror::MirrorSource;
use crate::scan_moment::{LastScan, Moments};
use crate::start::StartWhen;
use crate::steps::Steps;
use crate::stride::Stride;

/// One thing that acts in simulated time.
#[derive(Debug)]
pub(crate) enum Source {
    /// A CoLa scanner's mirror.
    Mirror(Box<MirrorSource>),
    /// An LMS2xx with its serial line.
    Lms2xx(Box<Lms2xxScanner>),
    /// What goes wrong.
    Faults(FaultSource),
    /// A scanner's digital lines.
    LineChanges(LineChanges),
    /// The tractor's control function on its bus.
    Bus(Box<BusOutput>),
    /// The tractor's GNSS receiver.
    Gnss(Box<GnssOutput>),
}

impl Source {
    fn next(&mut self) -> Option<SimTime> {
        match self {
            Self::Mirror(mirror) => Some(mirror.next()),
            Self::Lms2xx(scanner) => scanner.next(),
            Self::Faults(faults) => faults.next(),
            Self::LineChanges(changes) => changes.next(),
            Self::Bus(bus) => bus.next(),
            Self::Gnss(gnss) => gnss.next(),
        }
    }

    fn prepare(&mut self, at: SimTime) {
        if let Self::Mirror(mirror) = self {
            mirror.prepare(at);
        }
    }

    /// True if a scan, a sentence or a frame went to a taker.
    async fn fire(&mut self, firing: Firing) -> io::Result<bool> {
        match self {
            Self::Mirror(mirror) => Ok(mirror.fire(firing).await),
            Self::Lms2xx(scanner) => scanner.fire(firing).await,
            Self::Faults(faults) => Ok(faults.fire(firing.at)),
            Self::LineChanges(changes) => Ok(changes.fire(firing.at)),
            Self::Bus(bus) => Ok(bus.fire(firing).await),
            Self::Gnss(gnss) => Ok(gnss.fire(firing).await),
        }
    }

    fn poll_input(&mut self, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        match self {
            Self::Lms2xx(scanner) => scanner.poll_input(cx),
            Self::Bus(bus) => bus.poll_input(cx).map(Ok),
            Self::Mirror(_) | Self::Faults(_) | Self::LineChanges(_) | Self::Gnss(_) => Poll::Pending,
        }
    }

    async fn respond(&mut self, now: SimTime, delivery: Delivery) {
        if let Self::Bus(bus) = self {
            bus.respond(now, delivery).await;
        }
    }

    fn claim(&self) -> Claim {
        match self {
            Self::Mirror(mirror) => mirror.claim(),
            Self::Lms2xx(scanner) => scanner.claim(),
            Self::Faults(_) | Self::LineChanges(_) => Claim::Idle,
            Self::Bus(bus) => {
                if bus.has_taker() {
                    Claim::Taker
                } else {
                    Claim::Idle
                }
            }
            Self::Gnss(gnss) => {
                if gnss.has_taker() {
                    Claim::Taker
                } else {
                    Claim::Idle
                }
            }
        }
    }

    /// Whether the drive may wait for somebody to take what it sends.
    fn has_taker(&self) -> bool {
        match self {
            Self::Mirror(mirror) => mirror.has_taker(),
            Self::Lms2xx(scanner) => scanner.has_taker(),
            Self::Faults(_) | Self::LineChanges(_) => false,
            Self::Bus(bus) => bus.has_taker(),
            Self::Gnss(gnss) => gnss.has_taker(),
        }
    }

    /// What it has handed over and is not written yet.
    fn in_flight(&self, all: &mut Vec<InFlight>) {
        match self {
            Self::Mirror(mirror) => all.push(mirror.in_flight().clone()),
            Self::Bus(bus) => all.push(bus.in_flight().clone()),
            Self::Gnss(gnss) => all.extend(gnss.in_flight().cloned()),
            // A line is written where it acts.
            Self::Lms2xx(_) | Self::Faults(_) | Self::LineChanges(_) => {}
        }
    }

    /// Its place among those due at the same instant.
    pub(crate) fn rank(&self) -> u8 {
        match self {
            Self::Faults(_) => 0,
            Self::LineChanges(_) => 1,
            Self::Mirror(_) | Self::Lms2xx(_) => 2,
            Self::Bus(_) => 3,
            Self::Gnss(_) => 4,
        }
    }

    /// The last scan it made, if it is a scanner.
    fn last_scan(&self) -> Option<LastScan> {
        match self {
            Self::Mirror(mirror) => mirror.last_scan(),
            Self::Lms2xx(scanner) => scanner.last_scan(),
            Self::Faults(_) | Self::LineChanges(_) | Self::Bus(_) | Self::Gnss(_) => None,
        }
    }

    fn is_scanner(&self) -> bool {
        matches!(self, Self::Mirror(_) | Self::Lms2xx(_))
    }

    /// The drive has started.
    fn begin(&mut self, at: SimTime) {
        match self {
            Self::Bus(bus) => bus.begin(at),
            Self::Gnss(gnss) => gnss.begin(at),
            Self::Mirror(_) | Self::Lms2xx(_) | Self::Faults(_) | Self::LineChanges(_) => {}
        }
    }

    /// Time waits for others: whoever waits for this source's next act is answered without it.
    fn release(&self) {
        if let Self::Mirror(mirror) = self {
            mirror.release_polls();
        }
    }
}

/// How long the end of a paced timeline waits for clients that have not taken everything, host time.
const FLUSH_TIMEOUT: Duration = Duration::from_secs(2);

/// What a clock in lockstep waits for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Wait {
    /// What one source has sent is taken in.
    Source,
    /// The step is acknowledged.
    Step,
}

/// All sources of one rig.
#[derive(Debug)]
pub(crate) struct Timeline {
    pub(crate) clock: Arc<SimClock>,
    pub(crate) timer: Timer,
    pub(crate) sources: Vec<Source>,
    pub(crate) start: StartWhen,
    pub(crate) tractor: Tractor,
    /// Notified when a peer's interest changes, so that waiting time looks again.
    pub(crate) changed: Arc<Notify>,
    /// Sources know that the drive has started.
    pub(crate) begun: bool,
    /// Waits for acknowledgements, if the clock runs in lockstep.
    pub(crate) lockstep: Option<Lockstep>,
    /// Holds the start of the drive, if anything does.
    pub(crate) hold: Option<Hold>,
    /// Where time stops, if anywhere.
    pub(crate) end: Option<EndWhen>,
    /// Instants at which scans went to a taker since the drive has started.
    pub(crate) scan_instants: u64,
    /// How many steps may be taken.
    pub(crate) steps: Steps,
    /// How long a step is; without it, one ends whenever scanners act.
    pub(crate) stride: Option<Stride>,
    /// Who is told where the tractor truly is at the first scanner's scans.
    pub(crate) moments: Moments,
    /// What clients of pseudo-terminals have not read: the end waits for them, too.
    pub(crate) untaken: Vec<Untaken>,
}

impl Timeline {
    /// Runs until its end, if it has one, or until a step is not acknowledged.
    pub(crate) async fn run(mut self) -> Result<(), LockstepError> {
        self.wire_lockstep();
        let (clock, changed) = (Arc::clone(&self.clock), Arc::clone(&self.changed));
        let joined = self.lockstep.as_ref().map(Lockstep::joined).unwrap_or_default();
        let mut pacer = Pacer::new(&clock, &self.timer);
        if self.start == StartWhen::Now {
            self.tractor.begin(SimTime::ZERO);
        }
        loop {
            self.follow_start();
            let due = self.due();
            if due.is_some_and(|at| self.counts_step(at)) && self.steps.gate(&clock) {
                // Peers are answered while time stands.
                self.stand(&changed).await?;
                continue;
            }
            if let Some(at) = due {
                clock.expect(at);
                if self.end.is_some_and(|end| end.is_before(at, &self.tractor, self.scan_instants)) {
                    self.drain().await;
                    return Ok(());
                }
                self.prepare(at);
            }
            tokio::select! {
                biased;
                () = std::future::poll_fn(|cx| self.poll_inputs(cx)) => self.respond().await,
                () = changed.notified() => {}
                () = joined.notified() => {}
                () = reach(&clock, &mut pacer, due) => {
                    let at = due.unwrap_or_default();
                    let ends = self.ends_step(at);
                    // From the first step that is heard.
                    let (heard, counts) = (self.is_heard(at), self.counts_step(at));
                    if let Some(lockstep) = self.lockstep.as_mut().filter(|_| heard) {
                        lockstep.arm();
                    }
                    self.fire(at, ends && heard).await?;
                    if ends && heard {
                        self.wait_for(at, Wait::Step).await?;
                    }
                    if ends && counts {
                        self.steps.take(at, &clock);
                    }
                }
            }
        }
    }

    /// Tells those sources of the lockstep that acknowledge for others.
    fn wire_lockstep(&mut self) {
        let Some(lockstep) = &self.lockstep else { return };
        for source in &mut self.sources {
            if let Source::Bus(bus) = source {
                bus.count_frames(lockstep.bus_counts());
            }
        }
    }

    /// True if somebody hears what acts at `at`: nobody hears time zero.
    fn is_heard(&self, at: SimTime) -> bool {
        at > SimTime::ZERO && (self.begun || self.is_ready())
    }

    /// True if a step that ends at `at` counts.
    fn counts_step(&self, at: SimTime) -> bool {
        self.is_heard(at) || !self.clock.delivery().is_patient()
    }

    /// True if a step ends with what acts at `at`.
    fn ends_step(&mut self, at: SimTime) -> bool {
        match &mut self.stride {
            Some(stride) => stride.ends(at),
            None => self.sources.iter_mut().any(|source| source.is_scanner() && source.next() == Some(at)),
        }
    }

    /// Answers peers until something has changed, while all steps that were granted are taken.
    async fn stand(&mut self, changed: &Notify) -> Result<(), LockstepError> {
        let overdue = self.lockstep.as_ref();
        let overdue =
            overdue.map(|lockstep| lockstep.overdue_grant(self.steps.clone(), Arc::clone(&self.clock)));
        let mut overdue = pin!(async move {
            match overdue {
                Some(overdue) => overdue.await,
                None => std::future::pending().await,
            }
        });
        loop {
            tokio::select! {
                biased;
                () = std::future::poll_fn(|cx| self.poll_inputs(cx)) => self.respond().await,
                () = changed.notified() => return Ok(()),
                error = &mut overdue => return Err(error),
            }
        }
    }

    /// Waits until all participants have acknowledged what was due until `at`, or have taken in what one source sent; takes in meanwhile what
    /// they send.
    async fn wait_for(&mut self, at: SimTime, wait: Wait) -> Result<(), LockstepError> {
        let Some(mut lockstep) = self.lockstep.take() else { return Ok(()) };
        let mut pending = Vec::new();
        self.sources.iter().for_each(|source| source.in_flight(&mut pending));
        let mut asked = false;
        let acknowledged = loop {
            let waited = async {
                lockstep.written(at, &pending).await?;
                match wait {
                    Wait::Source => lockstep.settled(at).await,
                    Wait::Step => {
                        if !asked {
                            lockstep.begin(at);
                        }
                        lockstep.acknowledged(at).await
                    }
                }
            };
            let acknowledged = self.taking_in_until(waited).await;
            asked = true;
            // What has come in during the last look belongs to this step, and so do the answers to it.
            let came = acknowledged.is_ok()
                && std::future::poll_fn(|cx| Poll::Ready(self.poll_inputs(cx).is_ready())).await;
            if came {
                self.respond().await;
            }
            if !(came && lockstep.asks_only_the_kernel()) {
                break acknowledged;
            }
        };
        self.lockstep = Some(lockstep);
        acknowledged
    }

    /// Takes in what peers send until `done` is.
    async fn taking_in_until<T>(&mut self, done: impl Future<Output = T>) -> T {
        let mut done = pin!(done);
        loop {
            tokio::select! {
                biased;
                () = std::future::poll_fn(|cx| self.poll_inputs(cx)) => self.respond().await,
                found = &mut done => return found,
            }
        }
    }

    /// Waits until what was handed over is written, and read where that can be told: on a paced clock not for who does not take it.
    async fn drain(&mut self) {
        let mut pending = Vec::new();
        self.sources.iter().for_each(|source| source.in_flight(&mut pending));
        let written = async {
            for pending in &pending {
                pending.flushed().await;
            }
            for untaken in &self.untaken {
                untaken.taken().await;
            }
        };
        match self.clock.delivery() {
            Delivery::Patient => written.await,
            Delivery::Paced => {
                let _ = rowscan_ports::clock::within(FLUSH_TIMEOUT, written).await;
            }
        }
    }

    /// The next instant that something acts at; none while time waits.
    fn due(&mut self) -> Option<SimTime> {
        let next = self.sources.iter_mut().filter_map(Source::next).min()?;
        let began = self.tractor.began();
        let next =
            self.stride.as_mut().zip(began).map_or(next, |(stride, began)| stride.end(began).min(next));
        if !self.clock.delivery().is_patient() || self.may_go_on(next) {
            return Some(next);
        }
        self.sources.iter().for_each(Source::release);
        None
    }

    /// Where nothing may be lost, time stands still while nobody takes anything, except while a device is at work.
    fn may_go_on(&self, at: SimTime) -> bool {
        // Before anyone can have connected.
        if at == SimTime::ZERO {
            return true;
        }
        let wanted = if self.begun || self.is_ready() { Claim::Taker } else { Claim::Busy };
        self.takers().any(|source| source.claim() >= wanted)
    }

    /// The sources whose takers count: the scanners, or all that speak where there is none.
    fn takers(&self) -> impl Iterator<Item = &Source> {
        let scanners = self.sources.iter().any(Source::is_scanner);
        let counts = move |source: &&Source| match scanners {
            true => source.is_scanner(),
            false => matches!(source, Source::Bus(_) | Source::Gnss(_)),
        };
        self.sources.iter().filter(counts)
    }

    /// The drive may start.
    fn is_ready(&self) -> bool {
        if self.hold.as_ref().is_some_and(|hold| !hold.is_released()) {
            return false;
        }
        if self.lockstep.as_ref().is_some_and(|lockstep| !lockstep.has_participants()) {
            return false;
        }
        match self.start {
            StartWhen::Now => true,
            StartWhen::First => self.takers().any(Source::has_taker),
            StartWhen::All if !self.sources.iter().any(Source::is_scanner) => {
                self.takers().any(Source::has_taker)
            }
            StartWhen::All => self.takers().all(Source::has_taker),
        }
    }

    /// Tells the sources once that the tractor has been set going, by whomever.
    fn follow_start(&mut self) {
        let speaks_alone = !self.begun && !self.sources.iter().any(Source::is_scanner);
        if speaks_alone && self.is_ready() {
            self.tractor.begin(self.clock.now());
        }
        if let Some(at) = self.tractor.began().filter(|_| !self.begun) {
            self.begun = true;
            self.sources.iter_mut().for_each(|source| source.begin(at));
        }
    }

    fn prepare(&mut self, at: SimTime) {
        for source in &mut self.sources {
            if source.next() == Some(at) {
                source.prepare(at);
            }
        }
    }

    /// Everything due until `at` acts; `waited_for` if a step ends with it.
    async fn fire(&mut self, at: SimTime, waited_for: bool) -> Result<(), LockstepError> {
        let delivery = self.clock.delivery();
        let ready = self.begun || self.is_ready();
        let firing = Firing { at, heard: ready || !delivery.is_patient(), delivery };
        let (mut taken, mut scanned, mut number) = (false, false, 0);
        let (first, mut first_scan) = (self.first_scanner(), None);
        while let Some(source) = self.sources.get_mut(number) {
            if source.next().is_none_or(|next| next > at) {
                number += 1;
                continue;
            }
            match source.fire(firing).await {
                Ok(took) => {
                    taken |= took;
                    scanned |= took && source.is_scanner();
                    if took && first == Some(number) {
                        first_scan = source.last_scan();
                    }
                    number += 1;
                }
                Err(cause) => {
                    tracing::error!(%cause, "the line is gone");
                    self.remove(number);
                }
            }
            if ready && !(waited_for && self.is_last_of_step(at)) {
                self.wait_for(at, Wait::Source).await?;
            }
        }
        if ready && taken {
            self.tractor.begin(at);
        }
        // On a paced clock scans go out while the tractor still stands: they are none of the drive's.
        self.scan_instants += u64::from(scanned && self.tractor.began().is_some());
        self.moments.tell(first_scan, &self.tractor);
        if taken {
            // What was sent leaves before the next line is cast on the same thread.
            yield_once().await;
        }
        Ok(())
    }

    fn first_scanner(&self) -> Option<usize> {
        self.sources.iter().position(Source::is_scanner)
    }

    /// A scanner's line is gone, and the scanner with it.
    fn remove(&mut self, number: usize) {
        if self.first_scanner() == Some(number) {
            self.moments.end();
        }
        self.sources.remove(number);
    }

    /// True if nothing more acts until `at`, and the step's own wait asks for no more than the wait for its last source would.
    fn is_last_of_step(&mut self, at: SimTime) -> bool {
        self.lockstep.as_ref().is_some_and(Lockstep::asks_only_the_kernel)
            && self.sources.iter_mut().all(|source| source.next().is_none_or(|next| next > at))
    }

    /// Ready once any source has taken something from its peers.
    fn poll_inputs(&mut self, cx: &mut Context<'_>) -> Poll<()> {
        let (mut ready, mut gone) = (false, None);
        for (number, source) in self.sources.iter_mut().enumerate() {
            match source.poll_input(cx) {
                Poll::Ready(Ok(())) => ready = true,
                Poll::Ready(Err(cause)) => {
                    tracing::error!(%cause, "the line is gone");
                    (ready, gone) = (true, Some(number));
                }
                Poll::Pending => {}
            }
        }
        if let Some(number) = gone {
            self.remove(number);
        }
        if ready { Poll::Ready(()) } else { Poll::Pending }
    }

    async fn respond(&mut self) {
        let (now, delivery) = (self.clock.now(), self.clock.delivery());
        for source in &mut self.sources {
            source.respond(now, delivery).await;
        }
    }
}

/// Waits for `due`; for ever without one.
async fn reach(clock: &SimClock, pacer: &mut Pacer, due: Option<SimTime>) {
    match due {
        Some(due) => pacer.reach(clock, due).await,
        None => std::future::pending().await,
    }
}
