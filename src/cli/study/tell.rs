//! How a whole study is told: the flags every study and `merge` have.

use std::path::{Path, PathBuf};

use crate::cli::output::{self, say};
use crate::cli::{Failure, Format};
use crate::export::FigureFormat;

/// How a whole study is told.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct TellArgs {
    /// Draw the study's figure, by the file's name as SVG, PDF or PNG
    #[arg(long, value_name = "FILE", value_parser = figure_file)]
    figure: Option<PathBuf>,
    /// How to write the report
    #[arg(long, value_enum, default_value_t)]
    pub(super) format: Format,
}

/// A name that can be drawn to, found out before the study runs.
fn figure_file(name: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(name);
    let format = FigureFormat::of_path(&path).and_then(FigureFormat::check);
    format.map(|_| path).map_err(|why| why.to_string())
}

impl TellArgs {
    /// Refuses a figure for what has none.
    pub(super) fn no_figure(&self, what: &str) -> Result<(), Failure> {
        match &self.figure {
            Some(_) => Err(Failure::Usage(format!("{what} has no figure: leave out --figure"))),
            None => Ok(()),
        }
    }

    /// The file that is drawn to, if any.
    pub(super) fn files(&self) -> impl Iterator<Item = &Path> {
        self.figure.as_deref().into_iter()
    }

    /// Draws the figure, if one was asked for.
    pub(super) fn draw(&self, figure: impl FnOnce() -> String) -> Result<(), Failure> {
        let Some(path) = &self.figure else { return Ok(()) };
        let format = FigureFormat::of_path(path)?;
        output::write_file(path, &format.convert(figure())?)?;
        say(format_args!("wrote {}", path.display()));
        Ok(())
    }
}
