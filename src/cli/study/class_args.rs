//! The flags of studies over classes.

use std::path::PathBuf;

use rowscan_study::StudyFileError;
use rowscan_study::classes::{self, Classes};

use crate::cli::Failure;
use crate::cli::output::say;

/// Which classes, how many rows of each.
#[derive(Debug, clap::Args)]
pub(super) struct ClassArgs {
    /// A file of classes, instead of those that ship with the program (study/classes.toml); docs/studies.md says how it is written
    #[arg(long, value_name = "FILE.toml")]
    classes: Option<PathBuf>,
    /// Only these axes of the file
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    axes: Vec<String>,
    /// Seed of the study instead of the scene's
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
}

impl ClassArgs {
    /// The classes.
    pub(super) fn classes(&self) -> Result<Classes, Failure> {
        let read = |path: &PathBuf| -> Result<Classes, StudyFileError> { classes::read(path, say) };
        let mut classes = self.classes.as_ref().map_or_else(classes::built_in, read)?;
        if let Some(unknown) = self.axes.iter().find(|axis| !classes.axes().contains(&axis.as_str())) {
            return Err(Failure::Usage(format!(
                "there is no axis `{unknown}`; there are {}",
                classes.axes().join(", ")
            )));
        }
        classes.scene.seed = self.seed.unwrap_or(classes.scene.seed);
        Ok(classes.of_axes(&self.axes))
    }
}
