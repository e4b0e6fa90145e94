//! One telegram of any type.

use alloc::vec::Vec;

use super::crc::crc32;
use super::encoder::Encoder;
use super::error::{CompactError, EncodeError, Expected};
use super::imu::Imu;
use super::scan::ScanTelegram;
use super::wire::{Context, Fields, Reader, Writer};
use super::{HEAD, START, TAIL};
use crate::visit::Visitor;

/// One telegram.
#[derive(Clone, Debug, PartialEq)]
pub enum Telegram {
    /// A segment of a turn.
    Scan(ScanTelegram),
    /// Attitude and motion.
    Imu(Imu),
    /// The encoder.
    Encoder(Encoder),
}

impl Telegram {
    /// Takes apart the telegram that `bytes` are, from start to CRC: a whole datagram. The CRC is looked at before the fields, and memory is asked
    /// for only what the bytes hold.
    ///
    /// # Errors
    /// They are no telegram, a damaged one, or one of a type or version that is not known here.
    pub fn decode(bytes: &[u8]) -> Result<Self, CompactError> {
        let mut reader = Reader::new(bytes, 0);
        let start: [u8; 4] = reader.take()?;
        if start != START {
            let found = u32::from_be_bytes(start).into();
            return Err(CompactError { expected: Expected::Start, found, at: 0 });
        }
        reader.needs((HEAD - START.len() + TAIL) as u64)?;
        let Some((summed, crc)) = bytes.split_last_chunk::<TAIL>() else {
            return Err(CompactError { expected: Expected::Bytes(TAIL as u64), found: 0, at: bytes.len() });
        };
        let (expected, found) = (crc32(summed), u32::from_le_bytes(*crc));
        if expected != found {
            let (expected, at) = (Expected::Crc(expected), summed.len());
            return Err(CompactError { expected, found: found.into(), at });
        }
        let mut reader = Reader::new(summed, START.len());
        let mut number = 0_u32;
        number.read(&mut reader)?;
        let mut telegram = Self::of_type(number).ok_or(CompactError {
            expected: Expected::Type,
            found: number.into(),
            at: START.len(),
        })?;
        telegram.fields_mut().read(&mut reader)?;
        match reader.left() as u64 {
            0 => Ok(telegram),
            found => Err(CompactError { expected: Expected::End, found, at: reader.at() }),
        }
    }

    /// Appends the telegram's bytes.
    ///
    /// # Errors
    /// Its lists are not as long as its counts say, or its sizes are not those of its modules; then nothing is appended.
    pub fn encode(&self, out: &mut Vec<u8>) -> Result<(), EncodeError> {
        if let Self::Scan(scan) = self {
            scan.check()?;
        }
        let begin = out.len();
        out.extend_from_slice(&START);
        let mut writer = Writer { out, context: Context::default() };
        self.number().write(&mut writer);
        self.fields().write(&mut writer);
        let crc = crc32(out.get(begin..).unwrap_or_default());
        out.extend_from_slice(&crc.to_le_bytes());
        Ok(())
    }

    /// Visits the telegram's fields.
    pub fn visit(&self, visitor: &mut dyn Visitor) {
        self.fields().visit(visitor);
    }

    /// Its type in words.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Scan(_) => "scan",
            Self::Imu(_) => "imu",
            Self::Encoder(_) => "encoder",
        }
    }

    /// The number of the turn that it tells of; none of what is no scan.
    pub fn turn(&self) -> Option<u64> {
        match self {
            Self::Scan(scan) => scan.modules.0.first().map(|module| module.frame_number),
            Self::Imu(_) | Self::Encoder(_) => None,
        }
    }

    /// Its type on the wire.
    fn number(&self) -> u32 {
        match self {
            Self::Scan(_) => 1,
            Self::Imu(_) => 2,
            Self::Encoder(_) => 4,
        }
    }

    fn of_type(number: u32) -> Option<Self> {
        let all = [
            Self::Scan(ScanTelegram::default()),
            Self::Imu(Imu::default()),
            Self::Encoder(Encoder::default()),
        ];
        all.into_iter().find(|telegram| telegram.number() == number)
    }

    fn fields(&self) -> &dyn Fields {
        match self {
            Self::Scan(scan) => scan,
            Self::Imu(imu) => imu,
            Self::Encoder(encoder) => encoder,
        }
    }

    fn fields_mut(&mut self) -> &mut dyn Fields {
        match self {
            Self::Scan(scan) => scan,
            Self::Imu(imu) => imu,
            Self::Encoder(encoder) => encoder,
        }
    }
}
