//! LAS 1.4, point format 6, tenths of a millimetre. GPS time holds `gps_time` or `time_s`, the intensity `remission`, extra bytes the
//! label `organ`.

use std::io::{self, Seek, SeekFrom, Write};
use std::sync::{Arc, Mutex, PoisonError};

use las::point::{Classification, Format};
use las::{Builder, Transform, Vector, Vlr};

use super::{ExportError, Out, Table, TableWriter};

pub(super) struct Writer<W: Out> {
    out: las::Writer<Lasting<W>>,
    failure: Failure,
    place: [usize; 3],
    time: Option<usize>,
    intensity: Option<usize>,
    order: Option<usize>,
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
        let mut builder = Builder::from((1, 4));
        builder.point_format = Format::new(6)?;
        if organ.is_some() {
            builder.point_format.extra_bytes = 4;
            builder.vlrs.push(organ_record());
        }
        builder.generating_software = format!("rowscan {}", env!("CARGO_PKG_VERSION"));
        let tenth = Transform { scale: 1e-4, offset: 0.0 };
        builder.transforms = Vector { x: tenth, y: tenth, z: tenth };
        let (out, failure) = Lasting::around(out);
        Ok(Self {
            out: las::Writer::new(out, builder.into_header()?)?,
            failure,
            place,
            time: find("gps_time").or_else(|| find("time_s")),
            intensity: find("remission"),
            order: find("return_number"),
            of: find("number_of_returns"),
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
        let organ = self.organ.map(|column| at(Some(column)).unwrap_or(-1.0) as i64 as u32);
        self.out.write_point(las::Point {
            x,
            y,
            z,
            return_number: at(self.order).unwrap_or(1.0) as u8,
            number_of_returns: at(self.of).unwrap_or(1.0) as u8,
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
        })?;
        self.failure.told()
    }

    fn finish(mut self: Box<Self>) -> Result<W, ExportError> {
        self.out.close()?;
        self.failure.told()?;
        Ok(self.out.into_inner()?.into_inner())
    }
}

/// The record that names the extra bytes of every point: one unsigned 32-bit number `organ` (LAS 1.4 R15, "Extra Bytes").
fn organ_record() -> Vlr {
    const UNSIGNED_32: u8 = 5;
    const HAS_NO_DATA: u8 = 1;
    let mut data = vec![0; 192];
    let mut put = |from: usize, bytes: &[u8]| {
        data.iter_mut().skip(from).zip(bytes).for_each(|(place, byte)| *place = *byte);
    };
    put(2, &[UNSIGNED_32, HAS_NO_DATA]);
    put(4, b"organ");
    put(40, &u64::from(u32::MAX).to_le_bytes());
    put(160, b"leaf or branch within its tree");
    Vlr { user_id: "LASF_Spec".to_owned(), record_id: 4, description: "Extra bytes".to_owned(), data }
}

/// The first thing that went wrong underneath.
#[derive(Clone, Debug, Default)]
pub(super) struct Failure(Arc<Mutex<Option<io::Error>>>);

impl Failure {
    /// It, once.
    pub(super) fn told(&self) -> Result<(), ExportError> {
        match self.0.lock().unwrap_or_else(PoisonError::into_inner).take() {
            Some(cause) => Err(cause.into()),
            None => Ok(()),
        }
    }
}

/// A file that is not written on after a failure, and says it is: `las::Writer` closes when dropped, and panics if that fails.
pub(super) struct Lasting<W> {
    out: W,
    failure: Failure,
}

impl<W> Lasting<W> {
    pub(super) fn around(out: W) -> (Self, Failure) {
        let failure = Failure::default();
        (Self { out, failure: failure.clone() }, failure)
    }

    pub(super) fn into_inner(self) -> W {
        self.out
    }

    fn keep<T>(&mut self, instead: T, act: impl FnOnce(&mut W) -> io::Result<T>) -> io::Result<T> {
        let mut failure = self.failure.0.lock().unwrap_or_else(PoisonError::into_inner);
        if failure.is_some() {
            return Ok(instead);
        }
        match act(&mut self.out) {
            Err(cause) if cause.kind() == io::ErrorKind::Interrupted => Err(cause),
            Err(cause) => {
                *failure = Some(cause);
                Ok(instead)
            }
            done => done,
        }
    }
}

impl<W: Write> Write for Lasting<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.keep(bytes.len(), |out| out.write(bytes))
    }

    fn flush(&mut self) -> io::Result<()> {
        self.keep((), W::flush)
    }
}

impl<W: Seek> Seek for Lasting<W> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.keep(0, |out| out.seek(to))
    }
}

#[cfg(test)]
mod tests {
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
}
