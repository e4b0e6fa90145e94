//! One view: a raster of shades and dots, and lines.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use super::silhouette::Silhouette;

/// Leaf area behind a cell, over the cell's own area, from which each shade begins.
const SHADES: [(f64, &str); 5] =
    [(0.05, "#e3f0d3"), (0.4, "#bfdd9c"), (1.0, "#8fc063"), (2.0, "#5f9a3c"), (4.0, "#376b22")];

/// Width of a letter of a title, pixels, at most on average.
const LETTER_PX: f64 = 6.6;

/// Most cells of a view: a scene of odd size may not exhaust the memory.
const MOST_CELLS: f64 = 4e6;

/// A view being painted. Points are metres: to the right, and up.
#[derive(Clone, Debug)]
pub(super) struct Canvas {
    low: [f64; 2],
    columns: usize,
    rows: usize,
    cell_m: f64,
    scale_px: f64,
    ground: bool,
    area_m2: Vec<f64>,
    dots: BTreeMap<[u8; 3], Vec<bool>>,
    /// By colour and thickness in tenths of a pixel.
    lines: BTreeMap<([u8; 3], u32), String>,
    /// Filled shapes from the back to the front, millimetres from the upper left corner.
    shapes: Vec<([u8; 3], String)>,
    /// What stands behind the title.
    note: Option<String>,
}

impl Canvas {
    /// A canvas that holds all points; None for none. With `ground`, level 0 is on it and drawn.
    pub(super) fn around(
        points: impl Iterator<Item = [f64; 2]>,
        ground: bool,
        (cell_m, scale_px): (f64, f64),
    ) -> Option<Self> {
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for point in points {
            for axis in 0..2 {
                low[axis] = low[axis].min(point[axis]);
                high[axis] = high[axis].max(point[axis]);
            }
        }
        if ground {
            (low[1], high[1]) = (low[1].min(0.0), high[1].max(0.0));
        }
        let mut cell_m = cell_m.max(1e-3);
        let size_m = [0, 1].map(|axis| high[axis] - low[axis]);
        let cells = |cell_m: f64| size_m.map(|length_m| (length_m / cell_m).floor() + 1.0);
        if !low.iter().chain(&high).all(|c| c.is_finite()) {
            return None;
        }
        while cells(cell_m)[0] * cells(cell_m)[1] > MOST_CELLS {
            cell_m *= 2.0;
        }
        // The raster lies on whole cells, whatever is drawn.
        low = low.map(|c| (c / cell_m).floor() * cell_m);
        let [columns, rows] = cells(cell_m).map(|count| count as usize + 1);
        Some(Self {
            low,
            columns,
            rows,
            cell_m,
            scale_px,
            ground,
            area_m2: vec![0.0; columns * rows],
            dots: BTreeMap::new(),
            lines: BTreeMap::new(),
            shapes: Vec::new(),
            note: None,
        })
    }

    /// Width and height on paper, pixels.
    pub(super) fn size_px(&self) -> (f64, f64) {
        let cell_px = self.cell_m * self.scale_px;
        (self.columns as f64 * cell_px, self.rows as f64 * cell_px)
    }

    /// Room that the view takes from left to right, its title above it, pixels.
    pub(super) fn room_px(&self, title: &str) -> f64 {
        self.size_px().0.max(LETTER_PX * self.headline(title).chars().count() as f64)
    }

    /// The title with what stands behind it.
    fn headline(&self, title: &str) -> String {
        let note = self.note.as_ref().map(|note| format!("; {note}")).unwrap_or_default();
        format!("{title}{note}")
    }

    fn cell(&self, point: [f64; 2]) -> Option<usize> {
        let [column, row] = [0, 1].map(|axis| ((point[axis] - self.low[axis]) / self.cell_m).floor());
        let inside = column >= 0.0 && row >= 0.0 && column < self.columns as f64 && row < self.rows as f64;
        inside.then(|| row as usize * self.columns + column as usize)
    }

    /// Adds leaf area at a point.
    pub(super) fn shade(&mut self, point: [f64; 2], area_m2: f64) {
        if let Some(cell) = self.cell(point).and_then(|cell| self.area_m2.get_mut(cell)) {
            *cell += area_m2;
        }
    }

    /// Paints the cell of a point.
    pub(super) fn dot(&mut self, point: [f64; 2], colour: [u8; 3]) {
        let (Some(cell), count) = (self.cell(point), self.area_m2.len()) else { return };
        let painted = self.dots.entry(colour).or_insert_with(|| vec![false; count]);
        if let Some(painted) = painted.get_mut(cell) {
            *painted = true;
        }
    }

    /// Draws a line of a thickness in metres, at least half a pixel.
    pub(super) fn line(&mut self, from: [f64; 2], to: [f64; 2], thick_m: f64, colour: [u8; 3]) {
        let tenths = (thick_m * self.scale_px * 10.0).round().max(5.0) as u32;
        let ([x1, y1], [x2, y2]) = (self.on_paper(from), self.on_paper(to));
        // A level line keeps a length that is seen; writing to a string cannot fail.
        let path = self.lines.entry((colour, tenths)).or_default();
        let _ = write!(path, "M{x1:.0} {y1:.0}L{x2:.0} {y2:.0}");
    }

    /// Words behind the title.
    pub(super) fn note(&mut self, words: String) {
        self.note = Some(words);
    }

    /// Fills a silhouette, to the millimetre, over what is filled already.
    pub(super) fn fill(&mut self, silhouette: &Silhouette, colour: [u8; 3]) {
        let mut path = String::new();
        for contour in &silhouette.contours {
            let on_paper = |point: &[f64; 2]| {
                self.on_paper(*point).map(|px| (1000.0 * px / self.scale_px).round() as i64)
            };
            let mut points: Vec<[i64; 2]> = contour.iter().map(on_paper).collect();
            points.dedup();
            // What is smaller than a millimetre has no outline, and a path without points would end the whole.
            let [[x, y], ..] = points[..] else { continue };
            if points.len() < 3 {
                continue;
            }
            // Writing to a string cannot fail. Steps from point to point are short.
            let _ = write!(path, "M{x} {y}l");
            for ([x0, y0], [x, y]) in points.iter().zip(points.iter().skip(1)) {
                let _ = write!(path, "{} {} ", x - x0, y - y0);
            }
            path.push('z');
        }
        if !path.is_empty() {
            self.shapes.push((colour, path));
        }
    }

    /// Pixels from the upper left corner.
    fn on_paper(&self, [right, up]: [f64; 2]) -> [f64; 2] {
        let top_m = self.low[1] + self.rows as f64 * self.cell_m;
        [(right - self.low[0]) * self.scale_px, (top_m - up) * self.scale_px]
    }

    /// The cells that `is` holds for, as runs along the rows; cells count as one unit.
    fn runs(&self, is: impl Fn(usize) -> bool) -> String {
        let mut path = String::new();
        for row in 0..self.rows {
            let mut column = 0;
            while column < self.columns {
                let from = column;
                while column < self.columns && is(row * self.columns + column) {
                    column += 1;
                }
                if column > from {
                    let (down, width) = (self.rows - 1 - row, column - from);
                    let _ = write!(path, "M{from} {down}h{width}v1h-{width}z");
                }
                column += 1;
            }
        }
        path
    }

    /// Paths in units of a cell; nothing for none.
    fn raster(&self, paths: &str) -> String {
        if paths.is_empty() {
            return String::new();
        }
        let ((width, height), columns, rows) = (self.size_px(), self.columns, self.rows);
        format!(
            "<svg viewBox=\"0 0 {columns} {rows}\" width=\"{width:.0}\" height=\"{height:.0}\" preserveAspectRatio=\"none\" \
             shape-rendering=\"crispEdges\">\n{paths}</svg>\n"
        )
    }

    /// The group of this view, its corner at (`x_px`, `y_px`), its title above.
    pub(super) fn write(&self, title: &str, x_px: f64, y_px: f64) -> String {
        let (width, height) = self.size_px();
        let title = self.headline(title);
        let mut text =
            format!("<g transform=\"translate({x_px:.0} {y_px:.0})\">\n<text y=\"-6\">{title}</text>\n");
        let mut raster = String::new();
        let cell_m2 = self.cell_m * self.cell_m;
        for (place, (from, colour)) in SHADES.iter().enumerate() {
            let below = SHADES.get(place + 1).map_or(f64::INFINITY, |(next, _)| *next);
            let level = |cell: usize| self.area_m2.get(cell).map_or(0.0, |area| area / cell_m2);
            path(&mut raster, &self.runs(|cell| (*from..below).contains(&level(cell))), colour);
        }
        let mut dots = String::new();
        for (colour, painted) in &self.dots {
            path(&mut dots, &self.runs(|cell| painted.get(cell) == Some(&true)), &hex(*colour));
        }
        text.push_str(&self.raster(&raster));
        for (colour, path) in &self.shapes {
            let scale = self.scale_px / 1000.0;
            let _ = writeln!(
                text,
                "<path fill=\"{}\" fill-rule=\"evenodd\" transform=\"scale({scale})\" d=\"{path}\"/>",
                hex(*colour)
            );
        }
        for ((colour, tenths), path) in &self.lines {
            let _ = writeln!(
                text,
                "<path d=\"{path}\" fill=\"none\" stroke=\"{}\" stroke-width=\"{}\" stroke-linecap=\"round\"/>",
                hex(*colour),
                f64::from(*tenths) / 10.0
            );
        }
        text.push_str(&self.raster(&dots));
        if self.ground {
            let [_, y] = self.on_paper([0.0, 0.0]);
            let _ = writeln!(text, "<path d=\"M0 {y:.0}h{width:.0}\" stroke=\"#8a6d3b\"/>");
        }
        let _ = writeln!(
            text,
            "<path d=\"M0 {0:.0}h{1:.0}\" stroke=\"#000\" stroke-width=\"2\"/>\n<text x=\"{2:.0}\" y=\"{3:.0}\">1 m</text>\n</g>",
            height + 8.0,
            self.scale_px,
            self.scale_px + 4.0,
            height + 12.0
        );
        text
    }
}

fn path(text: &mut String, runs: &str, colour: &str) {
    if !runs.is_empty() {
        let _ = writeln!(text, "<path fill=\"{colour}\" d=\"{runs}\"/>");
    }
}

fn hex([r, g, b]: [u8; 3]) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}
