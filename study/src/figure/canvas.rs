//! What figures are drawn with: lines, surfaces and letters as SVG, in pixels from the upper left corner.

use std::fmt::Write;

use super::symbols;

/// A place: pixels to the right and down.
pub(super) type At = (f64, f64);

const FONT: &str = "sans-serif";

/// A colour, and how much of it covers what is below.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Ink {
    rgb: [u8; 3],
    cover: f64,
}

impl Ink {
    pub(super) const BLACK: Self = Self::new([0; 3]);

    pub(super) const fn new(rgb: [u8; 3]) -> Self {
        Self { rgb, cover: 1.0 }
    }

    /// Thinned to this share.
    pub(super) const fn thinned(self, cover: f64) -> Self {
        Self { cover, ..self }
    }

    /// As an attribute's value and the one beside it.
    fn attributes(self, name: &str) -> String {
        let [r, g, b] = self.rgb;
        let cover = if self.cover < 1.0 { format!(" opacity=\"{}\"", self.cover) } else { String::new() };
        format!("{name}=\"#{r:02X}{g:02X}{b:02X}\"{cover}")
    }
}

/// Which point of a text stands at its place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Anchor {
    /// The middle of its left side.
    Left,
    /// The middle of its right side.
    Right,
    /// The middle of its upper side.
    Top,
    /// The middle of its lower side.
    Bottom,
    /// The middle of its upper side, the text turned to be read from below.
    TurnedTop,
}

/// A part of a canvas.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Area {
    pub(super) left: f64,
    pub(super) top: f64,
    pub(super) width: f64,
    pub(super) height: f64,
}

impl Area {
    pub(super) fn right(self) -> f64 {
        self.left + self.width
    }

    pub(super) fn bottom(self) -> f64 {
        self.top + self.height
    }

    /// The upper part of this height, and the rest.
    pub(super) fn split_below(self, height: u32) -> (Self, Self) {
        let height = f64::from(height);
        let below = Self { top: self.top + height, height: self.height - height, ..self };
        (Self { height, ..self }, below)
    }

    /// So many equal parts, row by row.
    pub(super) fn grid(self, rows: usize, columns: usize) -> Vec<Self> {
        let (width, height) = (self.width / columns as f64, self.height / rows as f64);
        let part = |k: usize| Self {
            left: self.left + width * (k % columns) as f64,
            top: self.top + height * (k / columns) as f64,
            width,
            height,
        };
        (0..rows * columns).map(part).collect()
    }
}

/// A drawing that grows.
#[derive(Clone, Debug)]
pub(super) struct Canvas {
    size: (u32, u32),
    body: String,
}

impl Canvas {
    /// Without paper: to be laid over a picture.
    pub(super) fn clear(size: (u32, u32)) -> Self {
        Self { size, body: String::new() }
    }

    /// With white paper.
    pub(super) fn paper(size: (u32, u32)) -> Self {
        let mut canvas = Self::clear(size);
        canvas.rectangle(canvas.all(), Ink::new([255; 3]));
        canvas
    }

    pub(super) fn all(&self) -> Area {
        let (width, height) = self.size;
        Area { left: 0.0, top: 0.0, width: width.into(), height: height.into() }
    }

    /// The drawing as a file.
    pub(super) fn svg(self) -> String {
        let (width, height) = self.size;
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\">\n{}</svg>\n",
            self.body
        )
    }

    pub(super) fn line(&mut self, points: &[At], ink: Ink, width: f64) {
        let (points, stroke) = (places(points), ink.attributes("stroke"));
        self.put(format_args!(
            "<polyline points=\"{points}\" fill=\"none\" {stroke} stroke-width=\"{width}\"/>"
        ));
    }

    pub(super) fn polygon(&mut self, points: &[At], ink: Ink) {
        let (points, fill) = (places(points), ink.attributes("fill"));
        self.put(format_args!("<polygon points=\"{points}\" {fill}/>"));
    }

    pub(super) fn rectangle(&mut self, area: Area, ink: Ink) {
        let [x, y, width, height] = [area.left, area.top, area.width, area.height].map(pixels);
        let fill = ink.attributes("fill");
        self.put(format_args!("<rect x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\" {fill}/>"));
    }

    pub(super) fn disc(&mut self, (x, y): At, radius: f64, ink: Ink) {
        let (x, y, fill) = (pixels(x), pixels(y), ink.attributes("fill"));
        self.put(format_args!("<circle cx=\"{x}\" cy=\"{y}\" r=\"{radius}\" {fill}/>"));
    }

    pub(super) fn ring(&mut self, (x, y): At, radius: f64, ink: Ink) {
        let (x, y, stroke) = (pixels(x), pixels(y), ink.attributes("stroke"));
        self.put(format_args!("<circle cx=\"{x}\" cy=\"{y}\" r=\"{radius}\" fill=\"none\" {stroke}/>"));
    }

    /// Writes a line of text; its symbols get their subscripts.
    pub(super) fn text(&mut self, words: &str, (x, y): At, size: f64, anchor: Anchor) {
        let (x, y, size) = (pixels(x), pixels(y), pixels(size));
        let turn = match anchor {
            Anchor::TurnedTop => format!(" transform=\"rotate(270, {x}, {y})\""),
            _ => String::new(),
        };
        let (anchor, below) = match anchor {
            Anchor::Left => ("start", "0.35em"),
            Anchor::Right => ("end", "0.35em"),
            Anchor::Top | Anchor::TurnedTop => ("middle", "0.76em"),
            Anchor::Bottom => ("middle", "-0.25em"),
        };
        let words = symbols::set(&escaped(words));
        self.put(format_args!(
            "<text x=\"{x}\" y=\"{y}\" dy=\"{below}\" text-anchor=\"{anchor}\" font-family=\"{FONT}\" font-size=\"{size}\"{turn}>{words}</text>"
        ));
    }

    fn put(&mut self, element: std::fmt::Arguments<'_>) {
        // A string takes whatever is written to it.
        let _ = writeln!(self.body, "{element}");
    }
}

/// A length as it is written: to a tenth of a pixel.
fn pixels(length: f64) -> f64 {
    (10.0 * length).round() / 10.0 + 0.0
}

fn places(points: &[At]) -> String {
    let place = |(x, y): &At| format!("{},{}", pixels(*x), pixels(*y));
    points.iter().map(place).collect::<Vec<_>>().join(" ")
}

fn escaped(words: &str) -> String {
    words.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_text_says_is_no_mark_up() {
        let mut canvas = Canvas::clear((10, 10));
        canvas.text("a < b & I_T > c", (1.0, 2.0), 9.0, Anchor::Left);
        let svg = canvas.svg();
        assert!(
            svg.contains("a &lt; b &amp;") && svg.contains("&gt; c") && svg.contains(">T</tspan>"),
            "{svg}"
        );
    }

    #[test]
    fn parts_of_an_area_cover_it() {
        let all = Canvas::clear((300, 200)).all();
        let (above, below) = all.split_below(50);
        assert_eq!((above.bottom(), below.top, below.bottom()), (50.0, 50.0, 200.0));
        let parts = above.grid(2, 3);
        let corner = |k: usize| (parts[k].left, parts[k].top, parts[k].right(), parts[k].bottom());
        assert_eq!(
            (parts.len(), corner(0), corner(5)),
            (6, (0.0, 0.0, 100.0, 25.0), (200.0, 25.0, 300.0, 50.0))
        );
    }
}
