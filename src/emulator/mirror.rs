//! The mirror: turn after turn, at absolute instants of simulated time, it measures a line and hands the telegram to
//! every client that wants it.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

use bytes::Bytes;
use rowscan_protocol::device::{DeviceEvent as Event, Mirror, monitor_event, scan_event};
use rowscan_protocol::frame::Dialect;
use rowscan_protocol::telegram::LmdScandata;
use rowscan_protocol::time::SimTime;
use tokio::sync::mpsc::error::TrySendError;

use super::roster::{Member, Queued, Wants};
use super::voices::Speaking;
use super::world::World;
use super::{LineChange, Shared};
use crate::clock::{self, Pacer, TimeScale};

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

/// When the mirror passes its zero index: absolute instants epoch + n·T, never a sum of periods.
#[derive(Debug)]
pub(crate) struct Turns {
    epoch: SimTime,
    turned: u64,
    frequency_centihz: u32,
    period_ppm: i32,
}

impl Turns {
    pub(crate) fn new(epoch: SimTime, mirror: Mirror) -> Self {
        Self {
            epoch,
            turned: 0,
            frequency_centihz: mirror.frequency_centihz.max(1),
            period_ppm: mirror.period_ppm,
        }
    }

    /// The next turn's instant.
    pub(crate) fn next(&self) -> SimTime {
        SimTime(self.epoch.0 + period_times(self.turned, self.frequency_centihz, self.period_ppm))
    }

    /// On to the turn after; a changed frequency starts a new epoch there.
    pub(crate) fn advance(&mut self, mirror: Mirror) {
        if mirror.frequency_centihz == self.frequency_centihz {
            self.turned += 1;
        } else {
            *self = Self::new(self.next(), mirror);
            self.turned = 1;
        }
    }
}

/// `n` scan periods in ns, exact to the last one; each `ppm` parts per million longer than nominal.
fn period_times(n: u64, frequency_centihz: u32, ppm: i32) -> u64 {
    let stretch = 1_000_000 + i128::from(ppm);
    (i128::from(n) * 100_000 * stretch / i128::from(frequency_centihz)) as u64
}

/// Turns the mirror for as long as the scanner runs.
pub(super) async fn turn(shared: Arc<Shared>, mut world: World, mut voices: Speaking) {
    let mut turns = Turns::new(SimTime::ZERO, shared.device().mirror());
    let mut pacer = Pacer::new(&shared.clock, &shared.config.timer);
    let mut patience = Patience(Patience::MOST);
    let mut audience: Vec<(Arc<Member>, Wants)> = Vec::new();
    let mut line_changes = shared.config.line_changes.clone();
    loop {
        let at = turns.next();
        while let Some(due) = voices.next().filter(|due| *due < at) {
            pacer.reach(&shared.clock, due).await;
            voices.speak(due).await;
        }
        if !patience.bears(shared.clock.lateness(at)) {
            switch_lines(&shared, at, &mut line_changes);
            turns.advance(leave_out(&shared, at, world.encoder_ticks(at)));
            clock::step_aside().await;
            continue;
        }
        // Cast ahead, so that the line is ready before its deadline.
        world.look(shared.device().mirror(), at);
        pacer.reach(&shared.clock, at).await;
        if at > SimTime::ZERO {
            wait_for_clients(&shared, at).await;
        }
        // Nothing to do, unless mirror or tractor were told something else meanwhile.
        let mirror = shared.device().mirror();
        world.look(mirror, at);
        switch_lines(&shared, at, &mut line_changes);
        shared.device().set_encoder_ticks(world.encoder_ticks(at));
        // The turn at time zero is nobody's, however quick a client was: so every run begins alike.
        if at > SimTime::ZERO {
            shared.roster.audience(&mut audience);
        }
        if let Some(telegram) = Telegram::measure(&shared, at, &world, &audience) {
            telegram.deliver(&shared, &audience).await;
            if !audience.is_empty() {
                world.tractor().begin(at);
                // The telegram leaves before the next line is cast on the same thread.
                clock::step_aside().await;
            }
        }
        turns.advance(mirror);
    }
}

/// Passes a turn over that there is no time for; what the mirror does then.
fn leave_out(shared: &Shared, at: SimTime, encoder_ticks: f64) -> Mirror {
    let mut device = shared.device();
    device.set_encoder_ticks(encoder_ticks);
    let missed = device.miss(at);
    shared.counts.missed.fetch_add(missed.into(), Ordering::Relaxed);
    shared.clock.reached(at);
    device.mirror()
}

/// Switches the lines whose time has come.
fn switch_lines(shared: &Shared, now: SimTime, changes: &mut Vec<LineChange>) {
    changes.retain(|change| {
        let due = change.at <= now;
        if due {
            let mut device = shared.device();
            if let Err(cause) = change.apply(&mut device) {
                tracing::warn!(%cause, "line not switched");
            }
            shared.spread(&device);
        }
        !due
    });
}

/// As fast as the clients take it, time stands still while nobody wants a scan or the device does not measure. While it starts up
/// time goes on: clients wait for it to be ready.
async fn wait_for_clients(shared: &Shared, at: SimTime) {
    if shared.clock.scale() != TimeScale::Max {
        return;
    }
    let mut audience = Vec::new();
    loop {
        shared.roster.audience(&mut audience);
        let (settling, measuring) = {
            let device = shared.device();
            (device.is_settling(at), device.is_measuring())
        };
        if settling || measuring && !audience.is_empty() {
            return;
        }
        shared.interest.notified().await;
    }
}

/// One scan telegram, encoded once a dialect and name, whoever many want it.
#[derive(Debug, Default)]
struct Telegram {
    counter: u16,
    scan: Frames,
    monitor: Frames,
}

/// The same telegram in both dialects, as far as someone wants it.
#[derive(Debug, Default)]
struct Frames {
    a: Option<Bytes>,
    b: Option<Bytes>,
}

impl Frames {
    fn encode(
        scan: &LmdScandata,
        wanted: impl Fn(Dialect) -> bool,
        encode: fn(Dialect, &LmdScandata, &mut Vec<u8>),
    ) -> Self {
        let frame = |dialect| {
            wanted(dialect).then(|| {
                let mut frame = Vec::with_capacity(room(dialect, scan));
                encode(dialect, scan, &mut frame);
                Bytes::from(frame)
            })
        };
        Self { a: frame(Dialect::A), b: frame(Dialect::B) }
    }

    fn in_dialect(&self, dialect: Dialect) -> Option<Bytes> {
        match dialect {
            Dialect::A => self.a.clone(),
            Dialect::B => self.b.clone(),
        }
    }
}

/// Bytes to set aside for a telegram: more than it has, so that it is never moved while it is written.
fn room(dialect: Dialect, scan: &LmdScandata) -> usize {
    const HEAD: usize = 512;
    let values: usize = scan.channels16.iter().map(|channel| channel.values.len()).sum();
    let bytes: usize = scan.channels8.iter().map(|channel| channel.values.len()).sum();
    match dialect {
        Dialect::A => HEAD + 5 * values + 3 * bytes,
        Dialect::B => HEAD + 2 * values + bytes,
    }
}

impl Telegram {
    /// Lets the device turn its line into a telegram; `None` if it does not measure or leaves this turn out.
    fn measure(
        shared: &Shared,
        at: SimTime,
        world: &World,
        audience: &[(Arc<Member>, Wants)],
    ) -> Option<Self> {
        let mut device = shared.device();
        let measured = device.measure(at, &world.line()).map(|scan| {
            let wanted = |of: fn(&Wants) -> bool| {
                move |dialect| audience.iter().any(|(_, wants)| wants.dialect == dialect && of(wants))
            };
            Self {
                counter: scan.telegram_counter,
                scan: Frames::encode(scan, wanted(Wants::scans), scan_event),
                monitor: Frames::encode(scan, wanted(Wants::monitor), monitor_event),
            }
        });
        shared.spread(&device);
        measured
    }

    /// Hands it to everyone who wants it. Paced, a full queue drops it for that client alone; else the clock waits.
    async fn deliver(&self, shared: &Shared, audience: &[(Arc<Member>, Wants)]) {
        if let Some(latency) = shared.config.latency.as_ref().filter(|_| !audience.is_empty()) {
            latency.sent(self.counter);
        }
        for (member, wants) in audience {
            let scan = wants.scans().then(|| self.scan.in_dialect(wants.dialect)).flatten();
            let monitor = wants.monitor().then(|| self.monitor.in_dialect(wants.dialect)).flatten();
            let scan = scan.map(|frame| (Event::ScanData, frame));
            let monitor = monitor.map(|frame| (Event::Monitor, frame));
            for (event, frame) in scan.into_iter().chain(monitor) {
                hand_over(shared, member, Some(event), frame).await;
            }
        }
    }
}

/// Puts a telegram into a client's queue. Paced, a full queue drops it for that client alone; else the clock waits.
pub(super) async fn hand_over(shared: &Shared, member: &Member, event: Option<Event>, frame: Bytes) {
    let telegram = Queued { event, frame, slip: shared.backlog.enter() };
    let (taken, dropped) = match shared.clock.scale() {
        TimeScale::Max => (member.queue().send(telegram).await.is_ok(), false),
        TimeScale::Paced(_) => match member.queue().try_send(telegram) {
            Ok(()) => (true, false),
            Err(TrySendError::Full(_)) => (false, true),
            Err(TrySendError::Closed(_)) => (false, false),
        },
    };
    shared.counts.sent.fetch_add(taken.into(), Ordering::Relaxed);
    shared.counts.dropped.fetch_add(dropped.into(), Ordering::Relaxed);
}

#[cfg(test)]
mod tests {
    use super::*;
    use rowscan_protocol::angle::BeamGrid;

    fn mirror(frequency_centihz: u32) -> Mirror {
        Mirror { frequency_centihz, period_ppm: 0, beams: BeamGrid::spanning(-450_000, 2_250_000, 5000) }
    }

    #[test]
    fn ten_hours_of_turns_do_not_drift() {
        // 15 Hz: a period that no whole number of nanoseconds holds.
        let mut turns = Turns::new(SimTime::ZERO, mirror(1500));
        for _ in 0..15 * 36_000 {
            turns.advance(mirror(1500));
        }
        assert_eq!(turns.next(), SimTime(36_000_000_000_000));
    }

    #[test]
    fn a_recorded_period_is_kept() {
        let slow = Mirror { period_ppm: 5_600, ..mirror(5000) };
        let mut turns = Turns::new(SimTime::ZERO, slow);
        for _ in 0..1000 {
            turns.advance(slow);
        }
        assert_eq!(turns.next(), SimTime(20_112_000_000));
    }

    #[test]
    fn a_new_frequency_counts_from_the_turn_that_brought_it() {
        let mut turns = Turns::new(SimTime::ZERO, mirror(5000));
        turns.advance(mirror(5000));
        assert_eq!(turns.next(), SimTime(20_000_000));
        turns.advance(mirror(2500));
        assert_eq!(turns.next(), SimTime(60_000_000));
        turns.advance(mirror(2500));
        assert_eq!(turns.next(), SimTime(100_000_000));
    }
}
