//! `cargo xtask book`: docs/ as a book, where mdbook is installed. Its links are checked by the lint, which needs no mdbook.

use std::process::{Command, ExitCode};

use crate::shell;
use crate::workspace::Workspace;

/// Builds the book into `book` below cargo's build directory.
pub fn command(workspace: &Workspace, _arguments: &[String]) -> ExitCode {
    if !shell::has("mdbook") {
        println!("SKIPPED: book: mdbook is not installed (`cargo install --locked mdbook`)");
        return ExitCode::SUCCESS;
    }
    let folder = workspace.target.join("book");
    match shell::run(
        Command::new("mdbook").arg("build").arg(workspace.root.join("docs")).arg("--dest-dir").arg(&folder),
    ) {
        Ok(()) => {
            println!("{}/index.html", folder.display());
            ExitCode::SUCCESS
        }
        Err(why) => {
            eprintln!("book: {why}");
            ExitCode::FAILURE
        }
    }
}
