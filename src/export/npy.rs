//! NumPy's array files, format 1.0. A table is one structured array: `numpy.load(file)["x_m"]`.

use super::{Columns, Values};

pub(super) fn encode(columns: &Columns) -> Vec<u8> {
    let mut fields: Vec<Field<'_>> = Vec::new();
    for column in &columns.0 {
        let kind = match column.values {
            Values::F64(_) => "<f8",
            Values::U32(_) => "<u4",
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
    let mut out = head(&format!("[{}]", fields.join(", ")), &format!("({},)", columns.rows()));
    (0..columns.rows()).for_each(|row| columns.write_row(row, &mut out));
    out
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

/// What stands before an array's bytes: its element type and its shape, as Python writes them.
pub(crate) fn head(descr: &str, shape: &str) -> Vec<u8> {
    /// Magic, version and length, before the dictionary; all together fill a multiple of [`ALIGNED`].
    const PREAMBLE: usize = 10;
    const ALIGNED: usize = 64;
    let mut dictionary = format!("{{'descr': {descr}, 'fortran_order': False, 'shape': {shape}, }}");
    let len = (PREAMBLE + dictionary.len() + 1).next_multiple_of(ALIGNED) - PREAMBLE;
    dictionary.push_str(&" ".repeat(len - 1 - dictionary.len()));
    dictionary.push('\n');
    let mut out = b"\x93NUMPY\x01\x00".to_vec();
    out.extend_from_slice(&u16::try_from(dictionary.len()).unwrap_or(u16::MAX).to_le_bytes());
    out.extend_from_slice(dictionary.as_bytes());
    out
}
