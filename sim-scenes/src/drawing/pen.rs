//! SVG shapes of a technical drawing, in metres.

use std::fmt::Write as _;

/// One view of a drawing: where its origin is on paper, and which way its axes go.
#[derive(Clone, Debug)]
pub(super) struct Pen {
    origin_px: [f64; 2],
    scale_px: f64,
    /// 1 where the second axis goes up on paper, −1 where it goes down.
    up: f64,
    text: String,
}

/// Colours, each for one meaning.
pub(super) const INK: &str = "#333333";
pub(super) const TREE: &str = "#5f9a3c";
pub(super) const SCANNER: &str = "#005adc";
pub(super) const BEAM: &str = "#d2691e";
pub(super) const LENGTH: &str = "#7a3b8f";
pub(super) const FAINT: &str = "#aaaaaa";

impl Pen {
    pub(super) fn new(origin_px: [f64; 2], scale_px: f64, up: bool) -> Self {
        Self { origin_px, scale_px, up: if up { 1.0 } else { -1.0 }, text: String::new() }
    }

    fn at(&self, [right, up]: [f64; 2]) -> [f64; 2] {
        let [x, y] = self.origin_px;
        [x + right * self.scale_px, y - self.up * up * self.scale_px]
    }

    // Writing to a string cannot fail.
    fn put(&mut self, shape: std::fmt::Arguments<'_>) {
        let _ = self.text.write_fmt(shape);
        self.text.push('\n');
    }

    pub(super) fn line(&mut self, from: [f64; 2], to: [f64; 2], colour: &str, dashed: bool) {
        let ([x1, y1], [x2, y2]) = (self.at(from), self.at(to));
        let dashes = if dashed { " stroke-dasharray=\"5 4\"" } else { "" };
        self.put(format_args!(
            "<path d=\"M{x1:.1} {y1:.1}L{x2:.1} {y2:.1}\" stroke=\"{colour}\" fill=\"none\"{dashes}/>"
        ));
    }

    /// A line with a head at its end.
    pub(super) fn arrow(&mut self, from: [f64; 2], to: [f64; 2], colour: &str) {
        self.line(from, to, colour, false);
        let ([x1, y1], [x2, y2]) = (self.at(from), self.at(to));
        let length = f64::hypot(x2 - x1, y2 - y1).max(1e-9);
        let (ux, uy) = ((x2 - x1) / length, (y2 - y1) / length);
        let head = |side: f64| [x2 - 8.0 * ux - 3.0 * side * uy, y2 - 8.0 * uy + 3.0 * side * ux];
        let ([ax, ay], [bx, by]) = (head(1.0), head(-1.0));
        self.put(format_args!(
            "<path d=\"M{x2:.1} {y2:.1}L{ax:.1} {ay:.1}L{bx:.1} {by:.1}z\" fill=\"{colour}\"/>"
        ));
    }

    pub(super) fn circle(&mut self, at: [f64; 2], radius_m: f64, colour: &str, filled: bool) {
        let ([x, y], r) = (self.at(at), radius_m * self.scale_px);
        let paint =
            if filled { format!("fill=\"{colour}\"") } else { format!("fill=\"none\" stroke=\"{colour}\"") };
        self.put(format_args!("<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{r:.1}\" {paint}/>"));
    }

    pub(super) fn ellipse(&mut self, at: [f64; 2], radii_m: [f64; 2], colour: &str) {
        let ([x, y], [rx, ry]) = (self.at(at), radii_m.map(|radius_m| radius_m * self.scale_px));
        self.put(format_args!(
            "<ellipse cx=\"{x:.1}\" cy=\"{y:.1}\" rx=\"{rx:.1}\" ry=\"{ry:.1}\" fill=\"{colour}\" fill-opacity=\"0.15\" stroke=\"{colour}\"/>"
        ));
    }

    pub(super) fn rectangle(&mut self, low: [f64; 2], high: [f64; 2], colour: &str) {
        let corners = [low, [high[0], low[1]], high, [low[0], high[1]], low];
        corners.windows(2).for_each(|ends| self.line(ends[0], ends[1], colour, true));
    }

    /// Words, their middle at a point, moved on paper by so many pixels to the right and down.
    pub(super) fn words(&mut self, at: [f64; 2], [right_px, down_px]: [f64; 2], colour: &str, words: &str) {
        let [x, y] = self.at(at);
        let (x, y) = (x + right_px, y + down_px);
        let words = words.replace('&', "&amp;").replace('<', "&lt;");
        self.put(format_args!(
            "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"middle\" fill=\"{colour}\">{words}</text>"
        ));
    }

    /// A length between two points, drawn beside them.
    pub(super) fn length(&mut self, from: [f64; 2], to: [f64; 2], words: &str) {
        self.length_at(from, to, 0.5, words);
    }

    /// The same, with the words at this share of the way.
    pub(super) fn length_at(&mut self, from: [f64; 2], to: [f64; 2], share: f64, words: &str) {
        let middle = [from[0] + share * (to[0] - from[0]), from[1] + share * (to[1] - from[1])];
        self.arrow(middle, from, LENGTH);
        self.arrow(middle, to, LENGTH);
        let level = (from[1] - to[1]).abs() < (from[0] - to[0]).abs();
        let beside = if level { [0.0, -5.0] } else { [6.0 + 3.3 * words.chars().count() as f64, 4.0] };
        self.words(middle, beside, LENGTH, words);
    }

    pub(super) fn into_text(self) -> String {
        self.text
    }
}
