//! Shots as LAS 1.4: every echo is a point, and a miss is one, too, so that voxel programs know the free way. Each point has the place where its beam
//! began in extra bytes. LAS knows no miss; a miss is a point with the flag "withheld" [`MISS_M`] along its beam, which programs that know
//! nothing of shots leave out.

use super::las_file::{Extra, LasFile, Number};
use super::shot_columns::{Shot, ShotColumns};
use super::{ExportError, Out, Table, TableWriter};

/// How far along its beam a miss stands, metres.
const MISS_M: f64 = 100.0;

/// The extra bytes of a point: where its beam began.
const ORIGIN: [Extra; 3] = [origin(b"origin_x"), origin(b"origin_y"), origin(b"origin_z")];

const fn origin(name: &'static [u8]) -> Extra {
    Extra { name, number: Number::F64, about: b"where the beam began, metres" }
}

pub(super) struct Writer<W: Out> {
    out: LasFile<W>,
    columns: ShotColumns,
}

impl<W: Out> Writer<W> {
    pub(super) fn new(out: W, table: &Table) -> Result<Self, ExportError> {
        Ok(Self { columns: ShotColumns::of(table)?, out: LasFile::begin(out, &ORIGIN)? })
    }

    fn put(
        &mut self,
        shot: &Shot,
        range_m: f64,
        (order, of): (u8, u8),
        is_miss: bool,
    ) -> Result<(), ExportError> {
        let [x, y, z] = shot.point(range_m);
        self.out.put(las::Point {
            x,
            y,
            z,
            return_number: order,
            number_of_returns: of,
            is_withheld: is_miss,
            gps_time: Some(shot.time_s),
            extra_bytes: shot.origin.iter().flat_map(|place| place.to_le_bytes()).collect(),
            ..las::Point::default()
        })
    }
}

impl<W: Out> TableWriter<W> for Writer<W> {
    fn row(&mut self, row: &[f64]) -> Result<(), ExportError> {
        let shot = self.columns.shot(row);
        let count = u8::try_from(shot.ranges_m.len())?;
        if count == 0 {
            return self.put(&shot, MISS_M, (1, 1), true);
        }
        for (order, range_m) in (1..).zip(&shot.ranges_m) {
            self.put(&shot, *range_m, (order, count), false)?;
        }
        Ok(())
    }

    fn finish(self: Box<Self>) -> Result<W, ExportError> {
        self.out.finish()
    }
}
