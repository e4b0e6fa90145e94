//! One of the paper's scans on the command line: its files, and what cannot be scanned.
#![allow(
    clippy::expect_used,
    clippy::panic,
    clippy::print_stderr,
    reason = "a test fails by panicking and says what it skips"
)]

use crate::common;

use std::io;

use common::binary::{assert_says, refused, run, text};

#[test]
fn a_scan_writes_the_matrix_and_every_return_and_says_when_it_sees_nothing() {
    let folder = tempfile::tempdir().expect("a folder");
    let prefix = folder.path().join("row");
    let scanned = run(&[
        "scan",
        "spindle",
        "--two-rows",
        "--dy",
        "0.1",
        "--dtheta",
        "1",
        "--output",
        text(&prefix),
        "--write",
        "matrix,npy,csv,ply,las",
        "--format",
        "json",
    ]);
    assert_eq!(scanned.code, Some(0), "{}", scanned.stderr);
    let scans: serde_json::Value = serde_json::from_str(&scanned.stdout).expect("json");
    assert_eq!((&scans[0]["type"], &scans[1]["type"]), (&"opposite".into(), &"lateral".into()));
    assert_ne!(scans[0]["leaf_area_m2"], scans[1]["leaf_area_m2"], "different trees left and right");
    let read = |end: &str| std::fs::read(folder.path().join(format!("row{end}"))).expect(end);
    for (scan, side) in [(&scans[0], "_left"), (&scans[1], "_right")] {
        let matrix = String::from_utf8(read(&format!("{side}_L.csv"))).expect("UTF-8");
        let rows: Vec<&str> = matrix.lines().filter(|line| !line.starts_with('#')).collect();
        assert_eq!(Some(rows.len() as u64), scan["beams"].as_u64());
        assert!(rows.iter().all(|row| Some(row.split(',').count() as u64) == scan["lines"].as_u64()));
        let escapes = rows.iter().flat_map(|row| row.split(',')).filter(|range| *range == "1000").count();
        assert_eq!(Some(escapes as u64), scan["escapes"].as_u64());

        let npy = read(&format!("{side}_L.npy"));
        let (head, numbers) = npy.split_at(10 + usize::from(u16::from_le_bytes([npy[8], npy[9]])));
        let shape = format!("'shape': ({}, {})", rows.len(), scan["lines"]);
        let dictionary = String::from_utf8_lossy(&head[10..]);
        assert!(npy.starts_with(b"\x93NUMPY\x01\x00") && head.len() % 64 == 0 && dictionary.contains(&shape));
        let values =
            rows.iter().flat_map(|row| row.split(',')).map(|range| range.parse::<f64>().expect("a number"));
        let floats = numbers.chunks_exact(4).map(|four| f32::from_le_bytes(four.try_into().expect("four")));
        assert!(values.map(|range| range as f32).eq(floats), "the same matrix");
        let told = String::from_utf8(read(&format!("{side}_L.txt"))).expect("UTF-8");
        assert!(!told.is_empty() && matrix.starts_with(&told));

        let points = String::from_utf8(read(&format!("{side}_points.csv"))).expect("UTF-8");
        let first: Vec<&str> =
            points.lines().skip(1).filter(|line| line.split(',').nth(6) == Some("1")).collect();
        let of =
            |class: &str| first.iter().filter(|line| line.split(',').nth(3) == Some(class)).count() as u64;
        for (class, key) in [("leaf", "leaf_hits"), ("wood", "wood_hits"), ("ground", "ground_hits")] {
            assert_eq!(Some(of(class)), scan[key].as_u64(), "{class}");
        }
        let count = points.lines().count() - 1;
        let mut cloud =
            las::Reader::from_path(folder.path().join(format!("row{side}_points.las"))).expect("LAS");
        assert_eq!(cloud.header().number_of_points(), count as u64);
        let described = cloud.header().vlrs().iter().find(|vlr| vlr.record_id == 4).expect("extra bytes");
        assert_eq!((described.data.len(), &described.data[4..9]), (192, &b"organ"[..]));
        let organs =
            points.lines().skip(1).map(|line| line.split(',').nth(5).and_then(|organ| organ.parse().ok()));
        let all = cloud.read_all().expect("points");
        let kept = all.points().map(|point| {
            let bytes = point.expect("a point").extra_bytes;
            Some(u32::from_le_bytes(bytes.try_into().expect("four"))).filter(|organ| *organ != u32::MAX)
        });
        assert!(kept.eq(organs), "organs of the LAS file are those of the text");
        let mut ply = io::Cursor::new(read(&format!("{side}_points.ply")));
        let parsed = ply_rs_bw::parser::Parser::<ply_rs_bw::ply::DefaultElement>::new()
            .read_ply(&mut ply)
            .expect("PLY");
        assert_eq!(parsed.payload["vertex"].len(), count);
    }
    let blind = run(&["scan", "--range", "85..89", "--dy", "0.5"]);
    assert_eq!(blind.code, Some(1), "{}", blind.stderr);
    assert!(blind.stderr.contains("sees nothing"), "{}", blind.stderr);
}

#[test]
fn impossible_scans_are_refused() {
    assert_says(&refused(&["scan", "--dtheta", "0"]), &["angle between beams", "positive"]);
    assert_says(&refused(&["scan", "--type", "sideways"]), &["zenith-orthogonal"]);
    assert_says(&refused(&["scan", "--wood", "net"]), &["exact, mesh or mesh:HALF"]);
    assert_says(
        &refused(&["scan", "--wood", "mesh:0.001,0,0.001"]),
        &["a mesh needs", "found 0.001, 0 and 0.001"],
    );
    assert_says(&refused(&["scan", "--type", "zenith", "--two-rows"]), &["--two-rows", "zenith"]);
    assert_says(&refused(&["scan", "--distance", "0.2"]), &["inside a tree", "0.2 m", "distance"]);
    assert_says(
        &refused(&["scan", "--type", "zenith", "--overhead", "1"]),
        &["inside a tree", "height overhead"],
    );
}
