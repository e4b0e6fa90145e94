//! Scans and points of a recording as tables that other programs read.
//!
//! An export is columns of numbers; a format is one file that writes them.

mod csv;
mod las;
pub(crate) mod npy;
mod parquet;
mod ply;
mod points;
mod scans;

pub use points::{Placing, points};
pub use scans::ScanTable;

/// The numbers of one column.
#[derive(Clone, Debug, PartialEq)]
pub enum Values {
    /// 64-bit floats.
    F64(Vec<f64>),
    /// 32-bit whole numbers.
    U32(Vec<u32>),
}

/// A named column.
#[derive(Clone, Debug, PartialEq)]
pub struct Column {
    /// Its name, with its unit.
    pub name: String,
    /// Its numbers.
    pub values: Values,
}

/// Columns of equal length.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Columns(pub Vec<Column>);

impl Columns {
    /// Adds a column of floats.
    #[must_use]
    pub fn f64(mut self, name: &str, values: Vec<f64>) -> Self {
        self.0.push(Column { name: name.to_owned(), values: Values::F64(values) });
        self
    }

    /// Adds a column of whole numbers.
    #[must_use]
    pub fn u32(mut self, name: &str, values: Vec<u32>) -> Self {
        self.0.push(Column { name: name.to_owned(), values: Values::U32(values) });
        self
    }

    /// Rows.
    pub fn rows(&self) -> usize {
        self.0.first().map_or(0, |column| match &column.values {
            Values::F64(values) => values.len(),
            Values::U32(values) => values.len(),
        })
    }

    /// The floats of a column, if there is one of that name.
    fn floats(&self, name: &str) -> Option<&[f64]> {
        self.0.iter().find(|column| column.name == name).and_then(|column| match &column.values {
            Values::F64(values) => Some(values.as_slice()),
            Values::U32(_) => None,
        })
    }

    /// Appends row `row` in little-endian bytes.
    fn write_row(&self, row: usize, out: &mut Vec<u8>) {
        for column in &self.0 {
            match &column.values {
                Values::F64(values) => {
                    out.extend_from_slice(&values.get(row).copied().unwrap_or_default().to_le_bytes());
                }
                Values::U32(values) => {
                    out.extend_from_slice(&values.get(row).copied().unwrap_or_default().to_le_bytes());
                }
            }
        }
    }
}

/// How a table is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TableFormat {
    /// Text with a header.
    Csv,
    /// Binary PLY, a vertex a row.
    Ply,
    /// LAS 1.4, from the columns `x_m`, `y_m`, `z_m`.
    Las,
    /// One structured NumPy array.
    Npy,
    /// Parquet, uncompressed.
    Parquet,
}

/// Why a table could not be written in a format.
pub type ExportError = Box<dyn std::error::Error + Send + Sync>;

/// The table as the bytes of a file.
pub fn encode(columns: &Columns, format: TableFormat) -> Result<Vec<u8>, ExportError> {
    match format {
        TableFormat::Csv => csv::encode(columns),
        TableFormat::Ply => Ok(ply::encode(columns)),
        TableFormat::Las => las::encode(columns),
        TableFormat::Npy => Ok(npy::encode(columns)),
        TableFormat::Parquet => parquet::encode(columns),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    pub(super) fn sample() -> Columns {
        Columns::default()
            .f64("x_m", vec![1.0, -2.5])
            .f64("y_m", vec![0.0, 3.0])
            .f64("z_m", vec![4.0, 5.0])
            .u32("beam", vec![7, 8])
    }

    #[test]
    fn every_format_holds_every_row() {
        let text = String::from_utf8(encode(&sample(), TableFormat::Csv).expect("csv")).expect("text");
        assert_eq!(text, "x_m,y_m,z_m,beam\n1.0,0.0,4.0,7\n-2.5,3.0,5.0,8\n");

        let npy = encode(&sample(), TableFormat::Npy).expect("npy");
        assert!(npy.starts_with(b"\x93NUMPY\x01\x00"));
        assert_eq!(npy.len() % 64, 2 * 28, "the header is padded to 64 bytes");
        assert!(String::from_utf8_lossy(&npy).contains("('beam', '<u4')"));
        assert_eq!(npy[npy.len() - 4..], 8_u32.to_le_bytes());

        let beams =
            Columns::default().u32("range_0", vec![1]).u32("range_1", vec![2]).u32("range_7", vec![3]);
        let npy = encode(&beams, TableFormat::Npy).expect("npy");
        assert!(String::from_utf8_lossy(&npy).contains("[('range', '<u4', (2,)), ('range_7', '<u4')]"));
        assert_eq!(npy[npy.len() - 12..], [1, 0, 0, 0, 2, 0, 0, 0, 3, 0, 0, 0]);

        let ply = encode(&sample(), TableFormat::Ply).expect("ply");
        let header = String::from_utf8_lossy(&ply);
        assert!(
            header.starts_with("ply\nformat binary_little_endian 1.0\n")
                && header.contains("element vertex 2\n")
        );
        assert!(header.contains("property double x\n") && header.contains("property uint beam\n"));

        let bytes = encode(&sample(), TableFormat::Las).expect("las");
        let mut reader = ::las::Reader::new(std::io::Cursor::new(bytes)).expect("las");
        let all = reader.read_all().expect("points");
        let points: Vec<_> = all.points().map(|point| point.expect("a point")).collect();
        assert_eq!(points.len(), 2);
        assert!((points[1].x + 2.5).abs() < 1e-4 && (points[1].z - 5.0).abs() < 1e-4);

        let bytes = encode(&sample(), TableFormat::Parquet).expect("parquet");
        assert!(bytes.starts_with(b"PAR1") && bytes.ends_with(b"PAR1"));
    }
}
