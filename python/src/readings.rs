//! What scanners tell besides scans, as arrays.

use pyo3::prelude::*;
use pyo3::types::PyDict;
use rowscan_protocol::reading::{ImuReading, Reading, WheelReading};

use crate::arrays;

/// Readings as they come, before Python has them.
#[derive(Default)]
pub(crate) struct Readings {
    imu: Vec<(f64, ImuReading)>,
    wheel: Vec<(f64, WheelReading)>,
}

impl Readings {
    /// Takes one that came at `received_s`. One that cannot be read is in the counts of the link.
    pub(crate) fn push(&mut self, received_s: f64, reading: Reading) {
        match reading {
            Reading::Imu(imu) => self.imu.push((received_s, imu)),
            Reading::Wheel(wheel) => self.wheel.push((received_s, wheel)),
            _ => {}
        }
    }

    /// Those of the inertial measurement unit, by name; None if there is none.
    pub(crate) fn imu(&self, py: Python<'_>) -> PyResult<Option<Py<PyDict>>> {
        if self.imu.is_empty() {
            return Ok(None);
        }
        let dict = PyDict::new(py);
        let all = || self.imu.iter();
        dict.set_item("received_s", arrays::line(py, all().map(|(at, _)| *at).collect()))?;
        dict.set_item("time_us", arrays::line(py, all().map(|(_, imu)| imu.time_us).collect()))?;
        let threes = |of: fn(&ImuReading) -> [f32; 3]| all().flat_map(|(_, imu)| of(imu)).collect();
        let acceleration = arrays::rows(py, threes(|imu| imu.acceleration_m_s2), 3)?;
        dict.set_item("acceleration_m_s2", acceleration)?;
        dict.set_item("rate_rad_s", arrays::rows(py, threes(|imu| imu.rate_rad_s), 3)?)?;
        let attitude = all().flat_map(|(_, imu)| imu.orientation_wxyz).collect();
        dict.set_item("orientation_wxyz", arrays::rows(py, attitude, 4)?)?;
        Ok(Some(dict.unbind()))
    }

    /// Those of the encoder in telegrams of their own, by name; None if there is none.
    pub(crate) fn wheel(&self, py: Python<'_>) -> PyResult<Option<Py<PyDict>>> {
        if self.wheel.is_empty() {
            return Ok(None);
        }
        let dict = PyDict::new(py);
        let all = || self.wheel.iter();
        dict.set_item("received_s", arrays::line(py, all().map(|(at, _)| *at).collect()))?;
        dict.set_item("time_us", arrays::line(py, all().map(|(_, wheel)| wheel.time_us).collect()))?;
        dict.set_item("tick", arrays::line(py, all().map(|(_, wheel)| wheel.tick).collect()))?;
        dict.set_item("speed", arrays::line(py, all().map(|(_, wheel)| wheel.speed).collect()))?;
        Ok(Some(dict.unbind()))
    }
}
