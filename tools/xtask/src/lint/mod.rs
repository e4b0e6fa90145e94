//! `cargo xtask lint`: the invariants that neither rustc nor clippy holds. Each violation names file, line and rule.

mod documents;
mod rules;
mod source;

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use std::process::ExitCode;

use crate::workspace::Workspace;
use rules::Rule;
use source::Source;

/// A source file longer than this has more than one reason to change.
const MOST_LINES: usize = 600;

/// From here on a file is worth a look.
const MANY_LINES: usize = 400;

/// Folders whose `src` may read the clock in one file each.
const ONE_CLOCK: &[(&str, &str)] = &[("driver", "driver/src/"), ("rowscan", "src/")];

/// What counts as reading the clock or waiting for it.
const CLOCK: &[&str] = &["sleep", "sleep_until", "Instant::now", "SystemTime"];

/// What the lint found.
#[derive(Default)]
struct Findings {
    violations: Vec<String>,
    warnings: Vec<String>,
    notes: Vec<String>,
}

/// Runs the lint on its own.
pub fn command(workspace: &Workspace, _arguments: &[String]) -> ExitCode {
    match check(workspace) {
        Ok(()) => {
            println!("no violation");
            ExitCode::SUCCESS
        }
        Err(violations) => {
            eprintln!("{violations}");
            ExitCode::FAILURE
        }
    }
}

/// Reads every file of the workspace; an error lists all violations.
pub fn check(workspace: &Workspace) -> Result<(), String> {
    let mut files = Vec::new();
    for path in workspace.files()? {
        // What is not UTF-8 is not text.
        if let Ok(text) = fs::read_to_string(workspace.root.join(&path)) {
            files.push((path.to_string_lossy().into_owned(), text));
        }
    }
    let findings = inspect(&files, &format!("{}/", workspace.root.display()));
    for line in findings.warnings.iter().chain(&findings.notes) {
        println!("    {line}");
    }
    if findings.violations.is_empty() { Ok(()) } else { Err(findings.violations.join("\n")) }
}

fn inspect(files: &[(String, String)], checkout: &str) -> Findings {
    let mut findings = Findings::default();
    let mut clocks: Vec<BTreeSet<String>> = vec![BTreeSet::new(); ONE_CLOCK.len()];
    let paths: BTreeSet<&str> = files.iter().map(|(path, _)| path.as_str()).collect();
    for (path, text) in files {
        if path.ends_with(".md") {
            for (line, dead) in documents::dead_paths(path, text, &paths) {
                findings.violations.push(format!("{path}:{line}: `{dead}`: there is no such file"));
            }
        }
        check_paths(path, text, checkout, &mut findings);
        if !matches!(Path::new(path).extension().and_then(|e| e.to_str()), Some("rs" | "py" | "sh")) {
            continue;
        }
        check_length(path, text, &mut findings);
        if !path.ends_with(".rs") {
            continue;
        }
        let source = Source::new(text);
        for rule in rules::ALL.iter().filter(|rule| rule.covers(path)) {
            check_rule(rule, path, &source, &mut findings);
        }
        for ((_, folder), clocks) in ONE_CLOCK.iter().zip(&mut clocks) {
            if path.starts_with(folder)
                && let Some((line, word)) =
                    CLOCK.iter().find_map(|word| Some((*source.product_lines(word).first()?, word)))
            {
                clocks.insert(format!("{path}:{line} ({word})"));
            }
        }
    }
    for ((name, _), clocks) in ONE_CLOCK.iter().zip(clocks) {
        let list = clocks.iter().cloned().collect::<Vec<_>>().join(", ");
        match clocks.len() {
            0 => findings.notes.push(format!("{name} has no clock")),
            1 => findings.notes.push(format!("{name} has its clock in {list}")),
            n => findings.violations.push(format!("{list}: {name} reads the clock in {n} files; one may")),
        }
    }
    findings
}

fn check_rule(rule: &Rule, path: &str, source: &Source, findings: &mut Findings) {
    for word in rule.words {
        let lines = if rule.tests_too { source.all_lines(word) } else { source.product_lines(word) };
        for line in lines {
            findings.violations.push(format!("{path}:{line}: `{word}`: {}", rule.why));
        }
    }
}

fn check_length(path: &str, text: &str, findings: &mut Findings) {
    let lines = text.lines().count();
    if lines > MOST_LINES {
        findings.violations.push(format!("{path}:{lines}: longer than {MOST_LINES} lines"));
    } else if lines > MANY_LINES {
        findings.warnings.push(format!("{path}: {lines} lines; does it have one reason to change?"));
    }
}

/// Text that is true on one machine only. Examples in prose may name `/tmp`; code may not.
fn check_paths(path: &str, text: &str, checkout: &str, findings: &mut Findings) {
    // In a linked work tree `.git` is a file that names its repository.
    if rules::MAY_NAME_PATHS.contains(&path) || matches!(path, "Cargo.lock" | ".git") {
        return;
    }
    let source = path.ends_with(".rs").then(|| Source::new(text));
    for (i, line) in text.lines().enumerate() {
        let mut homes = rules::HOMES.iter().copied().chain([checkout]);
        let prose = homes.find(|home| source::names_path(line, home));
        let in_code = source.as_ref().is_some_and(|source| {
            !path.contains("tests/") && source::names_path(source.product_line(i), rules::TEMPORARY)
        });
        if let Some(found) = prose.or(in_code.then_some(rules::TEMPORARY)) {
            findings.violations.push(format!("{path}:{}: `{found}`: a path of one machine", i + 1));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Where the checkout under test is said to lie.
    const CHECKOUT: &str = "/some/where/rowscan/";

    /// The violations of one file, without the notes on clocks.
    fn violations(path: &str, text: &str) -> Vec<String> {
        inspect(&[(path.to_owned(), text.to_owned())], CHECKOUT).violations
    }

    #[test]
    fn sans_io_crates_name_no_clock_socket_environment_or_global_state() {
        for word in [
            "std::net::IpAddr",
            "tokio::spawn()",
            "std::env::var(\"A\")",
            "Instant::now()",
            "sleep(d)",
            "rand::thread_rng()",
        ] {
            for path in ["protocol/src/x.rs", "canopy/src/a/b.rs", "vehicle/src/x.rs", "sim-scenes/src/x.rs"]
            {
                assert_eq!(violations(path, &format!("fn f() {{ {word}; }}")).len(), 1, "{word} in {path}");
                assert!(
                    violations(path, &format!("// {word}\n/* {word} */ const A: &str = \"sleep(x)\";"))
                        .is_empty()
                );
            }
            assert!(violations("driver/src/x.rs", &format!("fn f() {{ {word}; }}")).is_empty());
        }
    }

    #[test]
    fn an_async_crate_has_one_clock() {
        let file = |path: &str| (path.to_owned(), "fn f() { sleep_until(t) }".to_owned());
        assert!(
            inspect(&[file("driver/src/a.rs"), file("src/a.rs"), file("tests/a.rs")], CHECKOUT)
                .violations
                .is_empty()
        );
        let two = inspect(&[file("driver/src/a.rs"), file("driver/src/b.rs")], CHECKOUT).violations;
        assert_eq!(
            two,
            [
                "driver/src/a.rs:1 (sleep_until), driver/src/b.rs:1 (sleep_until): driver reads the clock in 2 files; one may"
            ]
        );
        let in_tests = "fn f() {}\n#[cfg(test)]\nmod tests { fn g() { sleep(t) } }\n";
        assert!(
            inspect(&[file("src/a.rs"), ("src/b.rs".into(), in_tests.into())], CHECKOUT)
                .violations
                .is_empty()
        );
    }

    #[test]
    fn unfinished_code_and_silent_ignores_are_found_in_tests_too() {
        for word in ["todo!()", "unimplemented!(\"x\")", "#[ignore]", "unsafe { }"] {
            let text = format!("#[cfg(test)]\nmod tests {{\n    {word}\n}}\n");
            assert_eq!(violations("tests/x.rs", &text).len(), 1, "{word}");
            assert!(violations("tests/x.rs", &text)[0].starts_with("tests/x.rs:3:"));
        }
        assert!(
            violations("tests/x.rs", "#[ignore = \"needs a device\"]\n#![forbid(unsafe_code)]").is_empty()
        );
    }

    #[test]
    fn paths_of_one_machine() {
        let home = format!("see {}ann/x", rules::HOMES[0]);
        assert_eq!(violations("README.md", &home).len(), 1);
        assert!(violations("README.md", &format!("https://example.org{}ann", rules::HOMES[0])).is_empty());
        let temporary = format!("const A: &str = \"{}x\";", rules::TEMPORARY);
        assert_eq!(violations("src/x.rs", &temporary).len(), 1);
        assert!(violations("tests/x.rs", &temporary).is_empty());
        assert!(violations("src/x.rs", &format!("/// `--pty {}lms`\n", rules::TEMPORARY)).is_empty());
        assert!(violations("README.md", &temporary).is_empty());
        assert_eq!(violations("README.md", &format!("cd {CHECKOUT}src")).len(), 1);
    }

    #[test]
    fn long_files() {
        assert!(violations("src/x.rs", &"\n".repeat(600)).is_empty());
        assert_eq!(violations("src/x.rs", &"\n".repeat(601)).len(), 1);
        assert!(violations("sim-scenes/scenes/x.toml", &"\n".repeat(601)).is_empty());
    }
}
