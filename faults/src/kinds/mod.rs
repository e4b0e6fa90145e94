//! The table of faults: one file and one line each.

mod accept_close;
mod accept_silent;
mod bandwidth;
mod checksum;
mod coalesce;
mod delay;
mod dribble;
mod drop;
mod duplicate;
mod fin;
mod flip;
mod garble;
mod half_close;
mod half_open;
mod inject;
mod jitter;
mod length;
mod refuse;
mod reorder;
mod rst;
mod split;
mod stall;
mod truncate;

use crate::fault::Fault;

/// Every fault of a byte path.
pub const FAULTS: &[&Fault] = &[
    &split::FAULT,
    &coalesce::FAULT,
    &dribble::FAULT,
    &delay::FAULT,
    &jitter::FAULT,
    &stall::FAULT,
    &bandwidth::FAULT,
    &drop::FAULT,
    &duplicate::FAULT,
    &reorder::FAULT,
    &flip::FAULT,
    &checksum::FAULT,
    &length::FAULT,
    &truncate::FAULT,
    &inject::FAULT,
    &rst::FAULT,
    &fin::FAULT,
    &half_open::FAULT,
    &half_close::FAULT,
    &refuse::FAULT,
    &accept_silent::FAULT,
    &accept_close::FAULT,
    &garble::FAULT,
];

/// What else goes wrong on a machine, and why it is no fault of a byte path.
pub const NOT_HERE: &[(&str, &str)] = &[
    ("modem", "no modem lines are emulated"),
    ("power", "a device's fault"),
    ("contamination / pollution", "a device's fault; `emulate --contamination` sets it for a whole run"),
    ("motor / laser / temperature", "a device's fault"),
    ("login / busy / eeprom_full / fault_code", "a device's fault"),
    ("stored", "a device's fault; `emulate --state` gives stored settings"),
    ("clock_drift / clock_step / clock_wrap / ntp_jump", "a device clock's fault"),
    ("host_pause", "a child's fault: it needs a scenario that runs the child"),
    ("encoder", "a vehicle's fault"),
    ("gnss", "a vehicle's fault; the scene's `[gnss]` has outages for a whole run"),
    (
        "speed_command / stop / reverse / lateral / bounce",
        "a vehicle's fault; the scene's `[drive]` has them for a whole run",
    ),
    ("bus_off / bus_passive / bus_load / bus_error / ack_none", "a bus's fault"),
    ("address_steal / no_tecu / two_tecu / name_clash", "a bus's fault"),
    ("tc_lost / tc_busy / ddop_refused / heartbeat_stop", "needs the sprayer"),
    ("valve_stuck / valve_slow / pump_low / flow_meter_off", "needs the sprayer"),
    ("udp_loss / udp_dup", "no stream of a scanner is UDP here"),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_unique_and_no_parameter_hides_a_common_key() {
        let mut names: Vec<&str> = FAULTS.iter().map(|fault| fault.name).collect();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), FAULTS.len());
        for fault in FAULTS {
            for parameter in fault.parameters {
                assert!(!crate::spec::COMMON.contains(&parameter.key), "{}.{}", fault.name, parameter.key);
            }
        }
    }
}
