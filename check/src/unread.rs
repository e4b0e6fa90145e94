//! Clients that have stopped reading, or read slower than scans come: a bench sends all the same, and what nobody reads waits in the kernel.

use std::collections::BTreeMap;
use std::time::Duration;

use rowscan_bench::Bench;

use crate::scenario::Scenario;

/// Bytes that the clients of devices have not read, by the device's id: of those that are a second of scans and more behind, after a drive that took so long.
/// Empty where the kernel does not tell.
#[cfg(target_os = "linux")]
pub(crate) fn at_end(scenario: &Scenario, bench: &Bench, took: Duration) -> BTreeMap<String, u64> {
    use rowscan_bench::At;
    use rowscan_emulator::lockstep::{self, Unread};

    let connections = lockstep::unread().unwrap_or_default();
    let of = |id: &str| {
        let is_here = |found: &&Unread| {
            bench.places_of(id).any(|place| match place.at {
                At::Address(at) if place.kind == "udp" => found.written.is_none() && at == found.peer,
                At::Address(at) => found.written.is_some() && at.port() == found.here.port(),
                _ => false,
            })
        };
        let is_behind = |found: &&Unread| found.unread >= most(found.written, took);
        connections.iter().filter(is_here).find(is_behind).map(|found| (id.to_owned(), found.unread))
    };
    scenario.devices.iter().filter_map(|device| of(&device.id)).collect()
}

#[cfg(not(target_os = "linux"))]
pub(crate) fn at_end(_: &Scenario, _: &Bench, _: Duration) -> BTreeMap<String, u64> {
    BTreeMap::new()
}

/// From so many unread bytes on a client is behind: what a second of this drive wrote, and never so little that it may have come just now.
#[cfg_attr(not(target_os = "linux"), expect(dead_code, reason = "nothing is known to compare"))]
fn most(written: Option<u64>, took: Duration) -> u64 {
    const LEAST: u64 = 16 * 1024;
    /// Of datagrams, which take more memory than bytes: a third of what a socket takes by default.
    const DATAGRAMS: u64 = 64 * 1024;

    let Some(written) = written else { return DATAGRAMS };
    // Of a drive of less than a second it is all that was written.
    let a_second = written as f64 / took.as_secs_f64().max(1.0);
    (a_second as u64).max(LEAST)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_second_of_scans_is_behind_and_what_has_just_come_is_not() {
        let seconds = |s: f64| Duration::from_secs_f64(s);
        assert_eq!(most(Some(920_000), seconds(10.0)), 92_000);
        assert_eq!(most(Some(40_000), seconds(0.5)), 40_000, "all of a short drive");
        assert_eq!(most(Some(40_000), seconds(10.0)), 16 * 1024);
        assert_eq!(most(None, seconds(10.0)), 64 * 1024);
    }
}
