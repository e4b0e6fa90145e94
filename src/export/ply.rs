//! Binary PLY: a vertex a row, a property a column. Viewers want `x`, `y`, `z` without a unit.

use super::{Columns, Values};

pub(super) fn encode(columns: &Columns) -> Vec<u8> {
    let mut header = format!(
        "ply\nformat binary_little_endian 1.0\ncomment rowscan {}; metres\nelement vertex {}\n",
        env!("CARGO_PKG_VERSION"),
        columns.rows()
    );
    for column in &columns.0 {
        let kind = match column.values {
            Values::F64(_) => "double",
            Values::U32(_) => "uint",
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
    let mut out = header.into_bytes();
    (0..columns.rows()).for_each(|row| columns.write_row(row, &mut out));
    out
}
