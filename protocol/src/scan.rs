//! What a scan telegram means: one mirror turn, in SI units.

use alloc::string::String;
use alloc::vec::Vec;
use core::time::Duration;

use crate::angle::BeamGrid;
use crate::echo::EchoChoice;
use crate::leftover_set::LeftoverSet;
use crate::validity::DeviceStatus;

/// The range of a beam that came back without an echo. Misses are data: a canopy estimate without them is biased.
pub const NO_ECHO: f64 = f64::INFINITY;

/// The range of a beam whose receiver was dazzled: not a number, for what it met is not known. Ask with `is_nan`.
pub const DAZZLED: f64 = f64::NAN;

/// A layer whose elevation is no more than that is taken for level, degrees: its beams lie within 1.7 % of their range beside the plane.
pub const LEVEL_DEG: f64 = 1.0;

/// True of the layer with this code if it is taken for level: no more than [`LEVEL_DEG`] inclined.
pub fn is_level(layer_centideg: i16) -> bool {
    elevation_deg(layer_centideg).abs() <= LEVEL_DEG
}

/// Elevation of the layer with this code (1/100°), degrees: above the horizontal plane of the device, towards its roof.
///
/// An MRS1000 counts downwards: its layers 250, 0, −250, −500 are SICK's "−2.5°, 0°, +2.5°, +5°". Signs of a public client; not verified on a scene.
/// Of a multiScan the code is −phi: z = + d sin phi, as SICK's SDK reads it. [`Mount::phi`](crate::rig::Mount::phi) turns either about.
pub fn elevation_deg(layer_centideg: i16) -> f64 {
    // Not −0.
    0.0 - f64::from(layer_centideg) / 100.0
}

/// One mirror turn as a device reported it.
///
/// `echoes[0]` is the first echo; every echo has one range a beam, [`NO_ECHO`] where the beam met nothing, [`DAZZLED`] where that is not known.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scan {
    /// The device's serial number.
    pub serial_number: u32,
    /// What the device says of itself.
    pub status: DeviceStatus,
    /// The layer as the telegram names it, 1/100°: [`elevation_deg`] says where it is. 0 on scanners with one layer.
    pub layer_centideg: i16,
    /// Counts telegrams; wraps, and keeps running over restarts of the measurement.
    pub telegram_counter: u16,
    /// Counts mirror turns; wraps; some models restart it when measurement starts.
    pub scan_counter: u16,
    /// Device clock when the mirror passed its zero index, µs since power-up; wraps after 71.6 minutes.
    pub scan_time_us: u32,
    /// Device clock when the telegram was sent, µs since power-up.
    pub transmit_time_us: u32,
    /// Mirror turns a second, as the telegram states it; 0 where nothing tells it (an LMS2xx in bytes without times, index and rate).
    pub scan_frequency_hz: f64,
    /// Where the beams point.
    pub beams: BeamGrid,
    /// One entry an echo, first echo first. Never empty in a decoded scan.
    pub echoes: Vec<Echo>,
    /// Which echo the first of them is, where what was said to the device, and answered, tells; a telegram alone does not.
    pub echo: Option<EchoChoice>,
    /// Settings that take something from it, where what was said to the device, and answered, tells.
    pub leftovers: LeftoverSet,
    /// Encoder readings, empty unless configured.
    pub encoders: Vec<EncoderReading>,
    /// The device's name, empty unless configured.
    pub device_name: String,
    /// The stream began anew with it, by counters that the scan itself does not tell: its own are no continuation of those of the scan before.
    pub begins_anew: bool,
    /// The device counts neither its telegrams nor its time: counters and times are the reader's, and what is missing before it is not known.
    pub uncounted: bool,
    /// When its last byte was read, on the clock of whoever read it, any epoch; none where nobody did.
    pub received: Option<Duration>,
}

/// One echo of every beam.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Echo {
    /// Metres, [`NO_ECHO`] where there was none, [`DAZZLED`] where the receiver was dazzled. As long as the beam grid.
    pub range_m: Vec<f64>,
    /// Received signal strength, in the device's own digits; empty unless configured, else as long as the beam grid.
    pub remission: Vec<u16>,
}

/// One wheel encoder, latched at the scan's zero index.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct EncoderReading {
    /// Ticks; wraps.
    pub position_ticks: u32,
    /// Ticks a millimetre, as the manual names the field.
    pub speed: u16,
}

/// Where the scanner was when it took a line. Scene frame: X across the row into the vegetation, Y along the row, Z up, metres.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pose {
    /// Across the row; the row axis is X = 0, so a scanner beside the row has a negative X.
    pub x_m: f64,
    /// Along the row.
    pub y_m: f64,
    /// Height.
    pub z_m: f64,
}

/// One scan put in its place: what the canopy estimators eat. Borrowed, so that a stream of them allocates nothing.
#[derive(Clone, Copy, Debug)]
pub struct ScanLine<'a> {
    /// Device angles of the beams.
    pub beams: BeamGrid,
    /// First-echo ranges, metres, [`NO_ECHO`] for a miss, [`DAZZLED`] where it is not known.
    pub range_m: &'a [f64],
    /// First-echo remission, or empty.
    pub remission: &'a [u16],
    /// Where the scanner was.
    pub pose: Pose,
}
