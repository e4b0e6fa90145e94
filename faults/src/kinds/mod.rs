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
mod gap;
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

use std::sync::LazyLock;

use rowscan_settings::fault_table::ROWS;

use crate::fault::Fault;

/// Every fault of a byte path.
const OF_BYTES: &[&Fault] = &[
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

/// Every fault: of the byte path, then of the parts.
pub static FAULTS: LazyLock<Vec<Fault>> = LazyLock::new(|| {
    let parts = ROWS.iter().map(Fault::of_part);
    OF_BYTES.iter().map(|fault| **fault).chain(parts).collect()
});

/// What else goes wrong on a machine, and why no fault does it.
pub const NOT_HERE: &[(&str, &str)] = &[
    ("modem", "no modem lines are emulated; a pseudo-terminal has none, and RFC 2217 would carry them"),
    ("host_pause", "a child's fault, and only `rowscan check` runs a child: give it there, in a scenario"),
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
        for fault in FAULTS.iter() {
            for parameter in fault.parameters {
                assert!(!crate::spec::COMMON.contains(&parameter.key), "{}.{}", fault.name, parameter.key);
            }
        }
    }
}
