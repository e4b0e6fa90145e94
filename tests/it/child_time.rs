//! Children of a check whose time is simulated: what their own timers cost is seen in lockstep.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::common::binary::{Ended, assert_says, run, text};

/// False, visibly, where such children cannot run.
fn can_run() -> bool {
    let library = Path::new(env!("CARGO_BIN_EXE_rowscan"))
        .parent()
        .expect("a folder")
        .join("librowscan_child_clock.so");
    let why = match library.is_file() {
        _ if !cfg!(target_os = "linux") => "only Linux has it",
        false => "`cargo build -p rowscan-child-clock-preload` has not been run",
        true if Command::new("python3").arg("--version").output().is_err() => "no python3 on this machine",
        true => return true,
    };
    eprintln!("SKIPPED: simulated time of children: {why}");
    false
}

fn scenarios() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tools/scenarios")
}

/// The scenario ends some seconds after its fault, which is at 1 m: long enough for all that is asked of these runs.
const SHORT: (&str, &str) = ("end = { s = 24 }", "end = { s = 8 }");

/// Tries tools/scenarios/redial.toml with these texts replaced.
fn redial(changes: &[(&str, &str)]) -> Ended {
    let folder = tempfile::tempdir().expect("a folder");
    let mut scenario = std::fs::read_to_string(scenarios().join("redial.toml")).expect("there");
    let base = scenarios().join("base.toml");
    let controller = scenarios().join("controller.py");
    let paths =
        [("\"base.toml\"", format!("{base:?}")), ("{scenario}/controller.py", text(&controller).into())];
    let paths = paths.iter().map(|(from, to)| (*from, to.as_str()));
    for (from, to) in paths.chain(changes.iter().copied()) {
        assert!(scenario.contains(from), "`{from}` is not in redial.toml");
        scenario = scenario.replace(from, to);
    }
    // The scene stands beside the base.
    let scene = format!("scene = {:?}\n", scenarios().join("row.toml"));
    let path = folder.path().join("it.toml");
    std::fs::write(&path, scene + &scenario).expect("written");
    run(&["check", text(&path)])
}

#[test]
fn a_pause_before_dialling_again_takes_simulated_time() {
    if !can_run() {
        return;
    }
    let ended = redial(&[]);
    assert_eq!(ended.code, Some(0), "{}{}", ended.stdout, ended.stderr);
    assert_says(&ended.stdout, &["a scan from left after 0.22"]);
    let ended = redial(&[SHORT, ("\"{left.tcp}\"", "\"{left.tcp}\", \"--pause\", \"4\"")]);
    assert_eq!(ended.code, Some(1), "{}", ended.stdout);
    assert_says(&ended.stdout, &["expected a scan from left within 1 s, found one after 4.02"]);
    // In the host's time it takes what it takes, and no two runs are the same.
    let hosts = [
        ("time = \"simulated\"", ""),
        ("\"{left.tcp}\"", "\"{left.tcp}\", \"--pause\", \"0.5\""),
        ("within_s = 1 }", "within_s = 20 }"),
        ("{ what = \"same_bytes\", of = \"decisions.jsonl\", runs = 2 },", ""),
    ];
    let ended = redial(&hosts);
    assert_eq!(ended.code, Some(0), "{}", ended.stdout);
    assert_says(
        &ended.stdout,
        &["time went on at this machine's pace, and the run does not repeat to the byte"],
    );
}

#[test]
fn a_missing_time_out_is_seen() {
    if !can_run() {
        return;
    }
    let half_open =
        ("name = \"fin\", on = \"left\",", "name = \"half_open\", on = \"left\", for = { s = 1 },");
    let in_time = ("after = \"out\", within_s = 1", "after = \"out\", within_s = 3");
    let ended = redial(&[SHORT, half_open, in_time]);
    assert_eq!(ended.code, Some(0), "{}", ended.stdout);
    let ended = redial(&[SHORT, half_open, in_time, ("\"{left.tcp}\"", "\"{left.tcp}\", \"--patient\"")]);
    assert_eq!(ended.code, Some(1), "{}", ended.stdout);
    assert_says(&ended.stdout, &["expected a scan from left within 3 s, found none"]);
}

/// A controller that sleeps with a connection open: time waits for it, so by simulated time it is back at once.
#[test]
#[cfg(target_os = "linux")]
fn a_sleep_that_time_waits_for_is_told_and_what_was_due_meanwhile_is_not_judged() {
    let folder = tempfile::tempdir().expect("a folder");
    let tried = |pause_s: &str| {
        let scenario = format!(
            "version = 1\nscene = \"spindle\"\nseed = 7\nclock = {{ mode = \"lockstep\", deadline_wall_s = 60, startup_wall_s = 60 }}\nend = {{ s = 2 }}\n\
             fault = [{{ id = \"out\", name = \"fin\", on = \"left\", at = {{ row_m = 1.0 }} }}]\n\
             [[device]]\nid = \"left\"\nmodel = \"lms111\"\n[[bus]]\nid = \"can0\"\nport = \"socketcand:127.0.0.1:0\"\n\
             [[run]]\nid = \"sut\"\ncommand = [\"python3\", \"{{scenario}}/it.py\", \"{{left.tcp}}\", \"{{can0.address}}\", \"{pause_s}\"]\n\
             ready = {{ line = \"connected\" }}\n[[expect]]\nwhat = \"streaming\"\nafter = \"out\"\nwithin_s = 1\n\
             [[expect]]\nwhat = \"first_scan\"\nwithin_s = 60\n"
        );
        std::fs::write(folder.path().join("it.py"), SLEEPER).expect("written");
        let path = folder.path().join("it.toml");
        std::fs::write(&path, scenario).expect("written");
        run(&["check", text(&path)])
    };
    let ended = tried("0");
    assert_eq!(ended.code, Some(0), "{}{}", ended.stdout, ended.stderr);
    let ended = tried("1.5");
    assert_eq!(ended.code, Some(2), "{}{}", ended.stdout, ended.stderr);
    assert_says(
        &ended.stdout,
        &["note", "the sleep took no simulated time", "`time = \"simulated\"`", "ERROR   1. streaming"],
    );
    assert_says(&ended.stdout, &["passed  2. first_scan"]);
    // A busy machine wakes the sleeper late, and its sleep is noticed late: about what it asked for, or longer.
    let slept = ended.stdout.split_once("`sut` slept for ").and_then(|(_, rest)| rest.split_once(" s of"));
    let slept_s: f64 = slept.and_then(|(figure, _)| figure.parse().ok()).expect("how long it slept");
    assert!(slept_s >= 1.0, "{}", ended.stdout);
}

#[cfg(target_os = "linux")]
const SLEEPER: &str = r#"
import socket, sys, threading, time
def connect(place):
    host, port = place.rsplit(":", 1)
    return socket.create_connection((host, int(port)))
bus, asleep = connect(sys.argv[2]), threading.Lock()
bus.sendall(b"< open can0 >< rawmode >")
def listen():
    while bus.recv(65536):
        with asleep:
            pass
threading.Thread(target=listen, daemon=True).start()
while True:
    with connect(sys.argv[1]) as scanner:
        scanner.sendall(b"\x02sEN LMDscandata 1\x03")
        print("connected")
        while scanner.recv(65536):
            pass
    with asleep:
        time.sleep(float(sys.argv[3]))
"#;

/// All that a check tells as JSON lines but for this machine's time.
fn told_in_simulated_time(ended: &Ended) -> Vec<serde_json::Value> {
    let line = |line: &str| {
        let mut told: serde_json::Value = serde_json::from_str(line).expect("JSON");
        told.as_object_mut().expect("an object").retain(|key, _| !key.contains("wall"));
        told
    };
    ended.stdout.lines().map(line).collect()
}

/// A controller that ends by itself in the middle of the drive: how long this machine takes to end it, and to notice, is nothing of the run.
#[test]
fn ten_runs_of_a_controller_that_ends_by_itself_are_the_same() {
    let times: &[&str] = if can_run() { &["host", "simulated"] } else { &["host"] };
    if Command::new("python3").arg("--version").output().is_err() {
        return;
    }
    for time in times {
        let folder = tempfile::tempdir().expect("a folder");
        let [base, scene, controller] =
            ["base.toml", "row.toml", "controller.py"].map(|name| scenarios().join(name));
        let scenario = format!(
            "use = {base:?}\nscene = {scene:?}\n\
             run = [{{ id = \"sut\", command = [\"python3\", {controller:?}, \"{{left.tcp}}\", \"--quit-after\", \"20\"], time = \"{time}\", \
             ready = {{ line = \"connected\" }} }}]\n\
             expect = [{{ what = \"first_scan\", within_s = 0.1 }}, {{ what = \"exit_code\", equals = 1 }}, \
             {{ what = \"scans_lost\", equals = 0 }}, {{ what = \"log\", matches = \"row done\", within_s = 1 }}]\n"
        );
        let path = folder.path().join("it.toml");
        std::fs::write(&path, scenario).expect("written");
        let runs: Vec<_> = (0..10)
            .map(|_| {
                let ended = run(&["check", text(&path), "--format", "jsonl"]);
                assert_eq!(ended.code, Some(1), "{time}: {}{}", ended.stdout, ended.stderr);
                told_in_simulated_time(&ended)
            })
            .collect();
        let exited: Vec<_> = runs[0].iter().filter(|told| told["event"] == "sut.exited").collect();
        assert_eq!(exited.len(), 1, "{time}: {:#?}", runs[0]);
        // With the scan that was its last.
        assert_eq!(exited[0]["t_s"], 0.4, "{time}");
        let verdicts: Vec<_> = runs[0].iter().filter_map(|told| told["verdict"].as_str()).collect();
        assert_eq!(verdicts, ["passed", "passed", "passed", "failed"], "{time}: {:#?}", runs[0]);
        for (number, found) in runs.iter().enumerate().skip(1) {
            assert_eq!(found, &runs[0], "{time}: run {} beside the first", number + 1);
        }
    }
}

/// Threads that wait for a queue and for each other, and a loop of events; their timers are due at the same instants as scans and as each other.
#[test]
fn ten_runs_decide_the_same_at_the_same_times() {
    if !can_run() {
        return;
    }
    for (program, command) in [("threads", THREADS), ("loop", LOOP)] {
        let folder = tempfile::tempdir().expect("a folder");
        let scenario = "version = 1\nscene = \"spindle\"\nseed = 7\nclock = { mode = \"lockstep\", deadline_wall_s = 60, startup_wall_s = 60 }\nend = { s = 2 }\n\
             fault = [{ id = \"out\", name = \"fin\", on = \"left\", at = { row_m = 1.0 } }]\n\
             [[device]]\nid = \"left\"\nmodel = \"lms111\"\n\
             [[run]]\nid = \"sut\"\ncommand = [\"python3\", \"{scenario}/it.py\", \"{left.tcp}\", \"{clock}\"]\n\
             ready = { line = \"connected\" }\ntime = \"simulated\"\n\
             [[expect]]\nwhat = \"same_bytes\"\nof = \"decisions.log\"\nruns = 10\n";
        std::fs::write(folder.path().join("it.py"), command).expect("written");
        let (path, keep) = (folder.path().join("it.toml"), folder.path().join("kept"));
        std::fs::write(&path, scenario).expect("written");
        let ended = run(&["check", text(&path), "--keep", text(&keep)]);
        assert_eq!(ended.code, Some(0), "{program}: {}{}", ended.stdout, ended.stderr);
        let log = std::fs::read_to_string(keep.join("01-it/seed-7-run-10/decisions.log")).expect("written");
        // Twenty times in two seconds, at exact instants of the scene's day.
        assert_says(&log, &["06:00:00.120000 beat 1\n", "06:00:01.920000 beat 19\n", "scan 40\n"]);
    }
}

/// Reads the time from the page as well, as a program does that the library cannot help.
const THREADS: &str = r#"
import mmap, os, queue, socket, struct, sys, threading, time
page = mmap.mmap(os.open(sys.argv[2], os.O_RDONLY), 32, prot=mmap.PROT_READ)
log, lock, scans = open("decisions.log", "w", buffering=1), threading.Lock(), queue.Queue()
def say(text):
    now, offset = struct.unpack_from("<Qq", page, 16)
    assert now == time.monotonic_ns() and now + offset == time.time_ns()
    with lock:
        log.write("%s.%06d %s\n" % (time.strftime("%H:%M:%S", time.gmtime()), time.time_ns() // 1000 % 1000000, text))
def work():
    while True:
        try:
            say("scan %d" % scans.get(timeout=0.01))
        except queue.Empty:
            say("nothing")
def beat():
    never = threading.Event()
    for number in range(1, 1000):
        never.wait(0.1)
        say("beat %d" % number)
host, port = sys.argv[1].rsplit(":", 1)
count = 0
while True:
    with socket.create_connection((host, int(port))) as scanner:
        scanner.sendall(b"\x02sEN LMDscandata 1\x03")
        print("connected")
        while chunk := scanner.recv(65536):
            # Its answer comes before the drive.
            if count == 0 and b"sSN" in chunk:
                for thread in work, beat:
                    threading.Thread(target=thread, daemon=True).start()
            count += chunk.count(b"sSN LMDscandata")
            scans.put(count)
    time.sleep(0.2)
"#;

const LOOP: &str = r#"
import asyncio, sys, time
log = open("decisions.log", "w", buffering=1)
def say(text):
    log.write("%s.%06d %s\n" % (time.strftime("%H:%M:%S", time.gmtime()), time.time_ns() // 1000 % 1000000, text))
async def beat():
    begun = asyncio.get_running_loop().time()
    for number in range(1, 1000):
        await asyncio.sleep(begun + number / 10 - asyncio.get_running_loop().time())
        say("beat %d" % number)
async def main():
    # A loop of events has its own timers before the drive, too.
    await asyncio.sleep(0.05)
    host, port = sys.argv[1].rsplit(":", 1)
    count, beating = 0, None
    while True:
        reader, writer = await asyncio.wait_for(asyncio.open_connection(host, int(port)), 1)
        writer.write(b"\x02sEN LMDscandata 1\x03")
        print("connected")
        while chunk := await reader.read(65536):
            if beating is None and b"sSN" in chunk:
                beating = asyncio.create_task(beat())
            count += chunk.count(b"sSN LMDscandata")
            say("scan %d" % count)
        writer.close()
        await asyncio.sleep(0.2)
asyncio.run(main())
"#;

#[test]
fn simulated_time_without_lockstep_or_library_is_refused() {
    let wrong = |clock: &str| {
        let ended = redial(&[("end = { s = 24 }", &format!("end = {{ s = 30 }}\nclock = {clock}"))]);
        assert_eq!(ended.code, Some(2), "{}", ended.stdout);
        ended.stdout
    };
    assert_says(
        &wrong("{ mode = \"paced\" }"),
        &["`time` of run `sut`", "add `clock = { mode = \"lockstep\" }`"],
    );
    let read = wrong("{ mode = \"lockstep\", ack = { sut = \"read\" } }");
    assert_says(&read, &["`time` of run `sut`", "expected `ack` idle alone"]);
}
