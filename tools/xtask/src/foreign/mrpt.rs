//! MRPT's laser drivers CLMS100Eth, CSICKTim561Eth and CSickLaserSerial, built from Debian's MRPT and unmodified: each runs its own start-up, and what it
//! receives is what another client of the same scanner receives, and what the scene holds.

use std::collections::HashSet;
use std::f64::consts::PI;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use super::debian;
use crate::counts::Counts;
use crate::emulator::Emulator;
use crate::shell::{self, Limit};
use crate::steps::Outcome;
use crate::workspace::Workspace;

/// Longest run of a driver, its start-up included.
const LIMIT: Limit = Limit::InAll(Duration::from_secs(90));

/// Where Debian puts MRPT's headers, a folder a module.
const HEADERS: &str = "/usr/include/mrpt";
const PACKAGES: &[&str] = &["libmrpt-hwdrivers-dev", "g++"];
const LIBRARIES: &[&str] = &[
    "-lmrpt-hwdrivers",
    "-lmrpt-obs",
    "-lmrpt-comms",
    "-lmrpt-poses",
    "-lmrpt-math",
    "-lmrpt-serialization",
    "-lmrpt-rtti",
    "-lmrpt-core",
];

/// Scans a driver must deliver.
const SCANS: usize = 20;
/// The built-in scene: so high stands the scanner over flat ground; a side mount's device angle 0 looks straight down.
const SENSOR_HEIGHT_MM: f64 = 1600.0;
/// No leaf hangs within this angle of straight down.
const BARE_DEG: f64 = 15.0;
/// Rates CSickLaserSerial is asked for; it knows 9600, 38400 and 500000 only.
const SERIAL_RATES: &[&str] = &["9600", "38400"];
/// First beam of both scanners.
const START_DEG: f64 = -45.0;

/// A driver and the scanner it is for.
struct Case {
    class: &'static str,
    model: &'static str,
    beams: usize,
    step_deg: f64,
}

/// CLMS100Eth sets 25 Hz and a quarter of a degree by itself.
const CASES: &[Case] = &[
    Case { class: "CLMS100Eth", model: "lms111", beams: 1081, step_deg: 0.25 },
    Case { class: "CSICKTim561Eth", model: "tim561", beams: 811, step_deg: 1.0 / 3.0 },
];

/// Builds the programs and runs every driver.
pub fn run(workspace: &Workspace) -> Outcome {
    if let Err(why) = workspace.built_binary() {
        return Outcome::Skipped(why);
    }
    let there = || shell::has("g++") && Path::new(HEADERS).join("hwdrivers").is_dir();
    if let Err(why) = debian::provide_where("MRPT's hardware drivers", there, PACKAGES) {
        return Outcome::Skipped(why);
    }
    let mut counts = Counts::default();
    let result = build(workspace, "scans").and_then(|program| {
        counts.passed += 1;
        for case in CASES {
            check(workspace, &program, case).map_err(|error| format!("{}: {error}", case.class))?;
            counts.passed += 1;
        }
        if let Some(recorded) = recorded_lms111(workspace) {
            check_replay(workspace, &program, &recorded).map_err(|error| format!("replay: {error}"))?;
            counts.passed += 1;
        }
        let program = build(workspace, "serial_scans")?;
        for rate in SERIAL_RATES {
            check_serial(workspace, &program, rate)
                .map_err(|error| format!("CSickLaserSerial at {rate}: {error}"))?;
            counts.passed += 1;
        }
        Ok(())
    });
    Outcome::from_tests(counts, result)
}

fn build(workspace: &Workspace, name: &str) -> Result<PathBuf, String> {
    let program = workspace.scratch("mrpt")?.join(name);
    let mut compile = Command::new("g++");
    compile.args(["-std=c++17", "-O1", "-o"]).arg(&program);
    compile.arg(workspace.root.join(format!("tools/foreign/mrpt/{name}.cpp")));
    let modules = std::fs::read_dir(HEADERS).map_err(|error| format!("{HEADERS}: {error}"))?;
    for include in modules.flatten().map(|module| module.path().join("include")).filter(|path| path.is_dir())
    {
        compile.arg("-I").arg(include);
    }
    compile.args(["-isystem", "/usr/include/eigen3"]).args(LIBRARIES);
    shell::run(&mut compile)?;
    Ok(program)
}

fn check(workspace: &Workspace, program: &Path, case: &Case) -> Result<(), String> {
    let emulator = Emulator::start(workspace, &["--model", case.model])?;
    let (host, port) = emulator.place.rsplit_once(':').ok_or("no port")?;
    let witness = Witness::watch(&emulator.place)?;
    let mut scans = Vec::new();
    let mut command = Command::new(program);
    command.args([case.class, host, port, &SCANS.to_string()]);
    shell::run_lines(&mut command, LIMIT, |line| scans.extend(scan(line)))?;
    if scans.len() != SCANS {
        return Err(format!("{} of {SCANS} scans", scans.len()));
    }
    let seen = witness.seen();
    for (number, (aperture_deg, ranges_mm)) in scans.iter().enumerate() {
        let fail = |what: String| Err(format!("scan {number}: {what}"));
        if ranges_mm.len() != case.beams || (aperture_deg - 270.0).abs() > 0.3 {
            return fail(format!("{} beams over {aperture_deg} degrees", ranges_mm.len()));
        }
        if let Some((angle, found, expected)) = off_the_ground(case, START_DEG, ranges_mm) {
            return fail(format!("{found} mm at {angle} degrees, the ground is at {expected:.1} mm"));
        }
        if !seen.contains(ranges_mm) {
            return fail("no scan that another client received has these ranges".to_owned());
        }
    }
    println!("    {}: {SCANS} scans of {} beams, each as another client saw it", case.class, case.beams);
    emulator.stop()
}

/// The recording of a real LMS111, where this machine has it.
fn recorded_lms111(workspace: &Workspace) -> Option<PathBuf> {
    let facts =
        std::env::var_os("ROWSCAN_FACTS").map_or_else(|| workspace.root.join("../shared"), PathBuf::from);
    let recorded = facts.join("protocol/recordings/lms111_startup_first88.d2h.bin");
    if !recorded.is_file() {
        println!("    SKIPPED: replay: no recording at {}", recorded.display());
    }
    Some(recorded).filter(|recorded| recorded.is_file())
}

/// CLMS100Eth asks for 25 Hz, which a recording of 50 Hz cannot give: it is refused, and gets the recorded scans.
fn check_replay(workspace: &Workspace, program: &Path, recorded: &Path) -> Result<(), String> {
    let recorded = recorded.to_str().ok_or("a path that is not UTF-8")?;
    let replay = Emulator::command(workspace, "replay", &[recorded, "--loop"])?;
    let (host, port) = replay.place.rsplit_once(':').ok_or("no port")?;
    let witness = Witness::watch(&replay.place)?;
    let mut scans = Vec::new();
    let mut command = Command::new(program);
    command.args(["CLMS100Eth", host, port, &SCANS.to_string()]);
    shell::run_lines(&mut command, LIMIT, |line| scans.extend(scan(line)))?;
    let seen = witness.seen();
    match scans.iter().position(|(_, ranges_mm)| ranges_mm.len() != 541 || !seen.contains(ranges_mm)) {
        None if scans.len() == SCANS => {}
        None => return Err(format!("{} of {SCANS} scans", scans.len())),
        Some(number) => return Err(format!("scan {number} is none that another client received")),
    }
    println!("    CLMS100Eth: {SCANS} recorded scans of 541 beams, each as another client saw it");
    replay.stop()
}

/// CSickLaserSerial against a virtual LMS291 on a pseudo-terminal: it finds the device, switches its rate and configures it.
fn check_serial(workspace: &Workspace, program: &Path, rate: &str) -> Result<(), String> {
    let link = workspace.scratch("mrpt")?.join("scanner");
    let link = link.to_str().ok_or("the scratch folder's name is no text")?;
    let emulator = Emulator::start_on(workspace, "pty", &["--model", "lms291", "--pty", link])?;
    let mut scans = Vec::new();
    let mut command = Command::new(program);
    command.args([&emulator.place, rate, &SCANS.to_string()]);
    shell::run_lines(&mut command, LIMIT, |line| scans.extend(scan(line)))?;
    if scans.len() != SCANS {
        return Err(format!("{} of {SCANS} scans", scans.len()));
    }
    let case = Case { class: "CSickLaserSerial", model: "lms291", beams: 361, step_deg: 0.5 };
    for (number, (aperture_deg, ranges_mm)) in scans.iter().enumerate() {
        if ranges_mm.len() != case.beams || (aperture_deg - 180.0).abs() > 0.3 {
            return Err(format!("scan {number}: {} beams over {aperture_deg} degrees", ranges_mm.len()));
        }
        if let Some((angle, found, expected)) = off_the_ground(&case, 0.0, ranges_mm) {
            return Err(format!(
                "scan {number}: {found} mm at {angle} degrees, the ground is at {expected:.1} mm"
            ));
        }
    }
    println!(
        "    {}: {SCANS} scans of {} beams at {rate}, on the ground to the millimetre",
        case.class, case.beams
    );
    emulator.stop()
}

/// Angle, range and true distance of a beam that misses the bare ground straight below.
fn off_the_ground(case: &Case, start_deg: f64, ranges_mm: &[u32]) -> Option<(f64, u32, f64)> {
    let beams =
        ranges_mm.iter().enumerate().map(|(beam, &range)| (start_deg + beam as f64 * case.step_deg, range));
    let expected = |angle_deg: f64| SENSOR_HEIGHT_MM / (angle_deg * PI / 180.0).cos();
    beams
        .filter(|(angle_deg, _)| angle_deg.abs() <= BARE_DEG)
        .map(|(angle_deg, range)| (angle_deg, range, expected(angle_deg)))
        .find(|(_, range, expected)| (f64::from(*range) - expected).abs() > 1.0)
}

/// Aperture and ranges of one line of the program; others are MRPT's own chatter.
fn scan(line: &str) -> Option<(f64, Vec<u32>)> {
    let mut numbers = line.strip_prefix("SCAN ")?.split(' ');
    let aperture_deg = numbers.next()?.parse().ok()?;
    Some((aperture_deg, numbers.map(|number| number.parse().ok()).collect::<Option<_>>()?))
}

/// Another client of the same scanner, which subscribes and keeps every scan's ranges.
struct Witness {
    seen: Arc<Mutex<HashSet<Vec<u32>>>>,
}

impl Witness {
    fn watch(address: &str) -> Result<Self, String> {
        let fail = |error: std::io::Error| format!("the other client: {error}");
        let mut stream = TcpStream::connect(address).map_err(fail)?;
        stream.write_all(b"\x02sEN LMDscandata 1\x03").map_err(fail)?;
        let seen = Arc::new(Mutex::new(HashSet::new()));
        let kept = Arc::clone(&seen);
        // It ends with the emulator, which closes the connection.
        std::thread::spawn(move || {
            let mut received = Vec::new();
            let mut chunk = [0; 16 * 1024];
            while let Ok(read @ 1..) = stream.read(&mut chunk) {
                received.extend_from_slice(&chunk[..read]);
                while let Some(end) = received.iter().position(|&byte| byte == 0x03) {
                    let frame: Vec<u8> = received.drain(..=end).collect();
                    if let Some(ranges) = ranges_mm(&String::from_utf8_lossy(&frame)) {
                        kept.lock().unwrap_or_else(PoisonError::into_inner).insert(ranges);
                    }
                }
            }
        });
        Ok(Self { seen })
    }

    fn seen(&self) -> HashSet<Vec<u32>> {
        self.seen.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

/// The first channel's values in a scan telegram.
fn ranges_mm(text: &str) -> Option<Vec<u32>> {
    let tokens: Vec<&str> = text.trim_matches(['\x02', '\x03']).split(' ').collect();
    let number = |token: &&str| u32::from_str_radix(token, 16).ok();
    let name = tokens.iter().position(|token| *token == "DIST1")?;
    let count = number(tokens.get(name + 5)?)? as usize;
    tokens.get(name + 6..name + 6 + count)?.iter().map(number).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_are_read_from_both_sides() {
        assert_eq!(scan("SCAN 270.0 1600 0 12"), Some((270.0, vec![1600, 0, 12])));
        assert_eq!(scan("[CLMS100Eth] connected"), None);
        let telegram = "\x02sSN LMDscandata 1 1 DIST1 3F800000 00000000 FFF92230 1388 3 640 0 C 0\x03";
        assert_eq!(ranges_mm(telegram), Some(vec![1600, 0, 12]));
        assert_eq!(ranges_mm("\x02sEA LMDscandata 1\x03"), None);
    }

    #[test]
    fn the_ground_below_is_held_to_the_millimetre() {
        let case = Case { class: "", model: "", beams: 271, step_deg: 1.0 };
        let flat = |height: f64| -> Vec<u32> {
            let angle = |beam: u32| (START_DEG + f64::from(beam)) * PI / 180.0;
            (0..271).map(|beam| (height / angle(beam).cos().abs().max(0.01)).round() as u32).collect()
        };
        assert_eq!(off_the_ground(&case, START_DEG, &flat(1600.0)), None);
        assert!(off_the_ground(&case, START_DEG, &flat(1610.0)).is_some());
    }
}
