//! The beams of scans as shots: origin, direction and echoes, for programs that trace each beam through voxels.

use rowscan_canopy::Placing;
use rowscan_protocol::scan::Scan;

use super::{Column, ExportError, Kind, RowError, Rows, Table};

/// Every beam of every scan, with an echo or without: origin (metres), unit direction, number of echoes, range of each echo (metres, NaN for an echo
/// that was not measured), time on the device's clock (seconds), scan and beam from 0. Places are those of [`PointRows`](super::PointRows):
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
