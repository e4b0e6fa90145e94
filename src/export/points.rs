//! The returns of scans as points: in the scene where the rig is known, else in the scanner's own plane.

use rowscan_canopy::{PlacedLine, Placing};
use rowscan_protocol::scan::{Echo, Scan};

use super::{Column, ExportError, Kind, RowError, Rows, Table};

/// Every return of every scan: place, range, remission (NaN where the scan has none), which beam of which scan it was, and how many returns that beam has. `time_s` counts on the device's clock.
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
            ("echoes", Kind::U32),
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
        let echoes_of = |beam: usize| {
            let has = |echo: &&Echo| echo.range_m.get(beam).is_some_and(|range_m| range_m.is_finite());
            scan.echoes.iter().filter(has).count() as f64
        };
        for (order, echo) in scan.echoes.iter().enumerate() {
            for (beam, &range_m) in echo.range_m.iter().enumerate().filter(|(_, range_m)| range_m.is_finite())
            {
                let [x, y, z] = self.placing.place(&line, beam, range_m);
                let remission = echo.remission.get(beam).map_or(f64::NAN, |remission| f64::from(*remission));
                let (number, echoes) = (self.scans as f64, echoes_of(beam));
                let (beam, order) = (beam as f64, order as f64);
                put(&[x, y, z, range_m, remission, time_s, number, beam, order, layer_deg, echoes])?;
            }
        }
        self.scans += 1;
        Ok(())
    }
}
