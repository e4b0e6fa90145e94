//! The fuzz targets of `fuzz/`, built by the stable compiler and run for a short time each, from their seeds.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::counts::Counts;
use crate::shell;
use crate::steps::Outcome;
use crate::workspace::Workspace;

/// Seconds a target runs.
const SECONDS: u32 = 20;

/// Longest input, bytes.
const LONGEST: u32 = 4096;

/// What makes a stable compiler count coverage as libFuzzer reads it; cargo-fuzz and a nightly compiler are not needed.
const COVERAGE: &str = "-Cpasses=sancov-module -Cllvm-args=-sanitizer-coverage-level=4 \
                        -Cllvm-args=-sanitizer-coverage-inline-8bit-counters -Cllvm-args=-sanitizer-coverage-pc-table \
                        -Ccodegen-units=1";

/// Builds every target and runs it.
pub fn run(workspace: &Workspace) -> Outcome {
    if !["c++", "g++", "clang++"].iter().any(|compiler| shell::has(compiler)) {
        return Outcome::Skipped("no C++ compiler, which libFuzzer needs".to_owned());
    }
    let mut counts = Counts::default();
    let result = build(workspace).and_then(|folder| {
        for target in targets(workspace)? {
            let result = run_target(workspace, &folder, &target);
            counts +=
                Counts { passed: u32::from(result.is_ok()), failed: u32::from(result.is_err()), skipped: 0 };
            result.unwrap_or_else(|why| println!("    {target}: {why}"));
        }
        Ok(())
    });
    Outcome::from_tests(counts, result)
}

/// Builds all targets; returns the folder of their binaries.
fn build(workspace: &Workspace) -> Result<PathBuf, String> {
    let host = host(workspace)?;
    // With a target named, the flags do not reach build scripts.
    let mut cargo = workspace.cargo(&[
        "build",
        "--quiet",
        "--release",
        "--manifest-path",
        "fuzz/Cargo.toml",
        "--target",
        &host,
    ]);
    let folder = workspace.target.join("fuzz");
    shell::run(cargo.env("RUSTFLAGS", COVERAGE).env("CARGO_TARGET_DIR", &folder))?;
    Ok(folder.join(host).join("release"))
}

/// The compiler's own platform.
fn host(workspace: &Workspace) -> Result<String, String> {
    let text = shell::capture(Command::new("rustc").arg("-vV").current_dir(&workspace.root))?;
    let host = text.lines().find_map(|line| line.strip_prefix("host: "));
    host.map(str::to_owned).ok_or("rustc -vV names no host".to_owned())
}

/// The names of the targets, as the manifest lists them.
fn targets(workspace: &Workspace) -> Result<Vec<String>, String> {
    let text = shell::capture(&mut workspace.cargo(&[
        "metadata",
        "--no-deps",
        "--format-version",
        "1",
        "--manifest-path",
        "fuzz/Cargo.toml",
    ]))?;
    let metadata: serde_json::Value =
        serde_json::from_str(&text).map_err(|error| format!("cargo metadata: {error}"))?;
    let bins = metadata["packages"][0]["targets"].as_array().into_iter().flatten();
    let mut names: Vec<String> = bins.filter_map(|bin| bin["name"].as_str().map(str::to_owned)).collect();
    names.sort();
    if names.is_empty() { Err("fuzz/Cargo.toml names no target".to_owned()) } else { Ok(names) }
}

/// Runs one target from its seeds; what it finds is kept below the build directory.
fn run_target(workspace: &Workspace, binaries: &Path, target: &str) -> Result<(), String> {
    let corpus = workspace.scratch(&format!("fuzz/{target}"))?;
    let seeds = workspace.root.join("fuzz/seeds").join(target);
    let mut command = Command::new(binaries.join(target));
    command
        .arg(format!("-max_total_time={SECONDS}"))
        .arg(format!("-max_len={LONGEST}"))
        .args(["-timeout=10", "-verbosity=0", "-print_final_stats=1"])
        .arg(format!("-artifact_prefix={}/", corpus.with_extension("found").display()))
        .arg(&corpus);
    if seeds.is_dir() {
        command.arg(seeds);
    }
    let found = corpus.with_extension("found");
    fs::create_dir_all(&found).map_err(|error| format!("{}: {error}", found.display()))?;
    let output = command.output().map_err(|error| error.to_string())?;
    let text = String::from_utf8_lossy(&output.stderr);
    if !output.status.success() {
        let last: Vec<&str> = text.lines().rev().take(30).collect();
        let last: Vec<&str> = last.into_iter().rev().collect();
        return Err(format!("{}\n{}", output.status, last.join("\n")));
    }
    let runs = text.lines().find_map(|line| line.strip_prefix("stat::number_of_executed_units:"));
    println!("    {target}: {} runs in {SECONDS} s", runs.map_or("?", str::trim));
    Ok(())
}
