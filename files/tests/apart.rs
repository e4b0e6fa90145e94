//! Inputs are not written over, by any of their names. One test in a process of its own: what is opened belongs to the process.
#![allow(clippy::expect_used, reason = "helpers are not known as tests")]

use std::fs;
use std::io::{ErrorKind, Write};
use std::os::unix::fs::symlink;
use std::path::Path;

use rowscan_files::{KeptApart, OutputFile, read_own, read_text, will_be_read};

fn refusal(path: &Path) -> String {
    let refused = OutputFile::create(path).expect_err("it is an input, or written already");
    assert_eq!(refused.kind(), ErrorKind::InvalidInput);
    refused.to_string()
}

#[test]
fn what_is_read_or_written_is_not_written_again() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name);
    fs::write(at("scene.toml"), "version = 1").expect("written");
    fs::write(at("own"), "mine").expect("written");
    symlink("scene.toml", at("link")).expect("linked");
    fs::hard_link(at("scene.toml"), at("hard")).expect("linked");

    // A library's caller may do what it likes.
    read_text(&at("scene.toml")).expect("it is there");
    drop(OutputFile::create(&at("scene.toml")).expect("nobody keeps them apart"));

    let apart = KeptApart::begin();
    read_text(&at("scene.toml")).expect("it is there");
    for name in ["scene.toml", "./scene.toml", "link", "hard"] {
        assert!(refusal(&at(name)).contains("is read by this command"), "{name}");
    }
    assert_eq!(fs::read_to_string(at("scene.toml")).expect("read"), "version = 1");

    // What is read while the output is being written already is not replaced either.
    let mut late = OutputFile::create(&at("late")).expect("it is new");
    late.write_all(b"new").expect("written");
    fs::write(at("late"), "old").expect("written");
    will_be_read(&at("late"));
    assert_eq!(late.commit().expect_err("it is an input by now").kind(), ErrorKind::InvalidInput);
    assert_eq!(fs::read_to_string(at("late")).expect("read"), "old");

    // Two outputs of one name, while both are written.
    let first = OutputFile::create(&at("out")).expect("it is new");
    assert!(refusal(&folder.path().join("./out")).contains("written as two things"));
    assert!(OutputFile::append_to_new(&at("out")).is_err());
    first.commit().expect("committed");
    drop(OutputFile::create(&at("out")).expect("the first is done"));

    // What a program keeps for itself, what it repairs, and devices.
    read_own(&at("own"), 100).expect("it is there");
    OutputFile::create(&at("own")).expect("it may").commit().expect("it may");
    OutputFile::create_anew(&at("scene.toml")).expect("it may").commit().expect("it may");
    read_text(Path::new("/dev/null")).expect("empty");
    let null = || OutputFile::create(Path::new("/dev/null")).expect("it is no file");
    drop((null(), null()));

    drop(apart);
    drop(OutputFile::create(&at("hard")).expect("nobody keeps them apart any more"));
}
