//! `cargo xtask ci`: all that a machine with rustup's cargo and python3 can hold the project to.

use std::process::ExitCode;

use crate::steps::{self, Outcome, Step};
use crate::workspace::{FULL, Profile, Workspace};
use crate::{advisories, figures, layering, licences, lint, python, readme, rust_tests, shell, wheel};

/// Every step, quick ones first.
const STEPS: &[Step] = &[
    Step::new("invariants", |workspace| Outcome::from_result(lint::check(workspace))),
    Step::new("layering", |workspace| Outcome::from_result(layering::check(workspace))),
    Step::new("licences", |workspace| Outcome::from_result(licences::check(workspace))),
    Step::new("advisories", advisories::check),
    Step::new("format", |workspace| cargo(workspace, &["fmt", "--all", "--check"])),
    Step::new("build", rust_tests::build),
    // These compile, while those below mostly wait.
    Step::new("clippy", |workspace| {
        let before = ["clippy", "--workspace", "--all-targets"];
        cargo(workspace, &[&before[..], &FULL, &["--", "-D", "warnings"]].concat())
    })
    .beside(),
    Step::new("documentation", |workspace| {
        cargo(workspace, &[&["doc", "--workspace", "--no-deps"], &FULL[..]].concat())
    })
    .beside(),
    Step::new("examples", rust_tests::run_examples).beside(),
    // What README builds; `full` builds and runs it.
    Step::new("default-features", |workspace| cargo(workspace, &["check", "-p", "rowscan"])).beside(),
    // Delete sim-scenes: driver and canopy still build. Nor does the base of the protocol need the telegrams.
    Step::new("without-scenes", |workspace| {
        cargo(workspace, &["check", "-p", "rowscan-driver", "-p", "rowscan-canopy"])
    })
    .beside(),
    Step::new("bare-protocol", |workspace| {
        cargo(workspace, &["check", "-p", "rowscan-protocol", "--no-default-features"])
    })
    .beside(),
    // The driver with each of its features alone.
    Step::new("driver-features", |workspace| {
        let alone = ["tcp", "serial", "recordings"].map(|feature| {
            cargo(
                workspace,
                &["check", "-p", "rowscan-driver", "--no-default-features", "--features", feature],
            )
        });
        alone.into_iter().find(|outcome| !matches!(outcome, Outcome::Passed(_))).unwrap_or_else(Outcome::ok)
    })
    .beside(),
    Step::new("wheel-build", wheel::build_only).beside(),
    Step::new("tests", rust_tests::run),
    Step::new("readme", readme::run),
    Step::new("figures", figures::check),
    Step::new("python", python::run),
    // maturin writes both wheels to one folder.
    Step::new("wheel", wheel::run).behind(),
];

/// Runs every step, also after a failed one; or those named in `arguments` only. The programs are those that the tests are built with: to compile
/// all of it once more as it ships takes longer than to run everything here, and is for `full`.
pub fn command(workspace: &Workspace, arguments: &[String]) -> ExitCode {
    steps::run(&Workspace { profile: Profile::Dev, ..workspace.clone() }, STEPS, arguments)
}

fn cargo(workspace: &Workspace, arguments: &[&str]) -> Outcome {
    let mut cargo = workspace.cargo(arguments);
    Outcome::from_result(shell::run(cargo.env("RUSTDOCFLAGS", "-D warnings")))
}
