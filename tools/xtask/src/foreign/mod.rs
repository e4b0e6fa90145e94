//! `cargo xtask foreign`: programs nobody here wrote, from Debian packages, against the release binary.
//!
//! A part that cannot run here (no root, no network, no Debian) is skipped visibly; a part that runs and fails is a failure.

mod debian;
mod socat;

use std::process::ExitCode;

use crate::shell;
use crate::steps::{Outcome, Steps};
use crate::workspace::Workspace;

/// One foreign program and what is asked of it.
struct Part {
    name: &'static str,
    /// Debian packages it comes in.
    packages: &'static [&'static str],
    /// Programs it calls; nothing is installed if all are there.
    programs: &'static [&'static str],
    run: fn(&Workspace) -> Outcome,
}

/// Every part. A new one is a file beside this one and a line here.
const PARTS: &[Part] = &[socat::PART];

/// Runs every part, or those named in `arguments`.
pub fn command(workspace: &Workspace, arguments: &[String]) -> ExitCode {
    if let Some(unknown) = arguments.iter().find(|name| PARTS.iter().all(|part| part.name != *name)) {
        let names: Vec<&str> = PARTS.iter().map(|part| part.name).collect();
        eprintln!("xtask foreign: there is no part `{unknown}`; there are: {}", names.join(", "));
        return ExitCode::from(2);
    }
    let mut steps = Steps::default();
    let mut built = Ok(());
    steps.run("release build", || {
        built = shell::run(&mut workspace.cargo(&["build", "--release", "-p", "rowscan"]));
        Outcome::from_result(built.clone())
    });
    for part in
        PARTS.iter().filter(|part| arguments.is_empty() || arguments.iter().any(|name| name == part.name))
    {
        steps.run(part.name, || match (&built, debian::provide(part)) {
            (Err(_), _) => Outcome::Skipped("the binary did not build".to_owned()),
            (Ok(()), Err(why)) => Outcome::Skipped(why),
            (Ok(()), Ok(())) => (part.run)(workspace),
        });
    }
    steps.close()
}
