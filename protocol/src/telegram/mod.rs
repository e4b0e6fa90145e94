//! Telegrams: commands with typed fields. One file a telegram, named as the manual names the command.
//!
//! A payload is `sXX name arguments` in both dialects; [`Telegram::parse`] splits it. What the arguments are is
//! written once a telegram, as a [`Fields`] type, and serves both dialects and both directions.
//! [`COMMANDS`](crate::device::command::COMMANDS) lists them all.

mod kind;
mod sopas_error;
pub mod wire;

pub mod device_ident;
pub mod ee_writeall;
pub mod ei_address;
pub mod eihst_cola;
pub mod field_nnn;
pub mod firmware_version;
pub mod fr_echo_filter;
pub mod inertial_measurement_unit;
pub mod lcm_state;
pub mod lfe_rec;
pub mod lfp_filter;
pub mod lic_encoder;
pub mod lid_inputstate;
pub mod lid_outputstate;
pub mod lmc_meas;
pub mod lmd_scandata;
pub mod lmd_scandatacfg;
pub mod lmp_autostartmeas;
pub mod lmp_output_range;
pub mod lmp_scancfg;
pub mod location_name;
pub mod lsp_datetime;
pub mod ms_suppmode;
pub mod od_oprh;
pub mod od_pwrc;
pub mod ord_num;
pub mod performance_profile_number;
pub mod run;
pub mod sc_reboot;
pub mod scan_data_format;
pub mod scan_layer_filter;
pub mod scdevicestate;
pub mod serial_number;
pub mod set_access_mode;
pub mod set_active_applications;
pub mod stlms;
pub mod tsc_time_client;

use alloc::vec::Vec;
use core::fmt;

pub use kind::Kind;
pub use lmd_scandata::{Channel, DateTime, Encoder, EventInfo, LmdScandata, Position};
pub use sopas_error::SopasError;
use wire::{Excerpt, Fields, Reader, WireError, Writer};

use crate::frame::{self, Dialect};

/// A variable that can be read, and maybe written or subscribed to. `Self` is its value.
pub trait Variable: Fields + Default + fmt::Debug {
    /// The manual's name.
    const NAME: &'static str;
}

/// A method that can be called. `Self` is its arguments.
pub trait Method: Fields + Default + fmt::Debug {
    /// The manual's name.
    const NAME: &'static str;
    /// What it gives back.
    type Reply: Fields + Default + fmt::Debug;
}

/// A telegram whose arguments have not been read yet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Telegram<'a> {
    /// What it asks or answers.
    pub kind: Kind,
    /// The command's name; empty in `sFA`.
    pub name: &'a str,
    /// What follows the name.
    pub args: Args<'a>,
}

/// A telegram's arguments on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Args<'a> {
    /// How they are written.
    pub dialect: Dialect,
    /// What follows the blank after the name.
    pub bytes: &'a [u8],
}

impl<'a> Telegram<'a> {
    /// Splits a frame's payload.
    pub fn parse(dialect: Dialect, payload: &'a [u8]) -> Result<Self, HeaderError> {
        let unknown = || HeaderError { found: Excerpt::of(payload) };
        let (letters, rest) = payload.split_first_chunk::<3>().ok_or_else(unknown)?;
        let kind = Kind::from_letters(letters).ok_or_else(unknown)?;
        if kind == Kind::Fa {
            // Binary `sFA` has no blank before its code, whose first byte is never one.
            let bytes = rest.strip_prefix(b" ").unwrap_or(rest);
            return Ok(Self { kind, name: "", args: Args { dialect, bytes } });
        }
        let rest = match rest {
            [b' ', rest @ ..] => rest,
            // `sRI0`: a device takes an index with and without the blank.
            [b'0'..=b'9', ..] if kind == Kind::Ri => rest,
            _ => return Err(unknown()),
        };
        let end = rest.iter().position(|&b| b == b' ').unwrap_or(rest.len());
        let (name, bytes) = rest.split_at_checked(end).ok_or_else(unknown)?;
        let name = core::str::from_utf8(name).map_err(|_| unknown())?;
        if name.is_empty() || !name.bytes().all(|b| b.is_ascii_graphic()) {
            return Err(unknown());
        }
        let bytes = bytes.strip_prefix(b" ").unwrap_or(bytes);
        Ok(Self { kind, name, args: Args { dialect, bytes } })
    }

    /// The reason a device gives in `sFA`; none for other telegrams. A code that cannot be read is an unknown error.
    pub fn refusal(&self) -> Option<SopasError> {
        (self.kind == Kind::Fa).then(|| {
            self.args.decode::<u16>().map_or_else(|_| SopasError::UnknownError, SopasError::from_code)
        })
    }
}

impl<'a> Args<'a> {
    /// Reads them all into a new value.
    pub fn decode<T: Fields + Default>(&self) -> Result<T, WireError> {
        let mut value = T::default();
        self.decode_into(&mut value)?;
        Ok(value)
    }

    /// Reads them all into `value`, whose buffers are reused.
    pub fn decode_into<T: Fields>(&self, value: &mut T) -> Result<(), WireError> {
        let mut reader = self.reader();
        value.read(&mut reader)?;
        reader.end()
    }

    /// A reader at their beginning.
    pub fn reader(&self) -> Reader<'a> {
        Reader::new(self.dialect, self.bytes)
    }
}

/// Appends a telegram's payload.
pub fn encode<T: Fields>(dialect: Dialect, kind: Kind, name: &str, args: &T, out: &mut Vec<u8>) {
    args.write(&mut Writer::begin(dialect, kind, name, out));
}

/// Appends the payload of a telegram without arguments. `trailing_blank`: binary replies mostly end in one.
pub fn encode_empty(dialect: Dialect, kind: Kind, name: &str, trailing_blank: bool, out: &mut Vec<u8>) {
    let mut writer = Writer::begin(dialect, kind, name, out);
    if trailing_blank {
        writer.trailing_blank();
    }
}

/// Appends a telegram as a whole frame.
pub fn encode_frame<T: Fields>(dialect: Dialect, kind: Kind, name: &str, args: &T, out: &mut Vec<u8>) {
    frame::encode_with(dialect, out, |out| encode(dialect, kind, name, args, out));
}

/// A payload that is no telegram.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("expected a command such as \"sRN name\", found \"{found}\"")]
pub struct HeaderError {
    /// How it begins.
    pub found: Excerpt,
}
