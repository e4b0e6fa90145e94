//! What scanners tell besides scans: how they move, and how far the wheel has turned.

use crate::compact;
use crate::telegram::inertial_measurement_unit::InertialMeasurementUnit;

/// A telegram of the scanner's inertial measurement unit or of its encoder.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Reading {
    /// Of the inertial measurement unit.
    Imu(ImuReading),
    /// Of the encoder, in a telegram of its own.
    Wheel(WheelReading),
    /// One that cannot be read.
    Unreadable,
}

/// How a scanner moves, in its own axes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ImuReading {
    /// When, on the scanner's clock, µs.
    pub time_us: u64,
    /// Acceleration with gravity along x, y, z.
    pub acceleration_m_s2: [f32; 3],
    /// Rate of turn about x, y, z.
    pub rate_rad_s: [f32; 3],
    /// Attitude as a quaternion: w, x, y, z.
    pub orientation_wxyz: [f32; 4],
}

/// What the encoder counted.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct WheelReading {
    /// When `tick` was read, on the scanner's clock, µs.
    pub time_us: u64,
    /// Ticks; wraps.
    pub tick: u32,
    /// As the scanner tells it: its unit follows the scanner's settings.
    pub speed: f32,
}

impl From<&compact::Imu> for ImuReading {
    fn from(imu: &compact::Imu) -> Self {
        Self {
            time_us: imu.time_us,
            acceleration_m_s2: imu.acceleration_m_s2,
            rate_rad_s: imu.rate_rad_s,
            orientation_wxyz: imu.orientation_wxyz,
        }
    }
}

impl From<&compact::Encoder> for WheelReading {
    fn from(encoder: &compact::Encoder) -> Self {
        Self { time_us: encoder.tick_time_us, tick: encoder.tick, speed: encoder.speed }
    }
}

impl From<&InertialMeasurementUnit> for ImuReading {
    fn from(event: &InertialMeasurementUnit) -> Self {
        Self {
            time_us: event.time_us.into(),
            acceleration_m_s2: [event.acceleration_x, event.acceleration_y, event.acceleration_z],
            rate_rad_s: [event.rate_x, event.rate_y, event.rate_z],
            orientation_wxyz: [
                event.orientation_w,
                event.orientation_x,
                event.orientation_y,
                event.orientation_z,
            ],
        }
    }
}

/// How many readings came.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ReadingCounts {
    /// Of inertial measurement units.
    pub imu: u64,
    /// Of encoders, in telegrams of their own.
    pub wheel: u64,
    /// That could not be read.
    pub unreadable: u64,
}

impl ReadingCounts {
    /// Counts one.
    pub fn count(&mut self, reading: &Reading) {
        match reading {
            Reading::Imu(_) => self.imu += 1,
            Reading::Wheel(_) => self.wheel += 1,
            Reading::Unreadable => self.unreadable += 1,
        }
    }
}
