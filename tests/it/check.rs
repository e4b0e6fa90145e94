//! `rowscan check` with the scenarios and the controller of tools/scenarios.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::common::binary::{Ended, assert_says, run, text};

fn scenario(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tools/scenarios").join(name)
}

/// False, visibly, where the controller cannot run.
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
fn a_steady_run_passes_and_a_controller_that_quits_fails() {
    if !has_python() {
        return;
    }
    let ended = check("steady.toml", &["--seed", "7"]);
    assert_eq!(ended.code, Some(0), "{}", ended.stdout);
    assert_says(&ended.stderr, &["10 passed, 0 failed, 0 not judged, 0 skipped"]);

    let ended = check("quits.toml", &[]);
    assert_eq!(ended.code, Some(1), "it failed, and what it left open is not judged: {}", ended.stdout);
    assert_says(
        &ended.stdout,
        &[
            "FAILED  2. exit_code: 0 [seed 7]: exit code of sut: expected 0, found 1",
            "`sut` had crashed at 0.400 s, with code 1",
            "sut.exited: code 1",
            "quits.toml --seed 7",
        ],
    );
}

/// A scenario of the folder's base with this fault and these expectations, in a folder of its own.
fn of_base(fault: &str, expects: &str) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("it.toml");
    let (base, row, controller) = (scenario("base.toml"), scenario("row.toml"), scenario("controller.py"));
    let row = if row.exists() { text(&row).to_owned() } else { "spindle".to_owned() };
    let written = format!(
        "use = {base:?}\nscene = {row:?}\nfault = [{fault}]\nexpect = [{expects}]\n\
         run = [{{ id = \"sut\", command = [\"python3\", {controller:?}, \"{{left.tcp}}\"], ready = {{ line = \"connected\" }} }}]\n"
    );
    std::fs::write(&path, written).expect("written");
    (folder, path)
}

/// What was asked for and never came is lost, though it is the first that was asked for.
#[test]
fn scans_that_are_lost_before_the_first_delivered_one_count() {
    if !has_python() {
        return;
    }
    let (_folder, path) = of_base(
        "{ id = \"gone\", name = \"drop\", telegrams = 30, on = \"left\", at = { scan = 1 } }",
        "{ what = \"scans_lost\", equals = 30 }, { what = \"fault_acts\", of = \"gone\", equals = 30 }",
    );
    let ended = run(&["check", text(&path)]);
    assert_eq!(ended.code, Some(0), "{}{}", ended.stdout, ended.stderr);
}

/// Who asks for scans and reads none takes none, though all of them leave the scanner: they wait in the kernel.
#[test]
fn a_controller_that_reads_nothing_takes_no_scans() {
    if !has_python() {
        return;
    }
    let (folder, path) = of_base("", "");
    let program = "import socket, sys, time\nhost, port = sys.argv[1].split(':')\nlink = socket.create_connection((host, int(port)))\n\
        link.sendall(b'\\x02sEN LMDscandata 1\\x03')\nprint('connected', flush=True)\n\
        while sys.argv[2] == 'reads' and link.recv(65536):\n    pass\ntime.sleep(60)\n";
    std::fs::write(folder.path().join("client.py"), program).expect("written");
    let check = |does: &str, expects: &str| {
        let written = format!(
            "version = 1\nscene = \"spindle\"\nend = {{ s = 3 }}\nexpect = [{expects}]\n[[device]]\nid = \"left\"\nmodel = \"lms111\"\n[[run]]\nid = \"sut\"\n\
             command = [\"python3\", \"{{scenario}}/client.py\", \"{{left.tcp}}\", \"{does}\"]\nready = {{ line = \"connected\" }}\n"
        );
        std::fs::write(&path, written).expect("written");
        run(&["check", text(&path)])
    };
    let lost = "{ what = \"scans_lost\", equals = 0 }";
    let ended = check("sleeps", lost);
    assert_eq!(ended.code, Some(2), "{}{}", ended.stdout, ended.stderr);
    assert_says(&ended.stdout, &["somebody listens at the end", "bytes of `left` unread"]);
    let ended = check("reads", lost);
    assert_eq!(ended.code, Some(0), "{}{}", ended.stdout, ended.stderr);
}

/// What was lost while a scanner began to count anew nobody can tell, whether its controller comes back or not: with the run's other half gone it was 0.
#[test]
fn scans_lost_are_unknown_once_the_device_counts_anew_and_nobody_is_there() {
    if !has_python() {
        return;
    }
    let (folder, path) = of_base("", "");
    let program = "import socket, sys, time\nhost, port = sys.argv[1].split(':')\nlink = socket.create_connection((host, int(port)))\n\
        link.sendall(b'\\x02sEN LMDscandata 1\\x03')\nprint('connected', flush=True)\nwhile link.recv(65536):\n    pass\ntime.sleep(60)\n";
    std::fs::write(folder.path().join("client.py"), program).expect("written");
    let check = |fault: &str, expects: &str| {
        let written = format!(
            "version = 1\nscene = \"spindle\"\nend = {{ s = 3 }}\nclock = {{ mode = \"lockstep\", ack = {{ sut = \"idle\" }} }}\n\
             fault = [{fault}]\nexpect = [{expects}, {{ what = \"unheard_s\", below = 4 }}]\n[[device]]\nid = \"left\"\nmodel = \"lms111\"\n[[run]]\nid = \"sut\"\n\
             command = [\"python3\", \"{{scenario}}/client.py\", \"{{left.tcp}}\"]\nready = {{ line = \"connected\" }}\n"
        );
        std::fs::write(&path, written).expect("written");
        run(&["check", text(&path)])
    };
    let power = |at_s: f64| {
        format!("{{ id = \"off\", name = \"power\", at = {{ s = {at_s} }}, for = {{ s = 0.04 }} }}")
    };
    // The new numbers are smaller than the old ones, and larger.
    for at_s in [1.5, 0.5] {
        let ended = check(&power(at_s), "{ what = \"scans_lost\", below = 1000 }");
        assert_eq!(ended.code, Some(2), "{at_s}: {}{}", ended.stdout, ended.stderr);
        assert_says(&ended.stdout, &["scans_lost of left: unknown", "began to count anew"]);
        let before = "{ what = \"scans_lost\", between = [\"left.first_scan\", \"off\"], equals = 0 }";
        let ended = check(&power(at_s), before);
        assert_eq!(ended.code, Some(0), "{at_s}: {}{}", ended.stdout, ended.stderr);
    }
    // A cut cable lets the device count on: then all that came after is lost.
    let cut = "{ id = \"off\", name = \"fin\", at = { s = 1 } }";
    let ended = check(cut, "{ what = \"scans_lost\", above = 90 }");
    assert_eq!(ended.code, Some(0), "{}{}", ended.stdout, ended.stderr);
}

/// What an LMS2xx sent behind a cut and nobody got is lost, though nothing comes that would tell it by its number.
#[test]
fn what_a_serial_scanner_sends_into_a_cut_line_is_lost() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("cut.toml");
    let check = |fault: &str, expects: &str| {
        let written = format!(
            "version = 1\nscene = \"spindle\"\nclock = {{ mode = \"paced\", scale = 2 }}\nend = {{ s = 3 }}\nfault = [{fault}]\nexpect = [{expects}]\n\
             [[device]]\nid = \"d\"\nmodel = \"lms291\"\n[[run]]\nid = \"sut\"\n\
             command = [\"{{rowscan}}\", \"estimate\", \"serial:{{d.path}}\", \"--rig\", \"spindle\", \"--model\", \"lms291\"]\n\
             ready = {{ line = \"connected\" }}\n"
        );
        std::fs::write(&path, written).expect("written");
        run(&["check", text(&path)])
    };
    let none = "{ what = \"scans_lost\", equals = 0 }";
    let ended = check("", none);
    assert_eq!(ended.code, Some(0), "{}{}", ended.stdout, ended.stderr);
    for (name, more) in [("half_open", ""), ("drop", ", p = 1.0")] {
        let fault = format!("{{ name = \"{name}\", on = \"d\", at = {{ row_m = 1 }}{more} }}");
        let ended = check(&fault, none);
        assert_eq!(ended.code, Some(1), "{name}: {}{}", ended.stdout, ended.stderr);
        assert_says(&ended.stdout, &["FAILED  1. scans_lost: 0"]);
    }
}

/// A line that is cut because the run is over has no bad telegram on it, and a kept run says which model its device is.
#[test]
fn a_serial_scanner_is_cut_off_by_no_end_and_its_kept_run_knows_its_model() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("serial.toml");
    let written = "version = 1\nscene = \"spindle\"\nclock = { mode = \"paced\", scale = 3 }\nend = { s = 2.1 }\n\
        [[device]]\nid = \"d\"\nmodel = \"lms200\"\n[[run]]\nid = \"sut\"\n\
        command = [\"{rowscan}\", \"estimate\", \"serial:{d.path}\", \"--rig\", \"spindle\", \"--model\", \"lms200\", \"--format\", \"json\"]\n\
        ready = { line = \"connected\" }\n[[expect]]\nwhat = \"telegrams_bad\"\nequals = 0\n";
    std::fs::write(&path, written).expect("written");
    let kept = folder.path().join("kept");
    // Sooner or later the end falls inside a telegram.
    for _ in 0..2 {
        let ended = run(&["check", text(&path), "--keep", text(&kept)]);
        assert_eq!(ended.code, Some(0), "{}{}", ended.stdout, ended.stderr);
    }
    let mut runs = std::fs::read_dir(kept.join("01-serial")).expect("kept").flatten();
    let file = runs.next().expect("a run").path().join("run.mcap");
    let ended = run(&["record", "--info", text(&file), "--format", "json"]);
    let told: serde_json::Value = serde_json::from_str(&ended.stdout).expect("JSON");
    assert_eq!((told["model"].as_str(), told["mounts"]["d"].as_u64()), (Some("lms200"), Some(0)), "{told}");
    // What is kept ends with a whole telegram, too.
    assert_eq!(told["streams"][0]["telegrams_bad"], 0, "{told}");
    let ended = run(&["decode", text(&file)]);
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
}

/// An encoder whose wheels slip counts trees that are none: what it makes of the leaf area shows, as it does in the row's.
#[test]
fn a_way_that_was_not_driven_shows_in_the_leaf_areas_error() {
    let folder = tempfile::tempdir().expect("a folder");
    let error = |drive: &str, ticks: &str, end: &str, fault: &str| {
        let scene = folder.path().join("scene.toml");
        let written = format!(
            "version = 2\n[orchard]\ntrees = 4\nrows = 2\n[rig]\n{ticks}calibration = \"spindle\"\n[[rig.scanner]]\nmodel = \"lms111\"\n[drive]\n{drive}"
        );
        std::fs::write(&scene, written).expect("written");
        // Only who knows the rig asks for the encoder.
        let rig = if ticks.is_empty() { "" } else { ", \"--rig\", \"{scenario}/scene.toml\"" };
        let path = folder.path().join("it.toml");
        let written = format!(
            "version = 1\nscene = \"scene.toml\"\nclock = {{ mode = \"lockstep\", ack = {{ sut = \"idle\" }} }}\nend = {{ {end} }}\n{fault}\
             expect = [{{ what = \"leaf_area_error\", abs_below = 0.15 }}]\n[[device]]\nid = \"left\"\nmodel = \"lms111\"\n[[run]]\nid = \"sut\"\n\
             command = [\"{{rowscan}}\", \"estimate\", \"tcp://{{left.tcp}}\"{rig}]\nready = {{ line = \"connected\" }}\n"
        );
        std::fs::write(&path, written).expect("written");
        let ended = run(&["check", text(&path), "--format", "jsonl"]);
        let found = ended.stdout.split("found ").nth(1).and_then(|text| text.split(['"', ' ', ';']).next());
        let found: f64 = found
            .and_then(|text| text.parse().ok())
            .unwrap_or_else(|| panic!("{}{}", ended.stdout, ended.stderr));
        (ended.code, found)
    };
    let leg = |seconds: f64, m_s: f64| format!("[[drive.legs]]\nseconds = {seconds}\nspeed_m_s = {m_s}\n");
    let back =
        [leg(0.0, 1.0), leg(4.0, 1.0), leg(0.0, -1.0), leg(2.0, -1.0), leg(0.0, 1.0), leg(9.0, 1.0)].concat();
    let encoder = "encoder_ticks_per_m = 1000.0\n";
    // Wheels that slip by a fifth count a quarter more way, in one alley and in two. Without an encoder what was driven in reverse counts as ahead: the row of
    // 6 m is over after 4.
    for (right, wrong, end, expected) in [
        (("slip = 0.0\n", encoder), ("slip = 0.2\n", encoder), "row_m = 6.2", 0.25),
        (("slip = 0.0\nalleys = 2\n", encoder), ("slip = 0.2\nalleys = 2\n", encoder), "s = 14", 0.25),
        (("", ""), (back.as_str(), ""), "row_m = 6.2", 0.5),
    ] {
        let (code, even) = error(right.0, right.1, end, "");
        assert_eq!(code, Some(0), "{end}: {even}");
        let (code, off) = error(wrong.0, wrong.1, end, "");
        assert_eq!(code, Some(1), "{end}: {off}");
        assert!((off - even - expected).abs() < 0.12, "{end}: {even} {off}");
    }
    // What slips on the headland is nothing of the trees'.
    let two = "slip = 0.0\nalleys = 2\n";
    let headland = "fault = [{ name = \"encoder\", slip = 0.6, at = { s = 6.8 }, for = { s = 2.5 } }]\n";
    let (code, found) = error(two, encoder, "s = 14", headland);
    assert_eq!(code, Some(0), "{found}");
    assert!(found.abs() < 0.12, "{found}");
}

/// Who stops the scanner gets no scans, and none are lost: neither passes for listening.
#[test]
fn a_controller_that_stops_the_scanner_takes_no_scans() {
    if !has_python() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let program = "import socket, sys\nhost, port = sys.argv[1].split(':')\nlink = socket.create_connection((host, int(port)))\n\
        link.sendall(b'\\x02sEN LMDscandata 1\\x03')\nprint('connected', flush=True)\nseen = b''\nstop = sys.argv[2].encode()\n\
        while data := link.recv(65536):\n    seen += data\n    if stop and seen.count(b'sSN LMDscandata') > 20:\n        \
        link.sendall(b'\\x02sMN SetAccessMode 03 F4724744\\x03\\x02sMN ' + stop + b'\\x03')\n        stop = b''\n";
    std::fs::write(folder.path().join("client.py"), program).expect("written");
    let path = folder.path().join("stops.toml");
    let check = |stop: &str, expects: &str| {
        let written = format!(
            "version = 1\nscene = \"spindle\"\nend = {{ s = 1 }}\nclock = {{ mode = \"lockstep\", ack = {{ sut = \"idle\" }} }}\n\
             expect = [{expects}]\n[[device]]\nid = \"left\"\nmodel = \"lms111\"\n[[run]]\nid = \"sut\"\n\
             command = [\"python3\", \"{{scenario}}/client.py\", \"{{left.tcp}}\", \"{stop}\"]\nready = {{ line = \"connected\" }}\n"
        );
        std::fs::write(&path, written).expect("written");
        run(&["check", text(&path)])
    };
    let (lost, unheard) = ("{ what = \"scans_lost\", equals = 0 }", "{ what = \"unheard_s\", equals = 0 }");
    for stop in ["LMCstopmeas", "LMCstandby"] {
        let ended = check(stop, lost);
        assert_eq!(ended.code, Some(2), "{stop}: {}{}", ended.stdout, ended.stderr);
        assert_says(&ended.stdout, &["somebody listens at the end", "nobody had taken scans of `left`"]);
        let ended = check(stop, unheard);
        assert_eq!(ended.code, Some(1), "{stop}: {}{}", ended.stdout, ended.stderr);
        let ended = check(stop, "{ what = \"unheard_s\", between = [0.4, 0.7] }");
        assert_eq!(ended.code, Some(0), "{stop}: {}{}", ended.stdout, ended.stderr);
    }
    let ended = check("", &format!("{lost}, {unheard}"));
    assert_eq!(ended.code, Some(0), "{}{}", ended.stdout, ended.stderr);
}

/// CoLa A has no checksum that could be wrong.
#[test]
fn a_fault_that_could_act_on_nothing_has_not_acted_and_is_no_pass() {
    if !has_python() {
        return;
    }
    let fault = "{ id = \"sum\", name = \"checksum\", on = \"left\", at = { scan = 10 }, count = 3, every = { scans = 1 } }";
    let (_folder, path) = of_base(fault, "{ what = \"telegrams_bad\", equals = 0 }");
    let ended = run(&["check", text(&path)]);
    assert_eq!(ended.code, Some(2), "{}{}", ended.stdout, ended.stderr);
    assert_says(&ended.stdout, &["fault `sum` could act on nothing", "checksum"]);
    let (_folder, path) = of_base(fault, "{ what = \"fault_acts\", of = \"sum\", equals = 0 }");
    assert_eq!(run(&["check", text(&path)]).code, Some(0), "none was expected");
    let (_folder, path) = of_base(fault, "{ what = \"fault_acts\", of = \"sum\", equals = 3 }");
    assert_eq!(run(&["check", text(&path)]).code, Some(1), "it did nothing");
}

#[test]
fn verdicts_that_could_not_be_written_are_refused_before_anything_runs() {
    let folder = tempfile::tempdir().expect("a folder");
    let (path, keep) = (folder.path().join("it.toml"), folder.path().join("kept"));
    // Its expectation would fail: whatever ran is told on standard output.
    let written = "version = 1\nscene = \"spindle\"\nend = { s = 1 }\n[[device]]\nid = \"left\"\nmodel = \"lms111\"\n\
         [[run]]\nid = \"sut\"\ncommand = [\"false\"]\n[[expect]]\nwhat = \"exit_code\"\n";
    std::fs::write(&path, written).expect("written");
    let refused = |junit: &Path| {
        let ended = run(&["check", text(&path), "--junit", text(junit), "--keep", text(&keep)]);
        assert_eq!((ended.code, ended.stdout.as_str()), (Some(2), ""), "{}", ended.stderr);
        assert!(!keep.exists(), "nothing has run");
        ended.stderr
    };
    assert_says(&refused(&folder.path().join("nodir/x.xml")), &["nodir/x.xml", "No such file"]);
    assert_says(&refused(&path), &["it.toml", "it is read by this command: name another file"]);
    // By another name.
    let other = folder.path().join("kept-not/../it.toml");
    std::fs::create_dir(folder.path().join("kept-not")).expect("made");
    assert_says(&refused(&other), &["it is read by this command"]);
    assert_eq!(std::fs::read_to_string(&path).expect("still there"), written);
    // A controller, a recording, a base: what is no XML stays.
    let controller = folder.path().join("controller.py");
    std::fs::write(&controller, "import socket\n").expect("written");
    assert_says(&refused(&controller), &["controller.py", "expected a new file", "XML", "name another file"]);
    assert_eq!(std::fs::read_to_string(&controller).expect("still there"), "import socket\n");
}

#[test]
fn what_cannot_be_judged_exits_with_2() {
    if has_python() {
        let ended = check("deaf.toml", &["--format", "tap"]);
        assert_eq!(ended.code, Some(2), "{}", ended.stdout);
        assert_says(&ended.stdout, &["1..1\nnot ok 1 - deaf", "no one took scans within 4s"]);
    }
    let ended = check("base.toml", &[]);
    assert_eq!(ended.code, Some(2));
    assert_says(&ended.stdout, &["it expects nothing; add an [[expect]]"]);
}

/// A JUnit document without its times.
fn timeless(junit: &str) -> String {
    let mut rest = junit;
    let mut kept = String::new();
    while let Some((before, after)) = ["time=\"", "timestamp=\""]
        .iter()
        .filter_map(|key| rest.split_once(key))
        .min_by_key(|(before, _)| before.len())
    {
        kept += before;
        rest = after.split_once('"').map_or("", |(_, rest)| rest);
    }
    kept + rest
}

#[test]
fn in_lockstep_the_same_seed_gives_the_same_junit_but_for_times() {
    if !has_python() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    for seed in ["7", "8", "9"] {
        let junit = |name: &str| {
            let file = folder.path().join(name);
            let ended = check("quits.toml", &["--seed", seed, "--junit", text(&file)]);
            assert_eq!(ended.code, Some(1), "{}", ended.stdout);
            timeless(&std::fs::read_to_string(file).expect("written"))
        };
        let (first, second) = (junit("first.xml"), junit("second.xml"));
        assert!(first.contains("0.400 s"), "{first}");
        assert_eq!(first, second, "seed {seed}");
    }
}

#[test]
fn the_manual_lists_all_that_can_be_expected() {
    let manual =
        std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/bench.md")).expect("there");
    let table = run(&["check", "--markdown"]).stdout;
    assert!(manual.contains(&table), "docs/bench.md: put in the table of `rowscan check --markdown`");
}

/// Verdicts by scenario, name and message, without times of the host.
fn verdicts(jsonl: &str) -> Vec<(String, String, String)> {
    let lines = jsonl.lines().map(|line| serde_json::from_str::<serde_json::Value>(line).expect(line));
    let verdicts = lines.filter(|line| line["kind"] == "verdict");
    let text = |value: &serde_json::Value| value.as_str().expect("a text").to_owned();
    verdicts.map(|line| (text(&line["scenario"]), text(&line["name"]), text(&line["message"]))).collect()
}

#[test]
fn side_by_side_gives_the_same_verdicts_in_the_same_order() {
    if !has_python() {
        return;
    }
    let names = ["damaged.toml", "quits.toml", "base.toml", "two-scanners.toml", "deaf.toml"];
    let paths = names.map(scenario);
    let paths: Vec<&str> = paths.iter().map(|path| text(path)).collect();
    let tried = |flags: &[&str]| run(&[&["check", "--format", "jsonl"], &paths[..], flags].concat());
    let (one, side_by_side) = (tried(&[]), tried(&["-j", "3"]));
    assert_eq!((one.code, side_by_side.code), (Some(1), Some(1)), "{}", side_by_side.stderr);
    let expected = verdicts(&one.stdout);
    assert_eq!(expected.len(), 6 + 3 + 1 + 4 + 1);
    assert_eq!(verdicts(&side_by_side.stdout), expected);
    // Up to the first that is not fine.
    let stopped = verdicts(&tried(&["-j", "3", "--fail-fast"]).stdout);
    assert_eq!(stopped, verdicts(&tried(&["--fail-fast"]).stdout));
    assert_eq!(stopped, expected[..9]);
}

#[cfg(unix)]
#[test]
fn a_signal_ends_it_with_its_code_and_what_is_done_is_in_the_junit_file() {
    use std::io::Read;
    if !has_python() {
        return;
    }
    for (signal, code, jobs) in [("-TERM", 143, "1"), ("-INT", 130, "1"), ("-TERM", 143, "2")] {
        let folder = tempfile::tempdir().expect("a folder");
        let (junit, log) = (folder.path().join("all.xml"), folder.path().join("long.toml"));
        // One that is soon done, and one that takes a minute.
        std::fs::write(&log, long()).expect("written");
        let mut child = Command::new(env!("CARGO_BIN_EXE_rowscan"))
            .args([
                "check",
                text(&scenario("stored-dialect.toml")),
                text(&log),
                "-j",
                jobs,
                "--junit",
                text(&junit),
            ])
            .stdout(std::process::Stdio::piped())
            .stderr(std::process::Stdio::null())
            .spawn()
            .expect("it starts");
        let mut told = String::new();
        let mut out = child.stdout.take().expect("piped");
        let mut chunk = [0; 256];
        while !told.contains("scans_lost") {
            let read = out.read(&mut chunk).expect("read");
            assert!(read > 0, "it ended by itself: {told}");
            told += &String::from_utf8_lossy(&chunk[..read]);
        }
        let killed = Command::new("kill").args([signal, &child.id().to_string()]).status().expect("kill");
        assert!(killed.success());
        assert_eq!(child.wait().expect("it ends").code(), Some(code), "{signal}");
        let document = std::fs::read_to_string(&junit).expect("written");
        // The one that is done has its two cases; the one that ran is there as not judged.
        assert_eq!(document.matches("<testcase ").count(), 3, "{document}");
        let (_, ran) = document.split_once("<testsuite name=\"long\"").expect("the scenario that ran");
        assert!(ran.contains("errors=\"1\"") && ran.contains("told to end while it ran"), "{document}");
    }
}

/// A scenario of a minute.
#[cfg(unix)]
fn long() -> String {
    let base = scenario("base.toml");
    let scene = scenario("row.toml");
    let controller = scenario("controller.py");
    format!(
        "use = {base:?}\nscene = {scene:?}\nclock = {{ mode = \"paced\" }}\nend = {{ s = 60 }}\n\
         run = [{{ id = \"sut\", command = [\"python3\", {controller:?}, \"{{left.tcp}}\"] }}]\n\
         expect = [{{ what = \"scans_lost\", equals = 0 }}]\n"
    )
}

#[test]
fn the_manuals_five_minutes_are_as_it_says() {
    if !has_python() {
        return;
    }
    let manual =
        std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/bench.md")).expect("there");
    let (_, rest) = manual.split_once("```toml\n").expect("an example");
    let (example, _) = rest.split_once("```").expect("its end");
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).expect("written");
    std::fs::copy(scenario("controller.py"), folder.path().join("controller.py")).expect("copied");
    let quits = example.replace("\"{left.tcp}\"]", "\"{left.tcp}\", \"--quit-after\", \"20\"]");
    assert_ne!(quits, example);
    write("row.toml", example);
    write("quits.toml", &quits);
    for (name, code, says) in
        [("row.toml", 0, "passed  2. exit_code"), ("quits.toml", 1, "FAILED  2. exit_code")]
    {
        // By its bare name, as somebody in the folder says it.
        let ended = Command::new(env!("CARGO_BIN_EXE_rowscan"))
            .args(["check", name, "--junit", "verdicts.xml"])
            .current_dir(folder.path())
            .output()
            .expect("it runs");
        let told = String::from_utf8_lossy(&ended.stdout).into_owned();
        assert_eq!(ended.status.code(), Some(code), "{told}");
        assert!(told.contains(says), "{told}");
        assert!(folder.path().join("verdicts.xml").exists());
    }
}

/// What of a controller has left its process group ends with the run all the same, and is told; so does what is left when the run is interrupted.
#[cfg(target_os = "linux")]
#[test]
fn nothing_that_a_controller_started_outlives_the_run() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("daemon.toml");
    // No other program sleeps so long.
    let seconds = 100_000 + u64::from(std::process::id());
    let left = format!("setsid sleep {seconds} </dev/null >/dev/null 2>&1 &");
    let estimate = "exec {rowscan} estimate tcp://{left.tcp} --format json";
    let written = format!(
        "version = 1\nscene = \"spindle\"\nend = {{ s = 1 }}\n[[device]]\nid = \"left\"\nmodel = \"lms111\"\n\
         [[run]]\nid = \"sut\"\ncommand = [\"sh\", \"-c\", \"{left} {estimate}\"]\n\
         [[expect]]\nwhat = \"scans_lost\"\nequals = 0\n"
    );
    std::fs::write(&path, written).expect("written");
    let ended = run(&["check", text(&path)]);
    assert_eq!(ended.code, Some(0), "{}{}", ended.stdout, ended.stderr);
    let said = [ended.stdout, ended.stderr].concat();
    assert_says(&said, &["killed what the children left running outside their group: sleep"]);
    let lines = std::fs::read_dir("/proc").expect("linux").flatten();
    let lines = lines.filter_map(|process| std::fs::read_to_string(process.path().join("cmdline")).ok());
    assert_eq!(lines.filter(|line| line.contains(&seconds.to_string())).count(), 0, "it runs on");
}

/// A controller without a handler of signals that leaves when its stream ends is let leave: SIGTERM comes only to one that stays.
#[test]
fn the_streams_end_before_a_controller_is_told_to() {
    if !has_python() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let client = folder.path().join("client.py");
    let program = "import socket, sys\nhost, port = sys.argv[1].split(':')\nlink = socket.create_connection((host, int(port)))\n\
        link.sendall(b'\\x02sEN LMDscandata 1\\x03')\nwhile link.recv(65536):\n    pass\nprint('the stream has ended', flush=True)\n";
    std::fs::write(&client, program).expect("written");
    let written = |clock: &str| {
        format!(
            "version = 1\nscene = \"spindle\"\nend = {{ s = 1 }}\n{clock}[[device]]\nid = \"left\"\nmodel = \"lms111\"\n\
             [[run]]\nid = \"sut\"\ncommand = [\"python3\", \"{{scenario}}/client.py\", \"{{left.tcp}}\"]\n\
             [[expect]]\nwhat = \"exit_code\"\n[[expect]]\nwhat = \"log\"\nmatches = \"the stream has ended\"\n"
        )
    };
    for clock in ["", "clock = { mode = \"lockstep\", ack = { sut = \"idle\" } }\n"] {
        let path = folder.path().join("ends.toml");
        std::fs::write(&path, written(clock)).expect("written");
        let ended = run(&["check", text(&path)]);
        assert_eq!(ended.code, Some(0), "{clock}{}{}", ended.stdout, ended.stderr);
    }
}
