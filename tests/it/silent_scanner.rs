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

/// A controller that trusts the last leaf area of a scanner whose cable is out sprays by it for ever.
#[test]
fn the_bus_says_that_a_silent_scanner_has_no_canopy() {
    const STALE: u8 = 14;
    let (_folder, file) = folder();
    let (rig, faults) = (file("row.toml"), file("faults.toml"));
    for (text, is_silent) in [
        ("[[fault]]\nname = \"stall\"\nat = { scan = 40 }\nfor = { s = 1.5 }\n", true),
        // The wrong twin: nothing happens to this one.
        ("", false),
    ] {
        std::fs::write(&faults, text).expect("written");
        let emulator = Emulator::start(&[&rig, "--faults", &faults]);
        let log = file(if is_silent { "silent.log" } else { "steady.log" });
        let bus = format!("candump:{log}");
        let ended = run(&["estimate", &emulator.url(), "--rig", &rig, "--scans", "120", "--can", &bus]);
        assert_eq!(ended.code, Some(0), "{}", ended.stderr);
        let statuses = withheld(&std::fs::read_to_string(&log).expect("a log"));
        let stale = statuses.iter().filter(|status| **status == STALE).count();
        if is_silent {
            // From half a second of silence on, ten times a second.
            assert!(stale >= 5, "{statuses:?}");
            assert_ne!(statuses.last(), Some(&STALE), "it is back: {statuses:?}");
        } else {
            assert!(!statuses.is_empty() && stale == 0, "{statuses:?}");
        }
    }
}
