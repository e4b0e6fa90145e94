//! Flags of what is printed as a list or as a page of documentation.

use super::Format;

#[derive(Clone, Copy, Debug, clap::Args)]
pub(super) struct PageArgs {
    /// As a page of documentation, as it stands in docs/
    #[arg(long, conflicts_with = "format")]
    pub(super) markdown: bool,
    /// How to write the list
    #[arg(long, value_enum, default_value_t)]
    pub(super) format: Format,
}
