//! A pool from bytes that anybody may have sent.

use super::{
    Device, ElementKind, Kind, LONGEST_DESIGNATOR, MOST_BYTES, MOST_OBJECTS, Object, Pool, PoolError,
    PoolFault, Version,
};
use crate::name::Name;

/// The longest extended structure label.
const LONGEST_LABEL: usize = 32;

/// Bytes that are read one after the other.
struct Bytes<'a> {
    all: &'a [u8],
    at: usize,
    /// The object that is being read.
    object: Option<u16>,
}

impl<'a> Bytes<'a> {
    fn fault(&self, fault: PoolFault) -> PoolError {
        PoolError { object: self.object, parent: None, fault }
    }

    fn take(&mut self, count: usize) -> Result<&'a [u8], PoolError> {
        let end = self.at.saturating_add(count);
        let taken = self.all.get(self.at..end).ok_or_else(|| self.fault(PoolFault::Cut(self.all.len())))?;
        self.at = end;
        Ok(taken)
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N], PoolError> {
        let taken = self.take(N)?;
        taken.try_into().map_err(|_| self.fault(PoolFault::Cut(self.all.len())))
    }

    fn byte(&mut self) -> Result<u8, PoolError> {
        self.array().map(|[byte]| byte)
    }

    fn word(&mut self) -> Result<u16, PoolError> {
        self.array().map(u16::from_le_bytes)
    }

    fn text(&mut self) -> Result<String, PoolError> {
        let len = self.byte()?.into();
        let text = self.take(len)?.to_vec();
        let text = String::from_utf8(text).ok().filter(|text| text.len() <= LONGEST_DESIGNATOR);
        text.ok_or_else(|| self.fault(PoolFault::Designator))
    }
}

impl Pool {
    /// Reads a pool of a client of this version, and checks it.
    ///
    /// # Errors
    /// The first thing that is wrong, with the number of its object.
    pub fn read(bytes: &[u8], version: Version) -> Result<Self, PoolError> {
        if bytes.len() > MOST_BYTES {
            return Err(PoolError { object: None, parent: None, fault: PoolFault::Bytes(bytes.len()) });
        }
        let mut rest = Bytes { all: bytes, at: 0, object: None };
        let mut objects = Vec::new();
        while rest.at < bytes.len() {
            if objects.len() >= MOST_OBJECTS {
                return Err(rest.fault(PoolFault::Objects));
            }
            rest.object = None;
            objects.push(object(&mut rest, version)?);
        }
        let pool = Self(objects);
        pool.check()?;
        Ok(pool)
    }
}

fn object(rest: &mut Bytes<'_>, version: Version) -> Result<Object, PoolError> {
    let at = rest.at;
    let table: [u8; 3] = rest.array()?;
    if ![b"DVC", b"DET", b"DPD", b"DPT", b"DVP"].contains(&&table) {
        return Err(rest.fault(PoolFault::Table { at, found: table }));
    }
    let id = rest.word()?;
    rest.object = Some(id);
    let (designator, kind) = match &table {
        b"DVC" => {
            let designator = rest.text()?;
            (designator, Kind::Device(device(rest, version)?))
        }
        b"DET" => {
            let number = rest.byte()?;
            let kind = ElementKind::of(number).ok_or_else(|| rest.fault(PoolFault::ElementKind(number)))?;
            let designator = rest.text()?;
            let (number, parent, count) = (rest.word()?, rest.word()?, rest.word()?);
            let mut children = Vec::new();
            for _ in 0..count {
                children.push(rest.word()?);
            }
            (designator, Kind::Element { kind, number, parent, children })
        }
        b"DPD" => {
            let (ddi, [properties, triggers]) = (rest.word()?, rest.array()?);
            let designator = rest.text()?;
            (designator, Kind::Process { ddi, properties, triggers, presentation: rest.word()? })
        }
        b"DPT" => {
            let (ddi, value) = (rest.word()?, i32::from_le_bytes(rest.array()?));
            let designator = rest.text()?;
            (designator, Kind::Property { ddi, value, presentation: rest.word()? })
        }
        _ => {
            let (offset, scale) = (i32::from_le_bytes(rest.array()?), f32::from_le_bytes(rest.array()?));
            let decimals = rest.byte()?;
            (rest.text()?, Kind::Presentation { offset, scale, decimals })
        }
    };
    Ok(Object { id, designator, kind })
}

fn device(rest: &mut Bytes<'_>, version: Version) -> Result<Device, PoolError> {
    let software = rest.text()?;
    let name = Name(u64::from_le_bytes(rest.array()?));
    let serial = rest.text()?;
    let (structure, localization) = (rest.array()?, rest.array()?);
    let mut extended = Vec::new();
    if version >= Version::Fourth {
        let len = usize::from(rest.byte()?);
        if len > LONGEST_LABEL {
            return Err(rest.fault(PoolFault::Designator));
        }
        extended = rest.take(len)?.to_vec();
    }
    Ok(Device { software, name, serial, structure, localization, extended })
}
