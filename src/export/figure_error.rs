//! Why a figure cannot be written.

use crate::feature::MissingFeature;

/// Why a figure cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum FigureError {
    /// An ending that is none.
    #[error("expected a figure's name to end in .svg, .pdf or .png, found `{found}`")]
    Ending {
        /// The name.
        found: String,
    },
    /// A picture that is no vectors, in a format for vectors.
    #[error("expected a picture's name to end in .png or .svg, found `{found}`")]
    PictureEnding {
        /// The name.
        found: String,
    },
    /// PDF and PNG hold letters as outlines.
    #[error(
        "expected a sans-serif font on this machine for PDF and PNG, found none: install one (Debian: fonts-dejavu-core), or write .svg"
    )]
    NoFont,
    /// The drawing is not understood.
    #[error("the figure cannot be converted: {0}")]
    Convert(String),
    /// A build that writes SVG alone.
    #[error("{0}; or write .svg")]
    Feature(#[from] MissingFeature),
}
