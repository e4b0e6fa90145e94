//! Faults between a task controller and its client: one file each.

pub(super) mod ddop_refused;
pub(super) mod heartbeat_stop;
pub(super) mod tc_busy;
pub(super) mod tc_lost;
