//! The regressions of leaf area on impacted areas.

use plotters::coord::Shift;
use plotters::prelude::*;
use rowscan_canopy::reference::ImpactedArea;
use rowscan_scenes::scan::ScanAreas;

use super::{DrawError, INKS, axes, builder, legend};
use crate::areas::{AreasReport, Fit, Orchard, impacted, symbol};

/// Its colour in every figure.
fn colour(area: ImpactedArea) -> RGBColor {
    let [total, leaf, three] = [INKS[1], INKS[2], INKS[0]];
    match area {
        ImpactedArea::Leaf => leaf,
        ImpactedArea::Total => total,
        ImpactedArea::ThreeLeaves => three,
    }
}

/// Leaf area over impacted areas, both views, with our lines and the paper's: after the paper's Fig. 7.
pub fn areas(report: &AreasReport) -> Result<String, DrawError> {
    let mut svg = String::new();
    {
        let root = SVGBackend::with_string(&mut svg, (1120, 540)).into_drawing_area();
        root.fill(&WHITE)?;
        let (left, right) = root.split_horizontally(560);
        let lateral = |orchard: &Orchard| orchard.lateral;
        let zenith = |orchard: &Orchard| orchard.zenith;
        let sides: [(_, _, _, View<'_>); 2] = [
            (&left, "Lateral, angular", &report.lateral, &lateral),
            (&right, "Zenith, orthogonal", &report.zenith, &zenith),
        ];
        for (panel, title, view, of) in sides {
            let clouds: Vec<Cloud<'_>> = view
                .fits()
                .into_iter()
                .map(|(area, fit)| Cloud {
                    area,
                    fit,
                    points: report
                        .orchards
                        .iter()
                        .map(|orchard| (impacted(&of(orchard), area), orchard.leaf_area_m2))
                        .collect(),
                })
                .collect();
            regressions(panel, title, &clouds)?;
        }
        root.present()?;
    }
    Ok(svg)
}

/// The areas of one view.
type View<'a> = &'a dyn Fn(&Orchard) -> ScanAreas;

/// One impacted area of all orchards.
struct Cloud<'a> {
    area: ImpactedArea,
    fit: Option<&'a Fit>,
    points: Vec<(f64, f64)>,
}

fn regressions(
    panel: &DrawingArea<SVGBackend<'_>, Shift>,
    title: &str,
    clouds: &[Cloud<'_>],
) -> Result<(), DrawError> {
    let greatest = |value: fn(&(f64, f64)) -> f64| {
        clouds.iter().flat_map(|cloud| &cloud.points).map(value).fold(1e-6, f64::max)
    };
    // Room above the clouds for the legend.
    let (right, top) = (1.06 * greatest(|point| point.0), 1.45 * greatest(|point| point.1));
    let mut chart = builder(panel, title).build_cartesian_2d(0.0..right, 0.0..top)?;
    axes(&mut chart, "impacted area I, m²", "leaf area L_A, m²")?;
    for Cloud { area, fit, points } in clouds {
        let ink = colour(*area);
        let furthest = points.iter().map(|point| point.0).fold(0.0, f64::max);
        if let Some(fit) = fit {
            let line = |x: f64| (x, fit.leaf_area_m2(x));
            let ours = ends(clipped(line, furthest, top));
            chart.draw_series([PathElement::new(ours, ink.stroke_width(2))])?;
            if let Some(paper) = fit.paper {
                let theirs = clipped(|x| (x, paper.leaf_area_m2(x)), right, top);
                chart.draw_series(dashes(&theirs, right, top, ink))?;
            }
        }
        let text = label(*area, *fit);
        let area = *area;
        chart
            .draw_series(points.iter().map(|point| mark(area, *point)))?
            .label(text)
            .legend(move |(x, y)| mark(area, (x + 10, y)));
    }
    legend(&mut chart)
}

/// The regression in words.
fn label(area: ImpactedArea, fit: Option<&Fit>) -> String {
    let Some(fit) = fit else { return symbol(area).to_owned() };
    let intercept = fit.intercept_m2.map_or_else(String::new, |m2| {
        if m2 < 0.0 { format!(" − {:.2}", -m2) } else { format!(" + {m2:.2}") }
    });
    let paper = fit.paper.map_or_else(String::new, |paper| format!("; paper, dashed: {:.2}", paper.slope));
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
fn dashes(path: &[(f64, f64)], right: f64, top: f64, ink: RGBColor) -> Vec<PathElement<(f64, f64)>> {
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
            drawn.push(PathElement::new(std::mem::take(&mut dash), ink.mix(0.8).stroke_width(1)));
        }
    }
    if dash.len() > 1 {
        drawn.push(PathElement::new(dash, ink.mix(0.8).stroke_width(1)));
    }
    drawn
}

/// The mark of an orchard, in the chart or in the legend.
fn mark<B: DrawingBackend, C: Clone + 'static>(area: ImpactedArea, at: C) -> DynElement<'static, B, C> {
    let ink = colour(area);
    match area {
        ImpactedArea::Leaf => Circle::new(at, 4, ink.filled()).into_dyn(),
        ImpactedArea::Total => TriangleMarker::new(at, 5, ink.filled()).into_dyn(),
        ImpactedArea::ThreeLeaves => Cross::new(at, 4, ink.stroke_width(2)).into_dyn(),
    }
}
