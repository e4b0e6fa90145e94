//! Clients that have stopped reading: a bench sends all the same, and what nobody reads waits in the kernel.

use std::collections::BTreeMap;

use rowscan_bench::Bench;

use crate::scenario::Scenario;

/// Bytes that the clients of devices have not read, by the device's id: of those that have read less than half of what they were sent. Empty where the kernel
/// does not tell.
#[cfg(target_os = "linux")]
pub(crate) fn at_end(scenario: &Scenario, bench: &Bench) -> BTreeMap<String, u64> {
    use rowscan_bench::At;
    use rowscan_emulator::lockstep::{self, Unread};

    /// So much, a second of scans and more, is no telegram that has just come.
    const LEAST: u64 = 16 * 1024;

    let connections = lockstep::unread().unwrap_or_default();
    let of = |id: &str| {
        let is_here = |found: &&Unread| {
            let port = found.here.port();
            bench.places_of(id).any(|place| matches!(place.at, At::Address(at) if at.port() == port))
        };
        let has_stopped = |found: &&Unread| found.unread >= LEAST && 2 * found.unread > found.written;
        connections.iter().filter(is_here).find(has_stopped).map(|found| (id.to_owned(), found.unread))
    };
    scenario.devices.iter().filter_map(|device| of(&device.id)).collect()
}

#[cfg(not(target_os = "linux"))]
pub(crate) fn at_end(_: &Scenario, _: &Bench) -> BTreeMap<String, u64> {
    BTreeMap::new()
}
