//! Where another pass lies along a row, by the positions that the receivers of both told.

use rowscan_vehicle::earth::metres_per_degree;

use super::along::{RowOnEarth, turned};

/// Points of an axis over less than this tell no direction, metres.
const SHORTEST_M: f64 = 2.0;
/// On a straight way the axis goes on a metre a metre of the count, but for slip and the receiver's noise. Where it turns, the axis lags behind.
const STRAIGHT: std::ops::RangeInclusive<f64> = 0.8..=1.25;

/// Another pass along the same row, in this pass's count.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Registered {
    /// Where the other pass's count begins, metres along the row.
    pub start_m: f64,
    /// It counts towards the row's start.
    pub back: bool,
    /// The axis that the other pass says it looked at lies so far to the right of this one's, metres: the same row, if both are right.
    pub right_m: f64,
}

/// Where the pass was by its own count, and the row's axis there in metres east and north of a common origin.
type AxisPlace = (f64, [f64; 2]);

/// A row's axis, by a pass.
struct Axis {
    points: Vec<AxisPlace>,
}

/// A mean, and how coordinates go with the count.
struct Line {
    y_m: f64,
    place: [f64; 2],
    slope: [f64; 2],
}

impl Axis {
    fn of(row: &RowOnEarth, [longitude_deg, latitude_deg]: [f64; 2]) -> Self {
        let (north_m, east_m) = metres_per_degree(latitude_deg);
        let place = |[longitude, latitude]: [f64; 2]| {
            [turned(longitude - longitude_deg) * east_m, (latitude - latitude_deg) * north_m]
        };
        let points = row.known().filter_map(|y_m| Some((y_m, place(row.at(y_m)?.lon_lat)))).collect();
        Self { points }
    }

    fn line(&self) -> Option<Line> {
        let ends = self.points.iter().map(|(y_m, _)| *y_m);
        let (low, high) =
            ends.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), y_m| (low.min(y_m), high.max(y_m)));
        if high - low < SHORTEST_M || !(high - low).is_finite() {
            return None;
        }
        let count = self.points.len() as f64;
        let mean = |of: &dyn Fn(&AxisPlace) -> f64| self.points.iter().map(of).sum::<f64>() / count;
        let (y_m, place) = (mean(&|(y, _)| *y), [mean(&|(_, at)| at[0]), mean(&|(_, at)| at[1])]);
        let spread = mean(&|(y, _)| (y - y_m).powi(2));
        let slope = [0, 1].map(|axis| mean(&|(y, at)| (y - y_m) * (at[axis] - place[axis])) / spread);
        STRAIGHT.contains(&slope[0].hypot(slope[1])).then_some(Line { y_m, place, slope })
    }
}

impl RowOnEarth {
    /// Where `other`, a pass along the same row, lies in this one's count; `None` where the positions of either tell no line.
    pub fn registered(&self, other: &Self) -> Option<Registered> {
        let origin = self.known().find_map(|y_m| self.at(y_m))?.lon_lat;
        let (here, there) = (Axis::of(self, origin).line()?, Axis::of(other, origin).line()?);
        let length = here.slope[0].hypot(here.slope[1]);
        let [east, north] = here.slope.map(|part| part / length);
        let between = [there.place[0] - here.place[0], there.place[1] - here.place[1]];
        let along_m = here.y_m + (between[0] * east + between[1] * north) / length;
        let back = there.slope[0] * east + there.slope[1] * north < 0.0;
        Some(Registered {
            start_m: if back { along_m + there.y_m } else { along_m - there.y_m },
            back,
            right_m: between[0] * north - between[1] * east,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::along::{Lever, Station};
    use super::*;

    const FROM: [f64; 2] = [0.84, 41.6];

    /// A pass whose axis begins `start_m` along a row that runs 30 degrees north of east, `right_m` beside it, one way or back.
    fn pass(start_m: f64, back: bool, right_m: f64) -> RowOnEarth {
        let (north_m, east_m) = metres_per_degree(FROM[1]);
        let (north, east) = 30_f64.to_radians().sin_cos();
        let sense = if back { -1.0 } else { 1.0 };
        // The axis is 2 m to the left of the mirror, seen along the drive: the mirror drives 2 m to its right.
        let mirror_right_m = right_m + sense * 2.0;
        let stations = (0..=40).map(|step| {
            let y_m = f64::from(step) * 0.5;
            let along_m = start_m + sense * y_m;
            let at = [along_m * east + mirror_right_m * north, along_m * north - mirror_right_m * east];
            Station {
                y_m,
                longitude_deg: FROM[0] + at[0] / east_m,
                latitude_deg: FROM[1] + at[1] / north_m,
                quality: 4,
            }
        });
        RowOnEarth::told(stations.collect(), Lever { axis_right_m: -2.0, ..Lever::default() })
    }

    #[test]
    fn a_pass_is_found_where_it_began_whichever_way_it_went() {
        let here = pass(0.0, false, 0.0);
        for (start_m, back, right_m) in
            [(0.0, false, 0.0), (3.25, false, 0.1), (-4.0, false, 0.0), (21.5, true, 0.0), (8.0, true, -3.5)]
        {
            let found = here.registered(&pass(start_m, back, right_m)).expect("two lines");
            assert!((found.start_m - start_m).abs() < 1e-3, "{start_m}: {found:?}");
            assert!((found.right_m - right_m).abs() < 1e-3, "{right_m}: {found:?}");
            assert_eq!(found.back, back);
        }
    }

    /// Up the row, round its end, and back along its other side.
    #[test]
    fn a_drive_that_turns_is_no_line() {
        let here = pass(0.0, false, 0.0);
        let RowOnEarth::Told { stations, lever } = here.clone() else { panic!("told") };
        let turned = stations.iter().rev().zip(&stations);
        let turned = turned.map(|(back, on)| Station { y_m: 20.0 + on.y_m, ..*back });
        let both = RowOnEarth::told(stations.iter().copied().chain(turned).collect(), lever);
        assert_eq!((here.registered(&both), both.registered(&here)), (None, None));
    }

    #[test]
    fn what_tells_no_line_tells_no_place() {
        let here = pass(0.0, false, 0.0);
        let RowOnEarth::Told { stations, lever } = here.clone() else { panic!("told") };
        for few in [vec![], stations[..2].to_vec()] {
            let few = RowOnEarth::told(few, lever);
            assert_eq!((here.registered(&few), few.registered(&here)), (None, None));
        }
    }
}
