//! How far apart lines and beams may be: I_T at coarser advances against the finest, over orchards and random start offsets.
//!
//! Trees stand an irrational distance apart. Were their distance a multiple of an advance, every trunk would be met in the same phase, and what one line
//! more or less on a trunk does would be multiplied by the trees: an error of the layout and not of the advance. The sum over lines from a random start
//! has no bias, whatever the advance (Cavalieri's sampling); so the spread is what an advance is judged by, and the mean tells only how well it was
//! averaged.

use rowscan_scenes::scan::{ScanError, ScanPlan, ScanSettings, Target};
use rowscan_scenes::{Orchard, Scene};
use serde::{Deserialize, Serialize};

use super::{Header, Nursery, Study, Unit, UnitError, fingerprint};
use crate::archive::Depends;
use crate::notes::RowNotes;
use rowscan_protocol::random::Stream;

/// The advance every other is held against, millimetres: the paper's.
pub const REFERENCE_MM: u32 = 2;

/// Added to the scene's distance between trees, metres: a tenth of the golden ratio's fraction, which no advance in millimetres divides, nor
/// comes near to.
const IRRATIONAL_M: f64 = 0.061_803_398_874_989_49;
/// First word of the offsets' keys.
const OFFSET: u64 = 0x6f66_6673;

/// Advances and angles to compare, on so many orchards of a scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ResolutionStudy {
    /// Orchard and seed; each orchard's own seed follows.
    pub scene: Scene,
    /// How many orchards.
    pub orchards: usize,
    /// Distance between trees instead of the scene's, metres.
    pub tree_spacing_m: f64,
    /// Random start offsets an orchard and advance.
    pub offsets: usize,
    /// Advances from line to line, whole millimetres.
    pub dy_mm: Vec<u32>,
    /// Angles between beams, degrees.
    pub dtheta_deg: Vec<f64>,
    /// The scan; its advance and angle are replaced.
    pub scan: ScanSettings,
    /// The sensor stands farther off than its distance where the canopy would otherwise come nearer than this, metres.
    pub clearance_m: f64,
}

/// One orchard.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ResolutionUnit {
    /// Its own seed.
    pub seed: u64,
    /// True one-sided leaf area of the row, m².
    pub leaf_area_m2: f64,
    /// Metres of row.
    pub length_m: f64,
    /// One entry an angle, as the study lists them.
    pub angles: Vec<Angle>,
}

/// I_T at one angle between beams.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Angle {
    /// I_T at [`REFERENCE_MM`], m².
    pub reference_m2: f64,
    /// I_T, m²: by advance as the study lists them, then by start offset as drawn.
    pub total_m2: Vec<Vec<f64>>,
}

impl ResolutionStudy {
    /// The sweep of SCAN's table on a scene.
    pub fn new(scene: Scene) -> Self {
        let scan = super::lateral_of(&scene);
        Self {
            tree_spacing_m: scene.orchard.layout().tree_spacing_m + IRRATIONAL_M,
            offsets: 20,
            scene,
            orchards: 12,
            dy_mm: vec![2, 4, 5, 10, 20, 40, 50, 100, 200],
            dtheta_deg: vec![0.25, 0.5, 1.0],
            scan,
            clearance_m: 0.5,
        }
    }

    /// Distance of the lines that are cast: every advance is a multiple of it. Millimetres.
    fn base_mm(&self) -> u32 {
        self.dy_mm.iter().copied().fold(REFERENCE_MM, gcd).max(1)
    }

    /// Start offsets of an orchard at an advance, in lines that are cast; one where there is no other.
    fn offsets(&self, seed: u64, advance_mm: u32) -> Vec<usize> {
        let lines = (advance_mm / self.base_mm()).max(1);
        if lines == 1 {
            return vec![0];
        }
        let mut stream = Stream::keyed(seed, &[OFFSET, u64::from(advance_mm)]);
        (0..self.offsets).map(|_| (stream.unit() * f64::from(lines)) as usize).collect()
    }
}

impl Study for ResolutionStudy {
    const NAME: &'static str = "resolution";
    type Result = ResolutionUnit;

    fn units(&self) -> usize {
        self.orchards
    }

    fn scene(&self) -> &Scene {
        &self.scene
    }

    fn effort(&self, _: usize) -> f64 {
        1.0
    }

    fn depends(&self, index: usize) -> Option<Depends> {
        let seed = fingerprint::seed(Self::NAME, self.scene.seed, index);
        let one = Self { orchards: 1, scene: Scene { seed, ..self.scene.clone() }, ..self.clone() };
        Some(Depends::on_scene(&one.scene).and("settings", &one))
    }

    fn unit(
        &self,
        index: usize,
        _nursery: &Nursery,
        _notes: &mut RowNotes,
    ) -> Result<ResolutionUnit, UnitError> {
        let seed = fingerprint::seed(Self::NAME, self.scene.seed, index);
        let mut parameters = self.scene.orchard.clone();
        parameters.tree_spacing_m = Some(self.tree_spacing_m);
        let orchard = Orchard::grow(&parameters, seed, &|_, _| {})?;
        let target = Target::row(&orchard, 0).ok_or(ScanError::NothingThere { kind: self.scan.kind })?;
        let caster = self.scan.wood.caster(&orchard)?;
        let reach_m = target.extent.map_or(0.0, |extent| target.near_axis_x_m - extent.low[0]);
        let base_mm = self.base_mm();
        // Two lines at the least, wherever they begin.
        let needed_m = 2.0 * f64::from(self.dy_mm.iter().copied().max().unwrap_or(REFERENCE_MM)) / 1000.0;
        if orchard.length_m() < needed_m {
            return Err(UnitError::TooShort { length_m: orchard.length_m(), needed_m });
        }
        let angle = |dtheta_deg: f64| -> Result<Angle, UnitError> {
            let settings = ScanSettings {
                dy_m: f64::from(base_mm) / 1000.0,
                dtheta_deg,
                distance_m: self.scan.distance_m.max(reach_m + self.clearance_m),
                ..self.scan.clone()
            };
            let plan = ScanPlan::new(&target, &settings)?;
            let totals = plan.lines(caster.as_ref(), 1, |line| plan.line_areas(line.layers).total_m2);
            // Lines stand for the advance they are cast at; a coarser one counts every n-th line n-fold.
            let every = |mm: u32, offset: usize| {
                let step = (mm / base_mm) as usize;
                totals.iter().skip(offset).step_by(step).sum::<f64>() * step as f64
            };
            let reference_m2 = every(REFERENCE_MM, 0);
            if reference_m2 <= 0.0 {
                return Err(UnitError::SeesNothing { kind: settings.kind });
            }
            let started =
                |mm: u32| self.offsets(seed, mm).into_iter().map(|offset| every(mm, offset)).collect();
            Ok(Angle { reference_m2, total_m2: self.dy_mm.iter().map(|mm| started(*mm)).collect() })
        };
        Ok(ResolutionUnit {
            seed,
            leaf_area_m2: orchard.truth().leaf_area_m2,
            length_m: orchard.length_m(),
            angles: self.dtheta_deg.iter().map(|dtheta| angle(*dtheta)).collect::<Result<_, _>>()?,
        })
    }
}

/// What the study found.
#[derive(Clone, Debug, Serialize)]
pub struct ResolutionReport {
    /// Version, seed, scene, settings.
    pub provenance: Header<ResolutionStudy>,
    /// Advance of the reference, metres.
    pub reference_dy_m: f64,
    /// One row an angle and advance.
    pub rows: Vec<ResolutionRow>,
}

/// Error e = I_T / I_T(reference at the same angle) − 1, over orchards and start offsets.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct ResolutionRow {
    /// Advance from line to line, metres.
    pub dy_m: f64,
    /// Angle between beams, degrees.
    pub dtheta_deg: f64,
    /// Orchards times offsets.
    pub n: usize,
    /// Mean.
    pub error_mean: f64,
    /// Standard deviation.
    pub error_sd: f64,
    /// 95th percentile of |e| (nearest rank).
    pub error_p95_abs: f64,
    /// Standard deviation of the orchards' own means.
    pub error_orchard_sd: f64,
    /// Standard error of the mean, by the orchards' own means: no bias is to be seen within twice this.
    pub error_mean_se: f64,
    /// Mean error of this angle's reference against the finest angle's.
    pub dtheta_error_mean: f64,
}

/// Sums a whole study up.
pub fn report(provenance: Header<ResolutionStudy>, units: &[Unit<ResolutionUnit>]) -> ResolutionReport {
    let study = &provenance.settings;
    let finest =
        (0..study.dtheta_deg.len()).min_by(|a, b| study.dtheta_deg[*a].total_cmp(&study.dtheta_deg[*b]));
    let mut rows = Vec::new();
    for (at, dtheta_deg) in study.dtheta_deg.iter().enumerate() {
        let angles = || units.iter().filter_map(move |unit| unit.result.angles.get(at));
        let against_finest: Vec<f64> = units
            .iter()
            .filter_map(|unit| {
                let angles = &unit.result.angles;
                Some(angles.get(at)?.reference_m2 / angles.get(finest?)?.reference_m2 - 1.0)
            })
            .collect();
        for (column, dy_mm) in study.dy_mm.iter().enumerate() {
            let by_orchard: Vec<Vec<f64>> = angles()
                .filter_map(|angle| {
                    let totals = angle.total_m2.get(column)?;
                    Some(totals.iter().map(|total| total / angle.reference_m2 - 1.0).collect())
                })
                .collect();
            let means: Vec<f64> = by_orchard.iter().map(|errors| mean(errors)).collect();
            let errors = by_orchard.concat();
            rows.push(ResolutionRow {
                dy_m: f64::from(*dy_mm) / 1000.0,
                dtheta_deg: *dtheta_deg,
                n: errors.len(),
                error_mean: mean(&errors),
                error_sd: sd(&errors),
                error_p95_abs: p95_abs(&errors),
                error_orchard_sd: sd(&means),
                error_mean_se: sd(&means) / (means.len() as f64).sqrt(),
                dtheta_error_mean: mean(&against_finest),
            });
        }
    }
    ResolutionReport { provenance, reference_dy_m: f64::from(REFERENCE_MM) / 1000.0, rows }
}

fn mean(values: &[f64]) -> f64 {
    rowscan_canopy::regression::mean(values)
}

fn sd(values: &[f64]) -> f64 {
    let middle = mean(values);
    (values.iter().map(|v| (v - middle).powi(2)).sum::<f64>() / (values.len() as f64 - 1.0).max(1.0)).sqrt()
}

fn p95_abs(values: &[f64]) -> f64 {
    let mut sizes: Vec<f64> = values.iter().map(|v| v.abs()).collect();
    sizes.sort_unstable_by(f64::total_cmp);
    let rank = (0.95 * sizes.len() as f64).ceil() as usize;
    sizes.get(rank.saturating_sub(1)).copied().unwrap_or(f64::NAN)
}

fn gcd(a: u32, b: u32) -> u32 {
    if b == 0 { a } else { gcd(b, a % b) }
}
