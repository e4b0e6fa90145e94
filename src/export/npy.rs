//! NumPy's array files, format 1.0. A table is one structured array: `numpy.load(file)["x_m"]`.

use super::{Columns, Values};

pub(super) fn encode(columns: &Columns) -> Vec<u8> {
    let fields: Vec<String> = columns
        .0
        .iter()
        .map(|column| {
            let kind = match column.values {
                Values::F64(_) => "<f8",
                Values::U32(_) => "<u4",
            };
            format!("('{}', '{kind}')", column.name)
        })
        .collect();
    let mut out = head(&format!("[{}]", fields.join(", ")), &format!("({},)", columns.rows()));
    (0..columns.rows()).for_each(|row| columns.write_row(row, &mut out));
    out
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
