//! Real SocketCAN: Debian's kernel in a virtual machine without hardware or root, with vcan0, our binary, its SocketCAN tests and can-utils
//! inside; and a bridge, the machine's slcan interface on the pseudo-terminal of an emulator out here.

mod archive;
mod machine;

use std::path::{Path, PathBuf};

use serde_json::Value;

use self::machine::{Machine, last};
use crate::counts::Counts;
use crate::emulator::Emulator;
use crate::rust_tests::{Program, programs};
use crate::shell;
use crate::steps::Outcome;
use crate::workspace::Workspace;

/// Source address of the tractor.
const TRACTOR: &str = "F0";
/// Source address of the canopy sensor.
const SENSOR: &str = "80";
/// Source address of the command that the machine sends.
const COMMANDER: &str = "28";
/// 1.5 m/s, as 65096 begins with it: what the machine commands through the bridge.
const COMMANDED: &str = "DC05";

/// Boots the machine and judges what it says.
pub fn run(workspace: &Workspace) -> Outcome {
    let binary = match workspace.built_binary() {
        Ok(binary) => binary,
        Err(why) => return Outcome::Skipped(why),
    };
    if !shell::has("ldd") {
        return Outcome::Skipped("no ldd".to_owned());
    }
    match Machine::fetch(workspace) {
        Err(why) => Outcome::Skipped(why),
        Ok(debian) => {
            let mut counts = Counts::default();
            let result = judge(workspace, debian, &binary, &mut counts);
            Outcome::from_tests(counts, result)
        }
    }
}

fn judge(workspace: &Workspace, debian: PathBuf, binary: &Path, counts: &mut Counts) -> Result<(), String> {
    let tests = test_binary(workspace)?;
    let machine = Machine::assemble(workspace, debian, &[("rowscan", binary), ("socketcan", &tests)])?;
    let folder = workspace.scratch("vcan")?;
    let (link, sent) = (folder.join("adapter"), folder.join("sent.log"));
    // Of a run before.
    let _ = std::fs::remove_file(&sent);
    let ports = ["slcan", "candump"].map(|kind| {
        let place = if kind == "slcan" { &link } else { &sent };
        format!("{kind}:{}", place.display())
    });
    let scene = workspace.root.join("tools/foreign/vcan/scene.toml");
    let arguments =
        [&scene.display().to_string(), "--tcp", "127.0.0.1:0", "--can", &ports[0], "--can", &ports[1]];
    let emulator = Emulator::start_on(workspace, "slcan", &arguments)?;
    let console = machine.boot(&link)?;
    emulator.stop()?;
    if !console.iter().any(|line| line == "vcan: done") {
        return Err(format!("the machine did not come to its end:\n{}", last(&console)));
    }

    let ran = section(&console, "tests")?;
    let told = ran.iter().find_map(|line| Counts::from_libtest(line));
    *counts += told.ok_or_else(|| format!("the SocketCAN tests did not end:\n{}", ran.join("\n")))?;
    if counts.failed > 0 || counts.skipped > 0 || ran.iter().any(|line| line.contains("SKIPPED")) {
        return Err(ran.join("\n"));
    }

    let (heard, ours) = (frames(section(&console, "heard")?), frames(section(&console, "sent")?));
    for (who, address, at_least) in [("tractor", TRACTOR, 60), ("canopy sensor", SENSOR, 60)] {
        let (heard, ours) = (from(&heard, address), from(&ours, address));
        if heard.len() < at_least || !contains(&ours, &heard) {
            return Err(format!(
                "candump heard {} frames of the {who} on vcan0, which are not among the {} of the emulator's own log",
                heard.len(),
                ours.len()
            ));
        }
        println!("    vcan0: candump heard {} frames of the {who}, each as it was sent", heard.len());
        counts.passed += 1;
    }
    let said = section(&console, "said")?;
    let estimate: Value = serde_json::from_str(&section(&console, "estimate")?.join("\n"))
        .map_err(|error| format!("no estimate: {error}:\n{}", last(said)))?;
    if estimate["advance_source"] != "can" || estimate["scans"] != 150 {
        return Err(format!("an estimate of other scans: {estimate}"));
    }
    counts.passed += 1;

    let text = std::fs::read_to_string(&sent).map_err(|error| format!("{}: {error}", sent.display()))?;
    let sent: Vec<String> = text.lines().map(str::to_owned).collect();
    let (there, here) = (frames(section(&console, "bridge")?), frames(&sent));
    let (theirs, ours) = (from(&there, TRACTOR), from(&here, TRACTOR));
    if theirs.len() < 100 || !contains(&ours, &theirs) {
        return Err(format!(
            "candump in the machine heard {} frames on slcan0, which are not a stretch of the {} sent",
            theirs.len(),
            ours.len()
        ));
    }
    println!(
        "    slcan0: candump in the machine heard {} frames, each as the emulator sent it",
        theirs.len()
    );
    counts.passed += 1;
    if from(&here, COMMANDER).len() != 1 {
        return Err("the machine's speed command did not come out of the bridge once".to_owned());
    }
    let obeyed = theirs.iter().rfind(|frame| frame.contains("FE48"));
    if !obeyed.is_some_and(|frame| frame.contains(&format!("#{COMMANDED}"))) {
        return Err(format!("the tractor did not come to the speed commanded: {obeyed:?}"));
    }
    counts.passed += 1;
    Ok(())
}

/// The end-to-end tests, of which the machine runs those of SocketCAN, as they are built for `ci`.
fn test_binary(workspace: &Workspace) -> Result<PathBuf, String> {
    let is_end_to_end = |program: &Program| {
        let name = program.path.file_name().unwrap_or_default().to_string_lossy();
        program.folder == workspace.root && name.starts_with("it-")
    };
    let found = programs(workspace)?.into_iter().find(is_end_to_end);
    found.map(|program| program.path).ok_or_else(|| "cargo built no end-to-end tests".to_owned())
}

/// What the machine showed under a name.
fn section<'a>(console: &'a [String], name: &str) -> Result<&'a [String], String> {
    let at = |edge: &str| console.iter().position(|line| *line == format!("vcan: {edge} {name}"));
    match at("begin").zip(at("end")) {
        Some((begin, end)) if begin < end => Ok(&console[begin + 1..end]),
        _ => Err(format!("the machine's console shows no `{name}`:\n{}", last(console))),
    }
}

/// The frames of a candump log: `ID#DATA`.
fn frames(log: &[String]) -> Vec<&str> {
    log.iter().filter_map(|line| line.split_whitespace().nth(2)).collect()
}

/// The frames that a source address sent.
fn from<'a>(frames: &[&'a str], address: &str) -> Vec<&'a str> {
    let sender = |frame: &str| frame.split_once('#').and_then(|(id, _)| id.get(6..8).map(|a| a == address));
    frames.iter().copied().filter(|frame| sender(frame) == Some(true)).collect()
}

/// Whether `part` is a stretch of `whole`, with no frame missing and none between.
fn contains(whole: &[&str], part: &[&str]) -> bool {
    whole.windows(part.len().max(1)).any(|stretch| stretch == part)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stretch_has_no_gap() {
        let log =
            ["(1.0) can0 0CFE49F0#01", "(1.1) can0 0CFE4980#02", "(1.2) can0 0CFE49F0#03"].map(str::to_owned);
        let frames = frames(&log);
        assert_eq!(from(&frames, TRACTOR), ["0CFE49F0#01", "0CFE49F0#03"]);
        assert!(contains(&frames, &frames[1..]) && !contains(&frames, &from(&frames, TRACTOR)));
    }
}
