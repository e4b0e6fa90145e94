//! Estimate against truth by metre of row, below a picture of the row.

use super::axis::Axis;
use super::canvas::{Anchor, Area, Canvas, Ink};
use super::chart::Chart;
use super::sheet::{Sheet, Window};
use super::style::{INKS, Key, LEGEND_LEFT, Mark, TITLE, legend, legend_height};

/// Width of a sheet, pixels.
const WIDTH: u32 = 1000;
/// Height of the chart below the picture.
const CHART: u32 = 250;
/// What stands around the picture: above with the title, to the left with the axes below, to the right.
const ABOVE: u32 = 34;
const LEFT: u32 = LEGEND_LEFT as u32;
const RIGHT: u32 = 24;
/// Half of a bar, metres of row.
const HALF_BAR_M: f64 = 0.36;

/// One metre of row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Metre {
    /// Its middle, metres along the row.
    pub y_m: f64,
    /// Leaf area that is there, m².
    pub truth_m2: f64,
    /// Leaf area that was estimated, m²; None where it is unknown.
    pub estimate_m2: Option<f64>,
}

/// A row by the metre.
#[derive(Clone, Debug, PartialEq)]
pub struct Metres {
    /// Above the picture.
    pub title: String,
    /// From where to where along the row, metres.
    pub along_m: (f64, f64),
    /// Height of the picture, metres.
    pub up_m: f64,
    /// The metres.
    pub metres: Vec<Metre>,
    /// What the estimate is, for the legend.
    pub estimate: String,
    /// What the dots of the picture are, for the legend, and their colour.
    pub returns: (String, [u8; 3]),
}

/// The sheet of a row: a window for the picture, below it bars of the truth and dots of the estimate over the same metres.
pub fn metres(row: &Metres) -> Sheet {
    let wide = WIDTH - LEFT - RIGHT;
    let along = row.along_m;
    let high = (f64::from(wide) * row.up_m / (along.1 - along.0)).round().clamp(60.0, 900.0) as u32;
    let picture = ABOVE + high;
    let keys = [
        Key::new(Mark::Disc, Ink::new(row.returns.1), &row.returns.0),
        Key::new(Mark::Band, INKS[2], "leaf area that is there, leaves cut at each metre"),
        Key::new(Mark::Disc, INKS[0], &row.estimate),
    ];
    let size = (WIDTH, picture + CHART + legend_height(keys.len()));
    let mut canvas = Canvas::clear(size);
    let (_, below) = canvas.all().split_below(picture);
    let (place, below) = below.split_below(CHART);
    canvas.text(&row.title, (f64::from(LEFT), 16.0), TITLE, Anchor::Left);
    legend(&mut canvas, below, &keys);
    let most = row.metres.iter().flat_map(|metre| [Some(metre.truth_m2), metre.estimate_m2]);
    let most = most.flatten().fold(1e-3, f64::max);
    // The chart's own edge is narrower.
    let place = Area { width: f64::from(WIDTH - RIGHT + 12), ..place };
    let (x, y) = (Axis::linear(along.0, along.1), Axis::linear(0.0, 1.12 * most));
    let mut chart = Chart::new(&mut canvas, place, "", x, y);
    chart.axes("along the row, m", "leaf area, m² a metre");
    for metre in &row.metres {
        let (low, high) = ((metre.y_m - HALF_BAR_M, 0.0), (metre.y_m + HALF_BAR_M, metre.truth_m2));
        chart.bar(low, high, INKS[2].thinned(0.32));
    }
    let known: Vec<(f64, f64)> =
        row.metres.iter().filter_map(|metre| Some((metre.y_m, metre.estimate_m2?))).collect();
    chart.path(&known, INKS[0], 1.0);
    chart.marks(&known, Mark::Disc, INKS[0]);
    Sheet { svg: canvas.svg(), size, window: Window { left: LEFT, top: ABOVE, width: wide, height: high } }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_metre_without_an_estimate_has_a_bar_and_no_dot() {
        let metre = |k: u32, estimate_m2| Metre { y_m: f64::from(k) + 0.5, truth_m2: 5.0, estimate_m2 };
        let row = Metres {
            title: "demo".into(),
            along_m: (-0.5, 3.5),
            up_m: 3.0,
            metres: vec![metre(0, Some(4.0)), metre(1, None), metre(2, Some(6.0))],
            estimate: "estimated".into(),
            returns: ("returns".into(), [213, 94, 0]),
        };
        let sheet = metres(&row);
        // Those of the legend are two discs.
        assert_eq!(sheet.svg.matches("<circle").count(), 2 + 2);
        assert_eq!(sheet.svg.matches("fill=\"#009E73\"").count(), 3 + 1);
        assert!(sheet.svg.contains("m² a metre"));
        let Window { left, width, top, height } = sheet.window;
        assert!(left + width <= sheet.size.0 && top + height < sheet.size.1);
    }
}
