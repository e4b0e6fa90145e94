//! `rowscan scene new`, `rowscan rig new`

use std::path::PathBuf;

use crate::cli::output::{self, say};
use crate::cli::{Failure, Outcome};
use crate::reference::{Document, commented};

#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// Where to write it; a file that is there already is kept [default: standard output]
    #[arg(value_name = "FILE")]
    file: Option<PathBuf>,
}

pub(super) fn run(document: Document, args: &Args) -> Result<Outcome, Failure> {
    let text = commented(document);
    let Some(file) = &args.file else {
        output::print(&text)?;
        return Ok(Outcome::Done);
    };
    if file.is_file() {
        return Err(Failure::Usage(format!(
            "{} is there already; name another file, or remove it",
            file.display()
        )));
    }
    output::write_file(file, &text)?;
    say(format_args!("wrote {}", output::name_of(file)));
    Ok(Outcome::Done)
}
