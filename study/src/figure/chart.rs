//! A chart in the plane: its frame, and what is drawn by the values of its axes.

use super::axis::{Axis, mark_of};
use super::canvas::{Anchor, Area, At, Canvas, Ink};
use super::style::{BAND, LABEL, Mark, NAME, TITLE};

/// What stands around the window of a chart, pixels: edges, names and numbers of the axes, a title.
const EDGE: f64 = 12.0;
const BELOW: f64 = 46.0;
const LEFT: f64 = 60.0;
const CAPTION: f64 = 24.0;
/// Width of a letter on average, as a share of its height: more than it is.
const LETTER: f64 = 0.62;

/// Pixels that words take, at most as a rule.
fn width_of(words: &str, size: f64) -> f64 {
    LETTER * size * words.chars().count() as f64
}

/// A chart on a canvas.
#[derive(Debug)]
pub(super) struct Chart<'a> {
    pub(super) canvas: &'a mut Canvas,
    window: Area,
    /// Room for the numbers or names at the upward axis.
    left: f64,
    x: Axis,
    y: Axis,
}

impl<'a> Chart<'a> {
    /// A chart with room for its axes, and for its title if it has one.
    pub(super) fn new(canvas: &'a mut Canvas, area: Area, title: &str, x: Axis, y: Axis) -> Self {
        Self::with_names(canvas, area, title, (x, y), &[])
    }

    /// The same with room for the names of values at the upward axis.
    pub(super) fn with_names(
        canvas: &'a mut Canvas,
        area: Area,
        title: &str,
        (x, y): (Axis, Axis),
        names: &[(f64, String)],
    ) -> Self {
        let mut above = EDGE;
        if !title.is_empty() {
            // A long one is small, not cut.
            let size = TITLE * ((area.width - 2.0 * EDGE) / width_of(title, TITLE)).min(1.0);
            canvas.text(title, (area.left + area.width / 2.0, area.top + above), size, Anchor::Top);
            above += CAPTION;
        }
        let longest = names.iter().map(|(_, name)| width_of(name, LABEL)).fold(0.0, f64::max);
        // The axis's own name is beside them.
        let left = (longest + CAPTION + EDGE).min(area.width / 3.0).max(LEFT);
        let window = Area {
            left: area.left + EDGE + left,
            top: area.top + above,
            width: area.width - 2.0 * EDGE - left,
            height: area.height - above - BELOW - EDGE,
        };
        Self { canvas, window, left, x, y }
    }

    /// Where a point of the plane stands.
    fn at(&self, (x, y): (f64, f64)) -> At {
        let window = self.window;
        (window.left + self.x.share(x) * window.width, window.bottom() - self.y.share(y) * window.height)
    }

    fn all_at(&self, points: &[(f64, f64)]) -> Vec<At> {
        points.iter().map(|point| self.at(*point)).collect()
    }

    /// Draws both axes, with what they are.
    pub(super) fn axes(&mut self, x_name: &str, y_name: &str) {
        let marks = self.numbers();
        self.axes_with_names(x_name, y_name, &marks);
    }

    /// The numbers that the upward axis shows.
    fn numbers(&self) -> Vec<(f64, String)> {
        self.y.marks().into_iter().map(|value| (value, mark_of(value))).collect()
    }

    /// The same where values of the upward axis have names.
    pub(super) fn axes_with_names(&mut self, x_name: &str, y_name: &str, names: &[(f64, String)]) {
        let Area { top, .. } = self.window;
        let (bottom, axis) = (self.window.bottom(), self.x);
        for value in axis.marks() {
            let (x, _) = self.at((value, self.y.from()));
            self.canvas.line(&[(x, top), (x, bottom)], Ink::BLACK.thinned(0.1), 1.0);
            self.canvas.line(&[(x, bottom), (x, bottom + 5.0)], Ink::BLACK, 1.0);
            self.canvas.text(&mark_of(value), (x, bottom + 10.0), LABEL, Anchor::Top);
        }
        let middle = self.window.left + self.window.width / 2.0;
        self.canvas.text(x_name, (middle, bottom + BELOW), NAME, Anchor::Bottom);
        self.upward_axis(y_name, names);
    }

    /// The same where the places along X are categories: lines and numbers stand at Y alone, and every category has its name below its place.
    pub(super) fn axes_of_categories(&mut self, names: &[(String, f64)], y_name: &str) {
        let marks = self.numbers();
        self.upward_axis(y_name, &marks);
        for (name, place) in names {
            let (x, y) = self.at((*place, self.y.from()));
            for (line, words) in name.split_whitespace().enumerate() {
                self.canvas.text(words, (x, y + 6.0 + 13.0 * line as f64), LABEL - 1.0, Anchor::Top);
            }
        }
    }

    fn upward_axis(&mut self, name: &str, marks: &[(f64, String)]) {
        let Area { left, top, .. } = self.window;
        let (right, bottom) = (self.window.right(), self.window.bottom());
        for (value, words) in marks.iter().filter(|(value, _)| (0.0..=1.0).contains(&self.y.share(*value))) {
            let (_, y) = self.at((self.x.from(), *value));
            self.canvas.line(&[(left, y), (right, y)], Ink::BLACK.thinned(0.1), 1.0);
            self.canvas.line(&[(left - 5.0, y), (left, y)], Ink::BLACK, 1.0);
            self.canvas.text(words, (left - 9.0, y), LABEL, Anchor::Right);
        }
        self.canvas.line(&[(left, top), (left, bottom), (right, bottom)], Ink::BLACK, 1.0);
        self.canvas.text(name, (left - self.left, (top + bottom) / 2.0), NAME, Anchor::TurnedTop);
    }

    /// Draws a path.
    pub(super) fn path(&mut self, points: &[(f64, f64)], ink: Ink, width: f64) {
        let places = self.all_at(points);
        self.canvas.line(&places, ink, width);
    }

    /// Draws a band between two paths.
    pub(super) fn band(&mut self, low: &[(f64, f64)], high: &[(f64, f64)], ink: Ink) {
        let outline: Vec<(f64, f64)> = low.iter().chain(high.iter().rev()).copied().collect();
        let places = self.all_at(&outline);
        self.canvas.polygon(&places, ink.thinned(BAND));
    }

    /// Draws a bar between two corners.
    pub(super) fn bar(&mut self, low: (f64, f64), high: (f64, f64), ink: Ink) {
        let ((left, bottom), (right, top)) = (self.at(low), self.at(high));
        self.canvas.rectangle(Area { left, top, width: right - left, height: bottom - top }, ink);
    }

    /// Writes words to the right of a point; to its left where they would be cut.
    pub(super) fn label(&mut self, point: (f64, f64), words: &str) {
        let (x, y) = self.at(point);
        if x + 4.0 + width_of(words, LABEL) <= self.window.right() {
            self.canvas.text(words, (x + 4.0, y), LABEL, Anchor::Left);
        } else {
            self.canvas.text(words, (x - 4.0, y), LABEL, Anchor::Right);
        }
    }

    /// Draws marks at points.
    pub(super) fn marks(&mut self, points: &[(f64, f64)], mark: Mark, ink: Ink) {
        for place in self.all_at(points) {
            mark.draw(self.canvas, place, ink);
        }
    }
}
