//! The timeline: everything of one rig that acts at instants of simulated time, on one queue with one pacer.
//!
//! Calling order of a [`Source`]: [`Source::next`] says when it acts next; [`Source::prepare`] may be called any number of times with that
//! instant while the pacer still waits; [`Source::fire`] acts. [`Source::poll_input`] takes what its peers send and, once it is ready,
//! [`Source::respond`] answers. Sources due at the same instant fire in the order of the rig: faults, line changes, scanners, CAN, GNSS.

use std::pin::pin;
use std::sync::Arc;
use std::task::{Context, Poll};
use std::time::Duration;

use rowscan_faults::StreamFaults;
use rowscan_ports::{Delivery, Untaken};
use rowscan_protocol::time::SimTime;
use rowscan_vehicle::Tractor;
use tokio::sync::Notify;

use crate::clock::{Pacer, SimClock, Timer, yield_once};
use crate::end::EndWhen;
use crate::firing::{Claim, Firing};
use crate::gap::GapPacer;
use crate::hold::Hold;
use crate::lockstep::{ChildClock, Lockstep, LockstepError};
use crate::scan_moment::Moments;
use crate::source::Source;
use crate::start::StartWhen;
use crate::steps::Steps;
use crate::stride::Stride;

/// How long the end of a paced timeline waits for clients that have not taken everything, host time.
const FLUSH_TIMEOUT: Duration = Duration::from_secs(2);

/// Between two looks for who takes datagrams, host time.
const LOOK_EVERY: Duration = Duration::from_millis(20);

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
    /// In lockstep: nobody takes scans any more.
    pub(crate) gap: GapPacer,
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
    pub(crate) async fn run(&mut self) -> Result<(), LockstepError> {
        self.wire_lockstep();
        let (clock, changed) = (Arc::clone(&self.clock), Arc::clone(&self.changed));
        let joined = self.lockstep.as_ref().map(Lockstep::joined).unwrap_or_default();
        let children = self.lockstep.as_ref().and_then(Lockstep::children).cloned();
        let mut pacer = Pacer::new(&clock, &self.timer);
        if self.start == StartWhen::Now {
            self.tractor.begin(SimTime::ZERO);
        }
        loop {
            self.follow_start();
            let waits_for_receiver = self.look_for_receivers();
            let due = self.due();
            // Nothing tells when a fault begins to hold bytes back.
            let looks = waits_for_receiver || due.is_none() && self.byte_faults().next().is_some();
            if due.is_some_and(|at| self.counts_step(at)) && self.steps.gate(&clock) {
                // Peers are answered while time stands.
                self.stand(&changed).await?;
                continue;
            }
            if let Some(at) = due {
                clock.expect(at);
                let over = self.end.filter(|end| end.is_before(at, &self.tractor, self.scan_instants));
                if let Some(end) = over {
                    if clock.delivery().is_patient() {
                        clock.reached(end.instant((clock.now(), at), &self.tractor, self.scan_instants));
                    }
                    self.finish().await;
                    self.drain().await;
                    return Ok(());
                }
                self.prepare(at);
            }
            let held = due.map_or(Duration::ZERO, |at| self.gap.left(at));
            let before_drive = children.as_ref().filter(|_| !self.begun);
            tokio::select! {
                biased;
                () = std::future::poll_fn(|cx| self.poll_inputs(cx)) => self.respond().await,
                () = changed.notified() => {}
                () = joined.notified() => {}
                () = wait_by_host(before_drive) => {}
                () = look_again(looks) => {}
                () = reach(&clock, &mut pacer, held, due) => {
                    let at = due.unwrap_or_default();
                    self.gap.pass();
                    let ends = self.ends_step(at);
                    // From the first step that is heard.
                    let (heard, counts) = (self.is_heard(at), self.counts_step(at));
                    if let Some(lockstep) = self.lockstep.as_mut().filter(|_| heard) {
                        lockstep.arm();
                    }
                    if let Some(children) = children.as_ref().filter(|_| heard) {
                        if !self.begun {
                            // What they heard before the drive is behind them when their clock starts.
                            self.wait_for(at, Wait::Source).await?;
                        }
                        children.reach(at, self.begun);
                    }
                    if ends && counts {
                        self.steps.begin();
                    }
                    self.fire(at, ends && heard).await?;
                    if ends && heard {
                        self.wait_for(at, Wait::Step).await?;
                    }
                    if let Some(children) = &children {
                        self.fire_children(at, children).await?;
                    }
                    if ends && counts {
                        self.steps.take(&clock);
                    }
                }
            }
        }
    }

    /// In lockstep, looks for who takes datagrams; true if nobody takes those of a scanner. Nothing tells when somebody comes.
    fn look_for_receivers(&mut self) -> bool {
        let Some(lockstep) = self.lockstep.as_mut() else { return false };
        let mut absent = false;
        for source in &self.sources {
            if let Source::Mirror(mirror) = source {
                absent |= mirror.look_for_receiver(self.begun, |to| lockstep.has_receiver(to));
            }
        }
        absent
    }

    /// The children's timers that are due, behind all sources of that instant; each is dealt with before the next.
    async fn fire_children(&mut self, at: SimTime, children: &ChildClock) -> Result<(), LockstepError> {
        while self.begun && children.fire(at) {
            self.wait_for(at, Wait::Source).await?;
        }
        Ok(())
    }

    /// Tells those sources of the lockstep that acknowledge for others.
    fn wire_lockstep(&mut self) {
        let Some(lockstep) = &self.lockstep else { return };
        for source in &mut self.sources {
            if let Source::Bus(bus) = source {
                bus.count_frames(lockstep.bus_counts());
                bus.set_compute(lockstep.compute());
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
        if self.gap.is_open() {
            return Ok(());
        }
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

    /// Sends the rest of what is under way: a scan that was measured before the end goes out whole, and no telegram ends inside.
    async fn finish(&mut self) {
        let (now, delivery) = (self.clock.now(), self.clock.delivery());
        for source in &mut self.sources {
            if let Err(cause) = source.finish(now, delivery).await {
                tracing::debug!(%cause, "a line is gone at the end");
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
        let held = self.byte_faults().filter_map(StreamFaults::needs_time).min();
        // In lockstep it is no part of a step, and leaves with the next one.
        let waits = self.clock.delivery().is_patient() && self.lockstep.is_none();
        let held = held.map(|at| SimTime::ZERO + at).filter(|_| waits);
        let next = self.sources.iter_mut().filter_map(Source::next).min();
        let next = [next, held.filter(|at| *at > self.clock.now())].into_iter().flatten().min()?;
        let began = self.tractor.began();
        let next =
            self.stride.as_mut().zip(began).map_or(next, |(stride, began)| stride.end(began).min(next));
        let children = self.lockstep.as_ref().and_then(Lockstep::children).filter(|_| self.begun);
        let next = children.and_then(ChildClock::next).map_or(next, |timer| timer.min(next));
        let is_gap = self.is_gap();
        self.gap.set(is_gap, self.clock.now());
        if is_gap || !self.clock.delivery().is_patient() || self.may_go_on(next) {
            return Some(next);
        }
        self.sources.iter().for_each(Source::release);
        None
    }

    /// In lockstep, nobody takes scans any more, and nobody waits for what a scanner is at work on. Where steps are granted, whoever grants them says how
    /// time goes on.
    fn is_gap(&self) -> bool {
        let paces = self.begun && self.lockstep.as_ref().is_some_and(|lockstep| !lockstep.needs_grants());
        paces
            && !self.follows_children()
            && !self.takers().any(|source| source.claim() == Claim::Taker || source.is_waited_for())
    }

    /// True while a child goes by simulated time. It waits for nothing that does not pass: not to take scans costs it what it costs in the field.
    fn follows_children(&self) -> bool {
        self.lockstep.as_ref().and_then(Lockstep::children).is_some_and(ChildClock::is_followed)
    }

    /// What goes wrong on the scanners' connections.
    fn byte_faults(&self) -> impl Iterator<Item = &StreamFaults> {
        self.sources.iter().filter_map(Source::faults)
    }

    /// Where nothing may be lost, time stands still while nobody takes anything, except while a device is at work, or a fault holds back what only time lets go.
    fn may_go_on(&self, at: SimTime) -> bool {
        // Before anyone can have connected.
        if at == SimTime::ZERO {
            return true;
        }
        if self.begun && self.follows_children() {
            return true;
        }
        let wanted = if self.begun || self.is_ready() { Claim::Taker } else { Claim::Busy };
        self.takers().any(|source| source.claim() >= wanted)
            || self.byte_faults().any(|faults| faults.needs_time().is_some())
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
        // A step that was granted waits for the host: nothing of it is left out.
        let hurries = self.steps.granted().is_none();
        for source in &mut self.sources {
            if source.next() == Some(at) {
                source.prepare(at, hurries);
            }
        }
    }

    /// Everything due until `at` acts; `waited_for` if a step ends with it.
    async fn fire(&mut self, at: SimTime, waited_for: bool) -> Result<(), LockstepError> {
        let delivery = self.clock.delivery();
        let ready = self.begun || self.is_ready();
        let driving = self.tractor.began().is_some();
        let firing = Firing { at, heard: ready || !delivery.is_patient(), driving, delivery };
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

/// Waits for `due`, `held` at least; for ever without one.
async fn reach(clock: &SimClock, pacer: &mut Pacer, held: Duration, due: Option<SimTime>) {
    match due {
        Some(due) => {
            if !held.is_zero() {
                rowscan_ports::clock::rest(held).await;
            }
            pacer.reach(clock, due).await;
        }
        None => std::future::pending().await,
    }
}

/// Waits a little if somebody is to be looked for again; for ever otherwise.
async fn look_again(looks: bool) {
    match looks {
        true => rowscan_ports::clock::rest(LOOK_EVERY).await,
        false => std::future::pending().await,
    }
}

/// Before the drive children wait by the host; nobody does without them.
async fn wait_by_host(children: Option<&ChildClock>) {
    match children {
        Some(children) => children.follow_host().await,
        None => std::future::pending().await,
    }
}
