//! Parquet: one row group, plain, uncompressed; every reader takes it.

use std::sync::Arc;

use parquet::basic::{LogicalType, Repetition, Type as Physical};
use parquet::data_type::{DoubleType, Int32Type};
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::Type;

use super::{Columns, ExportError, Values};

pub(super) fn encode(columns: &Columns) -> Result<Vec<u8>, ExportError> {
    let fields = columns.0.iter().map(|column| {
        let builder = match column.values {
            Values::F64(_) => Type::primitive_type_builder(&column.name, Physical::DOUBLE),
            Values::U32(_) => Type::primitive_type_builder(&column.name, Physical::INT32)
                .with_logical_type(Some(LogicalType::integer(32, false))),
        };
        builder.with_repetition(Repetition::REQUIRED).build().map(Arc::new)
    });
    let fields = fields.collect::<Result<Vec<_>, _>>()?;
    let schema = Arc::new(Type::group_type_builder("rowscan").with_fields(fields).build()?);
    let mut writer =
        SerializedFileWriter::new(Vec::new(), schema, Arc::new(WriterProperties::builder().build()))?;
    let mut group = writer.next_row_group()?;
    for column in &columns.0 {
        let Some(mut out) = group.next_column()? else { break };
        match &column.values {
            Values::F64(values) => {
                out.typed::<DoubleType>().write_batch(values, None, None)?;
            }
            Values::U32(values) => {
                // Parquet's unsigned numbers are the signed ones' bits.
                let bits: Vec<i32> = values.iter().map(|value| value.cast_signed()).collect();
                out.typed::<Int32Type>().write_batch(&bits, None, None)?;
            }
        }
        out.close()?;
    }
    group.close()?;
    Ok(writer.into_inner()?)
}
