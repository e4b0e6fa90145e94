//! Faults of a scanner.

use std::time::Duration;

/// A fault of a scanner.
#[derive(Clone, Debug, PartialEq)]
pub enum DeviceFault {
    /// Its supply.
    Power(Power),
    /// Its front screen.
    Dirt(Dirt),
    /// A part of it.
    Broken(Broken),
    /// What it refuses.
    Refusal(Refusal),
    /// What its REST interface refuses.
    Rest(RestFault),
    /// What it is found with.
    Stored(Stored),
}

/// A fault of a REST interface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RestFault {
    /// A nonce is stale when it is used.
    StaleNonces,
    /// Every POST is one too many.
    TooMany,
}

/// A supply that fails.
#[derive(Clone, Debug, PartialEq)]
pub struct Power {
    /// Off for so long.
    pub off: Option<Duration>,
    /// The supply's voltage from each instant on.
    pub dips: Vec<(Duration, f64)>,
    /// It is off below this voltage.
    pub least_v: f64,
}

impl Power {
    /// When the supply goes off and comes back, from the fault's begin; no end where only the fault's end is one.
    pub fn outage(&self) -> (Duration, Option<Duration>) {
        let low = |(_, volts): &&(Duration, f64)| *volts < self.least_v;
        let Some((first, _)) = self.dips.iter().find(low) else { return (Duration::ZERO, self.off) };
        let last_low = self.dips.iter().rposition(|(_, volts)| *volts < self.least_v);
        let back = last_low.and_then(|last| self.dips.get(last + 1)).map(|(at, _)| *at);
        (*first, back.or(self.off))
    }

    /// How long the fault lasts by itself.
    pub(crate) fn lasts(&self) -> Option<Duration> {
        self.off.or_else(|| self.outage().1)
    }
}

/// Dirt on the front screen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dirt {
    /// 1 a warning, 2 an error, 3 a serious error.
    pub level: u8,
    /// Beams between these device angles see nothing, degrees; all that the level says where absent.
    pub sector_deg: Option<(f64, f64)>,
    /// The level is reached step by step over this time.
    pub ramp: Duration,
}

/// A part that fails.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Broken {
    /// Which.
    pub part: Piece,
    /// The device stays out of order after the end, until it is restarted.
    pub until_reboot: bool,
}

/// A part of a scanner.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Piece {
    /// The mirror's motor.
    Motor,
    /// The laser.
    Laser,
    /// What cools or heats it.
    Temperature,
}

/// A refusal of commands.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Refusal {
    /// Commands that begin so, such as `sWN LMDscandatacfg` or `mEEwriteall`; every one where absent.
    pub command: Option<String>,
    /// What is answered.
    pub answer: Answer,
    /// SCdevicestate says busy meanwhile.
    pub busy: bool,
}

/// What is answered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Answer {
    /// `sFA` with this code.
    Code(u16),
    /// The method's own way to say no: its result is 0.
    Declined,
}

/// What a device is found with.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Stored {
    /// This dialect, `a` or `b`.
    pub dialect: Option<char>,
    /// Rate of an LMS2xx, bits a second.
    pub rate: Option<u32>,
    /// Other contents of scan telegrams and a narrower range of angles.
    pub config: bool,
    /// It streams to its line already.
    pub streaming: bool,
    /// A client is logged in and has stopped the scans.
    pub other_client: bool,
}
