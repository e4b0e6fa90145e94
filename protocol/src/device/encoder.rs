//! The device's side of the wheel encoder: it counts the ticks it is given.
//!
//! Ticks per metre are a property of the wheel, which belongs to the vehicle. `LICencres` describes that wheel to the device: it scales what
//! the device derives from the ticks, and never the ticks.

use super::options::EncoderSpeed;
use super::state::Device;
use super::ticks::TickCounter;
use crate::telegram::Encoder;

impl Device {
    /// How many ticks the wheel encoder has given so far, forward minus backward. Fractions of a tick are not counted.
    pub fn set_encoder_ticks(&mut self, ticks: f64) {
        self.ticks.set(ticks);
    }

    /// The encoder block of a scan telegram: position in ticks, which wraps at 32 bits, and speed in the unit that
    /// [`Options::encoder_speed`](super::Options::encoder_speed) chooses. Zeros while no encoder is set up.
    pub(super) fn encoder_reading(&self) -> Encoder {
        let encoder = &self.settings.encoder;
        if !encoder.counts(self.model) {
            return Encoder::default();
        }
        let TickCounter { ticks, ticks_per_ms, .. } = self.ticks;
        let ticks_per_mm = f64::from(encoder.resolution.ticks_per_mm);
        let speed = match self.options.encoder_speed {
            EncoderSpeed::MmPerMs => ticks_per_ms.abs() / ticks_per_mm,
            EncoderSpeed::MmPerS => ticks_per_ms.abs() * 1000.0 / ticks_per_mm,
            EncoderSpeed::TicksPerMs => ticks_per_ms.abs(),
        };
        Encoder { position: ticks as i64 as u32, speed: (speed + 0.5) as u16 }
    }
}
