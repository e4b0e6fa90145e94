//! How far apart lines and beams may be: I_T at coarser advances against the finest, over orchards and start offsets.

use rowscan_scenes::scan::{ScanError, ScanPlan, ScanSettings, Target};
use rowscan_scenes::{Orchard, Scene};
use serde::{Deserialize, Serialize};

use super::{Header, Study, Unit, UnitError, fingerprint};

/// The advance every other is held against, millimetres: the paper's.
pub const REFERENCE_MM: u32 = 2;

/// Advances and angles to compare, on so many orchards of a scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ResolutionStudy {
    /// Orchard and seed; each orchard's own seed follows.
    pub scene: Scene,
    /// How many orchards.
    pub orchards: usize,
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
    /// Metres of row compared.
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
    /// I_T, m²: by advance as the study lists them, then by start offset.
    pub total_m2: Vec<Vec<f64>>,
}

impl ResolutionStudy {
    /// The sweep of SCAN's table on a scene.
    pub fn new(scene: Scene) -> Self {
        let scan = super::lateral_of(&scene);
        Self {
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

    /// All advances fit into this a whole number of times, millimetres.
    fn common_mm(&self) -> u64 {
        self.dy_mm.iter().map(|dy| u64::from(*dy)).fold(u64::from(REFERENCE_MM), lcm)
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

    fn unit(&self, index: usize) -> Result<ResolutionUnit, UnitError> {
        let seed = fingerprint::seed(Self::NAME, self.scene.seed, index);
        let orchard = Orchard::grow(&self.scene.orchard, seed, &|_, _| {})?;
        let target = Target::row(&orchard, 0).ok_or(ScanError::NothingThere { kind: self.scan.kind })?;
        let caster = self.scan.wood.caster(&orchard)?;
        let reach_m = target.extent.map_or(0.0, |extent| target.near_axis_x_m - extent.low[0]);
        let base_mm = self.base_mm();
        let row_mm = (orchard.length_m() * 1000.0 + 1e-6).floor() as u64;
        let length_mm = row_mm / self.common_mm() * self.common_mm();
        if length_mm == 0 {
            let needed_m = self.common_mm() as f64 / 1000.0;
            return Err(UnitError::TooShort { length_m: orchard.length_m(), needed_m });
        }
        let lines = (length_mm / u64::from(base_mm)) as usize;
        let angle = |dtheta_deg: f64| -> Result<Angle, UnitError> {
            let settings = ScanSettings {
                dy_m: f64::from(base_mm) / 1000.0,
                dtheta_deg,
                distance_m: self.scan.distance_m.max(reach_m + self.clearance_m),
                ..self.scan.clone()
            };
            let plan = ScanPlan::new(&target, &settings)?;
            let mut totals = plan.lines(caster.as_ref(), 1, |line| plan.line_areas(line.layers).total_m2);
            totals.truncate(lines);
            // Lines stand for the advance they are cast at; a coarser one counts every n-th line n-fold.
            let every = |mm: u32, offset: usize| {
                let step = (mm / base_mm) as usize;
                totals.iter().skip(offset).step_by(step).sum::<f64>() * step as f64
            };
            let reference_m2 = every(REFERENCE_MM, 0);
            if reference_m2 <= 0.0 {
                return Err(UnitError::SeesNothing { kind: settings.kind });
            }
            let offsets =
                |mm: u32| (0..(mm / base_mm) as usize).map(move |offset| every(mm, offset)).collect();
            Ok(Angle { reference_m2, total_m2: self.dy_mm.iter().map(|mm| offsets(*mm)).collect() })
        };
        Ok(ResolutionUnit {
            seed,
            leaf_area_m2: orchard.truth().leaf_area_m2,
            length_m: length_mm as f64 / 1000.0,
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
    /// Standard deviation of the orchards' own means: what the mean's error is judged by.
    pub error_orchard_sd: f64,
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

fn lcm(a: u64, b: u64) -> u64 {
    let greatest = |mut a: u64, mut b: u64| {
        while b != 0 {
            (a, b) = (b, a % b);
        }
        a
    };
    a.saturating_mul(b) / greatest(a, b).max(1)
}
