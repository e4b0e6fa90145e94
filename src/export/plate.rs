//! A picture with axes and texts around it, as one file.

use rowscan_render::Picture;
use rowscan_study::figure::Sheet;

use super::converter;
use super::figure::FigureFormat;
use super::figure_error::FigureError;
use super::raster::{COLOURS, SCALE};

/// Lays a sheet over its picture.
///
/// # Errors
/// For PNG as [`FigureFormat::check`]; a sheet or picture that is not understood.
pub fn plate(sheet: &Sheet, picture: &Picture, format: FigureFormat) -> Result<Vec<u8>, FigureError> {
    match format {
        FigureFormat::Png => {
            let (left, top) = (sheet.window.left * SCALE, sheet.window.top * SCALE);
            converter::png(&sheet.svg, Some((picture, (left, top))))
        }
        _ => svg(sheet, picture).map(String::into_bytes),
    }
}

fn failed(cause: impl ToString) -> FigureError {
    FigureError::Convert(cause.to_string())
}

/// White paper and the picture go in behind everything else.
fn svg(sheet: &Sheet, picture: &Picture) -> Result<String, FigureError> {
    let file = picture.png(Some(COLOURS)).map_err(failed)?;
    let begin = sheet.svg.find("<svg").and_then(|at| Some(at + sheet.svg.get(at..)?.find('>')? + 1));
    let (head, body) = sheet.svg.split_at(begin.ok_or_else(|| failed("the sheet is no SVG"))?);
    let window = sheet.window;
    Ok(format!(
        "{head}\n<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n<image x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" \
         href=\"data:image/png;base64,{}\"/>{body}",
        window.left,
        window.top,
        window.width,
        window.height,
        base64(&file)
    ))
}

/// Bytes as text (RFC 4648, section 4).
fn base64(bytes: &[u8]) -> String {
    const SIGNS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for three in bytes.chunks(3) {
        let of = |place: usize| u32::from(three.get(place).copied().unwrap_or(0));
        let bits = of(0) << 16 | of(1) << 8 | of(2);
        for sign in 0..4 {
            let value = (bits >> (18 - 6 * sign)) & 63;
            text.push(if sign > three.len() { '=' } else { char::from(SIGNS[value as usize]) });
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use rowscan_study::figure::Window;

    #[test]
    fn base64_is_that_of_the_standard() {
        let of = |text: &str| base64(text.as_bytes());
        assert_eq!(
            (of("f"), of("fo"), of("foo"), of("foobar")),
            ("Zg==".into(), "Zm8=".into(), "Zm9v".into(), "Zm9vYmFy".into())
        );
    }

    /// White paper with a red point in a green window.
    fn sheet() -> (Sheet, Picture) {
        let window = Window { left: 3, top: 2, width: 4, height: 5 };
        let drawing = "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"20\" height=\"10\"><rect x=\"4\" y=\"3\" width=\"1\" height=\"1\" fill=\"#f00\"/></svg>";
        let sheet = Sheet { svg: drawing.to_owned(), size: (20, 10), window };
        (sheet, Picture::from_rgb((8, 10), [20, 120, 60].repeat(80)).unwrap())
    }

    #[test]
    fn the_picture_stands_in_its_window_behind_the_drawing() {
        let (sheet, picture) = sheet();
        let svg = String::from_utf8(plate(&sheet, &picture, FigureFormat::Svg).unwrap()).unwrap();
        assert!(svg.find("<image").unwrap() < svg.find("#f00").unwrap() && svg.contains("x=\"3\" y=\"2\""));
    }

    #[cfg(feature = "figures")]
    #[test]
    fn a_picture_is_seen_where_the_drawing_leaves_it() {
        let (sheet, picture) = sheet();
        let file = match plate(&sheet, &picture, FigureFormat::Png) {
            Err(FigureError::NoFont) => return,
            file => file.unwrap(),
        };
        let page = resvg::tiny_skia::Pixmap::decode_png(&file).unwrap();
        let at = |x, y| page.pixel(x, y).map(|p| [p.red(), p.green(), p.blue()]);
        assert_eq!((page.width(), page.height()), (40, 20));
        assert_eq!((at(0, 0), at(9, 7), at(7, 5)), (Some([255; 3]), Some([255, 0, 0]), Some([20, 120, 60])));
    }
}
