//! The survey by mutation: the shipped scenarios find every fault that the reference controller can have, and none in the good one.

use std::path::Path;
use std::process::Command;

#[test]
fn the_shipped_scenarios_find_every_fault_of_the_controller() {
    let program = Path::new(env!("CARGO_BIN_EXE_rowscan"));
    let library = program.parent().expect("a folder").join("librowscan_child_clock.so");
    if !library.is_file() || !cfg!(target_os = "linux") {
        eprintln!(
            "SKIPPED: survey: `cargo build -p rowscan-child-clock-preload` has not been run, or this is not Linux"
        );
        return;
    }
    let survey = Path::new(env!("CARGO_MANIFEST_DIR")).join("tools/scenarios/survey/survey.py");
    let ended = match Command::new("python3").arg(&survey).arg(program).output() {
        Ok(ended) => ended,
        Err(cause) => {
            eprintln!("SKIPPED: survey: no python3 on this machine: {cause}");
            return;
        }
    };
    let (table, why) = (String::from_utf8_lossy(&ended.stdout), String::from_utf8_lossy(&ended.stderr));
    assert!(ended.status.success(), "{table}\n{why}");
    // What the page says was found is what is found: fault, what it does wrong, the expectation that caught it.
    let page =
        std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/measurements/survey.md"));
    let page = page.expect("docs/measurements/survey.md");
    let faults: Vec<&str> = table.lines().filter(|line| line.starts_with("| `")).collect();
    assert!(faults.len() > 20, "{table}");
    for line in faults {
        // The last column is that of all scenarios there.
        let line = line.trim_end_matches('|').trim_end().rsplit_once('|').map_or(line, |(line, _)| line);
        assert!(page.contains(line), "docs/measurements/survey.md is old: it lacks\n{line}");
    }
}
