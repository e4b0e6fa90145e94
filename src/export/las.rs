//! LAS 1.4, point format 6, tenths of a millimetre. GPS time holds `gps_time` or `time_s`, the intensity `remission`, extra bytes the
//! label `organ`.

use las::point::Classification;

use super::las_file::{Extra, LasFile, Number};
use super::{ExportError, Out, Table, TableWriter};

/// The extra bytes of a point.
const ORGAN: [Extra; 1] =
    [Extra { name: b"organ", number: Number::U32OrNone, about: b"leaf or branch within its tree" }];

pub(super) struct Writer<W: Out> {
    out: LasFile<W>,
    place: [usize; 3],
    time: Option<usize>,
    intensity: Option<usize>,
    order: Option<usize>,
    /// The same from 0 on.
    echo: Option<usize>,
    of: Option<usize>,
    class: Option<usize>,
    angle: Option<usize>,
    source: Option<usize>,
    organ: Option<usize>,
}

impl<W: Out> Writer<W> {
    pub(super) fn new(out: W, table: &Table) -> Result<Self, ExportError> {
        let find = |name: &str| table.columns.iter().position(|column| column.name == name);
        let need =
            |name: &str| find(name).ok_or_else(|| format!("LAS holds points: expected a column `{name}`"));
        let place = [need("x_m")?, need("y_m")?, need("z_m")?];
        let organ = find("organ");
        Ok(Self {
            out: LasFile::begin(out, if organ.is_some() { &ORGAN } else { &[] })?,
            place,
            time: find("gps_time").or_else(|| find("time_s")),
            intensity: find("remission"),
            order: find("return_number"),
            echo: find("echo"),
            of: find("number_of_returns").or_else(|| find("echoes")),
            class: find("classification"),
            angle: find("scan_angle"),
            source: find("point_source_id"),
            organ,
        })
    }
}

impl<W: Out> TableWriter<W> for Writer<W> {
    fn row(&mut self, row: &[f64]) -> Result<(), ExportError> {
        let at = |column: Option<usize>| column.and_then(|column| row.get(column)).copied();
        let [x, y, z] = self.place.map(|column| at(Some(column)).unwrap_or_default());
        let order = at(self.order).or_else(|| at(self.echo).map(|echo| echo + 1.0)).unwrap_or(1.0);
        let organ = self.organ.map(|column| at(Some(column)).unwrap_or(-1.0) as i64 as u32);
        self.out.put(las::Point {
            x,
            y,
            z,
            return_number: order as u8,
            // A device may leave an earlier echo out.
            number_of_returns: at(self.of).unwrap_or(1.0).max(order) as u8,
            classification: match at(self.class) {
                Some(class) => Classification::new(class as u8)?,
                None => Classification::default(),
            },
            scan_angle: at(self.angle).unwrap_or_default() as f32,
            point_source_id: at(self.source).unwrap_or_default() as u16,
            intensity: at(self.intensity).unwrap_or_default() as u16,
            gps_time: Some(at(self.time).unwrap_or_default()),
            extra_bytes: organ.map_or_else(Vec::new, |organ| organ.to_le_bytes().to_vec()),
            ..las::Point::default()
        })
    }

    fn finish(self: Box<Self>) -> Result<W, ExportError> {
        self.out.finish()
    }
}

#[cfg(test)]
mod tests {
    use std::io::{self, Seek, SeekFrom, Write};

    use super::super::{Column, Kind, TableFormat};
    use super::*;

    /// A disk that takes no more than so many bytes.
    struct Full(io::Cursor<Vec<u8>>, usize);

    impl Write for Full {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            match self.0.get_ref().len() + bytes.len() <= self.1 {
                true => self.0.write(bytes),
                false => Err(io::ErrorKind::StorageFull.into()),
            }
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    impl Seek for Full {
        fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
            self.0.seek(to)
        }
    }

    #[test]
    fn a_full_disk_is_an_error_and_no_panic() {
        let columns = ["x_m", "y_m", "z_m"].map(|name| Column::new(name, Kind::F64)).to_vec();
        let table = Table { columns, ..Table::default() };
        let full = Full(io::Cursor::new(Vec::new()), 500);
        let mut writer = TableFormat::Las.begin(full, &table).expect("the header fits");
        let failed = (0..100).find_map(|_| writer.row(&[1.0, 2.0, 3.0]).err()).expect("it is full");
        let failed = failed.downcast::<io::Error>().expect("the system's word");
        assert_eq!(failed.kind(), io::ErrorKind::StorageFull);
    }

    /// An echo counts from 0, a return from 1; of a device that leaves an earlier echo out there are as many returns as the last one's number.
    #[test]
    fn echoes_are_returns() {
        let columns =
            ["x_m", "y_m", "z_m", "echo", "echoes"].map(|name| Column::new(name, Kind::F64)).to_vec();
        let table = Table { columns, ..Table::default() };
        let mut writer = TableFormat::Las.begin(io::Cursor::new(Vec::new()), &table).expect("a header");
        for [echo, echoes] in [[0.0, 2.0], [1.0, 2.0], [0.0, 1.0], [1.0, 1.0]] {
            writer.row(&[1.0, 2.0, 3.0, echo, echoes]).expect("written");
        }
        let file = writer.finish().expect("finished").into_inner();
        let mut reader = las::Reader::new(io::Cursor::new(file)).expect("LAS");
        let all = reader.read_all().expect("points");
        let found: Vec<(u8, u8)> = all
            .points()
            .map(|point| point.map(|point| (point.return_number, point.number_of_returns)).expect("a point"))
            .collect();
        assert_eq!(found, [(1, 2), (2, 2), (1, 1), (2, 2)]);
    }
}
