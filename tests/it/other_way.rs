//! A recording that holds a ground speed beside the encoder: whether an estimate says that both tell another way.

use serde_json::Value;

use crate::common::binary::{Telling, run};
use crate::common::recorded::folder;

/// How long the wheel slips, of 12 s.
const SLIPS: &str = "[[fault]]\nname = \"encoder\"\nslip = 0.25\nat = { s = 3 }\nfor = { s = 4 }\n";

/// What an estimate of this recording says of the two ways, and where it ended.
fn told(recording: &str, rig: &str, more: &[&str]) -> (Option<String>, f64) {
    let ended = run(&[&["estimate", recording, "--rig", rig, "--format", "json"], more].concat());
    let told: Value = serde_json::from_str(&ended.stdout).unwrap_or_else(|_| panic!("{}", ended.stderr));
    let mut warnings = told["warnings"].as_array().expect("a list").iter().filter_map(Value::as_str);
    let differ = warnings.find(|warning| warning.starts_with("ways_differ: ")).map(str::to_owned);
    (differ, told["advance_m"].as_f64().expect("a way"))
}

#[test]
fn a_slipping_wheel_and_a_wrong_speed_are_told_by_the_ground_speed_beside_the_scans() {
    let (_folder, file) = folder();
    let (rig, faults) = (file("row.toml"), file("faults.toml"));
    std::fs::write(&faults, SLIPS).expect("written");
    let other = file("other.toml");
    let scene = std::fs::read_to_string(&rig).expect("written");
    std::fs::write(&other, format!("{scene}[rig]\nspeed_m_s = 1.3\n")).expect("written");
    for (bus, name) in [("--can", "CAN"), ("--nmea", "GNSS")] {
        for slips in [false, true] {
            let (place, recording) =
                (file(&format!("{name}{slips}.log")), file(&format!("{name}{slips}.mcap")));
            let port = if bus == "--can" { format!("candump:{place}") } else { "tcp:127.0.0.1:0".to_owned() };
            let mut args = vec![rig.as_str(), bus, &port, "--tcp", "127.0.0.1:0", "--record", &recording];
            args.extend(["--time-scale", "max"]);
            if slips {
                args.extend(["--faults", &faults]);
            }
            let mut emulator = Telling::start("emulate", &args);
            emulator.address();
            let scanner = format!("tcp://{}", emulator.address());
            run(&["estimate", &scanner, "--rig", &rig, "--scans", "600", "--format", "json"]);
            emulator.end();
            let (differ, way_m) = told(&recording, &rig, &[]);
            assert_eq!(differ.is_some(), slips, "{name}: {way_m} m, {differ:?}");
            assert!(differ.is_none_or(|said| said.contains(&format!("beside it ({name})"))), "{name}");
            // Taken from the speed itself, there is nothing to compare.
            let advance = name.to_lowercase();
            assert_eq!(told(&recording, &rig, &["--advance", &advance]).0, None, "{name}");
            let constant = told(&recording, &other, &["--advance", "constant"]).0.expect("another speed");
            assert!(constant.contains("the rig's constant speed"), "{constant}");
            assert_eq!(told(&recording, &rig, &["--advance", "constant"]).0, None, "{name}");
        }
    }
}
