//! Where a recorded drive was on Earth, by the receiver that was recorded beside its scans.

use std::path::Path;
use std::time::Duration;

use rowscan_protocol::rig::Rig;
use rowscan_recording::{FixReader, StreamKind};
use rowscan_scenes::Scene;

use super::super::Failure;
use super::super::recorded_stream::read_beside;
use crate::export::map::{Lever, RowOnEarth, Station};

/// The scanner's way is kept at steps of this, metres.
const STEP_M: f64 = 0.01;

/// The antenna beside a scanner's mirror, metres.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Antenna {
    pub(super) ahead_m: f64,
    pub(super) right_m: f64,
}

/// A scene's antenna: ahead of the scanners, right of the tractor's middle, metres.
#[derive(Clone, Copy, Debug)]
pub(super) struct SceneAntenna {
    ahead_m: f64,
    right_m: f64,
}

impl SceneAntenna {
    pub(super) fn of(scene: &Scene) -> Self {
        Self { ahead_m: scene.gnss.antenna_forward_m, right_m: scene.gnss.antenna_right_m }
    }

    /// The same beside the mirror of a rig's scanner.
    pub(super) fn beside(self, rig: &Rig, scanner: usize) -> Antenna {
        let mount = rig.scanners.get(scanner);
        Antenna {
            ahead_m: self.ahead_m - mount.map_or(0.0, |mount| mount.offset_y_m),
            right_m: self.right_m - mount.and_then(|mount| rig.right_of_middle_m(mount)).unwrap_or(0.0),
        }
    }
}

/// So many numbers with commas between them, each within its ends.
pub(super) fn numbers<const N: usize>(
    text: &str,
    ends: [(f64, f64); N],
    wanted: &str,
) -> Result<[f64; N], String> {
    let wrong = || format!("expected {wanted}, found `{text}`");
    let found: Result<Vec<f64>, _> = text.split(',').map(|part| part.trim().parse::<f64>()).collect();
    let found: [f64; N] = found.map_err(|_| wrong())?.try_into().map_err(|_| wrong())?;
    let is_within = |(value, (low, high)): (&f64, (f64, f64))| (low..=high).contains(value);
    if found.iter().zip(ends).all(is_within) { Ok(found) } else { Err(wrong()) }
}

pub(super) fn antenna(text: &str) -> Result<Antenna, String> {
    let [ahead_m, right_m] =
        numbers(text, [(-20.0, 20.0); 2], "metres AHEAD,RIGHT such as 0.4,-0.2, at most 20 each")?;
    Ok(Antenna { ahead_m, right_m })
}

/// Where the row of the rig's scanner lies that drove this way, by the positions in its recording; the antenna is above the mirror unless told. Where there
/// are none that can be used, the message ends with the `remedy`.
pub(super) fn row_by_receiver(
    path: &Path,
    (rig, scanner): (&Rig, usize),
    way: &Way,
    antenna: Option<Antenna>,
    remedy: &str,
) -> Result<RowOnEarth, Failure> {
    let Some(mount) = rig.scanners.get(scanner) else {
        return Ok(RowOnEarth::told(Vec::new(), Lever::default()));
    };
    let (mut reader, mut pace) = (FixReader::default(), Pace::default());
    let mut stations = Vec::new();
    read_beside(path, StreamKind::Nmea, |at, packet| {
        reader.push(&packet.bytes);
        while let Some(gga) = reader.next_gga() {
            pace.told(at, gga.utc_s);
            let (latitude_deg, longitude_deg) = (gga.fix.latitude_deg, gga.fix.longitude_deg);
            let station = |y_m| Station { y_m, latitude_deg, longitude_deg, quality: gga.quality };
            // The way is the tractor's; a metre lies where the mirror looked at it.
            stations.extend(way.y_m(at).map(|y_m| station(y_m + mount.offset_y_m)));
        }
    })
    .map_err(|cause| Failure::Usage(format!("cannot read positions from {}: {cause}", path.display())))?;
    if let Some(times) = pace.too_fast() {
        return Err(Failure::Usage(format!(
            "{} was made at {times:.0} times the pace of its receiver's clock: when a position came says nothing of where the scanner was; record at {MOST_PACE:.0} times at \
             most (`--time-scale`), or {remedy}",
            path.display()
        )));
    }
    if stations.is_empty() {
        return Err(Failure::Usage(format!(
            "{} holds no position beside its scans (NMEA sentence GGA with a fix): record the receiver too, or {remedy}",
            path.display()
        )));
    }
    let antenna = antenna.unwrap_or_default();
    let lever = Lever {
        antenna_ahead_m: antenna.ahead_m,
        antenna_right_m: antenna.right_m,
        axis_right_m: mount.side() * mount.distance_m,
    };
    Ok(RowOnEarth::told(stations, lever))
}

/// A faster recording has its positions anywhere, times the receiver's own pace.
const MOST_PACE: f64 = 10.0;
/// Over less nothing is told of a pace, seconds.
const SHORTEST_S: f64 = 1.0;

/// How fast positions came, by the receiver's clock.
#[derive(Clone, Copy, Debug, Default)]
struct Pace {
    first: Option<(Duration, f64)>,
    last: Option<(Duration, f64)>,
}

impl Pace {
    fn told(&mut self, at: Duration, utc_s: Option<f64>) {
        let Some(utc_s) = utc_s else { return };
        self.first.get_or_insert((at, utc_s));
        self.last = Some((at, utc_s));
    }

    /// How many times faster, if that is too fast. Midnight is none.
    fn too_fast(&self) -> Option<f64> {
        let ((from, from_s), (to, to_s)) = (self.first?, self.last?);
        let (told_s, took_s) = (to_s - from_s, to.saturating_sub(from).as_secs_f64());
        let times = told_s / took_s.max(1e-6);
        (told_s >= SHORTEST_S && times > MOST_PACE).then_some(times)
    }
}

/// Where a scanner was, and when.
#[derive(Clone, Debug, Default)]
pub(super) struct Way {
    steps: Vec<(Duration, f64)>,
}

impl Way {
    /// The scanner was at `y_m` at this time since the recording's beginning.
    pub(super) fn push(&mut self, at: Duration, y_m: Option<f64>) {
        let Some(y_m) = y_m else { return };
        let is_step = self.steps.last().is_none_or(|(_, last_m)| (y_m - last_m).abs() >= STEP_M);
        if is_step {
            self.steps.push((at, y_m));
        }
    }

    /// Where it was then; `None` before the first scan and after the last.
    fn y_m(&self, at: Duration) -> Option<f64> {
        let next = self.steps.partition_point(|(time, _)| *time <= at);
        let (from, from_m) = *self.steps.get(next.checked_sub(1)?)?;
        let (to, to_m) = *self.steps.get(next)?;
        let share = (at - from).as_secs_f64() / (to - from).as_secs_f64();
        Some(from_m + share * (to_m - from_m))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_way_is_known_between_its_scans() {
        let mut way = Way::default();
        let ms = Duration::from_millis;
        for (at, y_m) in [(1000, Some(2.0)), (1020, Some(2.001)), (1040, None), (2000, Some(4.0))] {
            way.push(ms(at), y_m);
        }
        assert_eq!(way.steps.len(), 2);
        assert_eq!([999, 1000, 1500, 2000].map(|at| way.y_m(ms(at))), [None, Some(2.0), Some(3.0), None]);
    }

    #[test]
    fn a_recording_that_is_much_faster_than_its_receivers_clock_is_known() {
        let pace = |took_ms: u64, told_s: f64| {
            let mut pace = Pace::default();
            pace.told(Duration::from_millis(500), Some(86_000.0));
            pace.told(Duration::from_millis(600), None);
            pace.told(Duration::from_millis(500 + took_ms), Some(86_000.0 + told_s));
            pace.too_fast().map(f64::round)
        };
        assert_eq!(
            [pace(100, 12.0), pace(12_000, 12.0), pace(2_000, 12.0), pace(1, 0.5)],
            [Some(120.0), None, None, None]
        );
        assert_eq!(pace(12_000, 12.0 - 86_400.0), None, "over midnight");
    }

    #[test]
    fn an_antenna_is_two_numbers() {
        assert_eq!(antenna("-0.5,0.25"), Ok(Antenna { ahead_m: -0.5, right_m: 0.25 }));
        assert!(antenna("30,0").is_err());
    }
}
