//! Binary PLY: a vertex a row, a property a column. Viewers want `x`, `y`, `z` without a unit.

use std::io::SeekFrom;

use super::{ExportError, Kind, Out, Table, TableWriter, put_bytes};

pub(super) struct Writer<W: Out> {
    out: W,
    table: Table,
    bytes: Vec<u8>,
    rows: u64,
}

impl<W: Out> Writer<W> {
    pub(super) fn new(mut out: W, table: &Table) -> Result<Self, ExportError> {
        out.write_all(head(table, 0).as_bytes())?;
        Ok(Self { out, table: table.clone(), bytes: Vec::new(), rows: 0 })
    }
}

impl<W: Out> TableWriter<W> for Writer<W> {
    fn row(&mut self, row: &[f64]) -> Result<(), ExportError> {
        self.bytes.clear();
        for (column, value) in self.table.columns.iter().zip(row) {
            put_bytes(column.kind, *value, &mut self.bytes);
        }
        self.out.write_all(&self.bytes)?;
        self.rows += 1;
        Ok(())
    }

    fn finish(mut self: Box<Self>) -> Result<W, ExportError> {
        self.out.seek(SeekFrom::Start(0))?;
        self.out.write_all(head(&self.table, self.rows).as_bytes())?;
        self.out.flush()?;
        Ok(self.out)
    }
}

/// Always as long, because it is written again once the rows are counted: the comment makes room for the number.
fn head(table: &Table, rows: u64) -> String {
    /// Digits of the largest number.
    const DIGITS: usize = 20;
    let rows = rows.to_string();
    let room = " ".repeat(DIGITS - rows.len());
    let mut header = format!(
        "ply\nformat binary_little_endian 1.0\ncomment rowscan {}; metres{}{room}\nelement vertex {rows}\n",
        env!("CARGO_PKG_VERSION"),
        table.note,
    );
    for column in &table.columns {
        let kind = match column.kind {
            Kind::F64 => "double",
            Kind::F32 => "float",
            Kind::U32 => "uint",
            Kind::U8 | Kind::Class(_) => "uchar",
            Kind::Label => "int",
        };
        let name = match column.name.as_str() {
            "x_m" => "x",
            "y_m" => "y",
            "z_m" => "z",
            other => other,
        };
        header.push_str(&format!("property {kind} {name}\n"));
    }
    header.push_str("end_header\n");
    header
}
