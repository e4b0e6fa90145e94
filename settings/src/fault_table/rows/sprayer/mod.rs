//! Faults of a sprayer: one file each.

pub(super) mod blocked_nozzle;
pub(super) mod coil_open;
pub(super) mod drip;
pub(super) mod flow_meter_off;
pub(super) mod held_shut;
pub(super) mod master_off;
pub(super) mod pump_low;
pub(super) mod swapped_wires;
pub(super) mod tank_empty;
pub(super) mod undervoltage;
pub(super) mod valve_slow;
pub(super) mod valve_stuck;

use crate::TomlError;

use crate::fault_table::parameter::{Form, Parameter};
use crate::fault_table::settings::Settings;
use crate::fault_table::sprayer::Valves;

const SECTION: Parameter =
    Parameter::new("section", Form::Whole(1, 64), "all", "only the section with this number in commands");
const NOZZLE: Parameter =
    Parameter::new("nozzle", Form::Whole(0, 255), "all", "only the nozzle with this number, from 0");

/// Whose valves `section` or `nozzle` names.
fn valves(settings: &Settings<'_>) -> Result<Valves, TomlError> {
    let number = |key| -> Result<Option<u16>, TomlError> {
        Ok(settings.whole(key)?.and_then(|number| u16::try_from(number).ok()))
    };
    match (number("section")?, number("nozzle")?) {
        (Some(_), Some(_)) => {
            Err(settings.refuse("`section` and `nozzle` both say whose valves; leave one out"))
        }
        (Some(section), None) => Ok(Valves::Section(section)),
        (None, Some(nozzle)) => Ok(Valves::Nozzle(nozzle)),
        (None, None) => Ok(Valves::All),
    }
}
