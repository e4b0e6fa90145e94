//! Parquet: dictionaries where values repeat, packed by Snappy, which every reader has.

use std::sync::Arc;

use parquet::basic::{Compression, LogicalType, Repetition, Type as Physical};
use parquet::data_type::{DoubleType, FloatType, Int32Type};
use parquet::file::properties::{EnabledStatistics, WriterProperties};
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::Type;

use super::{Column, ExportError, Kind, Out, Table, TableWriter};

/// Numbers of a row group, which are held until it is full. Larger groups make the file's own index shorter, of which some hundred
/// bytes a group and column are held to the end: 2 MB an hour of scans with 541 beams.
const GROUP_BYTES: usize = 32 * 1024 * 1024;

pub(super) struct Writer<W: Out> {
    out: SerializedFileWriter<W>,
    columns: Vec<Numbers>,
    /// Rows held.
    held: usize,
    /// Rows of a full group.
    full: usize,
}

/// Numbers of one column. Parquet's unsigned numbers are the signed ones' bits.
enum Numbers {
    F64(Vec<f64>),
    F32(Vec<f32>),
    I32(Kind, Vec<i32>),
}

impl<W: Out> Writer<W> {
    pub(super) fn new(out: W, table: &Table) -> Result<Self, ExportError> {
        let fields = table.columns.iter().map(field).collect::<Result<Vec<_>, _>>()?;
        let schema = Arc::new(Type::group_type_builder("rowscan").with_fields(fields).build()?);
        // No index of pages: it would be held until the end. A dictionary is held as long as its group.
        let properties = WriterProperties::builder()
            .set_dictionary_enabled(true)
            .set_compression(Compression::SNAPPY)
            .set_statistics_enabled(EnabledStatistics::Chunk)
            .set_offset_index_disabled(true)
            .build();
        let columns: Vec<Numbers> = table.columns.iter().map(|column| Numbers::of(column.kind)).collect();
        let row_bytes: usize = columns.iter().map(Numbers::bytes).sum();
        Ok(Self {
            out: SerializedFileWriter::new(out, schema, Arc::new(properties))?,
            columns,
            held: 0,
            full: (GROUP_BYTES / row_bytes.max(1)).max(1),
        })
    }

    /// Writes the rows that are held as a group.
    fn flush(&mut self) -> Result<(), ExportError> {
        let mut group = self.out.next_row_group()?;
        for numbers in &mut self.columns {
            let Some(mut column) = group.next_column()? else { break };
            match numbers {
                Numbers::F64(values) => {
                    column.typed::<DoubleType>().write_batch(values, None, None)?;
                    values.clear();
                }
                Numbers::F32(values) => {
                    column.typed::<FloatType>().write_batch(values, None, None)?;
                    values.clear();
                }
                Numbers::I32(_, values) => {
                    column.typed::<Int32Type>().write_batch(values, None, None)?;
                    values.clear();
                }
            }
            column.close()?;
        }
        group.close()?;
        self.held = 0;
        Ok(())
    }
}

impl<W: Out> TableWriter<W> for Writer<W> {
    fn row(&mut self, row: &[f64]) -> Result<(), ExportError> {
        self.columns.iter_mut().zip(row).for_each(|(numbers, value)| numbers.push(*value));
        self.held += 1;
        if self.held >= self.full { self.flush() } else { Ok(()) }
    }

    fn finish(mut self: Box<Self>) -> Result<W, ExportError> {
        if self.held > 0 {
            self.flush()?;
        }
        Ok(self.out.into_inner()?)
    }
}

fn field(column: &Column) -> Result<Arc<Type>, ExportError> {
    let builder = |physical| Type::primitive_type_builder(&column.name, physical);
    let whole = |bits| builder(Physical::INT32).with_logical_type(Some(LogicalType::integer(bits, false)));
    let builder = match column.kind {
        Kind::F64 => builder(Physical::DOUBLE),
        Kind::F32 => builder(Physical::FLOAT),
        Kind::U32 => whole(32),
        Kind::U8 | Kind::Class(_) => whole(8),
        Kind::Label => builder(Physical::INT32),
    };
    Ok(Arc::new(builder.with_repetition(Repetition::REQUIRED).build()?))
}

impl Numbers {
    fn of(kind: Kind) -> Self {
        match kind {
            Kind::F64 => Self::F64(Vec::new()),
            Kind::F32 => Self::F32(Vec::new()),
            kind => Self::I32(kind, Vec::new()),
        }
    }

    fn bytes(&self) -> usize {
        match self {
            Self::F64(_) => 8,
            Self::F32(_) | Self::I32(..) => 4,
        }
    }

    fn push(&mut self, value: f64) {
        match self {
            Self::F64(values) => values.push(value),
            Self::F32(values) => values.push(value as f32),
            Self::I32(Kind::Label, values) => values.push(value as i32),
            Self::I32(_, values) => values.push((value as u32).cast_signed()),
        }
    }
}
