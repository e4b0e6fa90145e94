//! One structured NumPy array (format 1.0): `numpy.load(file)["x_m"]`.

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
    let mut header = format!(
        "{{'descr': [{}], 'fortran_order': False, 'shape': ({},), }}",
        fields.join(", "),
        columns.rows()
    );
    // Magic, version and length take 10 bytes; the data begin at a multiple of 64.
    let len = (10 + header.len() + 1).next_multiple_of(64) - 10;
    header.push_str(&" ".repeat(len - 1 - header.len()));
    header.push('\n');
    let mut out = b"\x93NUMPY\x01\x00".to_vec();
    out.extend_from_slice(&u16::try_from(header.len()).unwrap_or(u16::MAX).to_le_bytes());
    out.extend_from_slice(header.as_bytes());
    (0..columns.rows()).for_each(|row| columns.write_row(row, &mut out));
    out
}
