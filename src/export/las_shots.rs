//! Shots as LAS 1.4: every echo is a point, and a miss is one, too, so that voxel programs know the free way. Each point has the place where its beam
//! began in extra bytes. LAS knows no miss; a miss is a point with the flag "withheld" [`MISS_M`] along its beam, which programs that know
//! nothing of shots leave out.

use las::point::Format;
use las::{Builder, Transform, Vector, Vlr};

use super::las::{Failure, Lasting};
use super::shot_columns::{Shot, ShotColumns};
use super::{ExportError, Out, Table, TableWriter};

/// How far along its beam a miss stands, metres.
const MISS_M: f64 = 100.0;

/// The extra bytes of a point: where its beam began.
const ORIGIN: [&str; 3] = ["origin_x", "origin_y", "origin_z"];

pub(super) struct Writer<W: Out> {
    out: las::Writer<Lasting<W>>,
    failure: Failure,
    columns: ShotColumns,
}

impl<W: Out> Writer<W> {
    pub(super) fn new(out: W, table: &Table) -> Result<Self, ExportError> {
        let mut builder = Builder::from((1, 4));
        builder.point_format = Format::new(6)?;
        builder.point_format.extra_bytes = 8 * ORIGIN.len() as u16;
        builder.vlrs.push(origin_record());
        builder.generating_software = format!("rowscan {}", env!("CARGO_PKG_VERSION"));
        let tenth = Transform { scale: 1e-4, offset: 0.0 };
        builder.transforms = Vector { x: tenth, y: tenth, z: tenth };
        let (out, failure) = Lasting::around(out);
        let out = las::Writer::new(out, builder.into_header()?)?;
        Ok(Self { out, failure, columns: ShotColumns::of(table)? })
    }

    fn put(
        &mut self,
        shot: &Shot,
        range_m: f64,
        (order, of): (u8, u8),
        is_miss: bool,
    ) -> Result<(), ExportError> {
        let [x, y, z] = shot.point(range_m);
        self.out.write_point(las::Point {
            x,
            y,
            z,
            return_number: order,
            number_of_returns: of,
            is_withheld: is_miss,
            gps_time: Some(shot.time_s),
            extra_bytes: shot.origin.iter().flat_map(|place| place.to_le_bytes()).collect(),
            ..las::Point::default()
        })?;
        self.failure.told()
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

    fn finish(mut self: Box<Self>) -> Result<W, ExportError> {
        self.out.close()?;
        self.failure.told()?;
        Ok(self.out.into_inner()?.into_inner())
    }
}

/// The record that names the extra bytes of every point: three 64-bit floats (LAS 1.4 R15, "Extra Bytes").
fn origin_record() -> Vlr {
    const LENGTH: usize = 192;
    const FLOAT_64: u8 = 10;
    let mut data = vec![0; LENGTH * ORIGIN.len()];
    for (record, name) in data.chunks_mut(LENGTH).zip(ORIGIN) {
        let mut put = |from: usize, bytes: &[u8]| {
            record.iter_mut().skip(from).zip(bytes).for_each(|(place, byte)| *place = *byte);
        };
        put(2, &[FLOAT_64]);
        put(4, name.as_bytes());
        put(160, b"where the beam began, metres");
    }
    Vlr { user_id: "LASF_Spec".to_owned(), record_id: 4, description: "Extra bytes".to_owned(), data }
}
