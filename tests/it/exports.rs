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
