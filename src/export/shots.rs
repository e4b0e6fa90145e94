//! The beams of scans as shots: origin, direction and echoes, for programs that trace each beam through voxels.

use rowscan_canopy::Placing;
use rowscan_protocol::scan::Scan;

use super::{Column, ExportError, Kind, RowError, Rows, Table};

/// Every beam of every scan, with an echo or without, but those of which it is not known (a dazzled receiver): origin (metres), unit direction, number of echoes, range of each echo (metres, NaN where there
/// was none), time on the device's clock (seconds), scan and beam from 0. Places are those of [`PointRows`](super::PointRows):
/// origin + range × direction is the point.
#[derive(Clone, Debug)]
pub struct ShotRows {
    placing: Placing,
    /// Echoes that a beam of the first scan can have.
    echoes: Option<usize>,
    scans: u64,
    row: Vec<f64>,
}

/// A scan with more echoes a beam than the table has columns for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "scan {number} has {found} echoes a beam, the first scan {expected}: a table of shots has the columns of its first scan; \
     `--what points` takes all"
)]
pub struct MoreEchoes {
    /// Which, from 0.
    pub number: u64,
    /// Its echoes.
    pub found: usize,
    /// Those of the first scan.
    pub expected: usize,
}

impl ShotRows {
    /// Shots placed so.
    pub fn new(placing: Placing) -> Self {
        Self { placing, echoes: None, scans: 0, row: Vec::new() }
    }
}

impl Rows for ShotRows {
    fn table(&self, first: &Scan) -> Table {
        let float = |name: &str| Column::new(name, Kind::F64);
        let whole = |name: &str| Column::new(name, Kind::U32);
        let mut columns =
            ["origin_x_m", "origin_y_m", "origin_z_m", "direction_x", "direction_y", "direction_z"]
                .map(float)
                .to_vec();
        columns.push(whole("echoes"));
        columns.extend((0..first.echoes.len()).map(|order| float(&format!("range_{order}_m"))));
        columns.extend([float("time_s"), whole("scan"), whole("beam")]);
        Table { columns, ..Table::default() }
    }

    fn push(
        &mut self,
        scan: &Scan,
        _: f64,
        put: &mut dyn FnMut(&[f64]) -> Result<(), ExportError>,
    ) -> Result<(), RowError> {
        let (expected, found) = (*self.echoes.get_or_insert(scan.echoes.len()), scan.echoes.len());
        if found > expected {
            return Err(MoreEchoes { number: self.scans, found, expected }.into());
        }
        let line = self.placing.line(scan);
        for beam in 0..scan.beams.len() {
            let mut ranges = scan.echoes.iter().map(|echo| echo.range_m.get(beam));
            // Neither a hit nor a miss: voxels on its way must not count as free.
            if scan.echoes.is_empty() || ranges.any(|range_m| range_m.is_none_or(|range_m| range_m.is_nan()))
            {
                continue;
            }
            let (origin, direction) = self.placing.shot(&line, beam);
            let range_m = |order: usize| {
                let range_m = scan.echoes.get(order).and_then(|echo| echo.range_m.get(beam)).copied();
                range_m.filter(|range_m| range_m.is_finite())
            };
            let count = (0..expected).filter_map(range_m).count();
            self.row.clear();
            self.row.extend(origin.into_iter().chain(direction));
            self.row.push(count as f64);
            self.row.extend((0..expected).map(|order| range_m(order).unwrap_or(f64::NAN)));
            self.row.extend([line.time_s, self.scans as f64, beam as f64]);
            put(&self.row)?;
        }
        self.scans += 1;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use rowscan_protocol::angle::BeamGrid;
    use rowscan_protocol::rig::{Mount, Rig};
    use rowscan_protocol::scan::{DAZZLED, Echo, NO_ECHO};

    use super::*;
    use crate::export::PointRows;

    fn scan() -> Scan {
        let echo = |range_m: [f64; 4]| Echo { range_m: range_m.to_vec(), ..Echo::default() };
        Scan {
            beams: BeamGrid::spanning(0, 150_000, 50_000),
            scan_frequency_hz: 50.0,
            echoes: vec![echo([1.5, NO_ECHO, DAZZLED, 2.0]), echo([NO_ECHO, NO_ECHO, DAZZLED, 3.0])],
            ..Scan::default()
        }
    }

    fn rows(mut of: impl Rows, scan: &Scan) -> Vec<Vec<f64>> {
        let mut rows = Vec::new();
        of.push(scan, 0.0, &mut |row| {
            rows.push(row.to_vec());
            Ok(())
        })
        .expect("rows");
        rows
    }

    fn placing(yaw_deg: f64) -> Placing {
        let mount = Mount { yaw_deg, ..Mount::default() };
        Placing::new(Some(Rig { scanners: vec![mount], ..Rig::default() }), 0, None)
    }

    /// The largest distance of a shot's echo from the point of the same beam and echo, metres.
    fn apart_m(shots: &[Vec<f64>], points: &[Vec<f64>]) -> f64 {
        let of = |point: &Vec<f64>| {
            let shot = shots.iter().find(|shot| shot[11] == point[7]).expect("a shot of every point");
            let range_m = shot[7 + point[8] as usize];
            (0..3)
                .map(|axis| (shot[axis] + range_m * shot[3 + axis] - point[axis]).powi(2))
                .sum::<f64>()
                .sqrt()
        };
        points.iter().map(of).fold(0.0, f64::max)
    }

    #[test]
    fn misses_are_rows_and_dazzled_beams_are_none() {
        let shots = rows(ShotRows::new(placing(0.0)), &scan());
        let counts: Vec<_> = shots.iter().map(|shot| (shot[11], shot[6])).collect();
        assert_eq!(counts, [(0.0, 1.0), (1.0, 0.0), (3.0, 2.0)]);
        assert_eq!(ShotRows::new(placing(0.0)).table(&scan()).columns.len(), shots[0].len());
    }

    #[test]
    fn an_echo_lies_where_its_point_does_and_not_without_the_mounts_rotation() {
        let points = rows(PointRows::new(placing(20.0)), &scan());
        assert_eq!(points.len(), 3);
        assert!(apart_m(&rows(ShotRows::new(placing(20.0)), &scan()), &points) < 1e-6);
        assert!(apart_m(&rows(ShotRows::new(placing(0.0)), &scan()), &points) > 0.1);
    }

    /// Models differ in their layers and in how they are mounted: an inclined layer is a cone, of which each beam has its own direction.
    #[test]
    fn an_echo_lies_where_its_point_does_for_every_layer_and_mount() {
        use rowscan_protocol::rig::{Orientation, Roof, RowSide};

        for layer_centideg in [-2200, -250, 0, 250, 4200] {
            for row in [RowSide::Right, RowSide::Left] {
                for orientation in [Orientation::Side, Orientation::Up] {
                    for roof in [Roof::Forward, Roof::Backward] {
                        let mount = Mount {
                            row,
                            orientation,
                            roof: Some(roof),
                            yaw_deg: 3.0,
                            pitch_deg: -7.0,
                            roll_deg: 11.0,
                            ..Mount::default()
                        };
                        let rig = Rig { scanners: vec![mount], row_spacing_m: Some(4.0), ..Rig::default() };
                        let placing = || Placing::new(Some(rig.clone()), 0, None);
                        let scan = Scan { layer_centideg, ..scan() };
                        let (shots, points) =
                            (rows(ShotRows::new(placing()), &scan), rows(PointRows::new(placing()), &scan));
                        let at = format!("{layer_centideg} {row:?} {orientation:?} {roof:?}");
                        assert!(apart_m(&shots, &points) < 1e-9, "{at}: {} m", apart_m(&shots, &points));
                        let length = |shot: &Vec<f64>| shot[3].hypot(shot[4]).hypot(shot[5]);
                        assert!(shots.iter().all(|shot| (length(shot) - 1.0).abs() < 1e-9), "{at}");
                    }
                }
            }
        }
    }

    #[test]
    fn a_scan_with_more_echoes_than_the_first_is_refused() {
        let mut shots = ShotRows::new(placing(0.0));
        let first = Scan { echoes: scan().echoes[..1].to_vec(), ..scan() };
        shots.push(&first, 0.0, &mut |_| Ok(())).expect("the first");
        let why = shots.push(&scan(), 0.0, &mut |_| Ok(())).expect_err("refused").to_string();
        assert!(why.contains("scan 1 has 2 echoes a beam, the first scan 1"), "{why}");
    }
}
