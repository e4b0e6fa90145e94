//! Text with a header.

use super::{ExportError, Kind, Out, Table, TableWriter};

pub(super) struct Writer<W: Out> {
    out: csv::Writer<W>,
    kinds: Vec<Kind>,
    field: String,
}

impl<W: Out> Writer<W> {
    pub(super) fn new(mut out: W, table: &Table) -> Result<Self, ExportError> {
        out.write_all(table.title.as_bytes())?;
        let mut out = csv::Writer::from_writer(out);
        out.write_record(table.columns.iter().map(|column| &column.name))?;
        Ok(Self {
            out,
            kinds: table.columns.iter().map(|column| column.kind).collect(),
            field: String::new(),
        })
    }
}

impl<W: Out> TableWriter<W> for Writer<W> {
    fn row(&mut self, row: &[f64]) -> Result<(), ExportError> {
        for (kind, value) in self.kinds.iter().zip(row) {
            self.field.clear();
            tell(*kind, *value, &mut self.field)?;
            self.out.write_field(&self.field)?;
        }
        self.out.write_record(None::<&[u8]>)?;
        Ok(())
    }

    fn finish(self: Box<Self>) -> Result<W, ExportError> {
        self.out.into_inner().map_err(|error| error.into_error().into())
    }
}

fn tell(kind: Kind, value: f64, text: &mut String) -> std::fmt::Result {
    use std::fmt::Write;
    match kind {
        Kind::F64 => write!(text, "{value:?}"),
        Kind::F32 => write!(text, "{:?}", value as f32),
        Kind::U32 | Kind::U8 if value.is_nan() => write!(text, "NaN"),
        Kind::U32 | Kind::U8 => write!(text, "{}", value as u32),
        Kind::Label if value < 0.0 => Ok(()),
        Kind::Label => write!(text, "{}", value as u32),
        Kind::Class(names) => {
            text.push_str(names.get(value as usize).copied().unwrap_or_default());
            Ok(())
        }
    }
}
