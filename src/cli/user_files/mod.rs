//! `rowscan scene` and `rowscan rig`: a commented file, a verdict, and what the file means, in rows and as a drawing.

mod check;
mod new;
mod show;

use super::{Failure, Outcome};
use crate::reference::Document;

#[derive(Debug, clap::Subcommand)]
pub(super) enum Command {
    /// Write a file with every key, its unit, its default and what it means; as it stands it means the default
    New(new::Args),
    /// Say whether files are right; for what is wrong, the line, the key and the nearest valid one
    Check(check::Args),
    /// Tell what a file means, every value written out, and draw it
    Show(show::Args),
}

pub(super) fn run(document: Document, command: Command) -> Result<Outcome, Failure> {
    match command {
        Command::New(args) => new::run(document, &args),
        Command::Check(args) => check::run(document, &args),
        Command::Show(args) => show::run(document, &args),
    }
}
