//! Text of shots as AMAPVox reads it: a header that it skips, then a line a shot with single spaces between its columns. Its reader
//! (`TxtShotReader.java` of umr-amap/AMAPVox) takes origin, direction, number of echoes, seven ranges, and from column 14 on seven classes.

use super::shot_columns::ShotColumns;
use super::{ExportError, Out, Table, TableWriter};

/// Columns for ranges, and for classes.
const MOST_ECHOES: usize = 7;
/// "Never classified", as in LAS.
const CLASS: u8 = 0;

pub(super) struct Writer<W> {
    out: W,
    columns: ShotColumns,
    line: String,
}

impl<W: Out> Writer<W> {
    pub(super) fn new(mut out: W, table: &Table) -> Result<Self, ExportError> {
        let columns = ShotColumns::of(table)?;
        if columns.most_echoes() > MOST_ECHOES {
            return Err(format!(
                "AMAPVox's text has room for {MOST_ECHOES} echoes a shot, the scans have {}",
                columns.most_echoes()
            )
            .into());
        }
        let names =
            |letter: char| (1..=MOST_ECHOES).map(|number| format!(" {letter}{number}")).collect::<String>();
        writeln!(
            out,
            "xOrigin yOrigin zOrigin xDirection yDirection zDirection nbEchoes{}{}",
            names('r'),
            names('c')
        )?;
        Ok(Self { out, columns, line: String::new() })
    }
}

impl<W: Out> TableWriter<W> for Writer<W> {
    fn row(&mut self, row: &[f64]) -> Result<(), ExportError> {
        use std::fmt::Write;
        let shot = self.columns.shot(row);
        self.line.clear();
        for number in shot.origin.iter().chain(&shot.direction) {
            write!(self.line, "{number:?} ")?;
        }
        write!(self.line, "{}", shot.ranges_m.len())?;
        for order in 0..MOST_ECHOES {
            match shot.ranges_m.get(order) {
                Some(range_m) => write!(self.line, " {range_m:?}")?,
                None => self.line.push_str(" NaN"),
            }
        }
        for _ in 0..MOST_ECHOES {
            write!(self.line, " {CLASS}")?;
        }
        self.line.push('\n');
        self.out.write_all(self.line.as_bytes())?;
        Ok(())
    }

    fn finish(mut self: Box<Self>) -> Result<W, ExportError> {
        self.out.flush()?;
        Ok(self.out)
    }
}
