//! GeoParquet 1.1: a Parquet file with a column of well-known binary. Without a `crs` it is OGC:CRS84, longitude before latitude.

use std::sync::Arc;

use parquet::basic::{Repetition, Type as Physical};
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType, Int32Type};
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::Type;
use serde_json::json;

use super::{ATTRIBUTES, LeafMap, wkb};
use crate::export::ExportError;

const GEOMETRY: &str = "geometry";

pub(super) fn write(map: &LeafMap) -> Result<Vec<u8>, ExportError> {
    let field = |name: &str, physical, repetition| {
        Type::primitive_type_builder(name, physical).with_repetition(repetition).build().map(Arc::new)
    };
    let mut fields = vec![
        field(GEOMETRY, Physical::BYTE_ARRAY, Repetition::REQUIRED)?,
        field("source", Physical::INT32, Repetition::REQUIRED)?,
    ];
    for name in ATTRIBUTES {
        fields.push(field(name, Physical::DOUBLE, Repetition::OPTIONAL)?);
    }
    let schema = Arc::new(Type::group_type_builder("leaf_area").with_fields(fields).build()?);
    let about = KeyValue::new("geo".to_owned(), about(map));
    let properties = WriterProperties::builder().set_key_value_metadata(Some(vec![about])).build();
    let mut file = SerializedFileWriter::new(Vec::new(), schema, Arc::new(properties))?;
    let mut group = file.next_row_group()?;
    let mut at = 0;
    while let Some(mut column) = group.next_column()? {
        match at {
            0 => {
                let shapes = map.metres.iter().map(|metre| ByteArray::from(wkb::polygon(&metre.corners)));
                let shapes: Vec<ByteArray> = shapes.collect();
                column.typed::<ByteArrayType>().write_batch(&shapes, None, None)?;
            }
            1 => {
                let sources = map.metres.iter().map(|metre| i32::try_from(metre.source));
                let sources = sources.collect::<Result<Vec<_>, _>>()?;
                column.typed::<Int32Type>().write_batch(&sources, None, None)?;
            }
            _ => {
                let values = || map.metres.iter().map(|metre| metre.values.get(at - 2).copied().flatten());
                let known: Vec<f64> = values().flatten().collect();
                let levels: Vec<i16> = values().map(|value| i16::from(value.is_some())).collect();
                column.typed::<DoubleType>().write_batch(&known, Some(&levels), None)?;
            }
        }
        column.close()?;
        at += 1;
    }
    group.close()?;
    Ok(file.into_inner()?)
}

/// What the key `geo` says of the file.
fn about(map: &LeafMap) -> String {
    let mut column = json!({ "encoding": "WKB", "geometry_types": ["Polygon"] });
    if let (Some(bounds), Some(column)) = (map.bounds(), column.as_object_mut()) {
        column.insert("bbox".to_owned(), json!(bounds));
    }
    json!({ "version": "1.1.0", "primary_column": GEOMETRY, "columns": { GEOMETRY: column } }).to_string()
}
