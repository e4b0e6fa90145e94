//! How soon after a scan's last byte its CAN frames are out: two scanners at 50 Hz, both estimated in one process on one core, their peer an idle task.

use std::process::{Command, ExitCode, Stdio};

use serde_json::{Value, json};

use crate::emulator::Emulator;
use crate::shell;
use crate::workspace::Workspace;

/// Scans of each scanner: twenty seconds.
const SCANS: &str = "1000";
/// Where the frames go: out of the process by a system call each, no farther than this machine.
const BUS: &str = "udp:239.74.163.2:43177";
/// The estimator's core.
const ESTIMATOR: &str = "0";
/// The scanners' core.
const SCANNERS: &str = "1";

/// Measures and prints one line a quantile.
pub fn run(workspace: &Workspace, _: &[String]) -> ExitCode {
    match measure(workspace) {
        Ok(reports) => {
            for (scanner, report) in reports.iter().enumerate() {
                for quantile in ["p50", "p99"] {
                    println!("{}", line(scanner, quantile, report));
                }
            }
            ExitCode::SUCCESS
        }
        Err(why) => {
            eprintln!("xtask bench latency: {why}");
            ExitCode::FAILURE
        }
    }
}

fn measure(workspace: &Workspace) -> Result<Vec<Value>, String> {
    if !shell::has("taskset") {
        return Err("there is no taskset to put both estimated in one process on one core".to_owned());
    }
    workspace.build_binary()?;
    let binary = workspace.built_binary()?;
    let mut scanners = Vec::new();
    for _ in 0..2 {
        let scanner = Emulator::start(workspace, &["--model", "lms111"])?;
        shell::run(
            Command::new("taskset")
                .args(["-a", "-p", "-c", SCANNERS, &scanner.id().to_string()])
                .stdout(Stdio::null()),
        )?;
        scanners.push(scanner);
    }
    let mut command = Command::new("taskset");
    command.args(["-c", ESTIMATOR]).arg(&binary).arg("estimate");
    command.args(scanners.iter().map(|scanner| format!("tcp://{}", scanner.place)));
    command.args(["--rig", "spindle", "--scanner", "0", "--scanner", "0"]);
    command.args(["--scans", SCANS, "--can", BUS, "--latency", "--format", "jsonl"]);
    let output = command
        .stdin(Stdio::null())
        .stderr(Stdio::null())
        .output()
        .map_err(|error| format!("taskset: {error}"))?;
    let text = String::from_utf8_lossy(&output.stdout);
    let lines = text.lines().filter_map(|line| serde_json::from_str::<Value>(line).ok());
    let reports: Vec<Value> = lines.filter(|line| line["latency_p99_ms"].is_number()).collect();
    if reports.len() != scanners.len() {
        return Err(format!("rowscan estimate told {} latencies: {text}", reports.len()));
    }
    scanners.into_iter().try_for_each(Emulator::stop)?;
    Ok(reports)
}

fn line(scanner: usize, quantile: &str, report: &Value) -> Value {
    let value = |of: &str| report[format!("{of}_{quantile}_ms")].as_f64().unwrap_or(f64::NAN);
    let (ours, idle) = (value("latency"), value("idle"));
    json!({
        "case": format!("last byte of a scan to its CAN frames, {quantile}, scanner {scanner} of 2 at 50 Hz, {} scans", report["scans"]),
        "ours": ours, "unit": "ms", "peer": "idle task that only waits for its deadline, in the same process",
        "peer_value": idle, "ratio": idle / ours, "threads": 1,
    })
}
