//! The tractor's ground speed as a recording of the scans holds it beside them: NMEA sentences, or CAN frames.

use std::path::Path;
use std::str;
use std::time::Duration;

use rowscan_bus::frame::{CanFrame, J1939Id};
use rowscan_bus::nmea::SpeedReader;
use rowscan_bus::pgn::tractor;
use rowscan_canopy::AdvanceSource;
use rowscan_driver::Source;
use rowscan_protocol::nmea::NmeaLines;
use rowscan_recording::{Packet, ReadError, StreamKind};

use super::Failure;
use super::recorded_stream::read_beside;

/// A speed not told for so long is lost: tractors tell it every 100 ms, receivers at least once a second.
const STALE: Duration = Duration::from_secs(2);

/// What was told, in the order of time since the recording's beginning.
#[derive(Clone, Debug, Default)]
pub(super) struct RecordedSpeed {
    told: Vec<(Duration, Option<f64>)>,
}

impl RecordedSpeed {
    /// Of the file that `source` is; none if it is a live scanner.
    pub(super) fn of(source: &Source, kind: StreamKind) -> Result<Option<Self>, Failure> {
        let Some(path) = source.file() else { return Ok(None) };
        let speed = Self::read(path, kind).map_err(|cause| {
            Failure::Usage(format!("cannot read the ground speed from {}: {cause}", path.display()))
        })?;
        if speed.told.is_empty() {
            let (what, other) = match kind {
                StreamKind::Can => ("CAN frame with a ground speed (PGN 65097)", "--can PORT"),
                _ => ("NMEA sentence VTG with its time", "--gnss HOST:PORT"),
            };
            return Err(Failure::Usage(format!(
                "{} holds no {what} to take the advance from; name another source with {other}, or take --advance constant",
                path.display()
            )));
        }
        Ok(Some(speed))
    }

    /// What a file holds of the ground speed besides what the way comes from: on its bus, else by its receiver; none if it holds neither.
    pub(super) fn found_beside(
        path: &Path,
        way: Option<AdvanceSource>,
    ) -> Result<Option<(AdvanceSource, Self)>, ReadError> {
        let all = [(StreamKind::Can, AdvanceSource::Can), (StreamKind::Nmea, AdvanceSource::Gnss)];
        for (kind, source) in all.into_iter().filter(|(_, source)| way != Some(*source)) {
            let speed = Self::read(path, kind)?;
            if speed.told.iter().any(|(_, speed)| speed.is_some()) {
                return Ok(Some((source, speed)));
            }
        }
        Ok(None)
    }

    fn read(path: &Path, kind: StreamKind) -> Result<Self, ReadError> {
        let mut reader = Reader::default();
        let mut told = Vec::new();
        read_beside(path, kind, |at, packet| {
            told.extend(reader.speed(kind, packet).map(|speed| (at, speed)));
        })?;
        Ok(Self { told })
    }

    /// The speed at this time since the recording's beginning, m/s; `None` while it is lost. The first one is told at the end of its period: that long before it
    /// holds, too.
    pub(super) fn at(&self, time: Duration) -> Option<f64> {
        let before = self.told.partition_point(|(at, _)| *at <= time);
        let Some(latest) = before.checked_sub(1) else { return self.before_the_first(time) };
        let (at, speed) = self.told.get(latest)?;
        speed.filter(|_| time.saturating_sub(*at) <= STALE)
    }

    fn before_the_first(&self, time: Duration) -> Option<f64> {
        let [(first, speed), (second, _), ..] = *self.told else { return None };
        let period = second.saturating_sub(first).min(STALE);
        speed.filter(|_| first.saturating_sub(time) <= period)
    }

    /// The same by the one told before and the one told behind: nothing is late where all is known.
    pub(super) fn between(&self, time: Duration) -> Option<f64> {
        let behind = self.told.partition_point(|(at, _)| *at <= time);
        let (from, before) = *self.told.get(behind.checked_sub(1)?)?;
        let (to, after) = *self.told.get(behind)?;
        let (before, after) = before.zip(after).filter(|_| to.saturating_sub(from) <= STALE)?;
        let share = (time - from).as_secs_f64() / (to - from).as_secs_f64();
        Some(before + share * (after - before))
    }
}

/// What tells the speed in one stream.
#[derive(Default)]
struct Reader {
    lines: NmeaLines,
    speed: SpeedReader,
}

impl Reader {
    /// What a packet tells last; none if it tells nothing.
    fn speed(&mut self, kind: StreamKind, packet: &Packet) -> Option<Option<f64>> {
        if kind == StreamKind::Can {
            let frame = CanFrame::from_text(str::from_utf8(&packet.bytes).ok()?)?;
            let is_speed = J1939Id::of(frame.id).is_some_and(|id| id.pgn == tractor::GROUND_SPEED.pgn);
            return is_speed.then(|| tractor::ground_speed_m_s(frame.data()));
        }
        let mut told = None;
        self.lines.push(&packet.bytes);
        while let Some(line) = self.lines.next_line() {
            told = self.speed.line(&line).or(told);
        }
        told
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_speed_told_holds_until_it_is_stale() {
        let s = Duration::from_secs;
        let speed = RecordedSpeed { told: vec![(s(1), Some(1.5)), (s(2), None), (s(3), Some(-0.5))] };
        for (at, expected) in
            [(0, Some(1.5)), (1, Some(1.5)), (2, None), (3, Some(-0.5)), (5, Some(-0.5)), (6, None)]
        {
            assert_eq!(speed.at(s(at)), expected, "at {at} s");
        }
        let late = RecordedSpeed { told: vec![(s(5), Some(1.0)), (s(6), Some(1.0))] };
        assert_eq!([3, 4, 5].map(|at| late.at(s(at))), [None, Some(1.0), Some(1.0)]);
        let lost = RecordedSpeed { told: vec![(s(1), None), (s(2), Some(1.0))] };
        assert_eq!(lost.at(s(0)), None, "nobody knew it");
        let speed =
            RecordedSpeed { told: [(1, 1.0), (2, 2.0), (9, 2.0)].map(|(at, v)| (s(at), Some(v))).into() };
        for (at_ms, expected) in
            [(500, None), (1000, Some(1.0)), (1500, Some(1.5)), (2500, None), (9000, None)]
        {
            assert_eq!(speed.between(Duration::from_millis(at_ms)), expected, "at {at_ms} ms");
        }
    }
}
