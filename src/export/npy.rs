//! NumPy's array files, format 1.0. A table is one structured array: `numpy.load(file)["x_m"]`.

use std::io::SeekFrom;

use super::{Column, ExportError, Kind, Out, Table, TableWriter, put_bytes};

pub(super) struct Writer<W: Out> {
    out: W,
    descr: String,
    kinds: Vec<Kind>,
    bytes: Vec<u8>,
    rows: u64,
}

impl<W: Out> Writer<W> {
    pub(super) fn new(mut out: W, table: &Table) -> Result<Self, ExportError> {
        let descr = descr(&table.columns);
        out.write_all(&head(&descr, &shape(0)))?;
        let kinds = table.columns.iter().map(|column| column.kind).collect();
        Ok(Self { out, descr, kinds, bytes: Vec::new(), rows: 0 })
    }
}

impl<W: Out> TableWriter<W> for Writer<W> {
    fn row(&mut self, row: &[f64]) -> Result<(), ExportError> {
        self.bytes.clear();
        self.kinds.iter().zip(row).for_each(|(kind, value)| put_bytes(*kind, *value, &mut self.bytes));
        self.out.write_all(&self.bytes)?;
        self.rows += 1;
        Ok(())
    }

    fn finish(mut self: Box<Self>) -> Result<W, ExportError> {
        self.out.seek(SeekFrom::Start(0))?;
        self.out.write_all(&head(&self.descr, &shape(self.rows)))?;
        self.out.flush()?;
        Ok(self.out)
    }
}

/// So many rows.
fn shape(rows: u64) -> String {
    format!("({rows},)")
}

fn descr(columns: &[Column]) -> String {
    let mut fields: Vec<Field<'_>> = Vec::new();
    for column in columns {
        let kind = match column.kind {
            Kind::F64 => "<f8",
            Kind::F32 => "<f4",
            Kind::U32 => "<u4",
            Kind::U8 | Kind::Class(_) => "u1",
            Kind::Label => "<i4",
        };
        let (name, number) = match column.name.rsplit_once('_') {
            Some((name, number)) => (name, number.parse::<usize>().ok()),
            None => (column.name.as_str(), None),
        };
        match (number, fields.last_mut()) {
            (Some(number), Some(last))
                if last.name == name && last.kind == kind && last.numbered == Some(number) =>
            {
                last.numbered = Some(number + 1);
            }
            (Some(0), _) => fields.push(Field { name, kind, numbered: Some(1) }),
            _ => fields.push(Field { name: &column.name, kind, numbered: None }),
        }
    }
    let fields: Vec<String> = fields.iter().map(Field::told).collect();
    format!("[{}]", fields.join(", "))
}

/// A field of the structured array. Columns that are numbered from 0 on are one field with as many values: NumPy refuses to read longer heads.
struct Field<'a> {
    name: &'a str,
    kind: &'static str,
    numbered: Option<usize>,
}

impl Field<'_> {
    fn told(&self) -> String {
        let Self { name, kind, numbered } = self;
        match numbered {
            Some(count) => format!("('{name}', '{kind}', ({count},))"),
            None => format!("('{name}', '{kind}')"),
        }
    }
}

/// What stands before an array's bytes: its element type and its shape, as Python writes them. It is as long for every shape, so that it
/// can be written again once the rows are counted.
pub(crate) fn head(descr: &str, shape: &str) -> Vec<u8> {
    /// Magic, version and length, before the dictionary; all together fill a multiple of [`ALIGNED`].
    const PREAMBLE: usize = 10;
    const ALIGNED: usize = 64;
    /// Two numbers of 64 bits, their brackets and commas.
    const LONGEST_SHAPE: usize = 2 * 20 + 4;
    let mut dictionary = format!("{{'descr': {descr}, 'fortran_order': False, 'shape': {shape}, }}");
    let longest = dictionary.len() + LONGEST_SHAPE.saturating_sub(shape.len());
    let len = (PREAMBLE + longest + 1).next_multiple_of(ALIGNED) - PREAMBLE;
    dictionary.push_str(&" ".repeat(len - 1 - dictionary.len()));
    dictionary.push('\n');
    let mut out = b"\x93NUMPY\x01\x00".to_vec();
    out.extend_from_slice(&u16::try_from(dictionary.len()).unwrap_or(u16::MAX).to_le_bytes());
    out.extend_from_slice(dictionary.as_bytes());
    out
}
