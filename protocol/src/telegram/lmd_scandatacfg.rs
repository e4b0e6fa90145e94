//! `LMDscandatacfg`: what the scan telegrams hold.

use super::Variable;
use super::wire::{LowHigh, fields};

fields! {
    /// Contents of `LMDscandata`.
    pub struct ScanDataConfig {
        /// Bit 0..4: echo 1..5.
        pub channels: LowHigh,
        /// Bit 0: remission; bit 1 (LMS1000, MRS1000): angle table.
        pub remission: u8,
        /// Width of the remission, [`REMISSION_8_BIT`] or [`REMISSION_16_BIT`].
        pub resolution: u8,
        /// Unit of the remission, always 0.
        pub unit: u8,
        /// Bit 0, 1: encoder 1, 2.
        pub encoders: LowHigh,
        /// Position block.
        pub position: bool,
        /// Device name.
        pub device_name: bool,
        /// Comment.
        pub comment: bool,
        /// Date and time.
        pub time: bool,
        /// Every n-th scan is sent; 1 = all.
        pub output_rate: u16,
    }
}

impl Variable for ScanDataConfig {
    const NAME: &'static str = "LMDscandatacfg";
}

/// Bit of the remission itself.
pub const REMISSION: u8 = 1;
/// Bit of the table of angles beside it.
pub const ANGLE_TABLE: u8 = 2;
/// Remission in 8 bits.
pub const REMISSION_8_BIT: u8 = 0;
/// Remission in 16 bits.
pub const REMISSION_16_BIT: u8 = 1;
