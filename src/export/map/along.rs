//! Where a row lies on Earth: by the positions that a receiver told while the scanner drove past it, or by a point and a direction that the user knows.

use rowscan_vehicle::earth::metres_per_degree;

/// Positions so far before and behind a place say where it is and which way the tractor went, metres.
const REACH_M: f64 = 3.0;
/// Of so many positions at least: where they are sparse, of those next to the place.
const FEWEST: usize = 4;
/// The next position may be no farther away, metres: what lies farther is not known.
const FARTHEST_M: f64 = 10.0;
/// Positions over less than this tell no direction, metres.
const SHORTEST_M: f64 = 0.5;

/// A position that a receiver told, and where the scanner was along the row at that time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Station {
    /// Y of the scanner's mirror, metres.
    pub y_m: f64,
    /// Degrees, north positive.
    pub latitude_deg: f64,
    /// Degrees, east positive.
    pub longitude_deg: f64,
    /// How it was determined, as GGA has it.
    pub quality: u8,
}

/// Where the antenna is beside the scanner's mirror, and the row's axis.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Lever {
    /// The antenna ahead of the mirror, metres.
    pub antenna_ahead_m: f64,
    /// The antenna to the right of the mirror, metres.
    pub antenna_right_m: f64,
    /// The axis of the row to the right of the mirror, metres.
    pub axis_right_m: f64,
}

/// A row on Earth.
#[derive(Clone, Debug, PartialEq)]
pub enum RowOnEarth {
    /// By positions, and the antenna's place beside the scanner.
    Told {
        /// In the order of `y_m`.
        stations: Vec<Station>,
        /// Where the antenna is.
        lever: Lever,
    },
    /// By its beginning and its direction.
    Stated(Stated),
}

/// A straight row whose beginning and direction the user knows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stated {
    /// Latitude of the row's axis at Y = 0, degrees.
    pub latitude_deg: f64,
    /// Longitude of it, degrees.
    pub longitude_deg: f64,
    /// Which way the row runs, degrees from north by east.
    pub azimuth_deg: f64,
}

/// A point of a row's axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisPoint {
    /// Longitude and latitude, degrees.
    pub lon_lat: [f64; 2],
    /// Unit direction of the row, east and north.
    ahead: [f64; 2],
    /// The worst quality of the positions it is made of; none of a stated row.
    pub quality: Option<u8>,
}

impl AxisPoint {
    /// The point so many metres to the right of it, as the row runs.
    pub fn right(&self, metres: f64) -> [f64; 2] {
        let [east, north] = self.ahead;
        moved(self.lon_lat, [north * metres, -east * metres])
    }
}

impl RowOnEarth {
    /// By positions in any order.
    pub fn told(mut stations: Vec<Station>, lever: Lever) -> Self {
        stations.sort_by(|one, other| one.y_m.total_cmp(&other.y_m));
        Self::Told { stations, lever }
    }

    /// Places along the row that a receiver told of, metres; none of a stated row.
    pub(super) fn known(&self) -> impl Iterator<Item = f64> + '_ {
        let stations = match self {
            Self::Told { stations, .. } => stations.as_slice(),
            Self::Stated(_) => &[],
        };
        stations.iter().map(|station| station.y_m)
    }

    /// Where the row's axis is at `y_m`; `None` where no positions tell.
    pub fn at(&self, y_m: f64) -> Option<AxisPoint> {
        match self {
            Self::Told { stations, lever } => by_positions(stations, lever, y_m),
            Self::Stated(row) => {
                let (east, north) = row.azimuth_deg.to_radians().sin_cos();
                let lon_lat = moved([row.longitude_deg, row.latitude_deg], [east * y_m, north * y_m]);
                Some(AxisPoint { lon_lat, ahead: [east, north], quality: None })
            }
        }
    }
}

/// A straight line through the positions near `y_m`, by least squares: its point there, its direction, and beside it the axis.
fn by_positions(stations: &[Station], lever: &Lever, y_m: f64) -> Option<AxisPoint> {
    let near = near(stations, y_m)?;
    let first = near.first()?;
    let origin = [first.longitude_deg, first.latitude_deg];
    let (north_m, east_m) = metres_per_degree(first.latitude_deg);
    let places = near.iter().map(|station| {
        let east = turned(station.longitude_deg - first.longitude_deg) * east_m;
        (station.y_m, [east, (station.latitude_deg - first.latitude_deg) * north_m])
    });
    let count = near.len() as f64;
    let (mut mean_y, mut mean) = (0.0, [0.0; 2]);
    for (y, [east, north]) in places.clone() {
        mean_y += y / count;
        mean = [mean[0] + east / count, mean[1] + north / count];
    }
    let (mut yy, mut slope) = (0.0, [0.0; 2]);
    for (y, [east, north]) in places {
        let off = y - mean_y;
        yy += off * off;
        slope = [slope[0] + off * (east - mean[0]), slope[1] + off * (north - mean[1])];
    }
    let slope = slope.map(|slope| slope / yy);
    let length = slope[0].hypot(slope[1]);
    // Positions that stand still, or jump about, tell no direction.
    if !(length.is_finite() && length > 0.5 && length < 2.0) {
        return None;
    }
    let ahead = slope.map(|part| part / length);
    let antenna = [mean[0] + slope[0] * (y_m - mean_y), mean[1] + slope[1] * (y_m - mean_y)];
    let right_m = lever.axis_right_m - lever.antenna_right_m;
    let axis = [
        antenna[0] - ahead[0] * lever.antenna_ahead_m + ahead[1] * right_m,
        antenna[1] - ahead[1] * lever.antenna_ahead_m - ahead[0] * right_m,
    ];
    let quality = near.iter().map(|station| station.quality).max_by_key(|quality| rank(*quality));
    Some(AxisPoint { lon_lat: moved(origin, axis), ahead, quality })
}

/// The positions that tell where `y_m` is.
fn near(stations: &[Station], y_m: f64) -> Option<&[Station]> {
    let below = |y_m: f64| stations.partition_point(|station| station.y_m < y_m);
    let (mut from, mut to) = (below(y_m - REACH_M), below(y_m + REACH_M));
    let distance = |at: usize| stations.get(at).map_or(f64::INFINITY, |station| (station.y_m - y_m).abs());
    let spans = |from: usize, to: usize| {
        let (first, last) = (stations.get(from)?, stations.get(to.checked_sub(1)?)?);
        Some(last.y_m - first.y_m >= SHORTEST_M)
    };
    while to - from < FEWEST || spans(from, to) != Some(true) {
        let before = from.checked_sub(1).map_or(f64::INFINITY, distance);
        if before.min(distance(to)) > FARTHEST_M {
            return None;
        }
        if before < distance(to) { from -= 1 } else { to += 1 }
    }
    let near = stations.get(from..to)?;
    // At an end of the row positions lie on one side; a place that none is near to is not known.
    near.iter().any(|station| (station.y_m - y_m).abs() <= REACH_M).then_some(near)
}

/// The larger, the worse a position of this quality.
pub(super) fn rank(quality: u8) -> u8 {
    match quality {
        4 => 0,
        5 => 1,
        2 | 3 => 2,
        1 => 3,
        _ => 4,
    }
}

/// A point so many metres east and north of another, longitude first.
fn moved([longitude_deg, latitude_deg]: [f64; 2], [east, north]: [f64; 2]) -> [f64; 2] {
    let (north_m, east_m) = metres_per_degree(latitude_deg);
    [turned(longitude_deg + east / east_m), latitude_deg + north / north_m]
}

/// A longitude above −180 degrees, up to 180.
pub(super) fn turned(longitude_deg: f64) -> f64 {
    180.0 - (180.0 - longitude_deg).rem_euclid(360.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    const LATITUDE: f64 = 41.6;

    /// A drive east by 1 m steps from longitude `from`, positions a metre apart along `y_m`.
    fn east(from: f64, steps: i32) -> Vec<Station> {
        let east_m = metres_per_degree(LATITUDE).1;
        let station = |y: i32| Station {
            y_m: f64::from(y),
            latitude_deg: LATITUDE,
            longitude_deg: turned(from + f64::from(y) / east_m),
            quality: 4,
        };
        (0..steps).map(station).collect()
    }

    /// Metres east and north from the beginning.
    fn metres([longitude, latitude]: [f64; 2], from: f64) -> [f64; 2] {
        let (north_m, east_m) = metres_per_degree(LATITUDE);
        [turned(longitude - from) * east_m, (latitude - LATITUDE) * north_m]
    }

    #[test]
    fn the_axis_lies_where_the_antenna_the_lever_and_the_row_say() {
        let lever = Lever { antenna_ahead_m: 0.4, antenna_right_m: 0.3, axis_right_m: 2.0 };
        // Over the date line as anywhere.
        for from in [0.84, 179.9999] {
            let row = RowOnEarth::told(east(from, 40), lever);
            let point = row.at(17.5).expect("known");
            let [x, y] = metres(point.lon_lat, from);
            assert!((x - 17.1).abs() < 1e-6 && (y + 1.7).abs() < 1e-6, "{x} {y}");
            let [x, y] = metres(point.right(1.0), from);
            assert!((x - 17.1).abs() < 1e-6 && (y + 2.7).abs() < 1e-6, "{x} {y}");
            assert_eq!(point.quality, Some(4));
        }
    }

    #[test]
    fn what_no_position_is_near_to_is_not_known() {
        let known =
            |stations: Vec<Station>, y_m: f64| RowOnEarth::told(stations, Lever::default()).at(y_m).is_some();
        assert!(known(east(0.0, 40), -2.0) && !known(east(0.0, 40), -3.5) && !known(east(0.0, 40), 43.0));
        assert!(!known(Vec::new(), 0.0) && !known(east(0.0, 3), 1.0));
        // A gap of 8 m, in the middle of which none is near; sparse ones, by their neighbours.
        let gap = east(0.0, 40).into_iter().filter(|station| !(10.5..18.5).contains(&station.y_m)).collect();
        assert!(!known(gap, 14.5));
        let sparse: Vec<_> = east(0.0, 40).into_iter().step_by(5).collect();
        assert!(known(sparse, 12.0));
        // A tractor that stood all the time, and a scanner that did not know that it did.
        let stood: Vec<_> =
            east(0.0, 40).into_iter().map(|station| Station { y_m: 3.0, ..station }).collect();
        assert!(!known(stood, 3.0));
        let lost: Vec<_> = east(0.0, 40).into_iter().map(|s| Station { longitude_deg: 0.0, ..s }).collect();
        assert!(!known(lost, 20.0));
    }

    #[test]
    fn the_worst_position_counts() {
        let mut stations = east(0.0, 40);
        stations[10].quality = 1;
        let row = RowOnEarth::told(stations, Lever::default());
        let quality = |y_m: f64| row.at(y_m).and_then(|point| point.quality);
        assert_eq!((quality(11.0), quality(20.0)), (Some(1), Some(4)));
    }

    #[test]
    fn a_stated_row_runs_where_it_is_said_to() {
        let row =
            RowOnEarth::Stated(Stated { latitude_deg: LATITUDE, longitude_deg: 0.5, azimuth_deg: 90.0 });
        let point = row.at(10.0).expect("known");
        let [east, north] = metres(point.lon_lat, 0.5);
        assert!((east - 10.0).abs() < 1e-6 && north.abs() < 1e-6);
        let [_, north] = metres(point.right(2.0), 0.5);
        assert!((north + 2.0).abs() < 1e-6 && point.quality.is_none());
    }
}
