//! A scan laid out: every line's origin, its beams, and the area each beam stands for.

use rayon::prelude::*;
use rowscan_protocol::scan::Pose;
use serde::{Deserialize, Serialize};

use super::kind::{Sampling, ScanKind};
use super::target::{Extent, Target};
use super::wood::{Casts, WoodTest};
use crate::angle::cos_sin_deg;
use crate::caster::{BeamFan, Beams, Class, Layers, ParallelBeams, Return, Scratch};

/// Most lines, and most beams of a line, that a scan may have.
const MOST: f64 = 10_000_000.0;

/// How a target is scanned. Lengths in metres, angles in degrees.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ScanSettings {
    /// Which of the six types.
    pub kind: ScanKind,
    /// Advance from line to line (Δy).
    pub dy_m: f64,
    /// Angle between beams of an angular scan (Δθ, Δφ).
    pub dtheta_deg: f64,
    /// Distance between beams of an orthogonal scan (Δz, Δx).
    pub pitch_m: f64,
    /// Where in its cell a sample is taken, along the row and, for angular scans, across. Orthogonal beams stand in their cells' middles
    /// either way, so that a full wall gives its exact area.
    pub sampling: Sampling,
    /// Distance of a lateral sensor from the axis of the row it faces (D).
    pub distance_m: f64,
    /// Height of a lateral angular sensor (z0).
    pub height_m: f64,
    /// Height of a zenith sensor (Zs); 2 m above the highest leaf or branch where absent.
    pub overhead_m: Option<f64>,
    /// First and last value of what is swept (θ or φ in degrees, z in metres, or x from the axis); from the canopy where absent.
    pub range: Option<(f64, f64)>,
    /// How wood is found; [`WoodTest::caster`] makes the caster that does so.
    #[serde(default)]
    pub wood: WoodTest,
}

impl Default for ScanSettings {
    /// The paper's Δy and Δθ; distance and heights, which it does not give, for 5 m rows.
    fn default() -> Self {
        Self {
            kind: ScanKind::Lateral,
            dy_m: 0.002,
            dtheta_deg: 0.25,
            pitch_m: 0.002,
            sampling: Sampling::Start,
            distance_m: 2.5,
            height_m: 1.6,
            overhead_m: None,
            range: None,
            wood: WoodTest::Exact,
        }
    }
}

/// Why a scan cannot be laid out.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ScanError {
    /// A number that must be positive is not.
    #[error("{key} must be a positive number, found {found}")]
    NotPositive {
        /// Which.
        key: &'static str,
        /// What it is.
        found: f64,
    },
    /// First and last value do not make a range.
    #[error("the range must be two numbers, the lower first{limits}, found {from}..{to}")]
    Range {
        /// What the type of scan allows.
        limits: &'static str,
        /// Lower.
        from: f64,
        /// Upper.
        to: f64,
    },
    /// Seen from the sensor the target has no width.
    #[error(
        "seen by a {kind} scan the target has no width, from {from} to {to}; say with --range what is to be swept"
    )]
    NoWidth {
        /// The type of scan.
        kind: ScanKind,
        /// Lower.
        from: f64,
        /// Upper.
        to: f64,
    },
    /// So many lines or beams that no scan would end.
    #[error("{key} gives {found:.0} {what}; at most {MOST:.0} are cast")]
    TooMany {
        /// The setting to blame.
        key: &'static str,
        /// Lines or beams.
        what: &'static str,
        /// How many.
        found: f64,
    },
    /// No leaf and no branch: there is nothing to aim at.
    #[error("there is neither leaf nor wood to scan, so the {kind} scan would see nothing")]
    NothingThere {
        /// The type of scan.
        kind: ScanKind,
    },
    /// The sensor would pass through leaves or wood.
    #[error(
        "the sensor would pass inside a tree: leaves or wood reach {reach_m:.3} m {towards}, the sensor stands at {found_m} m; raise {key}"
    )]
    InsideTree {
        /// The setting to raise.
        key: &'static str,
        /// From the axis, or up.
        towards: &'static str,
        /// How far the canopy reaches.
        reach_m: f64,
        /// Where the sensor is.
        found_m: f64,
    },
}

/// One cast line, as [`ScanPlan::lines`] hands it out.
#[derive(Clone, Copy, Debug)]
pub struct CastLine<'a> {
    /// Number of the line, from 0.
    pub index: usize,
    /// Where it was cast from.
    pub origin: Pose,
    /// What its beams met.
    pub layers: &'a Layers,
}

/// A scan laid out over a target.
#[derive(Clone, Debug)]
pub struct ScanPlan {
    settings: ScanSettings,
    target: Target,
    origin: Pose,
    length_m: f64,
    lines: usize,
    beams: Beams,
    /// Value of what is swept at beam 0: degrees or metres.
    first: f64,
    /// Area a beam stands for: times its range for angular scans, as it is for orthogonal ones. m.
    widths: Vec<f64>,
}

impl ScanPlan {
    /// Lays a scan out: beams over all of the target, lines over one period of it (or its length, where it does not repeat).
    ///
    /// # Errors
    /// Steps or distances that are not positive, a range without sense, nothing to scan, a sensor within the canopy.
    pub fn new(target: &Target, settings: &ScanSettings) -> Result<Self, ScanError> {
        let kind = settings.kind;
        let swept_key =
            if kind.is_angular() { "the angle between beams" } else { "the distance between beams" };
        let step = if kind.is_angular() { settings.dtheta_deg } else { settings.pitch_m };
        positive("the advance between lines", settings.dy_m)?;
        positive(swept_key, step)?;
        if !kind.is_zenith() {
            positive("the sensor's distance", settings.distance_m)?;
            positive("the sensor's height", settings.height_m)?;
        }
        let extent = target.extent.ok_or(ScanError::NothingThere { kind })?;
        let station = Station::of(target, &extent, settings)?;
        let (from, to) = station.range(kind, settings.range)?;
        let cells = if kind.is_angular() {
            // Both ends are beams: the paper sweeps from θ_min to θ_max.
            ((to - from) / step + 1e-9).floor() + 1.0
        } else {
            ((to - from) / step - 1e-9).ceil().max(1.0)
        };
        few_enough(swept_key, "beams a line", cells)?;
        let (start_m, length_m) = if target.period_m.is_finite() {
            (0.0, target.period_m)
        } else {
            (extent.low[1], extent.high[1] - extent.low[1])
        };
        let lines = (length_m / settings.dy_m + 1e-9).floor().max(1.0);
        few_enough("the advance between lines", "lines", lines)?;
        let middle = if settings.sampling == Sampling::Centre { 0.5 } else { 0.0 };
        let first = from + step * if kind.is_angular() { middle } else { 0.5 };
        let count = cells as usize;
        let beams = beams(kind, first, step, count);
        let widths = (0..count)
            .map(|j| match (kind.is_angular(), settings.sampling) {
                (false, _) => step,
                (true, Sampling::Start) => {
                    let sin = |j: usize| cos_sin_deg(first + j as f64 * step).1;
                    sin(j + 1) - sin(j)
                }
                (true, Sampling::Centre) => {
                    2.0 * cos_sin_deg(step / 2.0).1 * cos_sin_deg(first + j as f64 * step).0
                }
            })
            .collect();
        Ok(Self {
            settings: settings.clone(),
            target: target.clone(),
            origin: Pose { x_m: station.x_m, y_m: start_m + settings.dy_m * middle, z_m: station.z_m(kind) },
            length_m,
            lines: lines as usize,
            beams,
            first,
            widths,
        })
    }

    /// The settings it was made with.
    pub fn settings(&self) -> &ScanSettings {
        &self.settings
    }

    /// What its lines leave of the target's length, metres: less than a line, in no area.
    pub fn left_over_m(&self) -> f64 {
        (self.length_m - self.settings.dy_m * self.lines as f64).max(0.0)
    }

    /// Length of the target along the row, metres.
    pub fn length_m(&self) -> f64 {
        self.length_m
    }

    /// What it scans.
    pub fn target(&self) -> &Target {
        &self.target
    }

    /// Number of lines (M steps of the paper).
    pub fn len(&self) -> usize {
        self.lines
    }

    /// True if there is no line; never the case.
    pub fn is_empty(&self) -> bool {
        self.lines == 0
    }

    /// Beams of a line (N of the paper).
    pub fn beams(&self) -> &Beams {
        &self.beams
    }

    /// What is swept at beam `j`: θ or φ in degrees, z in metres, or x in metres of the scene frame.
    pub fn swept(&self, j: usize) -> f64 {
        let step =
            if self.settings.kind.is_angular() { self.settings.dtheta_deg } else { self.settings.pitch_m };
        self.first + j as f64 * step
    }

    /// Where line `index` is cast from; beams of orthogonal scans start from there along Z or X.
    pub fn origin(&self, index: usize) -> Pose {
        Pose { y_m: self.origin.y_m + index as f64 * self.settings.dy_m, ..self.origin }
    }

    /// Projected area, m², that beam `j` stands for when it comes back from `range_m`: eq. (3), Δy · l · (sin(θ + Δθ) − sin θ), or its
    /// midpoint form Δy · l · 2 sin(Δθ/2) cos θ for samples in the middle; Δy · Δz or Δy · Δx for orthogonal scans.
    pub fn patch_m2(&self, j: usize, range_m: f64) -> f64 {
        let width = self.widths.get(j).copied().unwrap_or(0.0);
        self.settings.dy_m * width * if self.settings.kind.is_angular() { range_m } else { 1.0 }
    }

    /// Area, m², that a beam covers at right angles to itself at `range_m`: Δy · l · Δθ, or Δy · Δz.
    pub fn square_patch_m2(&self, range_m: f64) -> f64 {
        let Self { settings, .. } = self;
        if settings.kind.is_angular() {
            settings.dy_m * range_m * settings.dtheta_deg.to_radians()
        } else {
            settings.dy_m * settings.pitch_m
        }
    }

    /// True if a return is a leaf or a branch of the target.
    pub fn counts(&self, found: &Return) -> bool {
        matches!(found.class, Class::Leaf | Class::Wood) && self.target.trees.contains(&found.tree)
    }

    /// Casts every line and measures it, lines in order whatever the number of threads. `layers` leaves a beam are kept.
    pub fn lines<T: Send>(
        &self,
        caster: &dyn Casts,
        layers: usize,
        measure: impl Fn(CastLine<'_>) -> T + Sync,
    ) -> Vec<T> {
        (0..self.lines)
            .into_par_iter()
            .with_min_len(16)
            .map_init(<(Scratch, Layers)>::default, |(scratch, found), index| {
                let origin = self.origin(index);
                caster.cast_layers(origin, &self.beams, layers, scratch, found);
                measure(CastLine { index, origin, layers: found })
            })
            .collect()
    }
}

/// Where the sensor stands across the row, and the box it looks at from there.
struct Station {
    x_m: f64,
    height_m: f64,
    /// From the sensor, along its gaze: nearest and farthest of the canopy. For zenith scans, the canopy's X.
    near_m: f64,
    far_m: f64,
    top_m: f64,
}

impl Station {
    fn of(target: &Target, extent: &Extent, settings: &ScanSettings) -> Result<Self, ScanError> {
        let ([low_x, _, _], [high_x, _, top_m]) = (extent.low, extent.high);
        let lateral = |x_m: f64, near_m: f64, far_m: f64, reach_m: f64| {
            if near_m > 0.0 {
                Ok(Self { x_m, height_m: settings.height_m, near_m, far_m, top_m })
            } else {
                let (key, towards) = ("the sensor's distance", "from the row's axis");
                Err(ScanError::InsideTree { key, towards, reach_m, found_m: settings.distance_m })
            }
        };
        match settings.kind {
            ScanKind::Lateral | ScanKind::LateralOrthogonal => {
                let x_m = target.near_axis_x_m - settings.distance_m;
                lateral(x_m, low_x - x_m, high_x - x_m, target.near_axis_x_m - low_x)
            }
            ScanKind::Opposite | ScanKind::OppositeOrthogonal => {
                let x_m = target.far_axis_x_m + settings.distance_m;
                lateral(x_m, x_m - high_x, x_m - low_x, high_x - target.far_axis_x_m)
            }
            ScanKind::Zenith | ScanKind::ZenithOrthogonal => {
                let height_m = settings.overhead_m.unwrap_or(top_m + 2.0);
                positive("the height overhead", height_m)?;
                if height_m <= top_m {
                    let (key, towards) = ("the height overhead", "up");
                    return Err(ScanError::InsideTree { key, towards, reach_m: top_m, found_m: height_m });
                }
                let x_m = (target.near_axis_x_m + target.far_axis_x_m) / 2.0;
                Ok(Self { x_m, height_m, near_m: low_x - x_m, far_m: high_x - x_m, top_m })
            }
        }
    }

    /// Z of a line's origin: level beams count their heights from the ground.
    fn z_m(&self, kind: ScanKind) -> f64 {
        match kind {
            ScanKind::LateralOrthogonal | ScanKind::OppositeOrthogonal => 0.0,
            _ => self.height_m,
        }
    }

    /// First and last value of what is swept, so that nothing of the canopy above the ground is missed.
    fn range(&self, kind: ScanKind, asked: Option<(f64, f64)>) -> Result<(f64, f64), ScanError> {
        let Self { height_m, near_m, far_m, top_m, .. } = *self;
        let (range, limits, (least, greatest)) = match kind {
            ScanKind::Lateral | ScanKind::Opposite => {
                let above_m = top_m - height_m;
                let up_deg = libm::atan2(above_m, if above_m > 0.0 { near_m } else { far_m }).to_degrees();
                let down_deg = libm::atan2(-height_m, near_m).to_degrees();
                ((down_deg, up_deg), " and both from -90 to 90", (-90.0, 90.0))
            }
            ScanKind::Zenith => {
                // The flanks are widest at the top for what lies on their side of the sensor, at the ground for what does not.
                let flank_deg = |x_m: f64, outwards: bool| {
                    let drop_m = if outwards { height_m - top_m } else { height_m };
                    libm::atan2(x_m, drop_m).to_degrees()
                };
                let range = (flank_deg(near_m, near_m < 0.0), flank_deg(far_m, far_m > 0.0));
                (range, " and both from -90 to 90", (-90.0, 90.0))
            }
            ScanKind::LateralOrthogonal | ScanKind::OppositeOrthogonal => {
                ((0.0, top_m), "", (f64::NEG_INFINITY, f64::INFINITY))
            }
            ScanKind::ZenithOrthogonal => ((near_m, far_m), "", (f64::NEG_INFINITY, f64::INFINITY)),
        };
        let (from, to) = asked.unwrap_or(range);
        if from.is_finite() && to.is_finite() && least <= from && from < to && to <= greatest {
            Ok((from, to))
        } else if asked.is_none() {
            Err(ScanError::NoWidth { kind, from, to })
        } else {
            Err(ScanError::Range { limits, from, to })
        }
    }
}

/// The beams; `first` and `step` in degrees or metres, of what is swept.
fn beams(kind: ScanKind, first: f64, step: f64, count: usize) -> Beams {
    match kind {
        ScanKind::Lateral => BeamFan::from_degrees(first, step, count).into(),
        ScanKind::Opposite => BeamFan::from_degrees(180.0 - first, -step, count).into(),
        ScanKind::Zenith => BeamFan::from_degrees(first - 90.0, step, count).into(),
        ScanKind::LateralOrthogonal => ParallelBeams::lateral(first, step, count).into(),
        ScanKind::OppositeOrthogonal => ParallelBeams::opposite(first, step, count).into(),
        ScanKind::ZenithOrthogonal => ParallelBeams::zenith(first, step, count).into(),
    }
}

fn positive(key: &'static str, found: f64) -> Result<(), ScanError> {
    if found.is_finite() && found > 0.0 { Ok(()) } else { Err(ScanError::NotPositive { key, found }) }
}

fn few_enough(key: &'static str, what: &'static str, found: f64) -> Result<(), ScanError> {
    if found <= MOST { Ok(()) } else { Err(ScanError::TooMany { key, what, found }) }
}
