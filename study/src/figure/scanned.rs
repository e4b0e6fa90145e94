//! Returns of a scan over the trees they came from: axes, what the colours mean, a metre.

use plotters::prelude::*;

use super::DrawError;
use super::colours::of_share;
use super::sheet::{Sheet, Window};
use super::style::{Area, Key, Mark, axes, builder, label, layer, legend, legend_height, title};

/// Width of a sheet, pixels.
const WIDTH: u32 = 1000;
/// Least and most pixels of the picture's height.
const HEIGHTS: (f64, f64) = (120.0, 700.0);
/// What the axes take: above, below and to the left, with the margins.
const ABOVE: u32 = 36;
const BELOW: u32 = 58;
const LEFT: u32 = 72;
const RIGHT: u32 = 24;
/// Room of the scale of colours.
const BAR: (i32, i32) = (320, 14);

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
///
/// # Errors
/// What the plotting library says.
pub fn scanned(panel: &Panel, key: &Legend) -> Result<Sheet, DrawError> {
    let (along, up) = (panel.along_m, panel.up_m);
    let wide = f64::from(WIDTH - LEFT - RIGHT);
    let per_m = wide / (along.1 - along.0);
    let high = (per_m * (up.1 - up.0)).clamp(HEIGHTS.0, HEIGHTS.1).round();
    let top_m = up.0 + high / per_m;
    let chart_height = high as u32 + ABOVE + BELOW;
    let keys = match key {
        Legend::Scale { .. } => 58,
        Legend::Kinds(kinds) => legend_height(kinds.len().max(2)),
    };
    let size = (WIDTH, chart_height + keys);
    let mut window = Window { left: 0, top: 0, width: 1, height: 1 };
    let svg = layer(size, |root| {
        let (above, below) = root.split_vertically(chart_height);
        title(&above, &panel.title, (LEFT as i32, 16))?;
        let place = above.margin(ABOVE - 12, 0, 0, RIGHT - 12);
        let mut chart = builder(&place, "").build_cartesian_2d(along.0..along.1, up.0..top_m)?;
        axes(&mut chart, "along the row, m", panel.up_name)?;
        window = Window::of(chart.plotting_area().get_pixel_range());
        metre(&below, per_m)?;
        match key {
            Legend::Scale { name, low, high } => scale(&below, name, *low, *high),
            Legend::Kinds(kinds) => {
                let ink = |[r, g, b]: [u8; 3]| RGBColor(r, g, b);
                let keys: Vec<Key> =
                    kinds.iter().map(|(name, rgb)| Key::new(Mark::Disc, ink(*rgb), name)).collect();
                legend(&below, LEFT as i32, &keys)
            }
        }
    })?;
    Ok(Sheet { svg, size, window })
}

/// A bar of one metre, at the right of the legend.
fn metre(area: &Area<'_>, per_m: f64) -> Result<(), DrawError> {
    let (right, y) = ((WIDTH - RIGHT) as i32, 22);
    let left = right - per_m.round() as i32;
    let line = |points: Vec<(i32, i32)>| PathElement::new(points, BLACK.stroke_width(2));
    area.draw(&line(vec![(left, y - 5), (left, y), (right, y), (right, y - 5)]))?;
    label(area, "1 m", ((left + right) / 2, y + 6), true)
}

/// The colours from low to high, with their numbers below and what they are above.
fn scale(area: &Area<'_>, name: &str, low: f64, high: f64) -> Result<(), DrawError> {
    let (left, top) = (LEFT as i32, 18);
    label(area, name, (left, 8), false)?;
    for x in 0..BAR.0 {
        let [r, g, b] = of_share(f64::from(x) / f64::from(BAR.0 - 1));
        let strip =
            Rectangle::new([(left + x, top), (left + x + 1, top + BAR.1)], RGBColor(r, g, b).filled());
        area.draw(&strip)?;
    }
    let decimals = if high - low < 10.0 { 1 } else { 0 };
    for share in [0.0, 0.5, 1.0] {
        let value = low + share * (high - low);
        let at = (left + (share * f64::from(BAR.0)) as i32, top + BAR.1 + 4);
        label(area, &format!("{value:.decimals$}"), at, true)?;
    }
    Ok(())
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
        let sheet = scanned(&panel(), &kinds).unwrap();
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
        let svg = scanned(&panel(), &key).unwrap().svg;
        let place = |needle: &str| svg.find(needle).unwrap_or_else(|| panic!("{needle} is missing"));
        assert!(place("#440154") < place("#21908D") && place("#21908D") < place("#FDE725"));
        assert!(place("1.2") < place("2.2") && place("2.2") < place("3.2"));
        assert!(svg.contains("distance from the scanner, m"));
    }
}
