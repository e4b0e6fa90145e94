//! `rowscan schema`

use super::output::print;
use super::{Failure, Outcome};
use crate::reference::{Document, markdown};

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// The kind of file
    #[arg(value_enum, required_unless_present = "markdown", conflicts_with = "markdown")]
    document: Option<Document>,
    /// Every key of every kind of file as a page, as docs/reference-keys.md has it
    #[arg(long)]
    markdown: bool,
}

pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    match args.document {
        Some(document) => {
            let text = serde_json::to_string_pretty(&document.schema());
            print(
                &(text.map_err(|cause| Failure::Write { what: "JSON".to_owned(), cause: cause.into() })?
                    + "\n"),
            )?;
        }
        None => print(&markdown())?,
    }
    Ok(Outcome::Done)
}
