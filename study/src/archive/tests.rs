use std::cell::Cell;
use std::path::{Path, PathBuf};

use rowscan_scenes::files::load_scene;

use super::*;

const NO_BOUND: u64 = u64::MAX;

fn archive(folder: &Path, build: &str) -> Archive {
    Archive::open(folder, build.to_owned(), NO_BOUND).expect("a folder")
}

/// Asks for a row that is the number 1 if it must be done; true if it was not kept.
fn is_done(archive: &Archive, study: &str, depends: &Depends) -> bool {
    let done = Cell::new(false);
    let row = archive.row(
        study,
        || Some(depends.clone()),
        |_| {
            done.set(true);
            Ok::<_, ()>(vec![Some(0.1), None, Some(-0.0)])
        },
    );
    assert_eq!(row, Ok(vec![Some(0.1), None, Some(-0.0)]));
    done.get()
}

fn spindle() -> rowscan_scenes::Scene {
    load_scene("spindle", |_| {}).expect("built in")
}

/// The one row of a folder.
fn row_of(folder: &Path) -> PathBuf {
    let mut rows = folder.read_dir().expect("a folder").map(|entry| entry.expect("an entry").path());
    let row = rows.next().expect("a row");
    assert_eq!(rows.next(), None);
    row
}

fn bytes_of(path: &Path) -> Vec<u8> {
    rowscan_files::read_own(path, NO_BOUND).expect("a file")
}

fn put(path: &Path, bytes: &[u8]) {
    rowscan_files::OutputFile::create_anew(path).expect("opened").write_whole(bytes).expect("written");
}

#[test]
fn a_row_is_found_again_by_all_that_it_depends_on_and_by_nothing_less() {
    let folder = tempfile::tempdir().expect("a folder");
    let of = |scene: &rowscan_scenes::Scene| Depends::on_pass(scene, "lms111");
    let own = of(&spindle()).and("band_m", &0.25);
    assert!(is_done(&archive(folder.path(), "1"), "pieces", &own));
    let again = archive(folder.path(), "1");
    assert!(!is_done(&again, "pieces", &own));
    let mut scene = spindle();
    scene.seed += 1;
    let seed = of(&scene).and("band_m", &0.25);
    let mut scene = spindle();
    scene.rig.speed_m_s = 1.000_000_1;
    let rig = of(&scene).and("band_m", &0.25);
    let mut scene = spindle();
    scene.optics.stages = rowscan_scenes::optics::Stages::device();
    let optics = of(&scene).and("band_m", &0.25);
    let mut scene = spindle();
    scene.rig.calibration = Some("paper".to_owned());
    let calibration = of(&scene).and("band_m", &0.25);
    let model = Depends::on_pass(&spindle(), "lms511").and("band_m", &0.25);
    let band = of(&spindle()).and("band_m", &0.5);
    for other in [seed, rig, optics, calibration, model, band] {
        assert!(is_done(&again, "pieces", &other), "{other:?}");
    }
    assert!(is_done(&again, "sides", &own), "another study");
    assert!(is_done(&archive(folder.path(), "2"), "pieces", &own), "another program");
    assert!(!is_done(&archive(folder.path(), "1"), "pieces", &own), "the first is still there");
    let tally = again.tally();
    assert_eq!((tally.found, tally.done, tally.spoilt, tally.lost), (1, 7, 0, 0));
}

#[test]
fn a_calibration_counts_by_its_content_and_not_by_its_name() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("own.toml");
    let text = rowscan_canopy::shipped::text("spindle-lms111").expect("shipped");
    put(&file, text.as_bytes());
    let mut scene = spindle();
    scene.rig.calibration = Some(file.to_str().expect("text").to_owned());
    let rows = folder.path().join("rows");
    let depends = || Depends::on_pass(&scene, "lms111");
    assert!(is_done(&archive(&rows, "1"), "x", &depends()));
    assert!(!is_done(&archive(&rows, "1"), "x", &depends()));
    let changed = text.replacen("preset = \"", "preset = \"other_", 1);
    assert_ne!(changed, text);
    put(&file, changed.as_bytes());
    assert!(is_done(&archive(&rows, "1"), "x", &depends()));

    // It changes while the row is done: nobody knows which of both the row saw.
    let unsure = archive(&rows, "3");
    let row = unsure.row(
        "x",
        || Some(depends()),
        |_| {
            put(&file, text.as_bytes());
            Ok::<_, ()>(1)
        },
    );
    assert_eq!(row, Ok(1));
    put(&file, changed.as_bytes());
    assert!(is_done(&archive(&rows, "3"), "x", &depends()), "it was not kept");
}

#[test]
fn what_is_damaged_or_of_something_else_is_told_and_done_anew() {
    let folder = tempfile::tempdir().expect("a folder");
    let depends = Depends::on_scene(&spindle());
    assert!(is_done(&archive(folder.path(), "1"), "x", &depends));
    let path = row_of(folder.path());
    let sound = bytes_of(&path);
    let mut damaged: Vec<Vec<u8>> =
        (0..sound.len() - 1).step_by(61).map(|end| sound[..end].to_vec()).collect();
    for at in (0..sound.len() - 1).step_by(37).chain([sound.len() - 3]) {
        let mut flipped = sound.clone();
        flipped[at] ^= 1;
        damaged.push(flipped);
    }
    damaged.push(vec![0xff; 300]);
    for bytes in damaged {
        put(&path, &bytes);
        let archive = archive(folder.path(), "1");
        assert!(is_done(&archive, "x", &depends), "{}", String::from_utf8_lossy(&bytes));
        let tally = archive.tally();
        assert_eq!((tally.found, tally.done, tally.spoilt), (0, 1, 1));
        assert!(tally.first_spoilt.is_some_and(|first| first.starts_with(path.to_str().expect("text"))));
        assert_eq!(bytes_of(&path), sound, "it is kept anew");
    }
    // A sound row of another key at this one's name.
    assert!(is_done(&archive(folder.path(), "2"), "x", &depends));
    let other = folder.path().read_dir().expect("a folder").map(|entry| entry.expect("an entry").path());
    let other = other.into_iter().find(|other| *other != path).expect("two rows");
    put(&path, &bytes_of(&other));
    let archive = archive(folder.path(), "1");
    assert!(is_done(&archive, "x", &depends));
    assert!(archive.tally().first_spoilt.is_some_and(|first| first.contains("depends on something else")));
}

#[test]
fn a_row_that_no_file_holds_and_a_failure_are_not_kept() {
    let folder = tempfile::tempdir().expect("a folder");
    let depends = || Some(Depends::on_scene(&spindle()));
    let own = archive(folder.path(), "1");
    for (n, value) in [Some(f64::NAN), Some(f64::INFINITY)].into_iter().enumerate() {
        let row: Result<Option<f64>, ()> = own.row("x", depends, |_| Ok(value));
        assert!(row.is_ok_and(|row| row.is_some_and(|row| !row.is_finite())));
        assert_eq!((own.tally().found, own.tally().lost), (0, n + 1));
    }
    assert_eq!(own.row("x", depends, |_| Err::<f64, _>("failed")), Err("failed"));
    assert_eq!(own.row("x", || None, |_| Ok::<_, ()>(1.0)), Ok(1.0));
    assert_eq!(folder.path().read_dir().expect("a folder").count(), 0);
    assert_eq!(Archive::none().row("x", depends, |_| Ok::<_, ()>(1.0)), Ok(1.0));
}

#[test]
fn the_oldest_rows_make_room_and_other_files_are_left_alone() {
    let folder = tempfile::tempdir().expect("a folder");
    let foreign = ["notes.row", "0123456789abcdef.txt", "0123456789abcdeg.row"];
    for name in foreign {
        put(&folder.path().join(name), &[b'x'; 5000]);
    }
    let depends = |n: u64| Depends::on_scene(&spindle()).and("n", &n);
    assert!(is_done(&archive(folder.path(), "1"), "x", &depends(0)));
    let sizes = || {
        let entries = folder.path().read_dir().expect("a folder").map(|entry| entry.expect("an entry"));
        let own = entries.filter(|entry| !foreign.contains(&entry.file_name().to_str().expect("text")));
        own.map(|entry| entry.metadata().expect("a file").len()).collect::<Vec<u64>>()
    };
    let one = sizes()[0];
    let most = 4 * one + one / 2;
    let bounded = Archive::open(folder.path(), "1".to_owned(), most).expect("a folder");
    for n in 1..20 {
        assert!(is_done(&bounded, "x", &depends(n)));
        assert!(sizes().iter().sum::<u64>() <= most);
    }
    assert_eq!(sizes().len(), 4);
    let again = archive(folder.path(), "1");
    assert!(is_done(&again, "x", &depends(0)), "the oldest is gone");
    assert!((16..20).all(|n| !is_done(&again, "x", &depends(n))), "the newest are there");
    for name in foreign {
        assert_eq!(bytes_of(&folder.path().join(name)).len(), 5000, "{name}");
    }
    let tiny = Archive::open(&folder.path().join("tiny"), "1".to_owned(), one / 2).expect("a folder");
    assert!(is_done(&tiny, "x", &depends(1)) && is_done(&tiny, "x", &depends(1)));
    assert_eq!(tiny.tally().lost, 2);
}

#[test]
fn what_estimates_say_of_themselves_is_told_of_kept_rows_too() {
    let folder = tempfile::tempdir().expect("a folder");
    let told = |archive: &Archive| {
        for seed in 1..=3u64 {
            let depends = Depends::on_scene(&rowscan_scenes::Scene { seed, ..spindle() });
            let row = archive.row(
                "x",
                || Some(depends.clone()),
                |notes| {
                    notes.estimates += 1;
                    *notes.withheld.entry("mostly_wood".to_owned()).or_default() += seed % 2;
                    Ok::<_, ()>(seed)
                },
            );
            assert_eq!(row, Ok(seed));
        }
        archive.tally()
    };
    let (first, again) = (told(&archive(folder.path(), "1")), told(&archive(folder.path(), "1")));
    assert_eq!((first.done, again.found), (3, 3));
    assert_eq!(first.notes.to_string(), "of 3 estimates, withheld: mostly_wood 2");
    assert_eq!([&again.notes, &told(&Archive::none()).notes], [&first.notes; 2]);
}
