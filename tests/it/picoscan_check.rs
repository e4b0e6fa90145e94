//! Scenarios whose scanner sends datagrams: what a reader was given is judged as scans are, and in lockstep it decides the same whatever the host does.

use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use crate::common::binary::{Ended, assert_says, run, text};

fn scenario(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tools/scenarios/picoscan").join(name)
}

/// False, visibly, where the reader cannot run.
fn has_python() -> bool {
    let found = Command::new("python3").arg("--version").output().is_ok();
    if !found {
        eprintln!("SKIPPED: scenarios: no python3 on this machine");
    }
    found
}

fn check(name: &str, flags: &[&str]) -> Ended {
    let path = scenario(name);
    run(&[&["check", text(&path)], flags].concat())
}

#[test]
fn scans_of_datagrams_are_judged_and_one_that_is_cut_is_red() {
    if !has_python() {
        return;
    }
    for name in ["steady.toml", "directed.toml", "lossy.toml"] {
        let ended = check(name, &[]);
        assert_eq!(ended.code, Some(0), "{name}: {}", ended.stdout);
    }
    let ended = check("cut.toml", &[]);
    assert_eq!(ended.code, Some(1), "{}", ended.stdout);
    assert_says(
        &ended.stdout,
        &[
            "expected a scan from pico within 0.5 s, found none",
            "scans_lost of pico: expected 0, found 32",
            "cut: udp_loss, on pico",
        ],
    );
}

/// A turn that was measured before the end goes out whole, whatever its end is in.
#[test]
fn a_run_of_so_many_scans_has_as_many_in_its_recording() {
    if !has_python() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let own = folder.path().join("picoscan");
    std::fs::create_dir(&own).expect("made");
    for name in ["base.toml", "reader.py", "../row.toml"] {
        std::fs::copy(scenario(name), own.join(name)).expect("copied");
    }
    for scans in [1, 37] {
        let path = own.join("it.toml");
        let expects =
            "expect = [{ what = \"scans_lost\", equals = 0 }, { what = \"segments_lost\", equals = 0 }]\n";
        let written = format!("use = \"base.toml\"\nend = {{ scans = {scans} }}\n{expects}");
        std::fs::write(&path, written).expect("written");
        let kept = folder.path().join(format!("kept-{scans}"));
        let ended = run(&["check", text(&path), "--keep", text(&kept)]);
        assert_eq!(ended.code, Some(0), "{scans}: {}{}", ended.stdout, ended.stderr);
        let mut runs = std::fs::read_dir(kept.join("01-it")).expect("kept").flatten();
        let file = runs.next().expect("a run").path().join("run.mcap");
        let ended = run(&["record", "--info", text(&file), "--format", "json"]);
        let told: serde_json::Value = serde_json::from_str(&ended.stdout).expect("JSON");
        assert_eq!(told["streams"][0]["scans"], scans, "{told}");
    }
}

/// A multiScan136: 16 lines a turn, and telegrams that need ten packets each.
#[test]
fn turns_of_several_lines_are_judged_and_fragments_that_are_lost_are_told() {
    if !has_python() {
        return;
    }
    for name in ["layers.toml", "fragments.toml"] {
        let ended = check(name, &[]);
        assert_eq!(ended.code, Some(0), "{name}: {}", ended.stdout);
    }
    let ended = check("layers_cut.toml", &[]);
    assert_eq!(ended.code, Some(1), "{}", ended.stdout);
    assert_says(&ended.stdout, &["scans_lost of pico: expected 0, found", "udp_fragment, on pico"]);
}

#[test]
fn by_the_host_s_clock_they_are_judged_too() {
    if has_python() {
        let ended = check("paced.toml", &[]);
        assert_eq!(ended.code, Some(0), "{}", ended.stdout);
    }
}

#[test]
fn who_does_not_read_is_told_in_lockstep() {
    if has_python() {
        let ended = check("deaf.toml", &[]);
        assert_eq!(ended.code, Some(2), "{}", ended.stdout);
        assert_says(
            &ended.stdout,
            &["was not acknowledged within 2s: 127.0.0.1:", "has not read", "; process "],
        );
    }
}

/// A program that computes, ended when dropped.
struct Busy(Child);

impl Busy {
    fn start() -> Self {
        let mut command = Command::new("sh");
        command.args(["-c", "while :; do :; done"]).stdout(Stdio::null());
        Self(command.spawn().expect("sh runs"))
    }
}

impl Drop for Busy {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// At both levels the reader's decisions and what it was sent are the same, alone and beside busy programs.
#[test]
fn in_lockstep_a_reader_decides_the_same_beside_busy_programs() {
    if !has_python() {
        return;
    }
    let base = tempfile::tempdir().expect("a folder");
    let decisions = |level: &str, name: &str| {
        let file = base.path().join(format!("{level}.toml"));
        let of = scenario("base.toml");
        let reader = scenario("reader.py");
        let written = format!(
            "use = \"{}\"\nscene = \"{}\"\nclock = {{ mode = \"lockstep\", ack = {{ sut = \"{level}\" }}, deadline_wall_s = 60 }}\n\
             run = [{{ id = \"sut\", command = [\"python3\", \"{}\", \"{{pico.udp}}\"], ready = {{ line = \"ready\" }} }}]\n\
             expect = [{{ what = \"scans_lost\", equals = 0 }}, {{ what = \"segments_lost\", equals = 0 }}]\n",
            text(&of),
            text(&scenario("../row.toml")),
            text(&reader)
        );
        std::fs::write(&file, written).expect("written");
        let kept = base.path().join(name);
        let ended = run(&["check", text(&file), "--keep", text(&kept), "--format", "tap"]);
        assert_eq!(ended.code, Some(0), "{}{}", ended.stdout, ended.stderr);
        let found: Vec<PathBuf> = walk(&kept);
        let of = |name: &str| {
            let path = found.iter().find(|path| path.ends_with(name));
            std::fs::read(path.unwrap_or_else(|| panic!("{name} in {found:?}"))).expect("it is there")
        };
        let decided = of("decisions.jsonl");
        let told =
            run(&["decode", text(found.iter().find(|path| path.ends_with("run.mcap")).expect("kept"))]);
        assert_eq!(told.code, Some(0), "{}", told.stderr);
        let sent: Vec<String> =
            told.stdout.lines().filter(|line| line.contains("Compact")).map(str::to_owned).collect();
        assert!(
            decided.len() > 1000 && sent.len() > 400,
            "{} bytes, {} telegrams",
            decided.len(),
            sent.len()
        );
        (decided, sent)
    };
    for level in ["idle", "read"] {
        let alone = decisions(level, &format!("{level}-alone"));
        let _busy = [Busy::start(), Busy::start()];
        let beside = decisions(level, &format!("{level}-beside"));
        if level == "idle" {
            assert_eq!(alone.0, beside.0, "decisions");
        }
        assert!(alone.1 == beside.1, "{level}: what was sent differs");
    }
}

/// All files below a folder.
fn walk(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("listed").path());
    entries.flat_map(|path| if path.is_dir() { walk(&path) } else { vec![path] }).collect()
}

#[test]
fn keys_of_datagrams_that_cannot_be_are_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    for (device, said) in [
        (
            "model = \"lms111\"\nudp = \"127.0.0.1:0\"",
            "`udp` of `left`: a lms111 has no REST interface and sends no datagrams",
        ),
        (
            "model = \"picoscan150\"\nudp = \"localhost\"",
            "`udp` of `left`: expected an IPv4 address with a port",
        ),
        (
            "model = \"picoscan150\"\nallow_destination = [\"there\"]",
            "expected IPv4 addresses, such as 192.0.2.7, found `there`",
        ),
        ("model = \"picoscan150\"\nstart = \"streaming\"", "nothing says where to: add `udp"),
        (
            "model = \"lms291\"\nudp = \"127.0.0.1:0\"",
            "leave `tcp`, `rest`, `udp` and `allow_destination` out",
        ),
    ] {
        let path = folder.path().join("it.toml");
        let written = format!(
            "version = 1\nscene = \"spindle\"\nend = {{ s = 1 }}\n[[device]]\nid = \"left\"\n{device}\n\
             [[run]]\nid = \"sut\"\ncommand = [\"false\"]\n[[expect]]\nwhat = \"exit_code\"\n"
        );
        std::fs::write(&path, written).expect("written");
        let ended = run(&["check", text(&path)]);
        assert_eq!(ended.code, Some(2), "{device}");
        assert_says(&ended.stdout, &[said]);
    }
}
