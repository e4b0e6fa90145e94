//! Faults of clocks. Time itself goes on: what is wrong is what stamps say.

use crate::fault_table::clock::ClockFault;
use crate::fault_table::parameter::{Form, Parameter};
use crate::fault_table::part_fault::PartFault;
use crate::fault_table::row::{Family, Row};
use crate::fault_table::vehicle::GnssFault;

/// A clock that runs too fast or too slow.
pub(super) const DRIFT: Row = Row {
    name: "clock_drift",
    family: Family::Clock,
    parameters: &[Parameter::new(
        "ppm",
        Form::Strength(-100_000.0, 100_000.0),
        "must be given",
        "too fast by so many parts per million, beside what it has",
    )],
    about: "The scanner's clock runs too fast or too slow: its µs stamps and its calendar. What it has gained stays.",
    reports: "drift",
    recovery: "areas unchanged; time corrected",
    make: |settings| Ok(PartFault::Clock(ClockFault::Drift { ppm: settings.needed("ppm")? })),
};

/// A clock that is set.
pub(super) const STEP: Row = Row {
    name: "clock_step",
    family: Family::Clock,
    parameters: &[Parameter::new(
        "s",
        Form::Strength(-3.2e9, 3.2e9),
        "must be given",
        "set forward by so many seconds; negative: back",
    )],
    about: "The scanner's clock is set: its µs stamps and its calendar. The end sets it back.",
    reports: "step",
    recovery: "areas unchanged; time corrected",
    make: |settings| Ok(PartFault::Clock(ClockFault::Step { s: settings.needed("s")? })),
};

/// A clock that wraps.
pub(super) const WRAP: Row = Row {
    name: "clock_wrap",
    family: Family::Clock,
    parameters: &[],
    about: "The µs stamps of scans reach 2^32 at this moment and begin at 0 again, as they do every 71.6 minutes. For this the clock starts at a value that makes it wrap then, as exactly as `s`, `row_m` or `tree` can be foreseen. The clock keeps running from there. Once scans were sent it is too late: it is refused.",
    reports: "nothing",
    recovery: "areas unchanged",
    make: |_| Ok(PartFault::Clock(ClockFault::Wrap)),
};

/// A host whose time jumps.
pub(super) const NTP_JUMP: Row = Row {
    name: "ntp_jump",
    family: Family::Clock,
    parameters: &[Parameter::new(
        "s",
        Form::Strength(-3.2e9, 3.2e9),
        "must be given",
        "later by so many seconds; negative: earlier",
    )],
    about: "The time that GNSS tells, in sentences and on the bus, jumps, as a host's does when NTP sets it. Simulated time goes on.",
    reports: "step",
    recovery: "areas unchanged; time corrected",
    make: |settings| Ok(PartFault::Gnss(GnssFault { time_s: settings.needed("s")?, ..GnssFault::default() })),
};
