//! Parquet of a real run, read back column by column: NumPy, LAS, PLY and CSV are read by their users' programs in `tools/python`.

use crate::common;

use std::fs::File;

use common::binary::{Emulator, run};
use parquet::basic::Compression;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::record::Field;
use rowscan_protocol::host::HostEvent;
use rowscan_recording::{Recording, ScanReader, StreamKind};

#[test]
fn parquet_holds_every_return_of_a_run() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = |name: &str| folder.path().join(name).to_str().expect("UTF-8").to_owned();
    let (recorded, exported) = (file("run.mcap"), file("points.parquet"));
    std::fs::write(file("row.toml"), "version = 1\n[orchard]\ntrees = 2\n[orchard.tree]\niterations = 7\n")
        .expect("written");
    let emulator = Emulator::start(&[&file("row.toml"), "--time-scale", "10"]);
    let ended = run(&["record", &emulator.url(), "-o", &recorded, "--scans", "20", "--decoded", "none"]);
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    let ended = run(&["export", &recorded, "--to", "parquet", "-o", &exported]);
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);

    let mut recording = Recording::open(recorded.as_ref()).expect("it opens");
    let mut reader = ScanReader::new(StreamKind::Cola, 64 * 1024).expect("a scanner's");
    let (mut sent, mut scans) = (Vec::new(), 0);
    while let Some(packet) = recording.next_packet().expect("it reads") {
        reader.push(std::time::Duration::ZERO, &packet);
        while let Some(event) = reader.next_event() {
            assert_eq!(event, HostEvent::Scan);
            let ranges = reader.scan().echoes[0].range_m.iter().enumerate();
            sent.extend(ranges.filter(|(_, m)| m.is_finite()).map(|(beam, m)| (scans, beam as u32, *m)));
            scans += 1;
        }
    }
    assert!(scans >= 20 && sent.len() > 1000);
    let reader = SerializedFileReader::new(File::open(&exported).expect("there")).expect("parquet");
    let mut found = Vec::new();
    for row in reader.get_row_iter(None).expect("rows") {
        let row = row.expect("a row");
        let whole = |name: &str| match row.get_column_iter().find(|(column, _)| *column == name) {
            Some((_, Field::UInt(value))) => *value,
            Some((_, Field::Int(value))) => *value as u32,
            other => panic!("{name}: {other:?}"),
        };
        let range = match row.get_column_iter().find(|(column, _)| *column == "range_m") {
            Some((_, Field::Double(value))) => *value,
            other => panic!("range_m: {other:?}"),
        };
        found.push((whole("scan"), whole("beam"), range));
    }
    assert_eq!(found, sent);
    // Plain columns take 68 bytes a point. A scan's time and number, and what there is few of, are entries of dictionaries.
    let bytes = std::fs::metadata(&exported).expect("there").len();
    assert!(bytes < 40 * sent.len() as u64, "{bytes} bytes of {} points", sent.len());
    let group = reader.metadata().row_group(0);
    for column in group.columns() {
        assert_eq!(column.compression(), Compression::SNAPPY, "{}", column.column_path());
    }
}

/// A table whose host times are unknown, or some of them, is converted whole: by the device's clock, as raw bytes are.
#[test]
fn scans_without_a_host_time_are_kept_when_a_table_is_converted() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = |name: &str| folder.path().join(name).to_str().expect("UTF-8").to_owned();
    let head = "# rowscan ranges 1; model lms111; frequency_hz 50; start_deg 45; step_deg 0.5; unit mm\nreceived_s,telegram_counter,scan_time_us,status,range_0,range_1\n";
    for (case, unknown) in [("none", 0..0), ("some", 3..7), ("all", 0..20)] {
        let line = |n: u32| {
            let received = if unknown.contains(&n) {
                String::new()
            } else {
                format!("{:.2}", 5.0 + f64::from(n) * 0.02)
            };
            format!("{received},{n},{},0,1500,1600\n", 20_000 * n)
        };
        std::fs::write(file("scans.csv"), format!("{head}{}", (0..20).map(line).collect::<String>()))
            .expect("written");
        let new = file(&format!("{case}.mcap"));
        let converted = run(&["record", &file("scans.csv"), "-o", &new]);
        assert_eq!(converted.code, Some(0), "{case}: {}", converted.stderr);
        let told = run(&["record", "--info", &new, "--format", "json"]);
        let info: serde_json::Value = serde_json::from_str(&told.stdout).expect("JSON");
        assert_eq!(info["streams"][0]["scans"].as_u64(), Some(20), "{case}: {info}");
    }
}

/// What an export says of its scans is what `record --info` and an estimate count, whatever happened on the way.
#[test]
fn an_export_counts_as_an_estimate_does() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = |name: &str| folder.path().join(name).to_str().expect("UTF-8").to_owned();
    let head = "# rowscan ranges 1; frequency_hz 50; start_deg 45; step_deg 0.5; unit mm\nreceived_s,telegram_counter,scan_time_us,status,range_0,range_1\n";
    // Number and device time of each scan: in order, twice the same, one overtaken by two, one missing, and a device that begins anew at once.
    let order = |numbers: &[u32]| numbers.iter().map(|n| (*n, 20_000 * n)).collect::<Vec<_>>();
    let anew: Vec<(u32, u32)> =
        (1..20).map(|n| (n, 20_000 * n)).chain((1..20).map(|n| (n, 20_000 * n - 7_000))).collect();
    type Case = (&'static str, Vec<(u32, u32)>, [u64; 4]);
    let cases: [Case; 5] = [
        ("in order", order(&[1, 2, 3, 4, 5, 6]), [0, 0, 0, 0]),
        ("repeated", order(&[1, 2, 3, 2, 3, 3, 4]), [3, 0, 0, 0]),
        ("late", order(&[1, 2, 4, 5, 3, 6]), [0, 1, 0, 0]),
        ("lost", order(&[1, 2, 3, 6, 7]), [0, 0, 2, 0]),
        ("restarted", anew, [0, 0, 0, 1]),
    ];
    for (name, scans, [repeated, late, lost, restarts]) in cases {
        let lines: Vec<String> = (0..)
            .zip(&scans)
            .map(|(at, (number, time_us))| {
                format!("{}.{:02},{number},{time_us},0,1500,1600\n", at / 50, at % 50 * 2)
            })
            .collect();
        std::fs::write(file("scans.csv"), format!("{head}{}", lines.concat())).expect("written");
        let told = run(&["record", "--info", &file("scans.csv"), "--format", "json"]);
        let info: serde_json::Value = serde_json::from_str(&told.stdout).expect("JSON");
        let stream = &info["streams"][0];
        let counted = ["scans_repeated", "scans_late", "restarts"].map(|key| stream[key].as_u64());
        assert_eq!(counted, [Some(repeated), Some(late), Some(restarts)], "{name}: {stream}");
        assert_eq!(stream["scans_lost"].as_u64(), (restarts == 0).then_some(lost), "{name}");
        let exported = run(&[
            "export",
            &file("scans.csv"),
            "--to",
            "csv",
            "--what",
            "scans",
            "-o",
            &file(&format!("{name}.csv")),
        ]);
        assert_eq!(exported.code, Some(0), "{name}: {}", exported.stderr);
        for (count, text) in [
            (repeated, "scans came again"),
            (late, "scans came behind later ones"),
            (lost, "scans are missing"),
            (restarts, "began to count anew"),
        ] {
            let said = exported.stderr.lines().find(|line| line.contains(text));
            assert_eq!(said.is_some(), count > 0, "{name}: {}", exported.stderr);
            assert!(said.is_none_or(|line| line.contains(&format!(" {count} "))), "{name}: {said:?}");
        }
    }
}
