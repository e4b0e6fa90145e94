//! A flow meter that counts wrongly.

use crate::parameter::{Form, Parameter};
use crate::part_fault::PartFault;
use crate::row::{Family, Row};
use crate::sprayer::SprayerFault;

const FACTOR: Parameter =
    Parameter::new("factor", Form::Number(0.0, 10.0), "0.8", "pulses for one");

/// It counts others.
pub(in crate::rows) const ROW: Row = Row {
    name: "flow_meter_off",
    family: Family::Sprayer,
    parameters: &[FACTOR],
    about: "The flow meter counts so many pulses for one. What leaves the nozzles is not changed by it, only by what a controller makes of it.",
    reports: "flow beside pressure",
    recovery: "litres within what the meter costs",
    make: |settings| {
        let factor = settings.number("factor")?.unwrap_or(0.8);
        Ok(PartFault::Sprayer(SprayerFault::FlowMeterOff(factor)))
    },
};
