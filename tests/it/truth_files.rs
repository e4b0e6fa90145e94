//! The truth of a drive as files: `emulate --truth` and `orchard truth --cells`.

use std::fs;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::path::Path;

use rowscan::feature::Feature;
use rowscan_protocol::frame::{Accept, Dialect, FrameDecoder};
use rowscan_protocol::telegram::{LmdScandata, Telegram};
use serde_json::Value;

use crate::common::binary::{Telling, assert_says, refused, run, text};

/// Drives past a row as fast as it goes; the scans that a client got, and the records of the truth.
fn driven(truth: &Path, arguments: &[&str]) -> (Vec<LmdScandata>, Vec<Value>) {
    let all =
        ["spindle", "--seed", "3", "--tcp", "127.0.0.1:0", "--time-scale", "max", "--truth", text(truth)];
    let mut telling = Telling::start("emulate", &[&all[..], arguments].concat());
    let mut client = TcpStream::connect(telling.address()).expect("it listens");
    client.write_all(b"\x02sEN LMDscandata 1\x03").expect("sent");
    let mut bytes = Vec::new();
    client.read_to_end(&mut bytes).expect("it ends in order");
    while telling.next().is_some() {}
    // The file is in its place before standard output ends.
    let records = json_lines(&fs::read_to_string(truth).expect("written"));
    let mut decoder = FrameDecoder::new(Accept::Either, 64 * 1024);
    let mut scans = Vec::new();
    for chunk in bytes.chunks(1024) {
        decoder.push(chunk);
        while let Some(frame) = decoder.next_frame() {
            let telegram = Telegram::parse(Dialect::A, frame.payload).expect("a telegram");
            // The first one answers the subscription.
            if frame.payload.starts_with(b"sSN") {
                scans.push(telegram.args.decode().expect("a scan"));
            }
        }
    }
    (scans, records)
}

fn json_lines(text: &str) -> Vec<Value> {
    text.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect()
}

fn number(record: &Value, key: &str) -> f64 {
    record[key].as_f64().unwrap_or_else(|| panic!("{key} in {record}"))
}

/// Sum of an area over some records.
fn sum<'a>(records: impl Iterator<Item = &'a Value>, key: &str) -> f64 {
    records.map(|record| number(record, key)).sum()
}

#[test]
fn each_scan_has_its_place_and_the_same_seed_the_same_bytes() {
    let folder = tempfile::tempdir().expect("a folder");
    let [one, other] = ["one.jsonl", "other.jsonl"].map(|name| folder.path().join(name));
    let (scans, records) = driven(&one, &["--seconds", "2"]);
    driven(&other, &["--seconds", "2"]);
    assert_eq!(fs::read(&one).expect("written"), fs::read(&other).expect("written"));
    assert_eq!((scans.len(), records.len()), (101, 101));
    // The rig drives 1 m/s from 0 on, from the first scan on.
    for (scan, record) in scans.iter().zip(&records) {
        assert_eq!(record["telegram_counter"], scan.telegram_counter);
        let device_s = f64::from(scan.scan_time_us - scans[0].scan_time_us) * 1e-6;
        let truth_s = number(record, "t_s") - number(&records[0], "t_s");
        assert!((device_s - truth_s).abs() < 2e-6, "{device_s} {truth_s}");
        assert!((number(record, "y_m") - truth_s).abs() < 1e-6, "{record}");
        assert_eq!((number(record, "x_m"), number(record, "slip")), (-2.0, 0.0));
        assert_eq!((&record["row"], &record["alley"]), (&0.into(), &0.into()));
        assert_eq!(record.get("left"), None, "there is no row to its left");
    }
}

#[test]
fn what_is_beside_the_scanner_is_what_the_cells_of_the_orchard_hold() {
    let folder = tempfile::tempdir().expect("a folder");
    let (_, records) = driven(&folder.path().join("truth.jsonl"), &["--seconds", "2"]);
    let cells = run(&["orchard", "truth", "spindle", "--seed", "3", "--cells", "--format", "jsonl"]);
    let cells = json_lines(&cells.stdout);
    let mut leafy = 0;
    for record in records.iter().step_by(7) {
        let right = &record["right"];
        let (from_m, to_m) = (number(right, "y_from_m"), number(right, "y_to_m"));
        assert!((from_m - 1e-9..=to_m + 1e-9).contains(&number(record, "y_m")), "{record}");
        for band in right["bands"].as_array().expect("bands") {
            let inside = |cell: &&Value| {
                cell["row"] == right["row"]
                    && cell["y_from_m"] == right["y_from_m"]
                    && cell["z_from_m"] == band["z_from_m"]
            };
            for key in ["leaf_area_m2", "wood_area_m2", "fruit_area_m2"] {
                let expected = sum(cells.iter().filter(inside), key);
                assert!((number(band, key) - expected).abs() < 1e-9, "{key} of {band}: {expected}");
            }
            leafy += usize::from(number(band, "leaf_area_m2") > 0.0);
        }
    }
    assert!(leafy > 20, "{leafy}");
    // The command's own totals are of the first row; so are the cells of this scene.
    let whole = run(&["orchard", "truth", "spindle", "--seed", "3", "--format", "json"]);
    let whole: Value = serde_json::from_str(&whole.stdout).expect("JSON");
    for key in ["leaf_area_m2", "wood_area_m2"] {
        assert!((sum(cells.iter(), key) - number(&whole, key)).abs() < 1e-9, "{key}");
    }
}

#[test]
fn a_fault_that_moves_the_tractor_shows_and_one_that_lies_about_it_does_not() {
    let folder = tempfile::tempdir().expect("a folder");
    let drive = |name: &str, faults: &str| {
        let (file, truth) = (folder.path().join(name), folder.path().join(format!("{name}.jsonl")));
        fs::write(&file, format!("[[fault]]\n{faults}\nat = {{ s = 2 }}\n")).expect("written");
        driven(&truth, &["--seconds", "4", "--faults", text(&file)]).1
    };
    let last = |records: &[Value], key| number(records.last().expect("records"), key);
    let aside = drive("lateral.toml", "name = \"lateral\"\non = \"tractor\"\nm = 0.5\nover_s = 0");
    assert_eq!((number(&aside[0], "x_m"), last(&aside, "x_m")), (-2.0, -1.5));
    let stop = drive("stop.toml", "name = \"stop\"\non = \"tractor\"\nchange_m_s2 = 1.0");
    // 1 m/s down to 0 in a second, some 1.98 s after the drive began: 1.98 m and half a metre.
    assert_eq!(last(&stop, "speed_m_s"), 0.0);
    assert!((last(&stop, "y_m") - 2.48).abs() < 0.021, "{}", last(&stop, "y_m"));
    assert_eq!(stop.last().expect("records").get("slip"), None, "unknown at standstill");
    let honest = driven(&folder.path().join("honest.jsonl"), &["--seconds", "4"]).1;
    assert_eq!(drive("encoder.toml", "name = \"encoder\"\non = \"encoder\"\nstuck = true"), honest);
}

#[test]
fn a_name_of_another_format_is_refused_and_a_drive_that_is_killed_leaves_nothing() {
    let said = refused(&["emulate", "spindle", "--truth", "truth.parquet"]);
    assert_says(&said, &["JSON lines", "truth.jsonl", ".parquet"]);
    let said = refused(&["emulate", "spindle", "--no-scanner", "--truth", "truth.jsonl"]);
    assert_says(&said, &["--truth", "cannot be used with", "--no-scanner"]);
    let folder = tempfile::tempdir().expect("a folder");
    let truth = folder.path().join("truth.jsonl");
    fs::write(&truth, "old").expect("written");
    let mut telling =
        Telling::start("emulate", &["spindle", "--tcp", "127.0.0.1:0", "--truth", text(&truth)]);
    telling.address();
    drop(telling);
    assert_eq!(fs::read_to_string(&truth).expect("there"), "old");
    for before in [Some("old"), None] {
        if before.is_none() {
            fs::remove_file(&truth).expect("removed");
        }
        let mut telling =
            Telling::start("emulate", &["spindle", "--tcp", "127.0.0.1:0", "--truth", text(&truth)]);
        telling.address();
        assert_eq!(telling.next().expect("it is ready")["event"], "ready");
        telling.end();
        let after = fs::read_to_string(&truth).ok();
        assert_eq!(after.as_deref(), before, "ended in order without a scan");
    }
}

#[test]
fn cells_go_to_files_and_a_side_sees_part_of_them() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name);
    let cells = |name: &str, more: &[&str]| {
        let to = path(name);
        let asked = ["orchard", "truth", "checker", "--cells", "--band", "1", "--output", text(&to)];
        let ended = run(&[&asked[..], more].concat());
        assert_eq!(ended.code, Some(0), "{}", ended.stderr);
        fs::read(to).expect("written")
    };
    let listed: Value = serde_json::from_slice(&cells("cells.json", &[])).expect("JSON");
    let listed = listed.as_array().expect("cells");
    let truth: Value =
        serde_json::from_str(&run(&["orchard", "truth", "checker", "--format", "json"]).stdout)
            .expect("JSON");
    assert!((sum(listed.iter(), "leaf_area_m2") - number(&truth, "leaf_area_m2")).abs() < 1e-9);
    assert_eq!(json_lines(&String::from_utf8(cells("cells.jsonl", &[])).expect("text")), *listed);
    assert!(!Feature::Tables.is_built() || cells("cells.parquet", &[]).starts_with(b"PAR1"));
    let seen = String::from_utf8(cells("seen.csv", &["--seen-from", "left"])).expect("text");
    assert!(seen.starts_with("row,tree,y_from_m,y_to_m,z_from_m,z_to_m,leaf_area_m2"), "{seen:.80}");
    let column = |name: &str| -> f64 {
        let at = seen.lines().next().expect("a header").split(',').position(|found| found == name);
        let at = at.expect("a column");
        seen.lines()
            .skip(1)
            .map(|line| line.split(',').nth(at).expect("a field").parse::<f64>().expect(name))
            .sum()
    };
    // Nothing stands before a checkered wall.
    assert!((column("leaf_visible_m2") / column("leaf_area_m2") - 1.0).abs() < 1e-6);
    let refused = run(&["orchard", "truth", "checker", "--cells", "--output", text(&path("cells.xlsx"))]);
    assert!(refused.code == Some(2) && refused.stderr.contains(".parquet"), "{}", refused.stderr);
    let none = run(&["orchard", "truth", "checker", "--cells", "--cell", "0"]);
    assert!(none.code == Some(2) && none.stderr.contains("positive number of metres"), "{}", none.stderr);
}
