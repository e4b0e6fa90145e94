//! `cargo xtask ci`: all that a machine with rustup's cargo and python3 can hold the project to.

use std::process::ExitCode;

use crate::steps::{Outcome, Steps};
use crate::workspace::Workspace;
use crate::{layering, licences, lint, python, readme, rust_tests, shell};

/// Steps that are one cargo command.
const CARGO_STEPS: &[(&str, &[&str])] = &[
    ("format", &["fmt", "--all", "--check"]),
    ("clippy", &["clippy", "--workspace", "--all-targets", "--", "-D", "warnings"]),
    ("documentation", &["doc", "--workspace", "--no-deps"]),
    ("driver and canopy without sim-scenes", &["check", "-p", "rowscan-driver", "-p", "rowscan-canopy"]),
    ("protocol without default features", &["check", "-p", "rowscan-protocol", "--no-default-features"]),
];

/// Runs every step, also after a failed one.
pub fn command(workspace: &Workspace, arguments: &[String]) -> ExitCode {
    if let Some(argument) = arguments.first() {
        eprintln!("xtask ci: takes no argument, got `{argument}`");
        return ExitCode::from(2);
    }
    let mut steps = Steps::default();
    steps.run("invariants", || Outcome::from_result(lint::check(workspace)));
    steps.run("layering", || Outcome::from_result(layering::check(workspace)));
    steps.run("licences", || Outcome::from_result(licences::check(workspace)));
    for (name, arguments) in CARGO_STEPS {
        steps.run(name, || {
            let mut cargo = workspace.cargo(arguments);
            Outcome::from_result(shell::run(cargo.env("RUSTDOCFLAGS", "-D warnings")))
        });
    }
    steps.run("tests", || rust_tests::run(workspace));
    let mut built = Ok(());
    steps.run("release build", || {
        built = shell::run(&mut workspace.cargo(&["build", "--release", "-p", "rowscan"]));
        Outcome::from_result(built.clone())
    });
    let with_binary = |step: fn(&Workspace) -> Outcome| {
        if built.is_ok() { step(workspace) } else { Outcome::Skipped("the binary did not build".to_owned()) }
    };
    steps.run("README", || with_binary(readme::run));
    steps.run("Python clients", || with_binary(python::run));
    steps.close()
}
