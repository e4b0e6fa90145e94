//! The regressions of leaf area on impacted areas.

use rowscan_canopy::reference::ImpactedArea;
use rowscan_scenes::scan::ScanAreas;

use super::axis::Axis;
use super::canvas::{Area, Canvas, Ink};
use super::chart::Chart;
use super::style::{INKS, Key, Mark, legend, legend_height};
use crate::areas::{AreasReport, Fit, Orchard, impacted, symbol};

/// Pixels of a view's chart.
const CHART: (u32, u32) = (560, 460);
/// Lines of its legend: three areas, what bands and dashes are.
const LINES: usize = 5;

/// Its colour and mark in every figure.
fn style(area: ImpactedArea) -> (Ink, Mark) {
    let [total, leaf, three] = [INKS[1], INKS[2], INKS[0]];
    match area {
        ImpactedArea::Leaf => (leaf, Mark::Disc),
        ImpactedArea::Total => (total, Mark::Triangle),
        ImpactedArea::ThreeLeaves => (three, Mark::Cross),
    }
}

/// Leaf area over impacted areas, both views, with our lines and the paper's: after the paper's Fig. 7.
pub fn areas(report: &AreasReport) -> String {
    let mut canvas = Canvas::paper((2 * CHART.0, CHART.1 + legend_height(LINES)));
    let lateral = |orchard: &Orchard| orchard.lateral;
    let zenith = |orchard: &Orchard| orchard.zenith;
    let sides: [(_, _, View<'_>); 2] =
        [("Lateral, angular", &report.lateral, &lateral), ("Zenith, orthogonal", &report.zenith, &zenith)];
    for (panel, (title, view, of)) in canvas.all().grid(1, 2).into_iter().zip(sides) {
        let points = |area: ImpactedArea| -> Vec<(f64, f64)> {
            let point = |orchard: &Orchard| (impacted(&of(orchard), area), orchard.leaf_area_m2);
            report.orchards.iter().map(point).collect()
        };
        let clouds: Vec<Cloud<'_>> =
            view.fits().into_iter().map(|(area, fit)| Cloud { area, fit, points: points(area) }).collect();
        let (chart, below) = panel.split_below(CHART.1);
        regressions(&mut canvas, chart, title, &clouds);
        legend(&mut canvas, below, &keys(&clouds));
    }
    canvas.svg()
}

/// The areas of one view.
type View<'a> = &'a dyn Fn(&Orchard) -> ScanAreas;

/// One impacted area of all orchards.
struct Cloud<'a> {
    area: ImpactedArea,
    fit: Option<&'a Fit>,
    points: Vec<(f64, f64)>,
}

fn regressions(canvas: &mut Canvas, panel: Area, title: &str, clouds: &[Cloud<'_>]) {
    let greatest = |value: fn(&(f64, f64)) -> f64| {
        clouds.iter().flat_map(|cloud| &cloud.points).map(value).fold(1e-6, f64::max)
    };
    let (right, top) = (1.06 * greatest(|point| point.0), 1.1 * greatest(|point| point.1));
    let mut chart = Chart::new(canvas, panel, title, Axis::linear(0.0, right), Axis::linear(0.0, top));
    chart.axes("impacted area I, m²", "leaf area L_A, m²");
    for Cloud { area, fit, points } in clouds {
        let (ink, mark) = style(*area);
        let furthest = points.iter().map(|point| point.0).fold(0.0, f64::max);
        if let Some(fit) = fit {
            let within = |y: f64| y.clamp(0.0, top);
            let side = |sign: f64| -> Vec<(f64, f64)> {
                let at = |x: f64| (x, within(fit.leaf_area_m2(x) + sign * fit.half_band_m2(x)));
                (0..=60).map(|step| at(furthest * f64::from(step) / 60.0)).collect()
            };
            chart.band(&side(-1.0), &side(1.0), ink);
            let line = |x: f64| (x, fit.leaf_area_m2(x));
            chart.path(&ends(clipped(line, furthest, top)), ink, 2.0);
            if let Some(paper) = fit.paper {
                let theirs = clipped(|x| (x, paper.leaf_area_m2(x)), right, top);
                for dash in dashes(&theirs, right, top) {
                    chart.path(&dash, ink.thinned(0.8), 1.0);
                }
            }
        }
        chart.marks(points, mark, ink);
    }
}

/// What the chart shows, line by line.
fn keys(clouds: &[Cloud<'_>]) -> Vec<Key> {
    let of_cloud = |cloud: &Cloud<'_>| {
        let (ink, mark) = style(cloud.area);
        Key::new(mark, ink, label(cloud.area, cloud.fit))
    };
    let mut keys: Vec<Key> = clouds.iter().map(of_cloud).collect();
    keys.push(Key::new(
        Mark::Band,
        Ink::BLACK,
        "95 % confidence band of the line, by Student's t over the orchards",
    ));
    if clouds.iter().any(|cloud| cloud.fit.is_some_and(|fit| fit.paper.is_some())) {
        keys.push(Key::new(Mark::Dashes, Ink::BLACK, "Méndez et al. 2013, eqs. (5) to (10)"));
    }
    keys
}

/// The regression in words.
fn label(area: ImpactedArea, fit: Option<&Fit>) -> String {
    let Some(fit) = fit else { return symbol(area).to_owned() };
    let intercept = fit.intercept_m2.map_or_else(String::new, |m2| {
        if m2 < 0.0 { format!(" − {:.2}", -m2) } else { format!(" + {m2:.2}") }
    });
    let paper = fit.paper.map_or_else(String::new, |paper| format!(" (paper {:.2})", paper.slope));
    format!("L_A = {:.2} {}{intercept}, R² {:.2}{paper}", fit.slope, symbol(area), fit.r2)
}

/// The part of a rising line between x = 0 and `right` that lies between y = 0 and `top`.
fn clipped(line: impl Fn(f64) -> (f64, f64), right: f64, top: f64) -> Vec<(f64, f64)> {
    let steps = 400;
    (0..=steps)
        .map(|step| line(right * f64::from(step) / f64::from(steps)))
        .filter(|(_, y)| (0.0..=top).contains(y))
        .collect()
}

/// A straight path by its ends alone: drawn without steps.
fn ends(path: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
    path.first().into_iter().chain(path.last()).copied().collect()
}

/// A path as dashes of equal length on paper.
fn dashes(path: &[(f64, f64)], right: f64, top: f64) -> Vec<Vec<(f64, f64)>> {
    let mut drawn = Vec::new();
    let mut dash: Vec<(f64, f64)> = Vec::new();
    let mut length = 0.0;
    for pair in path.windows(2) {
        let [a, b] = pair else { continue };
        length += ((b.0 - a.0) / right).hypot((b.1 - a.1) / top);
        // Thirty dashes and gaps each along a diagonal.
        if ((length * 45.0) as u64).is_multiple_of(2) {
            if dash.is_empty() {
                dash.push(*a);
            }
            dash.push(*b);
        } else if !dash.is_empty() {
            drawn.push(ends(std::mem::take(&mut dash)));
        }
    }
    if dash.len() > 1 {
        drawn.push(ends(dash));
    }
    drawn
}
