//! Drawings as PDF and PNG, their letters from a font of this machine.

use std::sync::Arc;

use resvg::{tiny_skia, usvg};
use rowscan_render::Picture;
use svg2pdf::{ConversionOptions, PageOptions};

use super::figure_error::FigureError;
use super::raster::{Behind, COLOURS, SCALE};

/// Fonts taken for `sans-serif`, the first that the machine has.
const FONTS: [&str; 5] = ["DejaVu Sans", "Liberation Sans", "Noto Sans", "Helvetica", "Arial"];

/// Refuses a machine without fonts.
pub(super) fn check() -> Result<(), FigureError> {
    fonts().map(drop)
}

/// The same vectors as a page.
pub(super) fn pdf(svg: &str) -> Result<Vec<u8>, FigureError> {
    svg2pdf::to_pdf(&tree(svg)?, ConversionOptions::default(), PageOptions::default()).map_err(failed)
}

/// The drawing on white paper, with a picture between them if there is one.
pub(super) fn png(svg: &str, behind: Option<Behind<'_>>) -> Result<Vec<u8>, FigureError> {
    let tree = tree(svg)?;
    let (width, height) = (tree.size().width().ceil() as u32, tree.size().height().ceil() as u32);
    let size = (width * SCALE, height * SCALE);
    let no_size = || failed(format!("{width} × {height} is no size"));
    let mut page = tiny_skia::Pixmap::new(size.0, size.1).ok_or_else(no_size)?;
    page.fill(tiny_skia::Color::WHITE);
    if let Some((picture, (left, top))) = behind {
        let line = 4 * size.0 as usize;
        for row in 0..picture.size().1 {
            for column in 0..picture.size().0 {
                let at = (top + row) as usize * line + 4 * (left + column) as usize;
                let inside = left + column < size.0;
                let pixel = page.data_mut().get_mut(at..at + 3).filter(|_| inside);
                if let (Some(pixel), Some(rgb)) = (pixel, picture.pixel(column, row)) {
                    pixel.copy_from_slice(&rgb);
                }
            }
        }
    }
    let scale = SCALE as f32;
    resvg::render(&tree, tiny_skia::Transform::from_scale(scale, scale), &mut page.as_mut());
    let rgb = page.data().chunks_exact(4).flat_map(|pixel| pixel.iter().take(3).copied()).collect();
    let page = Picture::from_rgb(size, rgb).ok_or_else(no_size)?;
    page.png(behind.map(|_| COLOURS)).map_err(failed)
}

fn tree(svg: &str) -> Result<usvg::Tree, FigureError> {
    let options = usvg::Options { fontdb: Arc::new(fonts()?), ..usvg::Options::default() };
    usvg::Tree::from_str(svg, &options).map_err(failed)
}

/// The machine's fonts, with one of them for `sans-serif`.
fn fonts() -> Result<usvg::fontdb::Database, FigureError> {
    let mut fonts = usvg::fontdb::Database::new();
    fonts.load_system_fonts();
    let has =
        |name: &&&str| fonts.faces().any(|face| face.families.iter().any(|(family, _)| family == *name));
    let Some(sans) = FONTS.iter().find(has) else { return Err(FigureError::NoFont) };
    fonts.set_sans_serif_family(*sans);
    Ok(fonts)
}

fn failed(cause: impl ToString) -> FigureError {
    FigureError::Convert(cause.to_string())
}
