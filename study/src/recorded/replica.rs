//! The scene of a recording rebuilt: a panel a beam at its mean range, edges where they were fitted; and what a model's eye sees of it.

use rowscan_protocol::model::AnyModel;
use rowscan_protocol::scan::Pose;
use rowscan_scenes::optics::{Eye, EyeModel, OpticsSettings, RangeLimits, Stages};
use rowscan_scenes::{BeamFan, Caster, Leaf, Orchard};

use super::Series;
use super::edges::{Edge, edges};

/// The scanner stands so high that no beam below 60 m sees the ground, metres.
const HEIGHT_M: f64 = 100.0;
/// Panels reach so far to either side of the scan plane, metres.
const HALF_M: f64 = 0.5;
/// Beams on either side whose mean stands for a panel: the recording's own noise must not be in the scene.
const SMOOTHED: usize = 3;

/// As many scans of the same scene as were recorded.
pub(super) fn seen(series: &Series, model: AnyModel, seed: u64) -> Series {
    let panels = panels(series, &edges(series, &model.optics().spot));
    let caster = Caster::new(&Orchard::from_organs(panels, Vec::new(), f64::INFINITY));
    let (min_range_m, max_range_m) = model.range_m();
    let limits = RangeLimits { min_range_m, max_range_m };
    let eye_model = EyeModel { optics: model.optics(), echoes: model.echoes(), limits };
    let settings =
        OpticsSettings { stages: Stages::device(), reference_range_m: 1.0, ..OpticsSettings::default() };
    let mut eye = Eye::new(eye_model, &settings, seed, 0);
    let start_deg = series.angles_deg.first().copied().unwrap_or(0.0);
    let step_deg = series.angles_deg.get(1).map_or(0.0, |next| next - start_deg);
    let fan = BeamFan::from_degrees(start_deg, step_deg, series.angles_deg.len());
    eye.turn_to(&fan, true);
    let origin = Pose { x_m: 0.0, y_m: 0.0, z_m: HEIGHT_M };
    let mut found = Series { angles_deg: series.angles_deg.clone(), scans_mm: Vec::new() };
    let (mut range_mm, mut remission) = (Vec::new(), Vec::new());
    for scan in 0..series.scans_mm.len() {
        eye.look(&caster, origin, 0.0, scan as u64);
        eye.write(0, &mut range_mm, &mut remission);
        let mm = |mm: &u16| if *mm == 0 { f64::NAN } else { f64::from(*mm) };
        found.scans_mm.push(range_mm.iter().map(mm).collect());
    }
    found
}

/// A panel for every beam that measured in every scan; ramps are replaced by the two surfaces and the edge between them.
fn panels(series: &Series, edges: &[Edge]) -> Vec<Leaf> {
    let means_mm = series.means_mm();
    let step_deg = match series.angles_deg.get(..2) {
        Some([first, second]) => (second - first).abs(),
        _ => return Vec::new(),
    };
    let ramp = |beam: usize| edges.iter().find(|edge| beam > edge.ends.0 && beam < edge.ends.1);
    let mut panels = Vec::new();
    for (beam, angle_deg) in series.angles_deg.iter().enumerate() {
        if ramp(beam).is_some() {
            continue;
        }
        let Some(range_mm) = smoothed(&means_mm, edges, beam) else { continue };
        let mut ends_deg = [angle_deg - step_deg / 2.0, angle_deg + step_deg / 2.0];
        for edge in edges {
            // A surface that ends at an edge reaches to it; the far one goes on behind the near one.
            let past_deg = 2.0 * step_deg;
            if beam == edge.ends.0 {
                ends_deg[1] = edge.angle_deg + if edge.near_first { 0.0 } else { past_deg };
            } else if beam == edge.ends.1 {
                ends_deg[0] = edge.angle_deg - if edge.near_first { past_deg } else { 0.0 };
            }
        }
        panels.extend(panel(ends_deg, 1e-3 * range_mm));
    }
    panels
}

/// The mean of the neighbours on the same surface.
fn smoothed(means_mm: &[f64], edges: &[Edge], beam: usize) -> Option<f64> {
    let own_mm = means_mm.get(beam).copied().filter(|mm| mm.is_finite())?;
    let apart =
        |a: usize, b: usize| edges.iter().any(|edge| a.min(b) <= edge.ends.0 && a.max(b) > edge.ends.0);
    // In pairs, so that a slanted surface stays where it is.
    let pair = |k: usize| {
        let (before, after) = (beam.checked_sub(k)?, beam + k);
        let mean_mm = f64::midpoint(*means_mm.get(before)?, *means_mm.get(after)?);
        let same = (mean_mm - own_mm).abs() < 0.02 * own_mm && !apart(before, after);
        (same && mean_mm.is_finite()).then_some(mean_mm)
    };
    let pairs: Vec<f64> = (1..=SMOOTHED).map_while(pair).collect();
    Some((own_mm + 2.0 * pairs.iter().sum::<f64>()) / (1.0 + 2.0 * pairs.len() as f64))
}

/// A flat piece of surface across the scan plane, all its middle line at about this range.
fn panel([from_deg, to_deg]: [f64; 2], range_m: f64) -> Option<Leaf> {
    let at = |degrees: f64, y_m: f64| {
        let (sin, cos) = degrees.to_radians().sin_cos();
        [range_m * cos, y_m, HEIGHT_M + range_m * sin]
    };
    let corners = [at(from_deg, -HALF_M), at(to_deg, -HALF_M), at(to_deg, HALF_M), at(from_deg, HALF_M)];
    Leaf::new(corners).ok()
}
