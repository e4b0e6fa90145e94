//! The wires of two sections, each in the other's plug.

use crate::fault_table::parameter::{Form, Parameter};
use crate::fault_table::part_fault::PartFault;
use crate::fault_table::row::{Family, Row};
use crate::fault_table::sprayer::SprayerFault;

const ONE: Parameter = Parameter::new("section", Form::Whole(1, 64), "1", "one of the two, by its number");
const OTHER: Parameter = Parameter::new("with", Form::Whole(1, 64), "2", "the other one");

/// Each gets the other's commands.
pub(in crate::fault_table::rows) const ROW: Row = Row {
    name: "swapped_wires",
    family: Family::Sprayer,
    parameters: &[ONE, OTHER],
    about: "Two sections get each other's commands.",
    reports: "feedback of another section",
    recovery: "tells the driver",
    make: |settings| {
        let number = |key, default| Ok(settings.count(key, default)?.try_into().unwrap_or(u16::MAX));
        let (one, other) = (number("section", 1)?, number("with", 2)?);
        if one == other {
            return Err(settings
                .refuse("`section` and `with`: expected two sections, found one: nothing would happen"));
        }
        Ok(PartFault::Sprayer(SprayerFault::SwappedWires(one, other)))
    },
};
