//! A flow meter that tells less or more than flows.

use crate::fault_table::parameter::{Form, Parameter};
use crate::fault_table::part_fault::PartFault;
use crate::fault_table::row::{Family, Row};
use crate::fault_table::sprayer::SprayerFault;

const RATIO: Parameter = Parameter::new(
    "ratio",
    Form::Number(0.0, 10.0),
    "0.8",
    "it tells so many times the flow; 0 is no pulse at all",
);

/// It tells another flow.
pub(in crate::fault_table::rows) const ROW: Row = Row {
    name: "flow_meter_off",
    family: Family::Sprayer,
    parameters: &[RATIO],
    about: "The flow meter tells so many times the flow. It needs `[sensors]` in boom.toml: without, nobody hears the meter.",
    reports: "a flow that pressure and open nozzles do not explain",
    recovery: "goes by pressure; tells the driver",
    make: |settings| {
        let ratio = settings.number("ratio")?.unwrap_or(0.8);
        Ok(PartFault::Sprayer(SprayerFault::FlowMeterOff(ratio)))
    },
};
