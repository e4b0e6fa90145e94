//! What all figures have in common: inks, marks, sizes of letters, legends.

use super::canvas::{Anchor, Area, At, Canvas, Ink};

/// Sizes of letters, pixels: title, what stands on an axis, marks of an axis and legend.
pub(super) const TITLE: f64 = 13.7;
pub(super) const NAME: f64 = 12.1;
pub(super) const LABEL: f64 = 10.5;
/// Pixels from line to line of a legend.
const LINE: u32 = 20;
/// Where a legend begins unless its figure says otherwise, pixels from the left: below the window of a chart.
pub(super) const LEGEND_LEFT: f64 = 72.0;

/// Told apart in print and by colour-blind readers as well (Okabe and Ito's palette).
pub(super) const INKS: [Ink; 6] = [
    Ink::new([0, 114, 178]),
    Ink::new([213, 94, 0]),
    Ink::new([0, 158, 115]),
    Ink::new([204, 121, 167]),
    Ink::new([86, 180, 233]),
    Ink::new([230, 159, 0]),
];
/// How strongly a confidence band is inked.
pub(super) const BAND: f64 = 0.16;

/// What a line of a legend shows before its text.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Mark {
    Dashes,
    Band,
    Disc,
    Ring,
    Triangle,
    Cross,
}

impl Mark {
    /// Draws the mark as a point of a chart or of a legend.
    pub(super) fn draw(self, canvas: &mut Canvas, (x, y): At, ink: Ink) {
        match self {
            Self::Ring => canvas.ring((x, y), 4.0, ink),
            Self::Triangle => canvas.polygon(&[(x, y - 5.0), (x - 4.3, y + 2.5), (x + 4.3, y + 2.5)], ink),
            Self::Cross => {
                canvas.line(&[(x - 4.0, y - 4.0), (x + 4.0, y + 4.0)], ink, 2.0);
                canvas.line(&[(x - 4.0, y + 4.0), (x + 4.0, y - 4.0)], ink, 2.0);
            }
            Self::Disc | Self::Dashes | Self::Band => canvas.disc((x, y), 4.0, ink),
        }
    }
}

/// A line of a legend.
#[derive(Clone, Debug)]
pub(super) struct Key {
    pub(super) mark: Mark,
    pub(super) ink: Ink,
    pub(super) text: String,
}

impl Key {
    pub(super) fn new(mark: Mark, ink: Ink, text: impl Into<String>) -> Self {
        Self { mark, ink, text: text.into() }
    }
}

/// Height of a legend of so many lines, pixels.
pub(super) fn legend_height(keys: usize) -> u32 {
    LINE * keys as u32 + 12
}

/// Draws a legend in an area of its own, below the chart, where it covers nothing.
pub(super) fn legend(canvas: &mut Canvas, area: Area, keys: &[Key]) {
    let left = area.left + LEGEND_LEFT;
    for (line, Key { mark, ink, text }) in keys.iter().enumerate() {
        let y = area.top + f64::from(LINE) * (line as f64 + 0.5);
        match mark {
            Mark::Dashes => {
                for dash in 0..3 {
                    let from = left + 10.0 * f64::from(dash);
                    canvas.line(&[(from, y), (from + 6.0, y)], *ink, 1.0);
                }
            }
            Mark::Band => {
                canvas.rectangle(Area { left, top: y - 6.0, width: 28.0, height: 12.0 }, ink.thinned(BAND))
            }
            point => point.draw(canvas, (left + 14.0, y), *ink),
        }
        canvas.text(text, (left + 38.0, y), LABEL, Anchor::Left);
    }
}
