//! Whole numbers of binary formats cannot say that something is not known: such a row is refused.

use super::{ExportError, Kind, Out, Table, TableWriter};

/// A beam of which it is not known what it met, in a format of whole numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "of some beams it is not known what they met (a lost segment, a dazzled receiver), and whole numbers of this format cannot say so: \
     expected `--to csv`, where they are NaN, or `--what shots` or `--what points`, which leave them out"
)]
pub struct UnknownBeam;

/// Writes rows that are known.
pub(super) struct Writer<W> {
    writer: Box<dyn TableWriter<W>>,
    /// By column: it holds whole numbers.
    whole: Vec<bool>,
}

impl<W> Writer<W> {
    pub(super) fn new(writer: Box<dyn TableWriter<W>>, table: &Table) -> Self {
        let is_whole = |kind| matches!(kind, Kind::U32 | Kind::U8);
        Self { writer, whole: table.columns.iter().map(|column| is_whole(column.kind)).collect() }
    }
}

impl<W: Out> TableWriter<W> for Writer<W> {
    fn row(&mut self, row: &[f64]) -> Result<(), ExportError> {
        if self.whole.iter().zip(row).any(|(whole, value)| *whole && value.is_nan()) {
            return Err(UnknownBeam.into());
        }
        self.writer.row(row)
    }

    fn finish(self: Box<Self>) -> Result<W, ExportError> {
        self.writer.finish()
    }
}
