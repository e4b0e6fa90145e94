//! How soon after a scan's last byte its CAN frames are out: two scanners at 50 Hz, both estimators on one core, their peer an idle task.

use std::process::{Child, Command, ExitCode, Stdio};

use serde_json::{Value, json};

use crate::emulator::Emulator;
use crate::shell;
use crate::workspace::Workspace;

/// Scans of each scanner: twenty seconds.
const SCANS: &str = "1000";
/// Where the frames go: out of the process by a system call each, no farther than this machine.
const BUS: &str = "udp:239.74.163.2:43177";
/// The estimators' core.
const ESTIMATORS: &str = "0";
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
        return Err("there is no taskset to put both estimators on one core".to_owned());
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
    let estimate = |place: &str| -> Result<Child, String> {
        let mut command = Command::new("taskset");
        command.args(["-c", ESTIMATORS]).arg(&binary).args(["estimate", &format!("tcp://{place}")]);
        command.args(["--rig", "spindle", "--scans", SCANS, "--can", BUS, "--latency", "--format", "jsonl"]);
        command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::null());
        command.spawn().map_err(|error| format!("taskset: {error}"))
    };
    let running = scanners.iter().map(|scanner| estimate(&scanner.place)).collect::<Result<Vec<_>, _>>()?;
    let mut reports = Vec::new();
    for child in running {
        let output = child.wait_with_output().map_err(|error| format!("rowscan estimate: {error}"))?;
        let text = String::from_utf8_lossy(&output.stdout);
        let mut reports_of = text.lines().filter_map(|line| serde_json::from_str::<Value>(line).ok());
        let report = reports_of.rfind(|line| line["latency_p99_ms"].is_number());
        reports.push(report.ok_or_else(|| format!("rowscan estimate told no latency: {text}"))?);
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
