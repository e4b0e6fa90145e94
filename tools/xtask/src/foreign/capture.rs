//! A network capture by dumpcap of the emulator on loopback: it reads back as the telegrams that were sent, and gives the same estimate.

use std::fs::File;
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;

use super::with_programs;
use crate::counts::Counts;
use crate::emulator::Emulator;
use crate::shell;
use crate::steps::Outcome;
use crate::workspace::Workspace;

/// Scans that are captured.
const SCANS: &str = "100";

/// How long dumpcap may take to begin, and to end.
const PATIENCE: Duration = Duration::from_secs(10);

/// Captures a client's session and reads it back.
pub fn run(workspace: &Workspace) -> Outcome {
    with_programs(workspace, &["dumpcap"], &["wireshark-common"], |workspace| {
        let mut counts = Counts::default();
        match capture(workspace, &mut counts) {
            Err(why) if why.starts_with(NOT_ALLOWED) => Outcome::Skipped(why),
            result => Outcome::from_tests(counts, result),
        }
    })
}

/// What is said where the loopback interface may not be captured.
const NOT_ALLOWED: &str = "dumpcap may not capture on lo";

fn capture(workspace: &Workspace, counts: &mut Counts) -> Result<(), String> {
    let binary = workspace.built_binary()?;
    let folder = workspace.scratch("capture")?;
    let (captured, recorded) = (folder.join("run.pcapng"), folder.join("run.mcap"));
    for old in [&captured, &recorded] {
        let _ = std::fs::remove_file(old);
    }
    let emulator = Emulator::start(workspace, &["--model", "lms111"])?;
    let (_, port) = emulator.place.rsplit_once(':').ok_or("no port")?;
    let dumpcap = begin(&captured, port)?;
    let record = path(&recorded)?;
    let url = format!("tcp://{}", emulator.place);
    let live = estimate(&binary, &[&url, "--rig", "spindle", "--scans", SCANS, "--record", record])?;
    // Packets are on their way through the kernel still.
    std::thread::sleep(Duration::from_secs(1));
    end(dumpcap)?;
    emulator.stop()?;
    counts.passed += 1;

    let from_capture = estimate(&binary, &[path(&captured)?, "--rig", "spindle", "--scans", SCANS])?;
    same("the estimate of the capture", &from_capture, &live)?;
    counts.passed += 1;

    // The recorder stopped listening with the last scan; the wire went on.
    let (wire, tapped) = (telegrams(&binary, &captured)?, telegrams(&binary, &recorded)?);
    if tapped.len() < 100 || !wire.starts_with(&tapped) {
        let at = wire.iter().zip(&tapped).position(|(wire, tapped)| wire != tapped);
        return Err(format!(
            "the device's telegrams differ from number {at:?} on: {} captured, {} recorded",
            wire.len(),
            tapped.len()
        ));
    }
    counts.passed += 1;
    println!("    {} telegrams captured, the first {} as they were recorded", wire.len(), tapped.len());
    Ok(())
}

fn begin(file: &Path, port: &str) -> Result<Child, String> {
    let log = file.with_extension("log");
    let said = File::create(&log).map_err(|error| format!("{}: {error}", log.display()))?;
    let child = Command::new("dumpcap")
        .args(["-i", "lo", "-f", &format!("tcp port {port}"), "-w", path(file)?])
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(said)
        // Signals go to groups.
        .process_group(0)
        .spawn()
        .map_err(|error| format!("cannot start dumpcap: {error}"))?;
    let mut dumpcap = child;
    let start = Instant::now();
    loop {
        let said = std::fs::read_to_string(&log).unwrap_or_default();
        // It names its file once it captures.
        if said.contains("File: ") {
            return Ok(dumpcap);
        }
        let ended = matches!(dumpcap.try_wait(), Ok(Some(_)));
        if ended || start.elapsed() > PATIENCE {
            shell::signal(&dumpcap, "KILL");
            let _ = dumpcap.wait();
            return Err(format!("{NOT_ALLOWED}: {}", said.trim().replace('\n', "; ")));
        }
        std::thread::sleep(Duration::from_millis(50));
    }
}

fn end(mut dumpcap: Child) -> Result<(), String> {
    shell::signal(&dumpcap, "INT");
    shell::wait(&mut dumpcap, PATIENCE).map(drop).ok_or_else(|| "dumpcap does not end".to_owned())
}

fn estimate(binary: &Path, arguments: &[&str]) -> Result<String, String> {
    let mut command = Command::new(binary);
    shell::capture(command.arg("estimate").args(arguments).args(["--format", "json"]))
}

fn same(what: &str, found: &str, expected: &str) -> Result<(), String> {
    if found == expected {
        Ok(())
    } else {
        Err(format!("{what} differs:\n{found}\nfrom the live one:\n{expected}"))
    }
}

/// What the device sent, as `rowscan decode` has it.
fn telegrams(binary: &Path, file: &Path) -> Result<Vec<Value>, String> {
    let mut command = Command::new(binary);
    let text = shell::capture(command.args(["decode", path(file)?, "--format", "jsonl", "--values"]))?;
    let lines = text.lines().filter_map(|line| serde_json::from_str::<Value>(line).ok());
    Ok(lines
        .filter(|line| line["from"] == "device")
        .map(|line| Value::Array(["kind", "name", "length", "words"].map(|key| line[key].clone()).to_vec()))
        .collect())
}

fn path(path: &Path) -> Result<&str, String> {
    path.to_str().ok_or_else(|| format!("{} is not UTF-8", path.display()))
}
