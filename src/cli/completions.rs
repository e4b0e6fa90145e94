//! `rowscan completions` and `rowscan man`: the command line, for shells and for `man`.

use std::path::PathBuf;

use clap::ValueEnum;

use super::{Failure, Outcome};

#[derive(Debug, clap::Args)]
pub(super) struct CompletionArgs {
    /// The shell
    #[arg(value_enum)]
    shell: Shell,
}

/// Shells with completions.
#[derive(Clone, Copy, Debug, ValueEnum)]
#[allow(clippy::enum_variant_names, reason = "its makers call one of them PowerShell")]
enum Shell {
    Bash,
    Elvish,
    Fish,
    #[value(name = "powershell")]
    PowerShell,
    Zsh,
}

#[derive(Debug, clap::Args)]
pub(super) struct ManArgs {
    /// Folder for the pages, one a subcommand; made if missing
    #[arg(value_name = "DIR")]
    folder: PathBuf,
}

/// Writes the shell's completions to standard output.
#[cfg(feature = "manual")]
pub(super) fn completions(args: &CompletionArgs) -> Result<Outcome, Failure> {
    let shell = match args.shell {
        Shell::Bash => clap_complete::Shell::Bash,
        Shell::Elvish => clap_complete::Shell::Elvish,
        Shell::Fish => clap_complete::Shell::Fish,
        Shell::PowerShell => clap_complete::Shell::PowerShell,
        Shell::Zsh => clap_complete::Shell::Zsh,
    };
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut super::command(), "rowscan", &mut script);
    super::output::print(&String::from_utf8_lossy(&script))?;
    Ok(Outcome::Done)
}

/// Writes the manual's pages.
#[cfg(feature = "manual")]
pub(super) fn man(args: &ManArgs) -> Result<Outcome, Failure> {
    let what = args.folder.display().to_string();
    let written = std::fs::create_dir_all(&args.folder)
        .and_then(|()| clap_mangen::generate_to(super::command(), &args.folder));
    written.map_err(|cause| Failure::Write { what, cause })?;
    super::output::say(format_args!(
        "wrote the manual's pages to {}: `man {0}/rowscan.1`",
        args.folder.display()
    ));
    Ok(Outcome::Done)
}

#[cfg(not(feature = "manual"))]
pub(super) fn completions(CompletionArgs { shell: _ }: &CompletionArgs) -> Result<Outcome, Failure> {
    Err(crate::feature::Feature::Manual.missing("a shell's completions").into())
}

#[cfg(not(feature = "manual"))]
pub(super) fn man(ManArgs { folder: _ }: &ManArgs) -> Result<Outcome, Failure> {
    Err(crate::feature::Feature::Manual.missing("the manual").into())
}
