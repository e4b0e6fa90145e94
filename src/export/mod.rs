//! Scans and points as tables that other programs read.
//!
//! A table is columns of numbers; a format is one file that writes them. Rows are written as they come, so a table takes no more
//! memory than one row, or one row group of Parquet, however long it becomes.

mod amapvox;
#[cfg_attr(not(feature = "figures"), path = "no_converter.rs")]
mod converter;
mod csv;
mod figure;
mod figure_error;
mod known;
#[cfg(feature = "tables")]
mod las;
#[cfg(feature = "tables")]
mod las_file;
#[cfg(feature = "tables")]
mod las_shots;
pub mod map;
pub(crate) mod npy;
#[cfg(feature = "tables")]
mod parquet;
mod plate;
mod ply;
mod points;
mod raster;
mod scans;
mod shot_columns;
mod shots;

use std::io::{Seek, Write};

pub use figure::FigureFormat;
pub use figure_error::FigureError;
pub use known::UnknownBeam;
pub use plate::plate;
pub use points::PointRows;
pub use raster::SCALE;
pub use scans::{OtherBeams, OtherLayer, ScanRows};
pub use shots::{MoreEchoes, ShotRows};

use rowscan_protocol::scan::Scan;

use crate::feature::{Feature, MissingFeature};
#[cfg(feature = "tables")]
use shot_columns::ShotColumns;

/// How the numbers of a column are written. Every kind of them has its place in a 64-bit float, which is what rows are made of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    /// 64-bit floats.
    F64,
    /// 32-bit floats.
    F32,
    /// 32-bit whole numbers from 0 on.
    U32,
    /// 8-bit whole numbers.
    U8,
    /// The number of something, or -1: none. Empty in text.
    Label,
    /// One of these names; its place among them in binary formats.
    Class(&'static [&'static str]),
}

/// A named column.
#[derive(Clone, Debug, PartialEq)]
pub struct Column {
    /// Its name, with its unit.
    pub name: String,
    /// Its numbers.
    pub kind: Kind,
}

impl Column {
    /// A column.
    pub fn new(name: impl Into<String>, kind: Kind) -> Self {
        Self { name: name.into(), kind }
    }
}

/// What a table is, before its rows.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table {
    /// Its columns.
    pub columns: Vec<Column>,
    /// What stands before the header of a text.
    pub title: String,
    /// What its numbers mean, for formats with comments.
    pub note: &'static str,
}

/// Where a table is written to.
pub trait Out: Write + Seek + Send + Sync + 'static {}
impl<W: Write + Seek + Send + Sync + 'static> Out for W {}

/// A table being written.
pub trait TableWriter<W> {
    /// Writes a row: a number for every column.
    fn row(&mut self, row: &[f64]) -> Result<(), ExportError>;

    /// Writes what only the end tells, and gives the file back.
    fn finish(self: Box<Self>) -> Result<W, ExportError>;
}

/// How a table is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TableFormat {
    /// Text with a header.
    Csv,
    /// Binary PLY, a vertex a row.
    Ply,
    /// LAS 1.4, from the columns `x_m`, `y_m`, `z_m`, or from those of shots.
    Las,
    /// One structured NumPy array.
    Npy,
    /// Parquet, packed by Snappy.
    Parquet,
    /// Text of shots, as AMAPVox reads it.
    AmapVox,
}

/// Why a table could not be written in a format.
pub type ExportError = Box<dyn std::error::Error + Send + Sync>;

impl TableFormat {
    /// Refuses a format that this build cannot write.
    ///
    /// # Errors
    /// LAS and Parquet without the feature `tables`.
    pub fn check(self) -> Result<(), MissingFeature> {
        match self {
            Self::Csv | Self::Ply | Self::Npy | Self::AmapVox => Ok(()),
            Self::Las => Feature::Tables.needed_by("LAS"),
            Self::Parquet => Feature::Tables.needed_by("Parquet"),
        }
    }

    /// Begins a table.
    pub fn begin<W: Out>(self, out: W, table: &Table) -> Result<Box<dyn TableWriter<W>>, ExportError> {
        self.check()?;
        let binary: Box<dyn TableWriter<W>> = match self {
            // Text has a word for what is not known.
            Self::Csv => return Ok(Box::new(csv::Writer::new(out, table)?)),
            Self::Ply => Box::new(ply::Writer::new(out, table)?),
            Self::AmapVox => return Ok(Box::new(amapvox::Writer::new(out, table)?)),
            #[cfg(feature = "tables")]
            Self::Las if ShotColumns::are_in(table) => Box::new(las_shots::Writer::new(out, table)?),
            #[cfg(feature = "tables")]
            Self::Las => Box::new(las::Writer::new(out, table)?),
            Self::Npy => Box::new(npy::Writer::new(out, table)?),
            #[cfg(feature = "tables")]
            Self::Parquet => Box::new(parquet::Writer::new(out, table)?),
            #[cfg(not(feature = "tables"))]
            Self::Las | Self::Parquet => return Err(Feature::Tables.missing("LAS or Parquet").into()),
        };
        Ok(Box::new(known::Writer::new(binary, table)))
    }

    /// True if its head says how many rows follow, so that the file must be one that can be rewound.
    pub fn is_rewound(self) -> bool {
        matches!(self, Self::Ply | Self::Las | Self::Npy)
    }
}

/// What a scan becomes in a table.
pub trait Rows {
    /// The table, by its first scan.
    fn table(&self, first: &Scan) -> Table;

    /// The rows of the next scan, which came `received_s` after the recording began, NaN where that is not known; each is given to `put`.
    fn push(
        &mut self,
        scan: &Scan,
        received_s: f64,
        put: &mut dyn FnMut(&[f64]) -> Result<(), ExportError>,
    ) -> Result<(), RowError>;
}

/// Why a scan is not in a table.
#[derive(Debug, thiserror::Error)]
pub enum RowError {
    /// It does not fit.
    #[error(transparent)]
    OtherBeams(#[from] OtherBeams),
    /// Nor does this.
    #[error(transparent)]
    OtherLayer(#[from] OtherLayer),
    /// Nor does this.
    #[error(transparent)]
    MoreEchoes(#[from] MoreEchoes),
    /// The table cannot be written.
    #[error(transparent)]
    Write(#[from] ExportError),
}

/// Appends a number in little-endian bytes.
fn put_bytes(kind: Kind, value: f64, out: &mut Vec<u8>) {
    match kind {
        Kind::F64 => out.extend_from_slice(&value.to_le_bytes()),
        Kind::F32 => out.extend_from_slice(&(value as f32).to_le_bytes()),
        Kind::U32 => out.extend_from_slice(&(value as u32).to_le_bytes()),
        Kind::U8 | Kind::Class(_) => out.push(value as u8),
        Kind::Label => out.extend_from_slice(&(value as i32).to_le_bytes()),
    }
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use super::*;

    const CLASSES: &[&str] = &["ground", "leaf"];

    fn encoded(columns: &[(&str, Kind)], rows: &[&[f64]], format: TableFormat) -> Vec<u8> {
        let columns = columns.iter().map(|(name, kind)| Column::new(*name, *kind)).collect();
        let table = Table { columns, ..Table::default() };
        let mut writer = format.begin(Cursor::new(Vec::new()), &table).expect("begun");
        for row in rows {
            writer.row(row).expect("written");
        }
        writer.finish().expect("finished").into_inner()
    }

    const COLUMNS: [(&str, Kind); 7] = [
        ("x_m", Kind::F64),
        ("y_m", Kind::F64),
        ("z_m", Kind::F64),
        ("beam", Kind::U32),
        ("class", Kind::Class(CLASSES)),
        ("tree", Kind::Label),
        ("cos", Kind::F32),
    ];
    const ROWS: [&[f64]; 2] =
        [&[1.0, 0.0, 4.0, 7.0, 1.0, 3.0, 0.5], &[-2.5, 3.0, 5.0, 8.0, 0.0, -1.0, 0.1_f32 as f64]];

    fn sample(format: TableFormat) -> Vec<u8> {
        encoded(&COLUMNS, &ROWS, format)
    }

    #[test]
    fn text_holds_every_row() {
        let text = String::from_utf8(sample(TableFormat::Csv)).expect("text");
        assert_eq!(
            text,
            "x_m,y_m,z_m,beam,class,tree,cos\n1.0,0.0,4.0,7,leaf,3,0.5\n-2.5,3.0,5.0,8,ground,,0.1\n"
        );
    }

    #[test]
    fn numpy_gets_the_number_of_rows_at_the_end() {
        let npy = sample(TableFormat::Npy);
        assert!(npy.starts_with(b"\x93NUMPY\x01\x00"));
        let row = 3 * 8 + 4 + 1 + 4 + 4;
        assert_eq!((npy.len() - 2 * row) % 64, 0, "the header is padded to 64 bytes");
        let head = String::from_utf8_lossy(&npy);
        assert!(head.contains("('beam', '<u4'), ('class', 'u1'), ('tree', '<i4'), ('cos', '<f4')"));
        assert!(head.contains("'shape': (2,), }"));
        let beams: Vec<(String, Kind)> =
            ["range_0", "range_1", "range_7"].iter().map(|name| ((*name).to_owned(), Kind::U32)).collect();
        let beams: Vec<(&str, Kind)> = beams.iter().map(|(name, kind)| (name.as_str(), *kind)).collect();
        let npy = encoded(&beams, &[&[1.0, 2.0, 3.0]], TableFormat::Npy);
        assert!(String::from_utf8_lossy(&npy).contains("[('range', '<u4', (2,)), ('range_7', '<u4')]"));
        assert_eq!(npy[npy.len() - 12..], [1, 0, 0, 0, 2, 0, 0, 0, 3, 0, 0, 0]);
    }

    #[test]
    fn ply_gets_the_number_of_rows_at_the_end() {
        let ply = sample(TableFormat::Ply);
        let mut cursor = Cursor::new(&ply);
        let parsed = ply_rs_bw::parser::Parser::<ply_rs_bw::ply::DefaultElement>::new()
            .read_ply(&mut cursor)
            .expect("PLY");
        let vertices = &parsed.payload["vertex"];
        assert_eq!(vertices.len(), 2);
        use ply_rs_bw::ply::Property;
        assert_eq!(vertices[1]["x"], Property::Double(-2.5));
        assert_eq!(vertices[1]["tree"], Property::Int(-1));
        assert_eq!((&vertices[0]["class"], &vertices[0]["beam"]), (&Property::UChar(1), &Property::UInt(7)));
    }

    #[cfg(feature = "tables")]
    #[test]
    fn las_needs_places_and_parquet_begins_and_ends_as_one() {
        let bytes = sample(TableFormat::Las);
        let mut reader = ::las::Reader::new(Cursor::new(bytes)).expect("las");
        let all = reader.read_all().expect("points");
        let points: Vec<_> = all.points().map(|point| point.expect("a point")).collect();
        assert_eq!(points.len(), 2);
        assert!((points[1].x + 2.5).abs() < 1e-4 && (points[1].z - 5.0).abs() < 1e-4);
        let table = Table { columns: vec![Column::new("x_m", Kind::F64)], ..Table::default() };
        let refused = TableFormat::Las.begin(Cursor::new(Vec::new()), &table).err().expect("refused");
        assert!(refused.to_string().contains("expected a column `y_m`"));
        let bytes = sample(TableFormat::Parquet);
        assert!(bytes.starts_with(b"PAR1") && bytes.ends_with(b"PAR1"));
    }
}
