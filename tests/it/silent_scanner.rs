//! A live scanner that falls silent: the bus says so while it lasts.

use crate::common::binary::{Emulator, run};
use crate::common::recorded::folder;

/// Why leaf areas are withheld, frame by frame, as `CanopyLeafStatus` (PGN 65301) has it in its first byte.
fn withheld(log: &str) -> Vec<u8> {
    let status = |line: &str| {
        let (id, data) = line.split_whitespace().nth(2)?.split_once('#')?;
        id.contains("FF15").then(|| u8::from_str_radix(data.get(..2)?, 16).ok())?
    };
    log.lines().filter_map(status).collect()
}

/// What the bus tells while 120 scans come of a scanner with these faults.
fn told(faults: &str) -> Vec<u8> {
    let (_folder, file) = folder();
    let (rig, plan, log) = (file("row.toml"), file("faults.toml"), file("bus.log"));
    std::fs::write(&plan, faults).expect("written");
    let emulator = Emulator::start(&[&rig, "--faults", &plan]);
    let bus = format!("candump:{log}");
    let ended = run(&["estimate", &emulator.url(), "--rig", &rig, "--scans", "120", "--can", &bus]);
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    withheld(&std::fs::read_to_string(&log).expect("a log"))
}

const STALE: u8 = 14;

fn stale(statuses: &[u8]) -> usize {
    statuses.iter().filter(|status| **status == STALE).count()
}

/// A controller that trusts the last leaf area of a scanner whose cable is out sprays by it for ever.
#[test]
fn the_bus_says_that_a_silent_scanner_has_no_canopy() {
    let silent = told("[[fault]]\nname = \"stall\"\nat = { scan = 40 }\nfor = { s = 1.5 }\n");
    // From half a second of silence on, ten times a second.
    assert!(stale(&silent) >= 5, "{silent:?}");
    assert_ne!(silent.last(), Some(&STALE), "it is back: {silent:?}");
    // The wrong twin: nothing happens to this one.
    let steady = told("");
    assert!(!steady.is_empty() && stale(&steady) == 0, "{steady:?}");
}

/// The bus goes by the scanner's clock, and does not wait for one that was set back.
#[test]
fn a_clock_that_is_set_back_does_not_stop_the_bus() {
    let steady = told("");
    let set_back = told("[[fault]]\nname = \"clock_step\"\ns = -20\nat = { scan = 40 }\n");
    assert!(set_back.len() * 10 >= steady.len() * 7, "{} frames for {}", set_back.len(), steady.len());
    assert_eq!(stale(&set_back), 0, "{set_back:?}");
}
