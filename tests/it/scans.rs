//! One of the paper's scans on the command line: its files, and what cannot be scanned.

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
        let (header, body) = matrix.split_once('\n').expect("a header");
        assert!(
            header.starts_with("theta_deg,0,0.1,0.2,"),
            "where the lines are along the row: {header:.40}"
        );
        // Behind the beam's angle.
        let rows: Vec<&str> =
            body.lines().filter_map(|line| line.split_once(',')).map(|(_, rest)| rest).collect();
        assert_eq!(Some(rows.len() as u64), scan["beams"].as_u64());
        let angles: Vec<f64> = body.lines().filter_map(|line| line.split(',').next()?.parse().ok()).collect();
        assert!(angles.windows(2).all(|pair| (pair[1] - pair[0] - 1.0).abs() < 1e-9), "{angles:?}");
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
        assert!(told.contains("matrix L") && told.contains("escape_m: 1000"), "{told}");

        let points = String::from_utf8(read(&format!("{side}_points.csv"))).expect("UTF-8");
        let first: Vec<&str> =
            points.lines().skip(1).filter(|line| line.split(',').nth(6) == Some("1")).collect();
        let of =
            |class: &str| first.iter().filter(|line| line.split(',').nth(3) == Some(class)).count() as u64;
        for (class, key) in [("leaf", "leaf_hits"), ("wood", "wood_hits"), ("ground", "ground_hits")] {
            assert_eq!(Some(of(class)), scan[key].as_u64(), "{class}");
        }
        let count = points.lines().count() - 1;
        // Two rows 4 m apart: LAS leaves out what lies on the ground beyond 2 m from them.
        let beyond = |line: &&str| {
            let fields: Vec<&str> = line.split(',').collect();
            let x_m: f64 = fields[0].parse().expect("a number");
            fields[3] == "ground" && !(-2.0..=6.0).contains(&x_m)
        };
        let clipped = points.lines().skip(1).filter(beyond).count();
        assert!(clipped > 0, "beams that graze the ground far off");
        let mut cloud =
            las::Reader::from_path(folder.path().join(format!("row{side}_points.las"))).expect("LAS");
        assert_eq!(cloud.header().number_of_points(), (count - clipped) as u64);
        let described = cloud.header().vlrs().iter().find(|vlr| vlr.record_id == 4).expect("extra bytes");
        assert_eq!((described.data.len(), &described.data[4..9]), (192, &b"organ"[..]));
        let organs = points
            .lines()
            .skip(1)
            .filter(|line| !beyond(line))
            .map(|line| line.split(',').nth(5).and_then(|organ| organ.parse().ok()));
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
fn only_points_of_the_classes_asked_for_are_written() {
    let folder = tempfile::tempdir().expect("a folder");
    let prefix = folder.path().join("row");
    let scan = |only: &[&str]| {
        let asked = [
            "scan",
            "spindle",
            "--dy",
            "0.2",
            "--dtheta",
            "1",
            "--output",
            text(&prefix),
            "--write",
            "csv,las",
        ];
        let ended = run(&[&asked[..], only].concat());
        assert_eq!(ended.code, Some(0), "{}", ended.stderr);
        let points = std::fs::read_to_string(folder.path().join("row_points.csv")).expect("points");
        let of =
            |class: &str| points.lines().skip(1).filter(|line| line.split(',').nth(3) == Some(class)).count();
        let counts = ["leaf", "wood", "ground"].map(of);
        let mut cloud = las::Reader::from_path(folder.path().join("row_points.las")).expect("LAS");
        let all = cloud.read_all().expect("points");
        let codes: Vec<u8> =
            all.points().map(|point| u8::from(point.expect("a point").classification)).collect();
        (counts, codes)
    };
    let (all, _) = scan(&[]);
    let (some, codes) = scan(&["--only", "leaf,wood"]);
    assert!(all[2] > 0 && some == [all[0], all[1], 0], "{all:?} {some:?}");
    assert_eq!(codes.len(), some[0] + some[1]);
    // As docs/studies.md has them.
    assert!(codes.iter().all(|code| [5, 64].contains(code)));
}

#[test]
fn impossible_scans_are_refused() {
    let only = refused(&["scan", "--output", "x", "--only", "leaf,bark"]);
    assert_says(&only, &["leaf, wood, ground, fruit, post, wire", "found `bark`"]);
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

/// Lines that leave a part of the row tell it: what stands there is in no area.
#[test]
fn an_advance_that_does_not_go_into_the_row_is_told() {
    let left = |dy: &str, kind: &str| {
        let scanned = run(&[
            "scan", "wall", "--type", kind, "--dy", dy, "--dtheta", "1", "--pitch", "0.5", "--format", "json",
        ]);
        assert_eq!(scanned.code, Some(0), "{}", scanned.stderr);
        scanned.stderr.lines().find(|line| line.contains("lines stand for")).map(str::to_owned)
    };
    // From above a wall has no width.
    for kind in ["lateral", "opposite", "lateral-orthogonal", "opposite-orthogonal"] {
        assert_eq!((left("0.5", kind), left("0.02", kind)), (None, None), "{kind}");
        let told = left("0.7", kind).unwrap_or_else(|| panic!("{kind}: 17 lines are 11.9 of 12 m"));
        assert!(told.contains("17 lines stand for 11.900 of 12.000 m"), "{kind}: {told}");
    }
}
