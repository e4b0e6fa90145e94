//! Maps of leaf area, for geographic information systems.

use std::path::PathBuf;
use std::time::Duration;

use rowscan_driver::Source;
use rowscan_protocol::rig::Rig;
use rowscan_recording::{FixReader, StreamKind};
use rowscan_scenes::Scene;

use super::super::Failure;
use super::super::output::{self, name_of, say};
use super::super::recorded_stream::read_beside;
use crate::export::map::{LeafMap, Lever, MapFormat, RowOnEarth, Stated, Station};

/// The scanner's way is kept at steps of this, metres.
const STEP_M: f64 = 0.01;

#[derive(Clone, Debug, Default, clap::Args)]
#[command(next_help_heading = "Map")]
pub(super) struct MapArgs {
    /// Write leaf area and LAI by metre as a map: .gpkg, .tif, .geojson or .parquet; repeatable. Metres lie where the GNSS receiver in the recording was
    #[arg(long, value_name = "FILE", requires = "rig")]
    map: Vec<PathBuf>,
    /// Where the row's axis begins (Y = 0) and which way it runs, instead of a receiver: degrees north, east, and from north by east
    #[arg(long, value_name = "LAT,LON,AZIMUTH", value_parser = stated, allow_hyphen_values = true, requires = "map")]
    map_from: Option<Stated>,
    /// The GNSS antenna's place beside the scanner, metres ahead of it and to its right, instead of the scene's own [default: above the scanner]
    #[arg(long, value_name = "AHEAD,RIGHT", value_parser = antenna, allow_hyphen_values = true, requires = "map", conflicts_with = "map_from")]
    antenna: Option<Antenna>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Antenna {
    ahead_m: f64,
    right_m: f64,
}

/// So many numbers with commas between them, each within its ends.
fn numbers<const N: usize>(text: &str, ends: [(f64, f64); N], wanted: &str) -> Result<[f64; N], String> {
    let wrong = || format!("expected {wanted}, found `{text}`");
    let found: Result<Vec<f64>, _> = text.split(',').map(|part| part.trim().parse::<f64>()).collect();
    let found: [f64; N] = found.map_err(|_| wrong())?.try_into().map_err(|_| wrong())?;
    let is_within = |(value, (low, high)): (&f64, (f64, f64))| (low..=high).contains(value);
    if found.iter().zip(ends).all(is_within) { Ok(found) } else { Err(wrong()) }
}

fn stated(text: &str) -> Result<Stated, String> {
    let ends = [(-80.0, 80.0), (-180.0, 180.0), (-360.0, 360.0)];
    let wanted = "LATITUDE,LONGITUDE,AZIMUTH in degrees such as 41.6,0.84,15 (latitude -80 to 80)";
    let [latitude_deg, longitude_deg, azimuth_deg] = numbers(text, ends, wanted)?;
    Ok(Stated { latitude_deg, longitude_deg, azimuth_deg })
}

fn antenna(text: &str) -> Result<Antenna, String> {
    let [ahead_m, right_m] =
        numbers(text, [(-20.0, 20.0); 2], "metres AHEAD,RIGHT such as 0.4,-0.2, at most 20 each")?;
    Ok(Antenna { ahead_m, right_m })
}

/// The maps of an estimate.
pub(super) struct Maps {
    files: Vec<(PathBuf, MapFormat)>,
    stated: Option<Stated>,
    antenna: Option<Antenna>,
    /// The antenna of the rig's scene: ahead of the scanners, right of the tractor's middle.
    of_scene: Option<Antenna>,
}

impl MapArgs {
    /// True if none is asked for.
    pub(super) fn is_empty(&self) -> bool {
        self.map.is_empty()
    }

    /// Refuses, before anything is read, what no map can be made of.
    pub(super) fn check(&self, sources: &[Source], scene: Option<&Scene>) -> Result<Maps, Failure> {
        let mut files = Vec::new();
        for path in &self.map {
            let format = MapFormat::of(path).map_err(|cause| Failure::Usage(format!("--map: {cause}")))?;
            format.check()?;
            output::can_be_written(path)?;
            files.push((path.clone(), format));
        }
        let live = sources.iter().find(|source| !matches!(source, Source::Recording { .. }));
        if let Some(live) = live.filter(|_| !files.is_empty() && self.map_from.is_none()) {
            return Err(Failure::Usage(format!(
                "--map takes its places from a receiver in the recording, and {live} is live: `rowscan record` both first, or say where the row lies with --map-from LAT,LON,AZIMUTH"
            )));
        }
        let of_scene = scene.map(|scene| Antenna {
            ahead_m: scene.gnss.antenna_forward_m,
            right_m: scene.gnss.antenna_right_m,
        });
        Ok(Maps { files, stated: self.map_from, antenna: self.antenna, of_scene })
    }
}

impl Maps {
    /// True if none was asked for.
    pub(super) fn are_none(&self) -> bool {
        self.files.is_empty()
    }

    /// Where the row of the rig's scanner lies that drove this way.
    pub(super) fn row(
        &self,
        source: &Source,
        (rig, scanner): (&Rig, usize),
        way: &Way,
    ) -> Result<RowOnEarth, Failure> {
        if let Some(stated) = self.stated {
            return Ok(RowOnEarth::Stated(stated));
        }
        let Source::Recording { path, .. } = source else {
            return Ok(RowOnEarth::told(Vec::new(), Lever::default()));
        };
        let offset_m = rig.scanners.get(scanner).map_or(0.0, |mount| mount.offset_y_m);
        let (mut reader, mut pace) = (FixReader::default(), Pace::default());
        let mut stations = Vec::new();
        read_beside(path, StreamKind::Nmea, |at, packet| {
            reader.push(&packet.bytes);
            while let Some(gga) = reader.next_gga() {
                pace.told(at, gga.utc_s);
                let (latitude_deg, longitude_deg) = (gga.fix.latitude_deg, gga.fix.longitude_deg);
                let station = |y_m| Station { y_m, latitude_deg, longitude_deg, quality: gga.quality };
                // The way is the tractor's; a metre lies where the mirror looked at it.
                stations.extend(way.y_m(at).map(|y_m| station(y_m + offset_m)));
            }
        })
        .map_err(|cause| Failure::Usage(format!("cannot read positions from {}: {cause}", path.display())))?;
        if let Some(times) = pace.too_fast() {
            return Err(Failure::Usage(format!(
                "{} was made at {times:.0} times the pace of its receiver's clock: when a position came says nothing of where the scanner was; record at {MOST_PACE:.0} \
                 times at most (`--time-scale`), or say where the row lies with --map-from LAT,LON,AZIMUTH",
                path.display()
            )));
        }
        if stations.is_empty() {
            return Err(Failure::Usage(format!(
                "{} holds no position beside its scans (NMEA sentence GGA with a fix): record the receiver too, or say where the row lies with --map-from LAT,LON,AZIMUTH",
                path.display()
            )));
        }
        Ok(RowOnEarth::told(stations, self.lever(rig, scanner)))
    }

    fn lever(&self, rig: &Rig, scanner: usize) -> Lever {
        let Some(mount) = rig.scanners.get(scanner) else { return Lever::default() };
        let beside_scanner = self.of_scene.map(|antenna| Antenna {
            ahead_m: antenna.ahead_m - mount.offset_y_m,
            right_m: antenna.right_m - rig.right_of_middle_m(mount).unwrap_or(0.0),
        });
        let antenna = self.antenna.or(beside_scanner).unwrap_or(Antenna { ahead_m: 0.0, right_m: 0.0 });
        Lever {
            antenna_ahead_m: antenna.ahead_m,
            antenna_right_m: antenna.right_m,
            axis_right_m: mount.side() * mount.distance_m,
        }
    }

    /// Writes every map; none, and false, where no metre has a place or none was estimated.
    pub(super) fn write(&self, map: &LeafMap) -> Result<bool, Failure> {
        if map.metres.is_empty() {
            let why = match map.without_place {
                0 => "no metre of row was estimated; the warnings say why".to_owned(),
                metres => format!("the receiver told no position within 3 m of any of {metres} metres"),
            };
            say(format_args!("no map is written: {why}"));
            return Ok(false);
        }
        for (path, format) in &self.files {
            let failed = |cause| Failure::Write { what: name_of(path), cause: std::io::Error::other(cause) };
            let bytes = format.write(map).map_err(failed)?;
            output::write_file(path, &bytes)?;
            say(format_args!("{}: {} metres of row", name_of(path), map.metres.len()));
        }
        if map.without_place > 0 && !self.are_none() {
            say(format_args!(
                "{} metres are on no map: the receiver told no position within 3 m of them",
                map.without_place
            ));
        }
        Ok(true)
    }
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
    fn places_are_refused_with_what_was_expected() {
        assert_eq!(stated("41.6, 0.84,15").map(|row| row.azimuth_deg), Ok(15.0));
        for wrong in ["", "41.6,0.84", "90,0,0", "a,b,c", "41.6,0.84,15,1", "nan,0,0"] {
            assert!(stated(wrong).is_err_and(|why| why.contains("LATITUDE,LONGITUDE,AZIMUTH")), "{wrong}");
        }
        assert_eq!(antenna("-0.5,0.25"), Ok(Antenna { ahead_m: -0.5, right_m: 0.25 }));
        assert!(antenna("30,0").is_err());
    }
}
