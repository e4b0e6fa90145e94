//! `cargo xtask lint`: the invariants that neither rustc nor clippy holds. Each violation names file, line and rule.

mod circles;
mod clocks;
mod documents;
mod facts;
mod links;
mod modules;
mod rules;
mod source;

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;
use std::process::ExitCode;

use crate::workspace::Workspace;
use clocks::CLOCKS;
use facts::Facts;
use modules::Crate;
use rules::Rule;
use source::Source;

/// A source file longer than this has more than one reason to change.
const MOST_LINES: usize = 600;

/// From here on a file is worth a look.
const MANY_LINES: usize = 400;

/// A function longer than this does not fit a screen.
const SCREEN: usize = 60;

/// Circles of files that are still there. More than these fail the lint; whoever breaks one lowers the number.
const KNOWN_CIRCLES: usize = 0;

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
    let paths = workspace.files()?;
    for path in &paths {
        // What is not UTF-8 is not text.
        if let Ok(text) = fs::read_to_string(workspace.root.join(path)) {
            files.push((path.to_string_lossy().into_owned(), text));
        }
    }
    let mut findings = inspect(&files, &format!("{}/", workspace.root.display()));
    let all = paths.iter().map(|path| path.to_string_lossy().into_owned()).collect();
    findings.violations.extend(links::check(&all, &files));
    for line in findings.warnings.iter().chain(&findings.notes) {
        println!("    {line}");
    }
    if findings.violations.is_empty() { Ok(()) } else { Err(findings.violations.join("\n")) }
}

fn inspect(files: &[(String, String)], checkout: &str) -> Findings {
    let mut findings = Findings::default();
    let paths: BTreeSet<&str> = files.iter().map(|(path, _)| path.as_str()).collect();
    let mut facts = BTreeMap::new();
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
        // Tests and examples are no part of a crate's modules.
        if path.starts_with("src/") || path.contains("/src/") {
            match Facts::read(text) {
                Ok(read) => drop(facts.insert(path.clone(), read)),
                Err(error) => {
                    let line = error.span().start().line;
                    findings.violations.push(format!("{path}:{line}: not Rust: {error}"));
                }
            }
        }
    }
    check_circles(&facts, &mut findings);
    check_clocks(&facts, &mut findings);
    note_sizes(files, &facts, &mut findings);
    findings
}

/// Circles of files in every crate; few may be left from before.
fn check_circles(facts: &BTreeMap<String, Facts>, findings: &mut Findings) {
    let is_root = |path: &&String| {
        ["src/lib.rs", "src/main.rs"].iter().any(|root| {
            path.strip_suffix(root).is_some_and(|folder| folder.is_empty() || folder.ends_with('/'))
        })
    };
    let mut described = Vec::new();
    for root in facts.keys().filter(is_root) {
        let edges = Crate::read(root, facts).map(|read| read.edges()).unwrap_or_default();
        described.extend(circles::circles(&edges).iter().map(|circle| circles::describe(circle, &edges)));
    }
    let count = described.len();
    if count > KNOWN_CIRCLES {
        let more = format!("circles: {count}, {KNOWN_CIRCLES} may be");
        findings.violations.extend(described.into_iter().chain([more]));
    } else {
        findings.notes.extend(described);
        findings.notes.push(format!("circles: {count}"));
    }
}

fn check_clocks(facts: &BTreeMap<String, Facts>, findings: &mut Findings) {
    for clock in CLOCKS {
        let found = clocks::find(clock, facts);
        findings.violations.extend(found.violations);
        let list = found.places.join(", ");
        match found.places.len() {
            0 => findings.notes.push(format!("places that sleep: {} 0", clock.name)),
            n => findings.notes.push(format!("places that sleep: {} {n}: {list}", clock.name)),
        }
    }
}

/// The largest file and the functions that do not fit a screen; told, not judged.
fn note_sizes(files: &[(String, String)], facts: &BTreeMap<String, Facts>, findings: &mut Findings) {
    let sources = files.iter().filter(|(path, _)| facts.contains_key(path));
    if let Some((lines, path)) = sources.map(|(path, text)| (text.lines().count(), path)).max() {
        findings.notes.push(format!("largest file: {path}, {lines} lines"));
    }
    let functions =
        facts.iter().flat_map(|(path, facts)| facts.functions.iter().map(move |f| (f.lines, path, f)));
    let mut long: Vec<_> = functions.filter(|(lines, ..)| *lines > SCREEN).collect();
    long.sort_by_key(|(lines, path, _)| (std::cmp::Reverse(*lines), *path));
    findings.notes.push(format!("functions over {SCREEN} lines: {}", long.len()));
    for (lines, path, function) in long {
        findings.notes.push(format!("  {path}:{}: {}, {lines} lines", function.line, function.name));
    }
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
            assert!(violations("driver/src/clock.rs", &format!("fn f() {{ {word}; }}")).is_empty());
        }
    }

    #[test]
    fn a_circle_more_than_the_known_ones_fails() {
        let circle = |n: usize| {
            let (a, b) = (format!("src/a{n}.rs"), format!("src/b{n}.rs"));
            [
                (a, format!("use crate::b{n}::B; pub struct A;")),
                (b, format!("use crate::a{n}::A; pub struct B;")),
            ]
        };
        let files = |count: usize| -> Vec<(String, String)> {
            let modules: String = (0..count).map(|n| format!("mod a{n}; mod b{n};")).collect();
            (0..count).flat_map(circle).chain([("src/lib.rs".to_owned(), modules)]).collect()
        };
        let within = inspect(&files(KNOWN_CIRCLES), CHECKOUT);
        assert!(within.violations.is_empty(), "{:?}", within.violations);
        assert!(within.notes.contains(&format!("circles: {KNOWN_CIRCLES}")));
        let beyond = inspect(&files(KNOWN_CIRCLES + 1), CHECKOUT).violations;
        assert_eq!(beyond.len(), KNOWN_CIRCLES + 2);
        assert!(beyond[0].contains("src/a0.rs -> src/b0.rs: B"), "{}", beyond[0]);
    }

    #[test]
    fn sizes_are_told() {
        let text = format!("fn long() {{\n{}}}\nfn short() {{}}\n", "\n".repeat(SCREEN));
        let notes = inspect(&[("src/a.rs".to_owned(), text)], CHECKOUT).notes;
        assert!(notes.contains(&"largest file: src/a.rs, 63 lines".to_owned()), "{notes:?}");
        assert!(notes.contains(&"functions over 60 lines: 1".to_owned()), "{notes:?}");
        assert!(notes.contains(&"  src/a.rs:1: long, 62 lines".to_owned()), "{notes:?}");
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
        assert!(violations("src/x.rs", &format!("//! `--pty {}lms`\n", rules::TEMPORARY)).is_empty());
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
