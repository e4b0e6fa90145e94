//! Clients that have stopped reading, or read slower than scans come: a bench sends all the same, and what nobody reads waits in the kernel.

use std::collections::BTreeMap;
use std::time::Duration;

use rowscan_bench::{At, Bench, Place};
use rowscan_emulator::lockstep;
use rowscan_ports::clock::{Stopwatch, rest};

use crate::scenario::{Mode, Scenario};

/// In lockstep clients have read all but what the last instant sent, and take that within so long.
const LAST_INSTANT: Duration = Duration::from_secs(1);
const EVERY: Duration = Duration::from_millis(20);

/// Bytes that the clients of devices have not read, by the device's id: of those that are a second of scans and more behind, after a drive that took so long.
/// Empty where the kernel does not tell.
pub(crate) async fn at_end(scenario: &Scenario, bench: &Bench, took: Duration) -> BTreeMap<String, u64> {
    let patience = if scenario.clock.mode == Mode::Lockstep { LAST_INSTANT } else { Duration::ZERO };
    let waited = Stopwatch::start();
    loop {
        let unread = now(scenario, bench, took);
        if unread.is_empty() || waited.elapsed() >= patience {
            return unread;
        }
        rest(EVERY).await;
    }
}

fn now(scenario: &Scenario, bench: &Bench, took: Duration) -> BTreeMap<String, u64> {
    let connections = lockstep::unread().unwrap_or_default();
    let unread_at = |place: &Place| {
        let At::Address(at) = place.at else { return None };
        if place.kind == "udp" {
            return lockstep::unread_datagrams(at).ok().filter(|unread| *unread >= DATAGRAMS);
        }
        let here = connections.iter().filter(|found| found.here.port() == at.port());
        here.map(|found| (found.unread, most(found.written, took)))
            .find_map(|(unread, most)| (unread >= most).then_some(unread))
    };
    let of = |id: &str| Some((id.to_owned(), bench.places_of(id).find_map(unread_at)?));
    scenario.devices.iter().filter_map(|device| of(&device.id)).collect()
}

/// From so much memory of unread datagrams on a client is behind: a third of what a socket takes by default.
const DATAGRAMS: u64 = 64 * 1024;

/// From so many unread bytes of a connection on a client is behind: what a second of this drive wrote, and never so little that it may have come just now.
fn most(written: u64, took: Duration) -> u64 {
    const LEAST: u64 = 16 * 1024;
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
        assert_eq!(most(920_000, seconds(10.0)), 92_000);
        assert_eq!(most(40_000, seconds(0.5)), 40_000, "all of a short drive");
        assert_eq!(most(40_000, seconds(10.0)), 16 * 1024);
    }
}
