//! `LICsrc`, `LICencset`, `LICencres`, `DO3And4Fnc`: the encoder that counts the way travelled.

use super::Variable;
use super::wire::fields;

fields! {
    /// Where increments come from: [`FIXED_SPEED`] or [`ENCODER`].
    #[derive(Copy)]
    pub struct IncrementSource {
        /// The code.
        pub code: u8,
    }

    /// How the encoder counts: [`OFF`], [`SINGLE`], [`PHASE`] or [`LEVEL`].
    #[derive(Copy)]
    pub struct EncoderSetting {
        /// The code.
        pub code: u8,
    }

    /// Encoder resolution, ticks a millimetre (not verified: clients send 1.0 only).
    #[derive(Copy)]
    pub struct EncoderResolution {
        /// Ticks a millimetre.
        pub ticks_per_mm: f32 ["ticks/mm"],
    }

    /// What inputs 3 and 4 of an LMS5xx are for.
    #[derive(Copy)]
    pub struct InputsThreeAndFour {
        /// 0 digital inputs, 1 encoder.
        pub encoder: bool,
    }
}

impl Variable for IncrementSource {
    const NAME: &'static str = "LICsrc";
}

impl Variable for EncoderSetting {
    const NAME: &'static str = "LICencset";
}

impl Variable for EncoderResolution {
    const NAME: &'static str = "LICencres";
}

impl Variable for InputsThreeAndFour {
    const NAME: &'static str = "DO3And4Fnc";
}

/// A fixed speed instead of an encoder.
pub const FIXED_SPEED: u8 = 0;
/// The encoder.
pub const ENCODER: u8 = 1;
/// Encoder off.
pub const OFF: u8 = 0;
/// One track: counts up whatever the direction.
pub const SINGLE: u8 = 1;
/// Two tracks: direction by phase.
pub const PHASE: u8 = 2;
/// Direction by level.
pub const LEVEL: u8 = 3;
