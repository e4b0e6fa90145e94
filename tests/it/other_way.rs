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

/// What the way came from is in the recording of an estimate: the same estimate can be made again from it, and not from one without.
#[test]
fn an_estimate_s_recording_keeps_what_its_way_came_from() {
    let (_folder, file) = folder();
    let rig = file("row.toml");
    for by in ["gnss", "can"] {
        let (group, recording) = ("udp:239.74.163.77:43177", file(&format!("{by}.mcap")));
        let outputs = match by {
            "gnss" => ["--nmea", "tcp:127.0.0.1:0"],
            _ => ["--can", group],
        };
        let args = [&[rig.as_str(), "--tcp", "127.0.0.1:0", "--time-scale", "4"][..], &outputs].concat();
        let mut emulator = Telling::start("emulate", &args);
        // The scanner's own port is told last.
        let other = emulator.address();
        let scanner = format!("tcp://{}", emulator.address());
        let source = if by == "gnss" { format!("tcp:{other}") } else { group.to_owned() };
        let args =
            ["estimate", &scanner, "--rig", &rig, "--scans", "400", "--format", "json", "--advance", by];
        let flag = format!("--{by}");
        let live = run(&[&args[..], &[&flag, &source, "--record", &recording]].concat());
        emulator.end();
        let live: Value = serde_json::from_str(&live.stdout).unwrap_or_else(|_| panic!("{}", live.stderr));
        let way_m = live["advance_m"].as_f64().expect("a way");
        let (_, again_m) = told(&recording, &rig, &["--advance", by, "--scans", "400"]);
        assert!((again_m - way_m).abs() < 0.2 && way_m > 5.0, "{by}: {way_m} m, and {again_m} m again");
    }
}
