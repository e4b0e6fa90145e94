//! `LFErec`: field evaluation results.

use alloc::vec::Vec;

use super::Variable;
use super::lmd_scandata::DateTime;
use super::wire::fields;

fields! {
    /// Results of all evaluation fields in use.
    pub struct FieldResults {
        /// One a field.
        pub fields: Vec<FieldResult>,
    }

    /// One field's result.
    pub struct FieldResult {
        /// Telegram version.
        pub version: u16,
        /// The field, from 1.
        pub field: u8,
        /// µs since power-up.
        pub time_us: u32 ["µs"],
        /// Scale of the field's ranges.
        pub scale: f32,
        /// Offset of the field's ranges.
        pub offset: f32,
        /// Angle between beams, 1/10000°.
        pub step: u32 ["1/10000°"],
        /// Device angle of the first beam, 1/10000°.
        pub start_angle: i32 ["1/10000°"],
        /// [`INVALID`], [`FREE`] or [`INFRINGED`].
        pub result: u8,
        /// A block recorded on an LMS511 with 15 bytes; what they mean was not found out.
        pub block1: Option<[u8; 15]>,
        /// A block never recorded. Its length is not known, so none is read.
        pub block2: Option<()>,
        /// A block never recorded. Its length is not known, so none is read.
        pub block3: Option<()>,
        /// When the result last changed.
        pub date_time: Option<DateTime>,
    }
}

impl Variable for FieldResults {
    const NAME: &'static str = "LFErec";
}

/// Not evaluated.
pub const INVALID: u8 = 0;
/// Nothing in the field.
pub const FREE: u8 = 1;
/// Something in the field.
pub const INFRINGED: u8 = 2;
