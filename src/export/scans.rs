//! Scans as a table: one scan a row, one beam a column. In CSV it is the self-describing form that every command reads again.
//!
//! `received_s` is the host's clock, `scan_time_us` the device's 32 bits, which wrap after 71.6 minutes; `telegram_counter` numbers telegrams, of a
//! scanner that sends Compact its frames; `status` is the number of a [`DeviceStatus`](rowscan_protocol::validity::DeviceStatus).

use rowscan_protocol::angle::BeamGrid;
use rowscan_protocol::model::AnyModel;
use rowscan_protocol::scan::{DAZZLED, NO_ECHO, Scan, elevation_deg};

use super::{Column, ExportError, Kind, RowError, Rows, Table};

/// All scans of one stream with one beam grid; millimetres, 0 where a beam met nothing, NaN where that is not known (a lost segment, a dazzled receiver).
#[derive(Clone, Debug, Default)]
pub struct ScanRows {
    /// The model that the recording names.
    model: Option<AnyModel>,
    /// Grid and layer of the first scan.
    first: Option<(BeamGrid, i16)>,
    scans: u64,
    row: Vec<f64>,
}

/// Scans that do not go into one table.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "scan {number} has {found} beams, the scans before it {expected}, or other angles: one table takes one grid of beams; \
     `--what points` takes all"
)]
pub struct OtherBeams {
    /// Which, from 0.
    pub number: u64,
    /// Its beams.
    pub found: usize,
    /// Theirs.
    pub expected: usize,
}

/// A scan of another layer than those before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "scan {number} is of the layer {}°, the scans before it of {}°: one table takes one layer; `--what points` takes all, each in its place",
    elevation_deg(*found),
    elevation_deg(*expected)
)]
pub struct OtherLayer {
    /// Which, from 0.
    pub number: u64,
    /// Its layer, 1/100°.
    pub found: i16,
    /// Theirs.
    pub expected: i16,
}

impl ScanRows {
    /// Scans of this model, where the recording names it.
    pub fn new(model: Option<AnyModel>) -> Self {
        Self { model, ..Self::default() }
    }
}

impl Rows for ScanRows {
    fn table(&self, first: &Scan) -> Table {
        let mut columns = vec![
            Column::new("received_s", Kind::F64),
            Column::new("telegram_counter", Kind::U32),
            Column::new("scan_time_us", Kind::U32),
            Column::new("status", Kind::U32),
        ];
        columns.extend((0..first.beams.len()).map(|beam| Column::new(format!("range_{beam}"), Kind::U32)));
        Table { columns, title: title(first, self.model), note: "" }
    }

    fn push(
        &mut self,
        scan: &Scan,
        received_s: f64,
        put: &mut dyn FnMut(&[f64]) -> Result<(), ExportError>,
    ) -> Result<(), RowError> {
        let (beams, layer) = *self.first.get_or_insert((scan.beams, scan.layer_centideg));
        if layer != scan.layer_centideg {
            return Err(OtherLayer { number: self.scans, found: scan.layer_centideg, expected: layer }.into());
        }
        if beams != scan.beams {
            let (found, expected) = (scan.beams.len(), beams.len());
            return Err(OtherBeams { number: self.scans, found, expected }.into());
        }
        self.row.clear();
        let (counter, time_us) = (f64::from(scan.telegram_counter), f64::from(scan.scan_time_us));
        self.row.extend([received_s, counter, time_us, f64::from(scan.status.number())]);
        let ranges = scan.echoes.first().map_or(&[][..], |echo| &echo.range_m);
        self.row.extend((0..beams.len()).map(|beam| match ranges.get(beam).copied().unwrap_or(DAZZLED) {
            NO_ECHO => 0.0,
            range_m => (range_m * 1000.0).round(),
        }));
        put(&self.row)?;
        self.scans += 1;
        Ok(())
    }
}

/// The line that makes a CSV of scans say what it is.
fn title(scan: &Scan, model: Option<AnyModel>) -> String {
    let model = model.map_or_else(String::new, |model| format!("; model {}", model.name()));
    let serial = Some(scan.serial_number).filter(|serial| *serial != 0);
    let serial = serial.map_or_else(String::new, |serial| format!("; serial {serial}"));
    format!(
        "# rowscan ranges 1; frequency_hz {}; start_deg {}; step_deg {}; unit mm{serial}{model}\n",
        scan.scan_frequency_hz,
        f64::from(scan.beams.start) / 10_000.0,
        f64::from(scan.beams.step) / 10_000.0,
    )
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;
    use std::time::Duration;

    use rowscan_protocol::host::HostEvent;
    use rowscan_protocol::random::{Rng, Stream};
    use rowscan_protocol::scan::Echo;
    use rowscan_recording::{FrameReader, Recording, ScanReader, StreamKind};

    use super::*;
    use crate::export::TableFormat;

    /// Written as a table of `format`, or why not.
    fn written(range_m: &[f64], format: TableFormat) -> Result<Vec<u8>, ExportError> {
        let scan = Scan {
            beams: BeamGrid::spanning(0, 10_000, 5_000),
            scan_frequency_hz: 50.0,
            echoes: vec![Echo { range_m: range_m.to_vec(), ..Echo::default() }],
            ..Scan::default()
        };
        let mut rows = ScanRows::default();
        let mut writer = format.begin(Cursor::new(Vec::new()), &rows.table(&scan))?;
        let mut failed = Ok(());
        let pushed = rows.push(&scan, 0.0, &mut |row| writer.row(row));
        if let Err(RowError::Write(cause)) = pushed {
            failed = Err(cause);
        }
        failed?;
        Ok(writer.finish()?.into_inner())
    }

    /// A table of scans is read again as the scans that it was made of, to the millimetre.
    #[test]
    fn a_table_is_read_as_what_was_written() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("scans.csv");
        let mut random = Stream::keyed(1, &[7]);
        for _ in 0..50 {
            let mut range = || match random.next_u64() % 4 {
                0 => NO_ECHO,
                1 => DAZZLED,
                // Values below 16 are no ranges in a telegram.
                _ => (50.0 + random.unit() * 60_000.0).round() / 1000.0,
            };
            let sent = [range(), range(), range()];
            std::fs::write(&file, written(&sent, TableFormat::Csv).expect("text")).expect("kept");
            let mut frames = FrameReader::new(Recording::open(&file).expect("it opens"));
            let mut reader =
                ScanReader::new(StreamKind::Cola, rowscan_recording::MAX_PAYLOAD).expect("a scanner's");
            while let Some(frame) = frames.next_frame().expect("it reads") {
                reader.push_bytes(Duration::ZERO, &frame.bytes);
            }
            reader.finish();
            assert_eq!(reader.next_event(), Some(HostEvent::Scan), "{sent:?}");
            for (sent, found) in sent.iter().zip(&reader.scan().echoes[0].range_m) {
                assert!(
                    sent == found || sent.is_nan() && found.is_nan() || (sent - found).abs() < 1e-6,
                    "{sent} {found}"
                );
            }
        }
    }

    #[test]
    fn what_a_beam_met_is_a_range_or_nothing_or_not_known() {
        let text = String::from_utf8(written(&[1.5, NO_ECHO, DAZZLED], TableFormat::Csv).expect("text"))
            .expect("UTF-8");
        assert!(text.lines().last().is_some_and(|line| line.ends_with(",1500,0,NaN")), "{text}");
        assert!(written(&[1.5, NO_ECHO, 2.0], TableFormat::Npy).is_ok());
        let why = written(&[1.5, NO_ECHO, DAZZLED], TableFormat::Npy).expect_err("refused").to_string();
        assert!(why.contains("not known") && why.contains("--to csv"), "{why}");
    }
}
