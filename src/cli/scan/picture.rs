//! The returns of a scan drawn over the trees they came from.

use std::path::Path;

use clap::ValueEnum;
use rowscan_emulator::stage::Stage;
use rowscan_render::{Mark, Model};
use rowscan_scenes::caster::{Class, Return};
use rowscan_scenes::optics;
use rowscan_scenes::scan::{CastLine, ScanKind, ScanPlan};
use rowscan_study::figure::{self, Legend, Panel, colours};

use crate::cli::Failure;
use crate::cli::pictured::{self, Extent, From};

/// Radius of a return, metres.
const RETURN_M: f64 = 0.013;
/// How pale the trees are behind the returns.
const PALE: f64 = 0.72;

/// What the colour of a return says.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(super) enum ColourBy {
    /// Distance from the scanner
    #[default]
    Depth,
    /// How bright it is to an ideal scanner
    Remission,
    /// What the beam met
    Class,
}

/// A return as it is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Shot {
    at: [f64; 3],
    found: Return,
}

/// What the beams of a line met first, without the ground.
pub(super) fn of_line(plan: &ScanPlan, line: &CastLine<'_>) -> Vec<Shot> {
    let rays = plan.beams().rays(line.origin).zip(line.layers.nearest());
    let hits = rays.filter(|(_, found)| found.is_hit() && found.class != Class::Ground);
    let shot = |((start, direction), found): (([f64; 3], [f64; 3]), &Return)| Shot {
        at: std::array::from_fn(|axis| start[axis] + found.range_m * direction[axis]),
        found: *found,
    };
    hits.map(shot).collect()
}

/// The number behind a colour.
fn value(by: ColourBy, found: &Return) -> f64 {
    match by {
        ColourBy::Remission => 100.0 * f64::from(optics::remission(found)) / f64::from(u16::MAX),
        ColourBy::Depth | ColourBy::Class => found.range_m,
    }
}

/// Legend and colours of the returns.
fn coloured(by: ColourBy, shots: &[Shot]) -> (Legend, Vec<Mark>) {
    let mark = |shot: &Shot, rgb| Mark { at: shot.at, radius_m: RETURN_M, rgb };
    if by == ColourBy::Class {
        let met = Class::ALL.iter().filter(|class| shots.iter().any(|shot| shot.found.class == **class));
        let kinds = met.map(|class| (class.name().to_owned(), colours::of_class(*class))).collect();
        let marks = shots.iter().map(|shot| mark(shot, colours::of_class(shot.found.class)));
        return (Legend::Kinds(kinds), marks.collect());
    }
    let values = || shots.iter().map(|shot| value(by, &shot.found));
    let low = values().fold(f64::INFINITY, f64::min);
    let high = values().fold(low, f64::max);
    let (low, high) = if low.is_finite() { (low, high.max(low + 1e-6)) } else { (0.0, 1.0) };
    let name = match by {
        ColourBy::Remission => "remission, % of a white surface square to the beam",
        _ => "distance from the scanner, m",
    };
    let marks =
        shots.iter().map(|shot| mark(shot, colours::of_share((value(by, &shot.found) - low) / (high - low))));
    (Legend::Scale { name: name.to_owned(), low, high }, marks.collect())
}

/// Draws the returns and writes the picture.
pub(super) fn write(
    path: &Path,
    by: ColourBy,
    plan: &ScanPlan,
    stage: &Stage,
    shots: Vec<Shot>,
) -> Result<(), Failure> {
    let kind = plan.settings().kind;
    let from = match kind {
        ScanKind::Lateral | ScanKind::LateralOrthogonal => From::Near,
        ScanKind::Opposite | ScanKind::OppositeOrthogonal => From::Far,
        ScanKind::Zenith | ScanKind::ZenithOrthogonal => From::Above,
    };
    let (key, marks) = coloured(by, &shots);
    let model = Model::of(&stage.orchard, usize::MAX)?.with_marks(marks);
    let extent = Extent::of(&model, from);
    let panel = Panel {
        title: format!("{}, {kind} scan: {} returns, ground left out", stage.scene.name, shots.len()),
        along_m: extent.along_m,
        up_m: extent.up_m,
        up_name: if from == From::Above { "across, m" } else { "height, m" },
    };
    let sheet = figure::scanned(&panel, &key);
    let picture = pictured::window(&model, &sheet, &extent, from, PALE)?;
    pictured::write(path, &sheet, &picture)
}
