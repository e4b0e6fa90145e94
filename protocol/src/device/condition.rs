//! What the scanner does at the moment: power-up, initialisation, standby, measuring, error.

use crate::time::SimTime;

/// The commanded state of laser and motor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Activity {
    #[default]
    Measuring,
    /// Laser off, the mirror turns.
    Standby,
    /// Laser and motor off.
    Stopped,
    /// Out of order.
    Error,
}

/// State, and the instants at which it will be another. In the bench profile they are all past.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Condition {
    pub(super) activity: Activity,
    /// A login has stopped the scans.
    pub(super) held_by_login: bool,
    /// Until then nothing is answered.
    pub(super) silent_until: SimTime,
    /// Until then STlms reports initialisation.
    pub(super) initialising_until: SimTime,
    /// Until then the motor speeds up.
    pub(super) rotating_until: SimTime,
    /// Until then STlms reports that measuring is prepared.
    pub(super) preparing_until: SimTime,
    /// From then on scans are made.
    pub(super) scans_from: SimTime,
    /// Until then SCdevicestate reports busy.
    pub(super) busy_until: SimTime,
    /// The scan mode is another than the one last measured in.
    pub(super) mode_changed: bool,
    /// LCMstate's level.
    pub(super) contamination: u8,
    pub(super) reboots: u32,
    pub(super) power_cycles: u32,
    /// Its supply is off.
    pub(super) off: bool,
}
