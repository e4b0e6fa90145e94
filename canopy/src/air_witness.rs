//! What the scans themselves say of the air: rain, snow, fog, dust and spray return beams before they reach the row.
//!
//! Close to the scanner nothing grows, for the tractor drives there. A leaf or a twig that hangs there all the same is wide, and neighbouring beams meet it, too;
//! drops and flakes are met by one beam alone, and fog and dust return each beam from another place. The spray of a nozzle that rides with the scanner is smooth,
//! and so is a part of the machine in its beams: such returns come in each line, wherever the tractor is, and those of a crown end with it.

use crate::across::NEAR_SCANNER_M;
use crate::beam_witness::compared_step;
use crate::geometry::{BeamTable, Frame, depth_m};

/// Farther from both of its neighbours, a return stands alone, metres.
const ALONE_M: f64 = 0.1;
/// Returns that stand alone, before anything is said.
const LEAST_ALONE: u64 = 100;
/// Share of the returns in the first zone that stand alone: rain and snow 0.85 to 0.99, fog and dust 0.40 to 0.49, and 0.00 to 0.03 of crowns of nine training
/// systems from 0.7 m on, 0.19 of 27 returns.
const WEATHER_ALONE: f64 = 0.35;
/// Share of all returns that the first zone has at least.
const WEATHER_SHARE: f64 = 0.005;
/// Share of all returns that weather makes in the second zone and from which on nothing is told. Rows of leaf area index 0.8 and 1.6, six models: with 0.03 (rain
/// of 10 mm/h) they read up to 5 % more than in clear air, with 0.06 (60 mm/h) 5 to 10 %, with 0.08 (dust of 0.05 g/m³) 30 %, with 0.12 (snow of 1 mm/h) 50 %.
const WEATHER_WITHHELD: f64 = 0.06;

/// Length of row along which each line has returns there where a nozzle sprays, metres; crowns end between trees.
const RIDES_M: f64 = 4.0;
/// Lines without a return there, or way without a line, that end such a stretch.
const APART_LINES: u64 = 4;
const APART_M: f64 = 0.5;
/// Share of all returns that lie there at least.
const RIDES_SHARE: f64 = 0.01;
/// Hedges and walls of fruit reach so far from their axis all along the row, metres.
const DEEPEST_HEDGE_M: f64 = 0.8;

/// Returns before the scanner, above low growth.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct AirWitness {
    /// All of them, to the middle between the rows.
    all: u64,
    /// Nearest to the scanner's way, and behind that as deep again.
    zones: [Zone; 2],
    /// Lines with a return in either zone that does not stand alone, one after the other.
    run: Run,
    longest_m: f64,
}

/// Lines one after the other.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Run {
    /// Where it began, metres along the row.
    from_m: Option<f64>,
    /// Where the latest line was.
    last_m: f64,
    /// How many without such a return came last.
    empty: u64,
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Zone {
    returns: u64,
    /// Those of them that stand alone.
    alone: u64,
}

/// What is in the air before the row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum InAir {
    /// Rain, snow, fog or dust.
    Weather {
        /// Share of the returns that it makes within [`NEAR_SCANNER_M`] of the scanner's way, and behind that as deep again.
        shares: [f64; 2],
        /// Whether leaf areas are withheld for it.
        withheld: bool,
    },
    /// Something that rides with the scanner.
    Rides {
        /// Share of the returns within [`BESIDE_SCANNER_M`] of the scanner's way.
        share: f64,
        /// Length of row along which each line has returns there, metres.
        length_m: f64,
    },
}

impl Run {
    /// Adds a line; how long it is now, metres, if that line has such a return.
    fn add(&mut self, y_m: f64, is_met: bool) -> Option<f64> {
        let is_far = (y_m - self.last_m).abs() > APART_M;
        self.last_m = y_m;
        self.empty = if is_met { 0 } else { self.empty + 1 };
        if is_far || self.empty >= APART_LINES {
            self.from_m = None;
        }
        is_met.then(|| (y_m - *self.from_m.get_or_insert(y_m)).abs())
    }
}

/// Where what rides with the scanner is looked for, metres from its way.
pub(crate) const BESIDE_SCANNER_M: f64 = 2.0 * NEAR_SCANNER_M;

impl AirWitness {
    /// Adds a line that was taken there by the way, metres.
    pub(crate) fn add(&mut self, frame: &Frame, table: &BeamTable, y_m: f64, range_m: &[f64]) {
        let stride = compared_step(table.grid(), 0.0);
        let depths = || range_m.iter().step_by(stride).map(|range_m| depth_m(*range_m));
        let (beams, after) = (table.beams().iter().step_by(stride).skip(1), depths().skip(2));
        let mut is_met = false;
        for (((beam, before_m), at_m), after_m) in beams.zip(depths()).zip(depths().skip(1)).zip(after) {
            let Some(x_m) = beam.as_ref().and_then(|beam| frame.crown_x_m(beam, at_m)) else { continue };
            self.all += 1;
            if let Some(zone) = self.zones.get_mut((x_m / NEAR_SCANNER_M) as usize) {
                let is_alone = (before_m - at_m).abs() > ALONE_M && (after_m - at_m).abs() > ALONE_M;
                zone.returns += 1;
                zone.alone += u64::from(is_alone);
                is_met |= !is_alone;
            }
        }
        if let Some(length_m) = self.run.add(y_m, is_met) {
            self.longest_m = self.longest_m.max(length_m);
        }
    }

    /// What is in the air before a row whose axis is so far from the scanner, metres.
    pub(crate) fn found(&self, distance_m: f64) -> Option<InAir> {
        let [near, behind] = self.zones;
        let of_all = |count: f64| count / self.all.max(1) as f64;
        let alone = near.alone as f64 / near.returns.max(1) as f64;
        let share = of_all(near.returns as f64);
        if near.alone >= LEAST_ALONE && alone >= WEATHER_ALONE && share >= WEATHER_SHARE {
            // Crowns may stand there, too.
            let behind = of_all(behind.alone as f64 / alone);
            return Some(InAir::Weather { shares: [share, behind], withheld: behind >= WEATHER_WITHHELD });
        }
        let share = of_all((near.returns + behind.returns) as f64);
        let length_m = self.longest_m;
        let rides = length_m >= RIDES_M && share >= RIDES_SHARE;
        let may_be_hedge = distance_m < DEEPEST_HEDGE_M + BESIDE_SCANNER_M;
        (rides && !may_be_hedge).then_some(InAir::Rides { share, length_m })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parameters::AreaForm;
    use rowscan_protocol::angle::BeamGrid;
    use rowscan_protocol::rig::{Mount, Rig};

    const GRID: BeamGrid = BeamGrid { start: 600_000, step: 5000, count: 121 };
    const DISTANCE_M: f64 = 2.0;

    /// A hundred lines, each beam as far as `range_m` says by line and beam.
    fn witness(range_m: impl Fn(usize, usize) -> f64) -> AirWitness {
        let mount = Mount { distance_m: DISTANCE_M, ..Mount::default() };
        let frame = Frame::new(&Rig::default(), &mount).expect("it is one");
        let mut table = BeamTable::default();
        table.update(GRID, &frame, AreaForm::Midpoint);
        let mut witness = AirWitness::default();
        for line in 0..100 {
            let ranges_m: Vec<f64> = (0..GRID.len()).map(|beam| range_m(line, beam)).collect();
            witness.add(&frame, &table, 0.05 * line as f64, &ranges_m);
        }
        witness
    }

    /// Whether this beam is one of `every` so many.
    fn one_of(every: usize, line: usize, beam: usize) -> bool {
        (line * 31 + beam * 7).is_multiple_of(every)
    }

    fn found(range_m: impl Fn(usize, usize) -> f64) -> Option<&'static str> {
        witness(range_m).found(DISTANCE_M).map(|found| match found {
            InAir::Weather { withheld: false, .. } => "drizzle",
            InAir::Weather { withheld: true, .. } => "snow",
            InAir::Rides { .. } => "rides",
        })
    }

    #[test]
    fn drops_before_the_scanner_are_weather_and_near_leaves_are_not() {
        assert_eq!(found(|_, _| 1.5), None);
        let drops = |every: usize, near_m: f64| {
            move |line: usize, beam: usize| if one_of(every, line, beam) { near_m } else { 1.5 }
        };
        assert_eq!(found(drops(20, 0.3)), Some("drizzle"));
        // As many where a crown may be, too.
        let snow = |line, beam| match (one_of(20, line, beam), one_of(11, line, beam)) {
            (true, _) => 0.3,
            (_, true) => 0.6,
            _ => 1.5,
        };
        assert_eq!(found(snow), Some("snow"));
        // A twig hangs before four beams.
        assert_eq!(found(|_, beam| if (40..44).contains(&beam) { 0.3 } else { 1.5 }), Some("rides"));
        // Of crowns it ends with each tree.
        let twigs = |line: usize, beam: usize| (40..44).contains(&beam) && line % 40 < 30;
        assert_eq!(found(|line, beam| if twigs(line, beam) { 0.3 } else { 1.5 }), None);
        assert_eq!(found(|_, _| f64::NAN), None);
        assert_eq!(found(|_, _| f64::INFINITY), None);
    }

    #[test]
    fn what_rides_with_the_scanner_is_in_each_line_and_a_hedge_may_be() {
        let cloud = witness(|_, beam| if (30..60).contains(&beam) { 0.6 } else { 2.0 });
        assert!(matches!(cloud.found(DISTANCE_M), Some(InAir::Rides { .. })));
        assert_eq!(cloud.found(1.2), None, "a hedge 0.6 m deep to its axis");
        // Two twigs, and scans that were lost between them.
        let mut run = Run::default();
        let ways = [0.0, 0.1, 5.0, 5.1].map(|y_m| run.add(y_m, true).expect("met"));
        assert!(ways.iter().all(|way_m| *way_m < 0.2), "{ways:?}");
    }
}
