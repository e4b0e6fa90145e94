//! Studies cut in parts, stopped and resumed: the same numbers, and nothing finished is lost.

use crate::common;

use std::io::{self, Write};
use std::process::{Command, Stdio};

use common::binary::{finish, run, text};
use common::studies::{SMALL, quick_areas, small, whole};
use rowscan_study::Shard;
use rowscan_study::archive::Archive;
use rowscan_study::areas::AreasStudy;
use rowscan_study::journal::{self, Journal};

#[test]
fn shards_and_an_interrupted_run_give_the_same_numbers() {
    let folder = tempfile::tempdir().expect("a folder");
    let straight = small(&[]);
    assert_eq!(straight.code, Some(0), "{}", straight.stderr);
    let files: Vec<String> = (1..=4)
        .map(|shard| {
            let file = folder.path().join(format!("{shard}.json"));
            let ended = small(&["--shard", &format!("{shard}/4"), "--output", text(&file)]);
            assert_eq!((ended.code, ended.stdout.as_str()), (Some(0), ""), "{}", ended.stderr);
            text(&file).to_owned()
        })
        .collect();
    let merge = |files: &[&String]| {
        run(&[
            &["study", "merge", "--format", "json"][..],
            &files.iter().map(|f| f.as_str()).collect::<Vec<_>>(),
        ]
        .concat())
    };
    let merged = merge(&files.iter().collect::<Vec<_>>());
    assert_eq!(merged.code, Some(0), "{}", merged.stderr);
    assert_eq!(merged.stdout, straight.stdout);
    let keys: serde_json::Value = serde_json::from_str(&merged.stdout).expect("json");
    for key in ["slope", "slope_origin", "r2", "r2_uncentred", "loo_rmse_relative"] {
        assert!(keys["zenith"]["I_3L"][key].is_number(), "{key}");
    }
    assert!(
        keys["lateral"]["I_T"]["intercept_m2"].is_number()
            && keys["lateral"]["I_L"]["intercept_m2"].is_null()
    );
    assert!(keys["orchards"][0]["lateral"]["I_L"].is_number());

    let missing = merge(&[&files[0], &files[2]]);
    assert_eq!(missing.code, Some(2));
    assert!(missing.stderr.contains("2 of 4 orchards"), "{}", missing.stderr);
    let twice = merge(&[&files[0], &files[0], &files[1], &files[2], &files[3]]);
    assert!(twice.code == Some(2) && twice.stderr.contains("again in"), "{}", twice.stderr);

    // A full disk in the middle, by a limit on file size: the first line and one orchard fit.
    let file = folder.path().join("whole.json");
    let mut shell = Command::new("sh");
    shell.args(["-c", "trap '' XFSZ; ulimit -f 4; exec \"$@\"", "sh", env!("CARGO_BIN_EXE_rowscan")]);
    shell.args(SMALL).args(["--output", text(&file)]).env("RAYON_NUM_THREADS", "1");
    let full = finish(shell.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("sh runs"));
    assert_eq!(full.code, Some(2), "{}", full.stderr);
    assert!(full.stderr.contains("--resume"), "{}", full.stderr);
    assert!(!file.exists(), "a shard is whole or it is not there");
    let begun = small(&["--output", text(&file)]);
    assert!(begun.code == Some(2) && begun.stderr.contains("--resume"), "{}", begun.stderr);
    let resumed = small(&["--output", text(&file), "--resume"]);
    assert_eq!((resumed.code, resumed.stdout == straight.stdout), (Some(0), true), "{}", resumed.stderr);
    let again = small(&["--output", text(&file), "--resume"]);
    assert!(again.stdout == straight.stdout && again.stderr.contains("finished already"), "{}", again.stderr);

    let other = folder.path().join("other.json");
    let resolution = run(&[
        "study",
        "resolution",
        "--orchards",
        "1",
        "--trees",
        "1",
        "--advances-mm",
        "50,100",
        "--angles",
        "2",
        "--output",
        text(&other),
    ]);
    assert_eq!(resolution.code, Some(0), "{}", resolution.stderr);
    let mixed = merge(&[&files[0], &text(&other).to_owned()]);
    assert!(mixed.code == Some(2) && mixed.stderr.contains("of study resolution"), "{}", mixed.stderr);
}

/// Takes so many bytes, then the disk is full.
struct FullDisk {
    kept: Vec<u8>,
    room: usize,
}

impl Write for &mut FullDisk {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let fits = bytes.len().min(self.room - self.kept.len());
        self.kept.extend_from_slice(&bytes[..fits]);
        if fits == 0 { Err(io::ErrorKind::StorageFull.into()) } else { Ok(fits) }
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[test]
fn a_journal_keeps_what_was_whole_wherever_the_disk_filled_up() {
    let study = quick_areas(1);
    let mut scene = study.scene.clone();
    scene.orchard.trees = Some(1);
    let study = AreasStudy { scene, iterations: vec![7], ..study };
    let units = whole(&study);
    let mut all = FullDisk { kept: Vec::new(), room: 1 << 20 };
    let mut journal = Journal::begin(&mut all, &study, Shard::WHOLE).expect("room");
    units.iter().for_each(|unit| journal.keep(unit).expect("room"));
    for room in (0..all.kept.len()).step_by(97) {
        let mut disk = FullDisk { kept: Vec::new(), room };
        if let Ok(mut journal) = Journal::begin(&mut disk, &study, Shard::WHOLE) {
            assert!(units.iter().any(|unit| journal.keep(unit).is_err()), "room for {room} bytes");
        }
        let Some(kept) = journal::read(&disk.kept, &study, Shard::WHOLE).expect("a journal") else {
            continue;
        };
        assert!(kept.units.len() < units.len() && kept.units == units[..kept.units.len()], "{room}");
        let resumed = rowscan_study::run(&study, Shard::WHOLE, kept.units, &Archive::none(), &|_| Ok(()))
            .expect("it runs");
        assert!(resumed == units);
    }
    let other = AreasStudy { clearance_m: 0.7, ..study.clone() };
    assert!(journal::read(&all.kept, &other, Shard::WHOLE).is_err(), "another run's journal");
    assert!(
        journal::read(&all.kept, &study, "1/2".parse().expect("a shard")).is_err(),
        "another shard's journal"
    );
    assert!(journal::read(b"{}\n", &study, Shard::WHOLE).is_err(), "no journal at all");
}
