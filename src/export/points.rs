//! The returns of scans as points: in the scene where the rig is known, else in the scanner's own plane.

use rowscan_canopy::{PlacedLine, Placing};
use rowscan_protocol::scan::Scan;

use super::{Column, ExportError, Kind, RowError, Rows, Table};

/// Every return of every scan: place, range, remission (NaN where the scan has none), and which beam of which scan it was. `time_s` counts on the device's clock.
#[derive(Clone, Debug)]
pub struct PointRows {
    placing: Placing,
    scans: u64,
}

impl PointRows {
    /// Points placed so.
    pub fn new(placing: Placing) -> Self {
        Self { placing, scans: 0 }
    }
}

impl Rows for PointRows {
    fn table(&self, _: &Scan) -> Table {
        let column = |(name, kind): (&str, Kind)| Column::new(name, kind);
        let columns = [
            ("x_m", Kind::F64),
            ("y_m", Kind::F64),
            ("z_m", Kind::F64),
            ("range_m", Kind::F64),
            ("remission", Kind::F64),
            ("time_s", Kind::F64),
            ("scan", Kind::U32),
            ("beam", Kind::U32),
            ("echo", Kind::U32),
            ("layer_deg", Kind::F64),
        ];
        Table { columns: columns.map(column).to_vec(), ..Table::default() }
    }

    fn push(
        &mut self,
        scan: &Scan,
        _: f64,
        put: &mut dyn FnMut(&[f64]) -> Result<(), ExportError>,
    ) -> Result<(), RowError> {
        let line = self.placing.line(scan);
        let PlacedLine { time_s, layer_deg, .. } = line;
        for (order, echo) in scan.echoes.iter().enumerate() {
            for (beam, &range_m) in echo.range_m.iter().enumerate().filter(|(_, range_m)| range_m.is_finite())
            {
                let [x, y, z] = self.placing.place(&line, beam, range_m);
                let remission = echo.remission.get(beam).map_or(f64::NAN, |remission| f64::from(*remission));
                let number = self.scans as f64;
                put(&[x, y, z, range_m, remission, time_s, number, beam as f64, order as f64, layer_deg])?;
            }
        }
        self.scans += 1;
        Ok(())
    }
}
