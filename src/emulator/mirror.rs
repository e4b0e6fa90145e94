//! The mirror: turn after turn, at absolute instants of simulated time, it measures a line and hands the telegram to
//! every client that wants it.

use std::sync::Arc;
use std::sync::atomic::Ordering;

use bytes::Bytes;
use rowscan_protocol::device::{Mirror, scan_event};
use rowscan_protocol::frame::Dialect;
use rowscan_protocol::time::SimTime;
use tokio::sync::mpsc::error::TrySendError;

use super::Shared;
use super::roster::Member;
use super::world::{Drive, World};
use crate::clock::TimeScale;

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
pub(super) async fn turn(shared: Arc<Shared>, mut world: World) {
    let mut turns = Turns::new(SimTime::ZERO, shared.device().mirror());
    let mut drive = Drive::default();
    let mut audience: Vec<(Arc<Member>, Dialect)> = Vec::new();
    loop {
        let at = turns.next();
        // Cast ahead, so that the line is ready before its deadline.
        let mut mirror = shared.device().mirror();
        world.look(mirror, drive.travelled(at));
        shared.clock.reach(at).await;
        if at > SimTime::ZERO {
            wait_for_clients(&shared).await;
        }
        let current = shared.device().mirror();
        if current != mirror {
            mirror = current;
            world.look(mirror, drive.travelled(at));
        }
        shared.roster.audience(&mut audience);
        if let Some(telegram) = Telegram::measure(&shared, at, &world, &audience) {
            telegram.deliver(&shared, &audience).await;
            if !audience.is_empty() {
                drive.begin(at);
            }
        }
        turns.advance(mirror);
    }
}

/// As fast as the clients take it, time stands still while nobody wants a scan or the device does not measure.
async fn wait_for_clients(shared: &Shared) {
    if shared.clock.scale() != TimeScale::Max {
        return;
    }
    let mut audience = Vec::new();
    loop {
        shared.roster.audience(&mut audience);
        if !audience.is_empty() && shared.device().is_measuring() {
            return;
        }
        shared.interest.notified().await;
    }
}

/// One scan telegram, encoded once a dialect, whoever many want it.
#[derive(Debug, Default)]
struct Telegram {
    counter: u16,
    a: Option<Bytes>,
    b: Option<Bytes>,
}

impl Telegram {
    /// Lets the device turn its line into a telegram; `None` if it does not measure or leaves this turn out.
    fn measure(
        shared: &Shared,
        at: SimTime,
        world: &World,
        audience: &[(Arc<Member>, Dialect)],
    ) -> Option<Self> {
        let mut device = shared.device();
        let scan = device.measure(at, &world.line())?;
        let encode = |dialect| {
            audience.iter().any(|(_, wanted)| *wanted == dialect).then(|| {
                let mut frame = Vec::new();
                scan_event(dialect, scan, &mut frame);
                Bytes::from(frame)
            })
        };
        Some(Self { counter: scan.telegram_counter, a: encode(Dialect::A), b: encode(Dialect::B) })
    }

    /// Hands it to everyone who wants it. Paced, a full queue drops it for that client alone; else the clock waits.
    async fn deliver(&self, shared: &Shared, audience: &[(Arc<Member>, Dialect)]) {
        if !audience.is_empty() {
            shared.latency.sent(self.counter);
        }
        for (member, dialect) in audience {
            let frame = match dialect {
                Dialect::A => &self.a,
                Dialect::B => &self.b,
            };
            let Some(frame) = frame.clone() else { continue };
            let (taken, dropped) = match shared.clock.scale() {
                TimeScale::Max => (member.queue().send(frame).await.is_ok(), false),
                TimeScale::Paced(_) => match member.queue().try_send(frame) {
                    Ok(()) => (true, false),
                    Err(TrySendError::Full(_)) => (false, true),
                    Err(TrySendError::Closed(_)) => (false, false),
                },
            };
            shared.counts.sent.fetch_add(taken.into(), Ordering::Relaxed);
            shared.counts.dropped.fetch_add(dropped.into(), Ordering::Relaxed);
        }
    }
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
