//! How a scanner behaves where real ones differ, and the state it starts in.

use core::time::Duration;

use crate::frame::Dialect;

/// What can be chosen about a scanner.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Options {
    /// Times and jitter.
    pub profile: Profile,
    /// The state it is found in.
    pub start: Start,
    /// Logging in stops the measurement until `Run` or `LMCstartmeas`, as the manual has it. Without it scans go on, as clients
    /// that never send `Run` rely on.
    pub strict_login: bool,
    /// How long before simulated time zero the scanner was powered up: where its 32-bit clock stands.
    pub power_up_before: Duration,
    /// How fast the device's clock runs, parts per million too fast.
    pub clock_ppm: i32,
    /// Seed of the device's random numbers.
    pub seed: u64,
    /// Which of the rig's scanners this is, from 0: scanners of one seed have different random numbers.
    pub scanner: u32,
    /// Unit of the encoder speed in scan telegrams.
    pub encoder_speed: EncoderSpeed,
    /// From power-up until telegrams are answered; the model's own time where there is none. `field` profile only.
    pub boot: Option<Duration>,
    /// From mEEwriteall to its reply; the model's own time where there is none. `field` profile only.
    pub save: Option<Duration>,
}

/// Unit of the encoder speed in scan telegrams. All of them are assumed: the telegram listing says ticks per millimetre, which is no
/// speed, and no recording holds a moving encoder.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum EncoderSpeed {
    /// Millimetres per millisecond: ticks per millisecond divided by LICencres.
    #[default]
    MmPerMs,
    /// Millimetres per second: ticks per second divided by LICencres.
    MmPerS,
    /// Ticks per millisecond; LICencres has no effect.
    TicksPerMs,
}

/// Whether the scanner takes the time a real one takes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Profile {
    /// Warm and ready: everything happens at once, every period is exact.
    #[default]
    Bench,
    /// Boot, busy and save times, reply latencies, the recorded period and its jitter.
    Field,
}

/// The state a scanner is found in.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Start {
    /// Measuring.
    #[default]
    Streaming,
    /// Just switched on.
    PowerUp,
    /// Laser off, the mirror turns.
    Standby,
    /// Stopped by a client that is gone.
    Stopped,
    /// A client logged in and vanished: no scans until `Run` or `LMCstartmeas`.
    LoggedIn,
    /// Out of order: it answers and never measures.
    Error,
    /// A client has stored this dialect.
    Stored(Dialect),
}

impl Profile {
    /// As flags and files name them, with what they mean.
    pub const NAMED: &'static [(&'static str, &'static str, Self)] = &[
        ("bench", "Warm and ready; exact periods, immediate answers", Self::Bench),
        ("field", "Boot, busy and save times, latencies, periods and jitter as recorded", Self::Field),
    ];

    /// The one of this name.
    pub fn by_name(name: &str) -> Option<Self> {
        Self::NAMED.iter().find(|(known, ..)| *known == name).map(|(.., profile)| *profile)
    }

    /// The state a CoLa scanner of this profile is found in, unless told otherwise.
    pub fn default_start(self) -> Start {
        match self {
            Self::Bench => Start::Streaming,
            Self::Field => Start::PowerUp,
        }
    }
}

impl Start {
    /// As flags and files name them, with what they mean.
    pub const NAMED: &'static [(&'static str, &'static str, Self)] = &[
        ("streaming", "Measuring", Self::Streaming),
        ("power-up", "Just switched on", Self::PowerUp),
        ("standby", "Laser off, the mirror turns", Self::Standby),
        ("stopped", "Stopped by a client that is gone", Self::Stopped),
        ("logged-in", "A client logged in and vanished: no scans until Run or LMCstartmeas", Self::LoggedIn),
        ("error", "Out of order", Self::Error),
        ("cola-a", "A client has stored CoLa A: it decides over --dialect a and b", Self::Stored(Dialect::A)),
        ("cola-b", "A client has stored CoLa B: it decides over --dialect a and b", Self::Stored(Dialect::B)),
    ];

    /// The one of this name.
    pub fn by_name(name: &str) -> Option<Self> {
        Self::NAMED.iter().find(|(known, ..)| *known == name).map(|(.., start)| *start)
    }
}
