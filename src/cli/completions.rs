//! `rowscan completions` and `rowscan man`: the command line, for shells and for `man`.

use std::path::PathBuf;

use clap_complete::Shell;

use super::output::{print, say};
use super::{Failure, Outcome, command};

#[derive(Debug, clap::Args)]
pub(super) struct CompletionArgs {
    /// The shell
    #[arg(value_enum)]
    shell: Shell,
}

#[derive(Debug, clap::Args)]
pub(super) struct ManArgs {
    /// Folder for the pages, one a subcommand; made if missing
    #[arg(value_name = "DIR")]
    folder: PathBuf,
}

/// Writes the shell's completions to standard output.
pub(super) fn completions(args: &CompletionArgs) -> Result<Outcome, Failure> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut command(), "rowscan", &mut script);
    print(&String::from_utf8_lossy(&script))?;
    Ok(Outcome::Done)
}

/// Writes the manual's pages.
pub(super) fn man(args: &ManArgs) -> Result<Outcome, Failure> {
    let what = args.folder.display().to_string();
    let written = std::fs::create_dir_all(&args.folder)
        .and_then(|()| clap_mangen::generate_to(command(), &args.folder));
    written.map_err(|cause| Failure::Write { what, cause })?;
    say(format_args!("wrote the manual's pages to {}: `man {0}/rowscan.1`", args.folder.display()));
    Ok(Outcome::Done)
}
