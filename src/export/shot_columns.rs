//! Where a table of shots has its numbers, for formats that hold shots.

use super::{ExportError, Table};

/// Places of a shot's numbers in a row.
#[derive(Clone, Debug)]
pub(super) struct ShotColumns {
    origin: [usize; 3],
    direction: [usize; 3],
    /// Of the echoes, nearest first.
    ranges: Vec<usize>,
    time: Option<usize>,
}

/// A beam with what it met.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Shot {
    pub(super) origin: [f64; 3],
    /// Of length 1.
    pub(super) direction: [f64; 3],
    /// Empty of a miss.
    pub(super) ranges_m: Vec<f64>,
    pub(super) time_s: f64,
}

impl Shot {
    /// The point so far along the beam.
    #[cfg(feature = "tables")]
    pub(super) fn point(&self, range_m: f64) -> [f64; 3] {
        std::array::from_fn(|axis| self.origin[axis] + range_m * self.direction[axis])
    }
}

impl ShotColumns {
    /// True if a table is one of shots.
    #[cfg(feature = "tables")]
    pub(super) fn are_in(table: &Table) -> bool {
        Self::find(table, "origin_x_m").is_some()
    }

    /// Their places in a table of shots.
    pub(super) fn of(table: &Table) -> Result<Self, ExportError> {
        let need = |name: &str| {
            Self::find(table, name)
                .ok_or_else(|| format!("this format holds shots: expected a column `{name}`"))
        };
        let ranges = (0..).map_while(|order| Self::find(table, &format!("range_{order}_m"))).collect();
        Ok(Self {
            origin: [need("origin_x_m")?, need("origin_y_m")?, need("origin_z_m")?],
            direction: [need("direction_x")?, need("direction_y")?, need("direction_z")?],
            ranges,
            time: Self::find(table, "time_s"),
        })
    }

    /// The shot of a row.
    pub(super) fn shot(&self, row: &[f64]) -> Shot {
        let at = |column: &usize| row.get(*column).copied().unwrap_or(f64::NAN);
        Shot {
            origin: self.origin.each_ref().map(at),
            direction: self.direction.each_ref().map(at),
            ranges_m: self.ranges.iter().map(at).filter(|range_m| range_m.is_finite()).collect(),
            time_s: self.time.as_ref().map_or(0.0, at),
        }
    }

    /// Echoes that a shot can have.
    pub(super) fn most_echoes(&self) -> usize {
        self.ranges.len()
    }

    fn find(table: &Table, name: &str) -> Option<usize> {
        table.columns.iter().position(|column| column.name == name)
    }
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use super::super::{Column, Kind, TableFormat};
    use super::*;

    /// A table of shots with two echoes a beam: one with two, one with one, a miss.
    fn written(format: TableFormat) -> Vec<u8> {
        let float = |name: &&str| Column::new(*name, Kind::F64);
        let mut columns: Vec<Column> =
            ["origin_x_m", "origin_y_m", "origin_z_m", "direction_x", "direction_y", "direction_z"]
                .iter()
                .map(float)
                .collect();
        columns.push(Column::new("echoes", Kind::U32));
        columns.extend(["range_0_m", "range_1_m", "time_s"].iter().map(float));
        let table = Table { columns, ..Table::default() };
        let mut writer = format.begin(Cursor::new(Vec::new()), &table).expect("begun");
        let rows = [
            [1.0, 2.0, 3.0, 1.0, 0.0, 0.0, 2.0, 0.5, 1.25, 7.0],
            [1.0, 2.5, 3.0, 0.0, 1.0, 0.0, 1.0, 2.0, f64::NAN, 8.0],
            [1.0, 3.0, 3.0, 0.0, 0.6, 0.8, 0.0, f64::NAN, f64::NAN, 9.0],
        ];
        rows.iter().for_each(|row| writer.row(row).expect("written"));
        writer.finish().expect("finished").into_inner()
    }

    /// What the reader of AMAPVox does with a line: single spaces, seven ranges from column 7 on, classes from 14 on.
    #[test]
    fn amapvox_finds_its_columns() {
        let text = String::from_utf8(written(TableFormat::AmapVox)).expect("text");
        let lines: Vec<Vec<&str>> = text.lines().map(|line| line.split(' ').collect()).collect();
        assert_eq!(lines.len(), 4, "a header that is skipped, and three shots");
        assert!(lines.iter().all(|line| line.len() == 21), "{text}");
        let ranges = |line: &[&str]| -> Vec<f64> {
            let count: usize = line[6].parse().expect("a whole number");
            (0..count).map(|at| line[7 + at].parse().expect("a number")).collect()
        };
        let found: Vec<Vec<f64>> = lines[1..].iter().map(|line| ranges(line)).collect();
        assert_eq!(found, [vec![0.5, 1.25], vec![2.0], vec![]]);
        assert_eq!(lines[3][..6], ["1.0", "3.0", "3.0", "0.0", "0.6", "0.8"]);
        assert!(lines[1..].iter().all(|line| line[14..].iter().all(|class| class.parse::<i32>().is_ok())));
    }

    #[cfg(feature = "tables")]
    #[test]
    fn las_holds_misses_apart_from_echoes_and_where_each_beam_began() {
        let mut reader = las::Reader::new(Cursor::new(written(TableFormat::Las))).expect("LAS");
        let all = reader.read_all().expect("points");
        let points: Vec<las::Point> = all.points().map(|point| point.expect("a point")).collect();
        let about = |point: &las::Point| (point.return_number, point.number_of_returns, point.is_withheld);
        let found: Vec<_> = points.iter().map(about).collect();
        assert_eq!(found, [(1, 2, false), (2, 2, false), (1, 1, false), (1, 1, true)]);
        let origin = |point: &las::Point| -> Vec<f64> {
            point
                .extra_bytes
                .chunks(8)
                .map(|bytes| f64::from_le_bytes(bytes.try_into().expect("8 bytes")))
                .collect()
        };
        assert_eq!(origin(&points[1]), [1.0, 2.0, 3.0]);
        assert!((points[1].x - 2.25).abs() < 1e-4);
        // A miss lies on its beam.
        let miss = &points[3];
        assert_eq!(origin(miss), [1.0, 3.0, 3.0]);
        assert!((miss.y - 63.0).abs() < 1e-4 && (miss.z - 83.0).abs() < 1e-4, "{miss:?}");
    }

    #[test]
    fn more_echoes_than_amapvox_has_columns_for_are_refused() {
        let mut columns: Vec<Column> =
            ["origin_x_m", "origin_y_m", "origin_z_m", "direction_x", "direction_y", "direction_z"]
                .iter()
                .map(|name| Column::new(*name, Kind::F64))
                .collect();
        columns.extend((0..8).map(|order| Column::new(format!("range_{order}_m"), Kind::F64)));
        let table = Table { columns, ..Table::default() };
        let refused = TableFormat::AmapVox.begin(Cursor::new(Vec::new()), &table).err().expect("refused");
        assert!(refused.to_string().contains("room for 7 echoes"), "{refused}");
    }
}
