//! Datagrams of a scanner with Compact output, before they are numbered and encoded.

use crate::compact::Telegram;
use crate::time::SimTime;

/// What a datagram holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Stream {
    /// A segment of a turn.
    Scan,
    /// Attitude and motion.
    Imu,
    /// The encoder's reading.
    Encoder,
}

/// Why nothing of a stream is sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Silent {
    /// It is off, or the device does not measure, or it has no such stream.
    Off,
    /// The format or the protocol is one that is not emulated, or goes out otherwise.
    Otherwise,
}

/// A telegram that waits for its instant.
#[derive(Clone, Debug)]
pub struct Datagram {
    /// When it is sent.
    pub at: SimTime,
    /// What it holds.
    pub stream: Stream,
    /// The number of the turn that ends with it.
    pub ends_turn: Option<u64>,
    pub(super) telegram: Telegram,
}

impl Datagram {
    /// The number of the turn that it tells of; none of what is no scan.
    pub fn turn(&self) -> Option<u64> {
        self.telegram.turn()
    }
}

impl Stream {
    /// All, in the order in which those of one instant are sent.
    pub const ALL: [Self; 3] = [Self::Scan, Self::Imu, Self::Encoder];

    /// The names of the variables that switch it on and direct it.
    pub fn variables(self) -> [&'static str; 2] {
        match self {
            Self::Scan => ["ScanDataEnable", "ScanDataEthSettings"],
            Self::Imu => ["ImuDataEnable", "ImuDataEthSettings"],
            Self::Encoder => ["EncoderDataEnable", "EncoderDataEthSettings"],
        }
    }

    /// What people call it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Scan => "scan",
            Self::Imu => "IMU",
            Self::Encoder => "encoder",
        }
    }
}
