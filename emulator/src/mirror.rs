//! The mirror of a CoLa scanner: turn after turn, at absolute instants of simulated time, it measures a line and hands the telegram to
//! every client that wants it.

use std::net::SocketAddrV4;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, MutexGuard};
use std::time::Duration;

use rowscan_faults::StreamFaults;
use rowscan_ports::in_flight::InFlight;
use rowscan_protocol::device::{Device, Mirror, Stream};
use rowscan_protocol::time::SimTime;

use crate::firing::{Claim, Firing};
use crate::imu;
use crate::roster::{Member, Wants};
use crate::scan_moment::LastScan;
use crate::shared::Shared;
use crate::telegram::Telegram;
use crate::turns::Turns;
use crate::view::ScannerView;

/// How often the layers of one turn are cast, if clients switch them meanwhile.
const MAX_CASTS: usize = 4;

/// How late a turn may come, host time. What holds a host up for less than [`Patience::MOST`] costs no scan. A host that is too slow loses
/// scans, evenly, rather than that they come ever later: the first turn left out takes the patience away, each turn in time
/// brings a little back.
#[derive(Debug)]
struct Patience(Duration);

impl Patience {
    const MOST: Duration = Duration::from_millis(200);
    const LEAST: Duration = Duration::from_millis(20);
    const EARNED: Duration = Duration::from_millis(1);

    /// True if a turn so late is worth taking.
    fn bears(&mut self, late: Duration) -> bool {
        let bears = late <= self.0;
        self.0 = if bears { Self::MOST.min(self.0 + Self::EARNED) } else { Self::LEAST };
        bears
    }
}

/// A scanner's mirror with what it looks at.
#[derive(Debug)]
pub(crate) struct MirrorSource {
    shared: Arc<Shared>,
    world: ScannerView,
    turns: Turns,
    patience: Patience,
    /// The turn that has been prepared, and whether the host is so late that it is left out.
    prepared: Option<(SimTime, bool)>,
    /// Kept from turn to turn, so that a scan costs no memory.
    audience: Vec<(Arc<Member>, Wants)>,
    last_scan: Option<LastScan>,
}

impl MirrorSource {
    pub(crate) fn new(shared: Arc<Shared>, world: ScannerView) -> Self {
        let turns = Turns::new(SimTime::ZERO, shared.device().mirror());
        let patience = Patience(Patience::MOST);
        Self { shared, world, turns, patience, prepared: None, audience: Vec::new(), last_scan: None }
    }

    pub(crate) fn next(&self) -> SimTime {
        self.turns.next()
    }

    /// Casts ahead, so that the line is ready before its deadline. One that `hurries` leaves out what the host is too late for; one that does not, any
    /// more, takes up again what was to be left out.
    pub(crate) fn prepare(&mut self, at: SimTime, hurries: bool) {
        if self.prepared.is_some_and(|(prepared, left_out)| prepared == at && (hurries || !left_out)) {
            return;
        }
        let in_time = self.patience.bears(self.shared.clock.lateness(at)) || !hurries;
        self.prepared = Some((at, !in_time));
        if in_time {
            let device = self.shared.device();
            let (mirror, mirrors) = (device.mirror(), self.layers(&device));
            drop(device);
            self.world.look(mirror, at);
            self.world.look_at_layers(&mirrors, at);
        }
    }

    /// What the mirror does for each line of the next turn, where they go out; none where a turn is one line.
    fn layers(&self, device: &Device) -> Vec<Mirror> {
        if device.has_layers() && self.shared.datagrams.is_streaming(device) {
            device.mirrors()
        } else {
            Vec::new()
        }
    }

    /// True if a scan went to a taker.
    pub(crate) async fn fire(&mut self, firing: Firing) -> bool {
        let at = self.next();
        if self.prepared == Some((at, true)) {
            self.turns.advance(leave_out(&self.shared, at, self.world.encoder_ticks(at)));
            return false;
        }
        // Nothing to do, unless mirror or tractor were told something else since the line was cast ahead.
        let mirror = self.shared.device().mirror();
        self.world.look(mirror, at);
        self.shared.device().set_encoder_ticks(self.world.encoder_ticks(at));
        // The scan at time zero is never sent, so that every run begins alike.
        let heard = firing.heard && at > SimTime::ZERO;
        self.audience.clear();
        if heard && self.shared.device().sends_scan_events() {
            self.shared.roster.audience(&mut self.audience);
        }
        let telegram = Telegram::measure(&self.shared, at, &self.world, &self.audience);
        let streamed = heard && telegram.is_some() && self.stream(mirror, at);
        self.turns.advance(mirror);
        let Some(telegram) = telegram else {
            // Who has stopped the device takes no scans; what goes wrong with it is nobody's silence.
            if firing.driving && self.shared.device().is_stopped() {
                self.time_silence(false, self.turns.next().elapsed().saturating_sub(at.elapsed()));
            }
            return false;
        };
        self.last_scan = Some(LastScan { at, telegram_counter: Some(telegram.counter()) });
        self.shared.counts.number(telegram.counter());
        if !self.audience.is_empty() {
            let number = u32::from(telegram.counter()) + 1;
            // Only the first one stays.
            let _ = self.shared.counts.first_taken.compare_exchange(
                0,
                number,
                Ordering::Relaxed,
                Ordering::Relaxed,
            );
        }
        telegram.deliver(&self.shared, &self.audience, firing.delivery).await;
        let polled = heard && self.shared.answer_polls();
        let taken = polled || streamed || !self.audience.is_empty();
        self.shared.counts.unheard.fetch_add(u64::from(!taken), Ordering::Relaxed);
        if firing.driving {
            self.time_silence(taken, self.turns.next().elapsed().saturating_sub(at.elapsed()));
        }
        taken
    }

    /// Casts the layers that go out, unless they were cast ahead, and takes the device: clients may switch layers while it is not held. None where they
    /// do so again and again.
    fn with_layers<'a>(&mut self, shared: &'a Shared, at: SimTime) -> Option<MutexGuard<'a, Device>> {
        for _ in 0..MAX_CASTS {
            let mirrors = self.layers(&shared.device());
            self.world.look_at_layers(&mirrors, at);
            let device = shared.device();
            if self.layers(&device) == mirrors {
                return Some(device);
            }
        }
        None
    }

    /// Hands the turn that was measured at `at` over as datagrams, each for its own instant; true if its scan goes where somebody
    /// listens, as far as that is known.
    fn stream(&mut self, mirror: Mirror, at: SimTime) -> bool {
        let shared = Arc::clone(&self.shared);
        let Some(mut device) = self.with_layers(&shared, at) else { return false };
        let Some(imu_period) = device.model().compact.map(|_| device.imu_period()) else { return false };
        let mut datagrams = Vec::new();
        device.segments(at, &self.world.lines(), &mut datagrams);
        let datagrams_heard = self.shared.datagrams.is_heard();
        let streamed =
            !datagrams.is_empty() && datagrams_heard && self.shared.datagrams.is_streaming(&device);
        if device.destination(Stream::Encoder).is_ok() {
            let speed_mm_s = (1e3 * self.world.wheel_speed_m_s(at)) as f32;
            datagrams.push(device.encoder_telegram(at, speed_mm_s));
        }
        if let Some(period) = imu_period.filter(|_| device.destination(Stream::Imu).is_ok()) {
            let (period_ns, next) = (period.as_nanos() as u64, self.turns.after(mirror));
            let readings = (at.0.div_ceil(period_ns)..).map(|number| SimTime(number * period_ns));
            for instant in readings.take_while(|instant| *instant < next) {
                datagrams.push(device.imu(instant, imu::reading(&self.world, mirror, instant)));
            }
        }
        drop(device);
        self.shared.datagrams.wait(datagrams);
        streamed
    }

    /// Adds a turn's time to that in which nobody takes scans; a client that polls listens between its polls.
    fn time_silence(&self, taken: bool, time: Duration) {
        let counts = &self.shared.counts;
        let polls = || {
            self.shared.polls_take_scans()
                && self.shared.roster.size() > 0
                && !self.shared.device().is_stopped()
        };
        if taken || polls() {
            counts.silence_ns.store(0, Ordering::Relaxed);
        } else {
            let time_ns = u64::try_from(time.as_nanos()).unwrap_or(u64::MAX);
            counts.silence_ns.fetch_add(time_ns, Ordering::Relaxed);
            counts.unheard_ns.fetch_add(time_ns, Ordering::Relaxed);
        }
    }

    /// The last scan it made.
    pub(crate) fn last_scan(&self) -> Option<LastScan> {
        self.last_scan
    }

    pub(crate) fn in_flight(&self) -> &InFlight {
        &self.shared.in_flight
    }

    /// What goes wrong on its connections, if anything may.
    pub(crate) fn faults(&self) -> Option<&StreamFaults> {
        self.shared.config.faults.as_ref()
    }

    /// What it needs time for: it starts up, or somebody takes its scans.
    pub(crate) fn claim(&self) -> Claim {
        let device = self.shared.device();
        // By the time that clients see: time goes on until they can see that the device is ready.
        if device.is_settling(self.shared.clock.now()) {
            return Claim::Busy;
        }
        let streams = self.shared.datagrams.has_taker(&device);
        let subscribed = device.sends_scan_events() && self.shared.roster.has_audience();
        let wanted = device.is_measuring() && (streams || subscribed || self.shared.polls_wait());
        if wanted { Claim::Taker } else { Claim::Idle }
    }

    /// In lockstep: looks for who takes its datagrams; true if nobody does yet, or any more.
    pub(crate) fn look_for_receiver(
        &self,
        begun: bool,
        has_receiver: impl FnOnce(SocketAddrV4) -> bool,
    ) -> bool {
        self.shared.datagrams.look_for_receiver(&self.shared.device(), begun, has_receiver)
    }

    /// It starts up, and a client is connected that waits for that.
    pub(crate) fn is_waited_for(&self) -> bool {
        self.claim() == Claim::Busy && self.shared.roster.size() > 0
    }

    /// Whether somebody has subscribed to its scans, or has ever polled for them.
    pub(crate) fn has_taker(&self) -> bool {
        self.shared.has_taker()
    }

    /// Time waits for others: polls are answered with the scan there is.
    pub(crate) fn release_polls(&self) {
        self.shared.answer_polls();
    }
}

/// Passes a turn over that there is no time for; what the mirror does then.
fn leave_out(shared: &Shared, at: SimTime, encoder_ticks: f64) -> Mirror {
    let mut device = shared.device();
    device.set_encoder_ticks(encoder_ticks);
    let missed = device.miss(at);
    tell_missed(&shared.counts.missed, missed.into());
    shared.clock.reached(at);
    device.mirror()
}

/// Counts scans that there was no time for. It is told at each doubling: a host that is too slow must not be made slower.
pub(crate) fn tell_missed(counted: &AtomicU64, missed: u64) {
    let before = counted.fetch_add(missed, Ordering::Relaxed);
    let so_far = before + missed;
    if missed > 0 && so_far.checked_ilog2() > before.checked_ilog2() {
        tracing::warn!(
            "this machine is too slow for this pace: {so_far} scans missed so far; half the time scale, or max, gives it time"
        );
    }
}
