//! A LAS 1.4 file of point format 6, tenths of a millimetre, with extra bytes: what points and shots have in common.

use std::io::{self, Seek, SeekFrom, Write};
use std::sync::{Arc, Mutex, PoisonError};

use las::point::Format;
use las::{Builder, Transform, Vector, Vlr};

use super::{ExportError, Out};

/// Extra bytes of every point: one number.
pub(super) struct Extra {
    pub(super) name: &'static [u8],
    pub(super) number: Number,
    pub(super) about: &'static [u8],
}

/// Types of extra bytes, by their numbers in LAS 1.4 R15.
#[derive(Clone, Copy)]
pub(super) enum Number {
    /// Unsigned, 32 bits; all ones are no number.
    U32OrNone = 5,
    /// A float of 64 bits.
    F64 = 10,
}

impl Number {
    fn bytes(self) -> u16 {
        match self {
            Self::U32OrNone => 4,
            Self::F64 => 8,
        }
    }
}

/// The file.
pub(super) struct LasFile<W: Out> {
    out: las::Writer<Lasting<W>>,
    failure: Failure,
}

impl<W: Out> LasFile<W> {
    pub(super) fn begin(out: W, extra: &[Extra]) -> Result<Self, ExportError> {
        let mut builder = Builder::from((1, 4));
        builder.point_format = Format::new(6)?;
        builder.point_format.extra_bytes = extra.iter().map(|extra| extra.number.bytes()).sum();
        builder.vlrs.extend((!extra.is_empty()).then(|| record(extra)));
        builder.generating_software = format!("rowscan {}", env!("CARGO_PKG_VERSION"));
        let tenth = Transform { scale: 1e-4, offset: 0.0 };
        builder.transforms = Vector { x: tenth, y: tenth, z: tenth };
        let failure = Failure::default();
        let out = Lasting { out, failure: failure.clone() };
        Ok(Self { out: las::Writer::new(out, builder.into_header()?)?, failure })
    }

    /// Writes a point.
    pub(super) fn put(&mut self, point: las::Point) -> Result<(), ExportError> {
        self.out.write_point(point)?;
        self.failure.check()
    }

    /// Writes what only the end tells, and gives the file back.
    pub(super) fn finish(mut self) -> Result<W, ExportError> {
        self.out.close()?;
        self.failure.check()?;
        Ok(self.out.into_inner()?.out)
    }
}

/// The record that names the extra bytes of every point (LAS 1.4 R15, "Extra Bytes").
fn record(extra: &[Extra]) -> Vlr {
    const LENGTH: usize = 192;
    const HAS_NO_DATA: u8 = 1;
    let mut data = vec![0; LENGTH * extra.len()];
    for (record, Extra { name, number, about }) in data.chunks_mut(LENGTH).zip(extra) {
        let mut put = |from: usize, bytes: &[u8]| {
            record.iter_mut().skip(from).zip(bytes).for_each(|(place, byte)| *place = *byte);
        };
        put(2, &[*number as u8]);
        put(4, name);
        if let Number::U32OrNone = number {
            put(3, &[HAS_NO_DATA]);
            put(40, &u64::from(u32::MAX).to_le_bytes());
        }
        put(160, about);
    }
    Vlr { user_id: "LASF_Spec".to_owned(), record_id: 4, description: "Extra bytes".to_owned(), data }
}

/// The first thing that went wrong underneath.
#[derive(Clone, Debug, Default)]
struct Failure(Arc<Mutex<Option<io::Error>>>);

impl Failure {
    /// An error after the first write that failed, once.
    fn check(&self) -> Result<(), ExportError> {
        match self.0.lock().unwrap_or_else(PoisonError::into_inner).take() {
            Some(cause) => Err(cause.into()),
            None => Ok(()),
        }
    }
}

/// A file that is not written on after a failure, and says it is: `las::Writer` closes when dropped, and panics if that fails.
struct Lasting<W> {
    out: W,
    failure: Failure,
}

impl<W> Lasting<W> {
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
