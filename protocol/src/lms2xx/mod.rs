//! The classic LMS2xx on a serial line: its own frames, telegrams, models and both sides' sessions. No CoLa.
//!
//! The modules are those of the CoLa side: [`frame`] finds frames, [`telegram`] decodes them, [`model`] is data, [`device`] is the
//! scanner and [`client`] the host, both without I/O. What a scan means is the same [`Scan`](crate::scan::Scan).

pub mod client;
pub mod configuration;
mod description;
pub mod device;
pub mod firmware;
pub mod frame;
mod likely_mode;
pub mod listing;
pub mod model;
mod output;
pub mod settings_reply;
pub mod telegram;
pub mod values;
mod words;

use core::fmt;
use core::time::Duration;

/// What a line can be switched to, bits a second.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Rate {
    /// What a device out of the box begins with.
    #[default]
    R9600,
    /// 19 200.
    R19200,
    /// 38 400.
    R38400,
    /// 500 000: RS-422 only.
    R500000,
}

impl Rate {
    /// All, in the order a host that knows nothing tries them.
    pub const ALL: [Self; 4] = [Self::R9600, Self::R38400, Self::R19200, Self::R500000];

    /// The rate of so many bits a second, if it is one of these.
    pub fn of(bits_per_second: u32) -> Option<Self> {
        Self::ALL.into_iter().find(|rate| rate.bits_per_second() == bits_per_second)
    }

    /// Bits a second.
    pub fn bits_per_second(self) -> u32 {
        match self {
            Self::R9600 => 9600,
            Self::R19200 => 19_200,
            Self::R38400 => 38_400,
            Self::R500000 => 500_000,
        }
    }

    /// How long so many bytes take on the line: start bit, eight bits, stop bit.
    pub fn transmission(self, bytes: usize) -> Duration {
        let bits = 10 * u64::try_from(bytes).unwrap_or(u64::MAX / 10_000_000_000);
        Duration::from_nanos((bits * 1_000_000_000).div_ceil(u64::from(self.bits_per_second())))
    }

    /// The operating mode that switches to it.
    pub(crate) fn mode(self) -> u8 {
        match self {
            Self::R38400 => 0x40,
            Self::R19200 => 0x41,
            Self::R9600 => 0x42,
            Self::R500000 => 0x48,
        }
    }

    pub(crate) fn of_mode(mode: u8) -> Option<Self> {
        Self::ALL.into_iter().find(|rate| rate.mode() == mode)
    }
}

impl fmt::Display for Rate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.bits_per_second().fmt(f)
    }
}

/// Scan angle and the angle between values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Variant {
    /// Degrees: 180, 100, or 90 on a Fast device.
    pub angle_deg: u16,
    /// Hundredths of a degree: 25, 50, 100.
    pub step_centideg: u16,
}

impl Variant {
    /// Values a scan.
    ///
    /// ```
    /// use rowscan_protocol::lms2xx::Variant;
    /// let variant = |angle_deg, step_centideg| Variant { angle_deg, step_centideg };
    /// assert_eq!(variant(180, 50).count(), 361);
    /// assert_eq!(variant(100, 25).count(), 401);
    /// ```
    pub fn count(self) -> u16 {
        let step = u32::from(self.step_centideg.max(1));
        (u32::from(self.angle_deg) * 100 / step + 1).min(u32::from(u16::MAX)) as u16
    }

    /// The beams of a whole scan, from right to left about straight ahead.
    pub fn beams(self) -> crate::angle::BeamGrid {
        crate::angle::BeamGrid {
            start: (90 - i32::from(self.angle_deg) / 2) * 10_000,
            step: self.step_centideg.saturating_mul(100),
            count: self.count(),
        }
    }
}
