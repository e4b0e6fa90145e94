//! Text with a header.

use super::{Columns, ExportError, Values};

pub(super) fn encode(columns: &Columns) -> Result<Vec<u8>, ExportError> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(columns.0.iter().map(|column| &column.name))?;
    for row in 0..columns.rows() {
        writer.write_record(columns.0.iter().map(|column| match &column.values {
            Values::F64(values) => values.get(row).map_or_else(String::new, |value| format!("{value:?}")),
            Values::U32(values) => values.get(row).map_or_else(String::new, u32::to_string),
        }))?;
    }
    Ok(writer.into_inner()?)
}
