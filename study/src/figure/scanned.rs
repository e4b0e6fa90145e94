//! Returns of a scan over the trees they came from: axes, what the colours mean, a metre.

use super::axis::Axis;
use super::canvas::{Anchor, Area, Canvas, Ink};
use super::chart::Chart;
use super::colours::of_share;
use super::sheet::{Sheet, Window};
use super::style::{Key, LABEL, LEGEND_LEFT, Mark, TITLE, legend, legend_height};

/// Width of a sheet, pixels.
const WIDTH: u32 = 1000;
/// Least and most pixels of the picture's height.
const HEIGHTS: (f64, f64) = (120.0, 700.0);
/// What the axes take: above, below and to the left, with the margins.
const ABOVE: u32 = 36;
const BELOW: u32 = 58;
const LEFT: u32 = LEGEND_LEFT as u32;
const RIGHT: u32 = 24;
/// Room of the scale of colours.
const BAR: (u32, f64) = (320, 14.0);

/// What part of the scene is drawn.
#[derive(Clone, Debug, PartialEq)]
pub struct Panel {
    /// Above the chart.
    pub title: String,
    /// From where to where along the row, metres.
    pub along_m: (f64, f64),
    /// From where to where upwards on the sheet, metres.
    pub up_m: (f64, f64),
    /// What stands at the upward axis.
    pub up_name: &'static str,
}

/// What the colours mean.
#[derive(Clone, Debug, PartialEq)]
pub enum Legend {
    /// A number, from dark to light.
    Scale {
        /// What and in which unit.
        name: String,
        /// At the dark end.
        low: f64,
        /// At the light end.
        high: f64,
    },
    /// Kinds, each with its colour.
    Kinds(Vec<(String, [u8; 3])>),
}

/// The sheet of a scan. A metre is as long along the row as upwards, so the window may show more upwards than was asked for.
pub fn scanned(panel: &Panel, key: &Legend) -> Sheet {
    let (along, up) = (panel.along_m, panel.up_m);
    let wide = WIDTH - LEFT - RIGHT;
    let per_m = f64::from(wide) / (along.1 - along.0);
    let high = (per_m * (up.1 - up.0)).clamp(HEIGHTS.0, HEIGHTS.1).round();
    let top_m = up.0 + high / per_m;
    let chart_height = high as u32 + ABOVE + BELOW;
    let keys = match key {
        Legend::Scale { .. } => 58,
        Legend::Kinds(kinds) => legend_height(kinds.len().max(2)),
    };
    let size = (WIDTH, chart_height + keys);
    let mut canvas = Canvas::clear(size);
    let (above, below) = canvas.all().split_below(chart_height);
    canvas.text(&panel.title, (f64::from(LEFT), 16.0), TITLE, Anchor::Left);
    // The chart's own edges are narrower.
    let lower = f64::from(ABOVE - 12);
    let place = Area {
        top: above.top + lower,
        height: above.height - lower,
        width: f64::from(WIDTH - RIGHT + 12),
        ..above
    };
    let (x, y) = (Axis::linear(along.0, along.1), Axis::linear(up.0, top_m));
    Chart::new(&mut canvas, place, "", x, y).axes("along the row, m", panel.up_name);
    metre(&mut canvas, below, per_m);
    match key {
        Legend::Scale { name, low, high } => scale(&mut canvas, below, name, *low, *high),
        Legend::Kinds(kinds) => {
            let key = |(name, rgb): &(String, [u8; 3])| Key::new(Mark::Disc, Ink::new(*rgb), name);
            legend(&mut canvas, below, &kinds.iter().map(key).collect::<Vec<_>>());
        }
    }
    let window = Window { left: LEFT, top: ABOVE, width: wide, height: high as u32 };
    Sheet { svg: canvas.svg(), size, window }
}

/// A bar of one metre, at the right of the legend.
fn metre(canvas: &mut Canvas, area: Area, per_m: f64) {
    let (right, y) = (f64::from(WIDTH - RIGHT), area.top + 22.0);
    let left = right - per_m;
    canvas.line(&[(left, y - 5.0), (left, y), (right, y), (right, y - 5.0)], Ink::BLACK, 2.0);
    canvas.text("1 m", ((left + right) / 2.0, y + 6.0), LABEL, Anchor::Top);
}

/// The colours from low to high, with their numbers below and what they are above.
fn scale(canvas: &mut Canvas, area: Area, name: &str, low: f64, high: f64) {
    let (left, top, (width, height)) = (f64::from(LEFT), area.top + 18.0, BAR);
    canvas.text(name, (left, area.top + 8.0), LABEL, Anchor::Left);
    for x in 0..width {
        let ink = Ink::new(of_share(f64::from(x) / f64::from(width - 1)));
        canvas.rectangle(Area { left: left + f64::from(x), top, width: 1.0, height }, ink);
    }
    let decimals = if high - low < 10.0 { 1 } else { 0 };
    for share in [0.0, 0.5, 1.0] {
        let value = low + share * (high - low);
        let at = (left + share * f64::from(width), top + height + 4.0);
        canvas.text(&format!("{value:.decimals$}"), at, LABEL, Anchor::Top);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn panel() -> Panel {
        Panel { title: "lateral".into(), along_m: (-0.5, 18.5), up_m: (0.0, 3.4), up_name: "height, m" }
    }

    #[test]
    fn a_metre_is_as_long_along_the_row_as_upwards_and_the_window_lies_on_the_sheet() {
        let kinds = Legend::Kinds(vec![("leaf".into(), [0, 158, 115]), ("wood".into(), [213, 94, 0])]);
        let sheet = scanned(&panel(), &kinds);
        let Window { left, top, width, height } = sheet.window;
        assert!(left + width <= sheet.size.0 && top + height < sheet.size.1);
        let per_m = f64::from(width) / 19.0;
        assert!((f64::from(height) / per_m - 3.4).abs() < 0.05, "{width} x {height}");
        assert!(sheet.svg.contains("leaf") && sheet.svg.contains("1 m") && sheet.svg.contains("height, m"));
        assert!(!sheet.svg.to_lowercase().contains("fill=\"#ffffff\""), "the picture shows through");
    }

    #[test]
    fn the_scale_runs_from_dark_at_its_low_end_to_light_at_its_high_end_and_names_the_unit() {
        let key = Legend::Scale { name: "distance from the scanner, m".into(), low: 1.25, high: 3.25 };
        let svg = scanned(&panel(), &key).svg;
        let place = |needle: &str| svg.find(needle).unwrap_or_else(|| panic!("{needle} is missing"));
        assert!(place("#440154") < place("#21908D") && place("#21908D") < place("#FDE725"));
        // As labels: places have digits too.
        assert!(place(">1.2<") < place(">2.2<") && place(">2.2<") < place(">3.2<"));
        assert!(svg.contains("distance from the scanner, m"));
    }
}
