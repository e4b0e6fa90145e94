//! Restarts that counters do not tell: while a device is off, the host's time goes on and its own does not.
//!
//! A device that begins to count anew may happen to stand a little beyond where it stood, and its counters look as if telegrams were missing. Its clock gives it away:
//! it has gone on by less than the host's has.

use core::time::Duration;

/// How much shorter than the host's a device's time may be, and be only late, seconds. No scanner starts up in less.
const LATE_S: f64 = 1.0;
/// Clocks of quartz, and hosts whose clock is set, differ by less than this share.
const DRIFT: f64 = 0.01;
/// Pace is that of about the last so many seconds of the device.
const PACE_S: f64 = 4.0;

/// Compares the device's time with the host's from one telegram to the next.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Uptime {
    /// When the last telegram was received.
    last: Option<Duration>,
    /// How long telegrams that follow on each other took of late, by the host and by the device: a virtual device may run slower than its host.
    host_s: f64,
    device_s: f64,
}

impl Uptime {
    /// Time that the host has counted since the last telegram, seconds; none where it is not known.
    pub(crate) fn passed_s(&self, received: Option<Duration>) -> Option<f64> {
        Some(received?.saturating_sub(self.last?).as_secs_f64())
    }

    /// The same in the device's time, as the two went together before: seconds of a device that runs slower or faster than its host.
    pub(crate) fn device_s(&self, received: Option<Duration>) -> Option<f64> {
        let is_paced = self.device_s > 0.0 && self.host_s > 0.0;
        let pace = if is_paced { self.host_s / self.device_s } else { 1.0 };
        self.passed_s(received).map(|host_s| host_s / pace)
    }

    /// True if the device was off since the last telegram: by its clock so many seconds have passed, which are too few. A telegram that is the next one
    /// cannot tell that: it may have waited on its way.
    pub(crate) fn is_too_short(&self, received: Option<Duration>, device_s: f64) -> bool {
        let pace = if self.device_s > 0.0 { (self.host_s / self.device_s).max(1.0) } else { 1.0 };
        self.passed_s(received)
            .is_some_and(|host_s| host_s * (1.0 - DRIFT) > device_s.max(0.0) * pace + LATE_S)
    }

    /// Takes note of a telegram; `device_s` is the device's time since the one before, where it is the next one.
    pub(crate) fn take(&mut self, received: Option<Duration>, device_s: Option<f64>) {
        if let (Some(host_s), Some(device_s)) = (self.passed_s(received), device_s) {
            self.host_s += host_s;
            self.device_s += device_s;
            if self.device_s > PACE_S {
                self.host_s *= 0.5;
                self.device_s *= 0.5;
            }
        }
        self.last = received.or(self.last);
    }
}
