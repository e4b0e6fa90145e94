//! A rig's time.

use rowscan_emulator::{ClockMode, RigControl};

use crate::time::{Refused, Seeking, Time, TimeState, Wait};

impl Time for RigControl {
    fn state(&self) -> TimeState {
        let time = self.time();
        TimeState {
            mode: match time.mode {
                ClockMode::Paced => "paced",
                ClockMode::Max => "max",
                ClockMode::Lockstep => "lockstep",
                ClockMode::Granted => "granted",
            },
            now_s: time.at.as_secs_f64(),
            paused: time.paused,
            scale: time.scale,
            steps: Some(time.steps),
            granted: time.granted,
            drive_began_s: time.began.map(|began| began.as_secs_f64()),
            row_m: time.row_m,
            recorded_s: None,
            recorded_span_s: None,
        }
    }

    fn pause(&self, paused: bool) {
        match paused {
            true => Self::pause(self),
            false => self.resume(),
        }
    }

    fn set_scale(&self, scale: f64) -> Result<(), Refused> {
        Self::set_scale(self, scale).map_err(|error| Refused(error.to_string()))
    }

    fn step(&self, count: u64) -> Result<u64, Refused> {
        Ok(Self::step(self, count))
    }

    fn stepped(&self, last: u64) -> Wait {
        let control = self.clone();
        Box::pin(async move { Self::stepped(&control, last).await })
    }

    fn seek(&self, _place: &str) -> Seeking {
        let refused = Refused("a rig drives forwards only: `seek` is of a replay".to_owned());
        Box::pin(std::future::ready(Err(refused)))
    }
}
