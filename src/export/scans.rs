//! Scans as a table: one scan a row, one beam a column. In CSV it is the self-describing form that every command reads again.

use rowscan_protocol::scan::{NO_ECHO, Scan};

use super::Columns;

/// All scans of one stream with one beam grid.
#[derive(Clone, Debug, Default)]
pub struct ScanTable {
    scans: Vec<Scan>,
    /// Host times, seconds since the recording began.
    times_s: Vec<f64>,
}

/// Scans that do not go into one table.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "scan {number} has {found} beams, the scans before it {expected}; export them apart (`--to csv --what points` takes all)"
)]
pub struct OtherBeams {
    /// Which, from 0.
    pub number: usize,
    /// Its beams.
    pub found: usize,
    /// Theirs.
    pub expected: usize,
}

impl ScanTable {
    /// Takes the next scan.
    pub fn push(&mut self, scan: &Scan, time_s: f64) -> Result<(), OtherBeams> {
        if let Some(first) = self.scans.first().filter(|first| first.beams != scan.beams) {
            let (found, expected) = (scan.beams.len(), first.beams.len());
            return Err(OtherBeams { number: self.scans.len(), found, expected });
        }
        self.scans.push(scan.clone());
        self.times_s.push(time_s);
        Ok(())
    }

    /// The scans.
    pub fn scans(&self) -> &[Scan] {
        &self.scans
    }

    /// One scan a row; millimetres, 0 where a beam met nothing.
    pub fn columns(&self) -> Columns {
        let counters = self.scans.iter().map(|scan| u32::from(scan.telegram_counter)).collect();
        let stamps = self.scans.iter().map(|scan| scan.scan_time_us).collect();
        let columns = Columns::default()
            .f64("time_s", self.times_s.clone())
            .u32("telegram_counter", counters)
            .u32("scan_time_us", stamps);
        let beams = self.scans.first().map_or(0, |scan| scan.beams.len());
        (0..beams).fold(columns, |columns, beam| {
            let range = |scan: &Scan| {
                let range_m = scan.echoes.first().and_then(|echo| echo.range_m.get(beam)).copied();
                range_m
                    .filter(|range_m| *range_m < NO_ECHO)
                    .map_or(0, |range_m| (range_m * 1000.0).round() as u32)
            };
            columns.u32(&format!("range_{beam}"), self.scans.iter().map(range).collect())
        })
    }

    /// The line that makes a CSV of [`Self::columns`] say what it is.
    pub fn title(&self) -> String {
        let Some(scan) = self.scans.first() else { return String::new() };
        format!(
            "# rowscan ranges 1; frequency_hz {}; start_deg {}; step_deg {}; unit mm; serial {}\n",
            scan.scan_frequency_hz,
            f64::from(scan.beams.start) / 10_000.0,
            f64::from(scan.beams.step) / 10_000.0,
            scan.serial_number
        )
    }
}
