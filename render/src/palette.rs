//! Few colours for many: the median cut, for files that must be small.

use std::collections::BTreeMap;

/// The colours of a palette, and which of them stands for which.
#[derive(Debug)]
pub(crate) struct Palette {
    colours: Vec<[u8; 3]>,
    /// By colour with its lowest bits left out.
    number: BTreeMap<[u8; 3], u8>,
}

/// A colour as it is looked at, and its pixels.
type Count = ([u8; 3], Pixels);

/// Pixels of like colour: how many, and the sums of what they are.
#[derive(Clone, Copy, Debug, Default)]
struct Pixels {
    count: u32,
    sum: [u64; 3],
}

/// What of a colour is looked at: 6 bits of red and blue, 7 of green.
fn coarse(rgb: &[u8]) -> [u8; 3] {
    match rgb {
        [r, g, b] => [r & 0xfc, g & 0xfe, b & 0xfc],
        _ => [0; 3],
    }
}

impl Palette {
    /// At most `most` colours for the pixels.
    pub(crate) fn of(rgb: &[u8], most: usize) -> Self {
        let mut counts: BTreeMap<[u8; 3], Pixels> = BTreeMap::new();
        for pixel in rgb.chunks_exact(3) {
            let pixels = counts.entry(coarse(pixel)).or_default();
            pixels.count += 1;
            for (sum, value) in pixels.sum.iter_mut().zip(pixel) {
                *sum += u64::from(*value);
            }
        }
        let mut boxes: Vec<Vec<Count>> = vec![counts.into_iter().collect()];
        while boxes.len() < most {
            let widest =
                boxes.iter().enumerate().max_by_key(|(place, colours)| (weight(colours), usize::MAX - place));
            let Some(place) = widest.filter(|(_, colours)| weight(colours) > 0).map(|(place, _)| place)
            else {
                break;
            };
            let (low, high) = cut(boxes.swap_remove(place));
            boxes.extend([low, high]);
        }
        let mut number = BTreeMap::new();
        let mut colours = Vec::with_capacity(boxes.len());
        for (place, counts) in boxes.iter().enumerate() {
            colours.push(mean(counts));
            number.extend(counts.iter().map(|(colour, _)| (*colour, place as u8)));
        }
        Self { colours, number }
    }

    /// Three bytes a colour.
    pub(crate) fn bytes(&self) -> Vec<u8> {
        self.colours.concat()
    }

    /// The number of each pixel's colour.
    pub(crate) fn numbers(&self, rgb: &[u8]) -> Vec<u8> {
        rgb.chunks_exact(3).map(|pixel| self.number.get(&coarse(pixel)).copied().unwrap_or(0)).collect()
    }
}

/// The axis along which colours differ most, and by how much.
fn spread(counts: &[Count]) -> (usize, u32) {
    let range = |axis: usize| {
        let values = || counts.iter().map(move |(colour, _)| colour[axis]);
        u32::from(values().max().unwrap_or(0) - values().min().unwrap_or(0))
    };
    // The eye tells greens apart best.
    let ranges = [3 * range(0), 4 * range(1), 2 * range(2)];
    let axis = (0..3).max_by_key(|axis| ranges[*axis]).unwrap_or(1);
    (axis, ranges[axis])
}

/// How urgently a box is cut: wide ones first, and those of many pixels; 0 for what cannot be cut.
fn weight(counts: &[Count]) -> u64 {
    if counts.len() < 2 {
        return 0;
    }
    let pixels: u64 = counts.iter().map(|(_, pixels)| u64::from(pixels.count)).sum();
    let width = u64::from(spread(counts).1);
    width * width * (1 + pixels.isqrt())
}

fn cut(mut counts: Vec<Count>) -> (Vec<Count>, Vec<Count>) {
    let (axis, _) = spread(&counts);
    counts.sort_by_key(|(colour, _)| (colour[axis], *colour));
    let half = counts.iter().map(|(_, pixels)| u64::from(pixels.count)).sum::<u64>() / 2;
    let mut sum = 0;
    let middle = counts.iter().position(|(_, pixels)| {
        sum += u64::from(pixels.count);
        sum > half
    });
    let middle = middle.unwrap_or(0).clamp(1, counts.len() - 1);
    let high = counts.split_off(middle);
    (counts, high)
}

/// The mean of the pixels themselves, so that a picture of few colours keeps them.
fn mean(counts: &[Count]) -> [u8; 3] {
    let pixels: u64 = counts.iter().map(|(_, pixels)| u64::from(pixels.count)).sum();
    std::array::from_fn(|axis| {
        let sum: u64 = counts.iter().map(|(_, pixels)| pixels.sum[axis]).sum();
        ((sum + pixels / 2) / pixels.max(1)).min(255) as u8
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_of_few_colours_keeps_them() {
        let colours = [[255, 255, 255], [255, 0, 0], [0, 0, 0], [21, 121, 61]];
        let rgb: Vec<u8> = colours.into_iter().cycle().take(40).flatten().collect();
        let palette = Palette::of(&rgb, 16);
        let (bytes, numbers) = (palette.bytes(), palette.numbers(&rgb));
        let back: Vec<u8> =
            numbers.iter().flat_map(|number| bytes[3 * usize::from(*number)..][..3].to_vec()).collect();
        assert_eq!(back, rgb);
    }
}
