//! A figure, drawn as SVG, in the formats that print and slides take.

use std::path::Path;

use super::converter;
use super::figure_error::FigureError;

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

    /// The format itself, if this build on this machine can write it.
    ///
    /// # Errors
    /// Unless it is SVG: a build without the feature `figures`, a machine without fonts.
    pub fn check(self) -> Result<Self, FigureError> {
        if self != Self::Svg {
            converter::check()?;
        }
        Ok(self)
    }

    /// The figure's bytes.
    ///
    /// # Errors
    /// As [`check`](Self::check); a drawing that is not understood.
    pub fn convert(self, svg: String) -> Result<Vec<u8>, FigureError> {
        match self {
            Self::Svg => Ok(svg.into_bytes()),
            Self::Pdf => converter::pdf(&svg),
            Self::Png => converter::png(&svg, None),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(feature = "figures")]
    const SVG: &str = "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"40\" height=\"20\"><rect width=\"40\" height=\"20\" fill=\"#f00\"/></svg>";

    #[test]
    fn the_ending_says_the_format() {
        let of = |name: &str| FigureFormat::of_path(Path::new(name)).map_err(|why| why.to_string());
        assert_eq!(of("a.pdf"), Ok(FigureFormat::Pdf));
        assert_eq!(of("a.b.svg"), Ok(FigureFormat::Svg));
        let why = of("figure.jpg").expect_err("no format of ours");
        assert!(why.contains(".svg, .pdf or .png") && why.contains("figure.jpg"), "{why}");
    }

    #[cfg(feature = "figures")]
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
        let picture = resvg::tiny_skia::Pixmap::decode_png(&png).expect("PNG");
        assert_eq!((picture.width(), picture.height()), (80, 40));
        let red = picture.pixel(40, 20).expect("inside");
        assert_eq!((red.red(), red.green(), red.blue()), (255, 0, 0));
    }
}
