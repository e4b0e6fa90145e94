//! The table of faults of parts: one line a fault.

mod broken;
mod clock;
mod controller;
mod datagrams;
mod dirt;
mod drive;
mod encoder;
mod gnss;
mod node;
mod power;
mod refusal;
mod rest;
mod sprayer;
mod stored;
mod task_controller;

use crate::fault_table::row::Row;

/// Every fault of a part.
pub const ROWS: &[Row] = &[
    power::ROW,
    dirt::CONTAMINATION,
    dirt::POLLUTION,
    broken::MOTOR,
    broken::LASER,
    broken::TEMPERATURE,
    refusal::LOGIN,
    refusal::BUSY,
    refusal::EEPROM_FULL,
    refusal::FAULT_CODE,
    rest::STALE,
    rest::TOO_MANY,
    stored::ROW,
    clock::DRIFT,
    clock::STEP,
    clock::WRAP,
    clock::NTP_JUMP,
    encoder::ROW,
    gnss::ROW,
    drive::SPEED_COMMAND,
    drive::STOP,
    drive::REVERSE,
    drive::LATERAL,
    drive::BOUNCE,
    controller::OFF,
    controller::PASSIVE,
    controller::LOAD,
    controller::ERROR,
    controller::ACK_NONE,
    node::ADDRESS_STEAL,
    node::NO_TECU,
    node::TWO_TECU,
    node::NAME_CLASH,
    datagrams::UDP_LOSS,
    datagrams::UDP_DUP,
    datagrams::UDP_LATE,
    datagrams::UDP_REORDER,
    datagrams::UDP_FRAGMENT,
    sprayer::valve_stuck::ROW,
    sprayer::valve_slow::ROW,
    sprayer::coil_open::ROW,
    sprayer::undervoltage::ROW,
    sprayer::swapped_wires::ROW,
    sprayer::blocked_nozzle::ROW,
    sprayer::drip::ROW,
    sprayer::pump_low::ROW,
    sprayer::flow_meter_off::ROW,
    sprayer::master_off::ROW,
    sprayer::held_shut::ROW,
    sprayer::tank_empty::ROW,
    task_controller::tc_lost::ROW,
    task_controller::tc_busy::ROW,
    task_controller::ddop_refused::ROW,
    task_controller::heartbeat_stop::ROW,
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_their_keys_are_unique() {
        let unique = |mut names: Vec<&str>| {
            let all = names.len();
            names.sort_unstable();
            names.dedup();
            assert_eq!(names.len(), all, "{names:?}");
        };
        unique(ROWS.iter().map(|row| row.name).collect());
        for row in ROWS {
            unique(row.parameters.iter().map(|parameter| parameter.key).collect());
        }
    }
}
