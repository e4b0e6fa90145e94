//! A pump that gives less than it should.

use crate::fault_table::parameter::{Form, Parameter};
use crate::fault_table::part_fault::PartFault;
use crate::fault_table::row::{Family, Row};
use crate::fault_table::sprayer::SprayerFault;

const SHARE: Parameter =
    Parameter::new("share", Form::Number(0.0, 2.0), "0.5", "share of its flow that is left");

/// It gives less.
pub(in crate::fault_table::rows) const ROW: Row = Row {
    name: "pump_low",
    family: Family::Sprayer,
    parameters: &[SHARE],
    about: "The pump gives this share of its flow. It needs `[hydraulics]` in boom.toml: without, the pressure is constant.",
    reports: "pressure below its aim",
    recovery: "opens the regulating valve less; tells the driver",
    make: |settings| {
        let share = settings.number("share")?.unwrap_or(0.5);
        Ok(PartFault::Sprayer(SprayerFault::PumpLow(share)))
    },
};
