//! Known weaknesses of dependencies (RustSec), by `cargo deny` where it is installed and reaches its database.

use crate::shell;
use crate::steps::Outcome;
use crate::workspace::Workspace;

/// What cargo-deny says when it cannot fetch the database.
const NO_DATABASE: [&str; 2] = ["failed to fetch advisory database", "failed to load advisory database"];

/// Checks Cargo.lock against the database; skipped without cargo-deny, or without the network it needs.
pub fn check(workspace: &Workspace) -> Outcome {
    if !shell::has("cargo-deny") {
        return Outcome::Skipped(
            "cargo-deny is not installed (`cargo install --locked cargo-deny`)".to_owned(),
        );
    }
    match workspace.cargo(&["deny", "check", "advisories"]).output() {
        Ok(output) => {
            let said = String::from_utf8_lossy(&output.stderr).into_owned();
            judge(output.status.success(), &said)
        }
        Err(cause) => Outcome::failed(format!("cargo deny: {cause}")),
    }
}

fn judge(success: bool, said: &str) -> Outcome {
    if success {
        return Outcome::ok();
    }
    match said.lines().find(|line| NO_DATABASE.iter().any(|reason| line.contains(reason))) {
        Some(reason) => Outcome::Skipped(reason.trim().to_owned()),
        None => Outcome::failed(said),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_database_that_cannot_be_fetched_skips_and_a_finding_fails() {
        assert!(matches!(judge(true, ""), Outcome::Passed(_)));
        let offline = "error[E]: failed to fetch advisory database https://github.com/rustsec/advisory-db";
        assert!(matches!(judge(false, offline), Outcome::Skipped(_)));
        assert!(matches!(judge(false, "error[vulnerability]: use after free"), Outcome::Failed(..)));
    }
}
