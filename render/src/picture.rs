//! A picture: rows of red, green and blue bytes.

use crate::error::RenderError;
use crate::palette::Palette;

/// A picture as a display shows it (sRGB), row by row from the top.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture {
    width: u32,
    height: u32,
    rgb: Vec<u8>,
}

impl Picture {
    /// `rgb` has three bytes a pixel.
    pub(crate) fn new((width, height): (u32, u32), rgb: Vec<u8>) -> Self {
        Self { width, height, rgb }
    }

    /// A picture drawn by somebody else, three bytes a pixel; None where there are more or fewer.
    pub fn from_rgb(size: (u32, u32), rgb: Vec<u8>) -> Option<Self> {
        let pixels = u64::from(size.0) * u64::from(size.1);
        (pixels > 0 && rgb.len() as u64 == 3 * pixels).then(|| Self::new(size, rgb))
    }

    /// Width and height, pixels.
    pub fn size(&self) -> (u32, u32) {
        (self.width, self.height)
    }

    /// Three bytes a pixel, row by row from the top.
    pub fn rgb(&self) -> &[u8] {
        &self.rgb
    }

    /// The pixel at a place.
    pub fn pixel(&self, column: u32, row: u32) -> Option<[u8; 3]> {
        let first = 3 * (row as usize * self.width as usize + column as usize);
        let bytes = self.rgb.get(first..first + 3).filter(|_| column < self.width)?;
        bytes.try_into().ok()
    }

    /// The picture as a PNG file: in all its colours, or in at most `colours` (2 to 256), which makes a small file.
    ///
    /// # Errors
    /// What the packer says.
    pub fn png(&self, colours: Option<u16>) -> Result<Vec<u8>, RenderError> {
        let mut bytes = Vec::new();
        let failed = |cause: png::EncodingError| RenderError::Png(cause.to_string());
        let mut encoder = png::Encoder::new(&mut bytes, self.width, self.height);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_compression(png::Compression::Best);
        let palette = colours.map(|colours| Palette::of(&self.rgb, usize::from(colours.clamp(2, 256))));
        let data = match &palette {
            None => {
                encoder.set_color(png::ColorType::Rgb);
                encoder.set_adaptive_filter(png::AdaptiveFilterType::Adaptive);
                self.rgb.clone()
            }
            Some(palette) => {
                encoder.set_color(png::ColorType::Indexed);
                encoder.set_palette(palette.bytes());
                encoder.set_filter(png::FilterType::NoFilter);
                palette.numbers(&self.rgb)
            }
        };
        let mut writer = encoder.write_header().map_err(failed)?;
        writer.write_image_data(&data).map_err(failed)?;
        writer.finish().map_err(failed)?;
        Ok(bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gradient() -> Picture {
        let pixel = |k: u32| [(k % 64 * 4) as u8, (k / 64 * 4) as u8, 90];
        Picture::new((64, 64), (0..4096).flat_map(pixel).collect())
    }

    #[test]
    fn a_file_read_back_has_the_same_pixels() {
        let picture = gradient();
        let file = picture.png(None).unwrap();
        let mut reader = png::Decoder::new(file.as_slice()).read_info().unwrap();
        let mut bytes = vec![0; reader.output_buffer_size()];
        reader.next_frame(&mut bytes).unwrap();
        assert_eq!(bytes, picture.rgb());
        assert_eq!(picture.pixel(3, 2), Some([12, 8, 90]));
        assert_eq!((picture.pixel(64, 0), picture.pixel(0, 64)), (None, None));
    }

    #[test]
    fn few_colours_make_a_smaller_file_that_is_near_the_picture() {
        let picture = gradient();
        let file = picture.png(Some(64)).unwrap();
        let mut decoder = png::Decoder::new(file.as_slice());
        decoder.set_transformations(png::Transformations::EXPAND);
        let mut reader = decoder.read_info().unwrap();
        let mut bytes = vec![0; reader.output_buffer_size()];
        reader.next_frame(&mut bytes).unwrap();
        let off = bytes.iter().zip(picture.rgb()).map(|(a, b)| a.abs_diff(*b)).max();
        assert!(off <= Some(24), "{off:?}");
        let mut colours: Vec<&[u8]> = bytes.chunks(3).collect();
        colours.sort_unstable();
        colours.dedup();
        assert!(colours.len() <= 64 && colours.len() > 32, "{}", colours.len());
    }
}
