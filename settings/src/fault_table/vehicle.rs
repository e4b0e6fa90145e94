//! Faults of the tractor and what is on it.

use std::time::Duration;

/// A fault of the wheel encoder.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EncoderFault {
    /// Share of the way that the wheel rolls that is not driven.
    pub slip: f64,
    /// Share of the ticks that are missed.
    pub missed: f64,
    /// Share of the ticks that are counted twice.
    pub extra: f64,
    /// It gives no ticks.
    pub stuck: bool,
    /// It counts the other way.
    pub reversed: bool,
    /// Its count wraps at the beginning.
    pub wrap: bool,
    /// Its cable is out: no ticks.
    pub cable_out: bool,
}

/// A fault of the GNSS receiver.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct GnssFault {
    /// No position.
    pub lost: bool,
    /// RTK without fixed ambiguities: decimetres.
    pub float: bool,
    /// The last fix comes again and again.
    pub stale: bool,
    /// Sentences have wrong checksums.
    pub bad_checksum: bool,
    /// The position is off by so many metres.
    pub jump_m: f64,
    /// Into this direction, degrees clockwise from north.
    pub jump_deg: f64,
    /// The antenna is so much farther ahead, and farther right, than the receiver reckons with, metres.
    pub lever_arm_m: (f64, f64),
    /// Time is so many seconds later.
    pub time_s: f64,
}

/// A fault of the drive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DriveFault {
    /// It makes for this speed, then for its own again.
    Speed {
        /// Speed, m/s; negative in reverse.
        m_s: f64,
        /// How fast the speed changes, m/s².
        change_m_s2: f64,
    },
    /// It is shifted to its right, and back at the end.
    Lateral {
        /// How far, metres; negative: left.
        m: f64,
        /// How long the shift takes.
        over: Duration,
    },
    /// It goes up and down, and rolls.
    Bounce {
        /// Up and down by so many metres.
        m: f64,
        /// So often a second.
        hz: f64,
        /// Rolls by so many radians.
        roll_rad: f64,
    },
}
