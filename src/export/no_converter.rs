//! No PDF and PNG of drawings: a build without the feature `figures`.

use super::figure_error::FigureError;
use super::raster::Behind;
use crate::feature::Feature;

pub(super) fn check() -> Result<(), FigureError> {
    Err(Feature::Figures.missing("a figure as PNG or PDF").into())
}

pub(super) fn pdf(_: &str) -> Result<Vec<u8>, FigureError> {
    Err(Feature::Figures.missing("a figure as PDF").into())
}

pub(super) fn png(_: &str, _: Option<Behind<'_>>) -> Result<Vec<u8>, FigureError> {
    Err(Feature::Figures.missing("a figure as PNG").into())
}
