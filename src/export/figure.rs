//! A figure, drawn as SVG, in the formats that print and slides take.

use std::path::Path;
use std::sync::Arc;

use resvg::{tiny_skia, usvg};
use svg2pdf::{ConversionOptions, PageOptions};

/// How a figure is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FigureFormat {
    /// As it was drawn.
    Svg,
    /// The same vectors, its letters from a font of this machine and in the file.
    Pdf,
    /// 192 pixels an inch.
    Png,
}

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
}

/// Fonts taken for `sans-serif`, the first that the machine has.
const FONTS: [&str; 5] = ["DejaVu Sans", "Liberation Sans", "Noto Sans", "Helvetica", "Arial"];
/// Pixels of the picture for each of the drawing's.
const SCALE: f32 = 2.0;

impl FigureFormat {
    /// By the ending of a file's name.
    ///
    /// # Errors
    /// Any other ending.
    pub fn of_path(path: &Path) -> Result<Self, FigureError> {
        match path.extension().and_then(|extension| extension.to_str()) {
            Some("svg") => Ok(Self::Svg),
            Some("pdf") => Ok(Self::Pdf),
            Some("png") => Ok(Self::Png),
            _ => Err(FigureError::Ending { found: path.display().to_string() }),
        }
    }

    /// By the ending of a picture's name.
    ///
    /// # Errors
    /// Any other ending than those of pictures.
    pub fn of_picture(path: &Path) -> Result<Self, FigureError> {
        match Self::of_path(path) {
            Ok(format @ (Self::Svg | Self::Png)) => Ok(format),
            _ => Err(FigureError::PictureEnding { found: path.display().to_string() }),
        }
    }

    /// The format itself, if this machine can write it.
    ///
    /// # Errors
    /// A machine without fonts, unless it is SVG.
    pub fn check(self) -> Result<Self, FigureError> {
        if self != Self::Svg {
            fonts()?;
        }
        Ok(self)
    }

    /// The figure's bytes.
    ///
    /// # Errors
    /// A machine without fonts, a drawing that is not understood.
    pub fn convert(self, svg: String) -> Result<Vec<u8>, FigureError> {
        match self {
            Self::Svg => Ok(svg.into_bytes()),
            Self::Pdf => {
                let tree = tree(&svg)?;
                let pdf = svg2pdf::to_pdf(&tree, ConversionOptions::default(), PageOptions::default());
                pdf.map_err(|cause| FigureError::Convert(cause.to_string()))
            }
            Self::Png => png(&tree(&svg)?),
        }
    }
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

pub(super) fn tree(svg: &str) -> Result<usvg::Tree, FigureError> {
    let options = usvg::Options { fontdb: Arc::new(fonts()?), ..usvg::Options::default() };
    usvg::Tree::from_str(svg, &options).map_err(|cause| FigureError::Convert(cause.to_string()))
}

fn png(tree: &usvg::Tree) -> Result<Vec<u8>, FigureError> {
    let size = tree.size().to_int_size();
    let pixels = |length: u32| (length as f32 * SCALE).ceil() as u32;
    let Some(mut picture) = tiny_skia::Pixmap::new(pixels(size.width()), pixels(size.height())) else {
        return Err(FigureError::Convert(format!("{} × {} is no size", size.width(), size.height())));
    };
    resvg::render(tree, tiny_skia::Transform::from_scale(SCALE, SCALE), &mut picture.as_mut());
    picture.encode_png().map_err(|cause| FigureError::Convert(cause.to_string()))
}

#[cfg(test)]
mod tests {
    use super::*;

    const SVG: &str = "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"40\" height=\"20\"><rect width=\"40\" height=\"20\" fill=\"#f00\"/></svg>";

    #[test]
    fn the_ending_says_the_format() {
        let of = |name: &str| FigureFormat::of_path(Path::new(name)).map_err(|why| why.to_string());
        assert_eq!(of("a.pdf"), Ok(FigureFormat::Pdf));
        assert_eq!(of("a.b.svg"), Ok(FigureFormat::Svg));
        let why = of("figure.jpg").expect_err("no format of ours");
        assert!(why.contains(".svg, .pdf or .png") && why.contains("figure.jpg"), "{why}");
    }

    #[test]
    fn a_drawing_becomes_a_page_and_a_picture() {
        let convert = |format: FigureFormat| format.convert(SVG.to_owned());
        let pdf = match convert(FigureFormat::Pdf) {
            // Without any font there is no figure with letters, so none at all.
            Err(FigureError::NoFont) => return,
            pdf => pdf.expect("a page"),
        };
        assert!(pdf.starts_with(b"%PDF-"));
        let png = convert(FigureFormat::Png).expect("a picture");
        let picture = tiny_skia::Pixmap::decode_png(&png).expect("PNG");
        assert_eq!((picture.width(), picture.height()), (80, 40));
        let red = picture.pixel(40, 20).expect("inside");
        assert_eq!((red.red(), red.green(), red.blue()), (255, 0, 0));
    }
}
