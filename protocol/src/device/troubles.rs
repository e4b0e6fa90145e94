//! What can be wrong with a scanner for a while: its parts, what it refuses, how it was left.

use alloc::string::String;
use alloc::vec::Vec;

use crate::frame::Dialect;

/// Something that is wrong, from [`Device::begin_trouble`](super::Device::begin_trouble) to [`Device::end_trouble`](super::Device::end_trouble).
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Trouble {
    /// Dirt on the front screen.
    Dirt {
        /// 1 a warning, 2 an error, 3 a serious error.
        level: u8,
        /// From an error on, beams between these device angles see nothing, degrees.
        sector_deg: Option<(f64, f64)>,
    },
    /// Its REST interface refuses.
    Rest(RestTrouble),
    /// A part of it fails.
    Failure {
        /// Which.
        part: Part,
        /// It is out of order until a restart, also after the end.
        until_reboot: bool,
    },
    /// Commands are refused.
    Refusal {
        /// Those of this kind, this name, or both, such as `sWN LMDscandatacfg`; every one where absent.
        command: Option<String>,
        /// What is answered.
        answer: RefusedWith,
        /// SCdevicestate says busy, and without `command` only writes and methods are refused.
        busy: bool,
    },
}

/// A part of a scanner.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// The mirror's motor: no scans.
    Motor,
    /// The laser: no beam sees anything.
    Laser,
    /// What keeps its temperature.
    Temperature,
}

/// What a REST interface refuses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RestTrouble {
    /// A nonce is stale when it is used.
    StaleNonces,
    /// No password is right.
    Passwords,
    /// Every POST is one too many.
    TooMany,
}

/// How a command is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RefusedWith {
    /// By `sFA` and this code.
    Code(u16),
    /// By the method's own result 0.
    Zero,
}

/// How somebody left a scanner.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LeftBehind {
    /// This dialect was stored.
    pub dialect: Option<Dialect>,
    /// Scan telegrams were set up with remission, every second scan and half of the angles, and that was saved.
    pub other_scan_data: bool,
    /// The measurement was stopped.
    pub stopped: bool,
}

/// Everything that is wrong.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Troubles {
    pub(super) list: Vec<(u64, Trouble)>,
    /// Until the next restart.
    pub(super) lingering: Vec<Part>,
}

impl Troubles {
    pub(super) fn has(&self, part: Part) -> bool {
        let fails =
            |trouble: &Trouble| matches!(trouble, Trouble::Failure { part: other, .. } if *other == part);
        self.list.iter().any(|(_, trouble)| fails(trouble)) || self.lingering.contains(&part)
    }

    /// What a restart leaves.
    pub(super) fn after_restart(&self) -> Self {
        Self { list: self.list.clone(), lingering: Vec::new() }
    }
}
