//! A chart in the plane: its frame, and what is drawn by the values of its axes.

use super::axis::{Axis, mark_of};
use super::canvas::{Anchor, Area, At, Canvas, Ink};
use super::style::{BAND, LABEL, Mark, NAME, TITLE};

/// What stands around the window of a chart, pixels: edges, names and numbers of the axes, a title.
const EDGE: f64 = 12.0;
const BELOW: f64 = 46.0;
const LEFT: f64 = 60.0;
const CAPTION: f64 = 24.0;

/// A chart on a canvas.
#[derive(Debug)]
pub(super) struct Chart<'a> {
    pub(super) canvas: &'a mut Canvas,
    window: Area,
    x: Axis,
    y: Axis,
}

impl<'a> Chart<'a> {
    /// A chart with room for its axes, and for its title if it has one.
    pub(super) fn new(canvas: &'a mut Canvas, area: Area, title: &str, x: Axis, y: Axis) -> Self {
        let mut above = EDGE;
        if !title.is_empty() {
            canvas.text(title, (area.left + area.width / 2.0, area.top + above), TITLE, Anchor::Top);
            above += CAPTION;
        }
        let window = Area {
            left: area.left + EDGE + LEFT,
            top: area.top + above,
            width: area.width - 2.0 * EDGE - LEFT,
            height: area.height - above - BELOW - EDGE,
        };
        Self { canvas, window, x, y }
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
        self.upward_axis(y_name);
    }

    /// The same where the places along X are categories: lines and numbers stand at Y alone, and every category has its name below its place.
    pub(super) fn axes_of_categories(&mut self, names: &[(String, f64)], y_name: &str) {
        self.upward_axis(y_name);
        for (name, place) in names {
            let (x, y) = self.at((*place, self.y.from()));
            for (line, words) in name.split_whitespace().enumerate() {
                self.canvas.text(words, (x, y + 6.0 + 13.0 * line as f64), LABEL - 1.0, Anchor::Top);
            }
        }
    }

    fn upward_axis(&mut self, name: &str) {
        let Area { left, top, .. } = self.window;
        let (right, bottom) = (self.window.right(), self.window.bottom());
        for value in self.y.marks() {
            let (_, y) = self.at((self.x.from(), value));
            self.canvas.line(&[(left, y), (right, y)], Ink::BLACK.thinned(0.1), 1.0);
            self.canvas.line(&[(left - 5.0, y), (left, y)], Ink::BLACK, 1.0);
            self.canvas.text(&mark_of(value), (left - 9.0, y), LABEL, Anchor::Right);
        }
        self.canvas.line(&[(left, top), (left, bottom), (right, bottom)], Ink::BLACK, 1.0);
        self.canvas.text(name, (left - LEFT, (top + bottom) / 2.0), NAME, Anchor::TurnedTop);
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

    /// Writes words to the right of a point.
    pub(super) fn label(&mut self, point: (f64, f64), words: &str) {
        let (x, y) = self.at(point);
        self.canvas.text(words, (x + 4.0, y), LABEL, Anchor::Left);
    }

    /// Draws marks at points.
    pub(super) fn marks(&mut self, points: &[(f64, f64)], mark: Mark, ink: Ink) {
        for place in self.all_at(points) {
            mark.draw(self.canvas, place, ink);
        }
    }
}
