//! What each thing that a real beam does does to the measures: one stage of the eye at a time, then all of them, against the thin beam on the same row.

use rayon::prelude::*;
use rowscan_canopy::estimator::by_name;
use rowscan_canopy::{Estimate, Quantity};
use rowscan_emulator::stage::Stage as Set;
use rowscan_protocol::model::AnyModel;
use rowscan_protocol::scan::NO_ECHO;
use rowscan_scenes::Scene;
use rowscan_scenes::caster::Class;
use rowscan_scenes::optics::{Stage, Stages};
use serde::{Deserialize, Serialize};

use crate::appraisal::Appraisal;
use crate::archive::{Archive, Depends};
use crate::eye::{placed, spot_left_in};
use crate::moments;
use crate::reading::{CalibrationChoice, Reading, rig_with};
use crate::trial::{StartUpRequests, TrialError, each_scan_met};

/// A number that a scan of a row gives.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Output {
    /// I_T as measured, m².
    ImpactedTotal,
    /// I_T of the beams whose echo is mostly a leaf's, m²; unknown where the scanner sends other beams than it casts.
    ImpactedLeaf,
    /// Leaf area by contact frequency, the spot left in, m².
    Contact,
    /// Leaf area by gap fraction, the spot left in, m².
    Gap,
    /// Height, metres.
    Height,
    /// Width, metres.
    Width,
    /// Volume, m³.
    Volume,
    /// Tree row volume, m³/ha.
    TreeRowVolume,
    /// Leaf wall area, m²/ha.
    LeafWallArea,
    /// What an estimate calls the leaf area, m²: the spot taken out, calibrated where the rig names a calibration.
    LeafArea,
    /// Leaf area index, by that leaf area.
    Lai,
}

impl Output {
    /// All of them, in the order of the table.
    pub const ALL: [Self; 11] = [
        Self::ImpactedTotal,
        Self::ImpactedLeaf,
        Self::Contact,
        Self::Gap,
        Self::Height,
        Self::Width,
        Self::Volume,
        Self::TreeRowVolume,
        Self::LeafWallArea,
        Self::LeafArea,
        Self::Lai,
    ];

    /// Its name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::ImpactedTotal => "I_T",
            Self::ImpactedLeaf => "I_L",
            Self::Contact => "contact",
            Self::Gap => "gap",
            Self::Height => "height",
            Self::Width => "width",
            Self::Volume => "volume",
            Self::TreeRowVolume => "TRV",
            Self::LeafWallArea => "LWA",
            Self::LeafArea => "leaf area",
            Self::Lai => "LAI",
        }
    }

    /// What it should have been; impacted areas have no truth but the thin beam's.
    fn truth(self) -> Option<Quantity> {
        match self {
            Self::ImpactedTotal | Self::ImpactedLeaf => None,
            Self::Contact | Self::Gap | Self::LeafArea => Some(Quantity::LeafArea),
            Self::Height => Some(Quantity::Height),
            Self::Width => Some(Quantity::Width),
            Self::Volume => Some(Quantity::Volume),
            Self::TreeRowVolume => Some(Quantity::TreeRowVolume),
            Self::LeafWallArea => Some(Quantity::LeafWallArea),
            Self::Lai => Some(Quantity::Lai),
        }
    }
}

/// What is tried.
#[derive(Clone, Debug)]
pub struct Physics {
    /// The scene; its optics' stages are what varies.
    pub scene: Scene,
    /// Rows.
    pub seeds: Vec<u64>,
    /// Scanners.
    pub models: Vec<AnyModel>,
    /// From the mirror to the row plane, metres.
    pub distances_m: Vec<f64>,
}

/// One output under some stages.
#[derive(Clone, Debug, Serialize)]
pub struct Effect {
    /// The scene.
    pub scene: String,
    /// The scanner.
    pub model: &'static str,
    /// From the mirror to the row plane, metres.
    pub distance_m: f64,
    /// The stages that were on.
    pub stages: String,
    /// The number.
    pub output: Output,
    /// Rows that have it.
    pub n: usize,
    /// Its mean.
    pub mean: f64,
    /// Mean of value / the thin beam's value − 1, over rows.
    pub change: Option<f64>,
    /// Standard deviation of that.
    pub change_sd: Option<f64>,
    /// Mean of value / truth − 1.
    pub error: Option<f64>,
    /// Standard deviation of that.
    pub error_sd: Option<f64>,
}

/// Rays first, each stage alone, spot and echoes together (echoes have nothing to blend without a spot), everything last.
pub fn ladder() -> Vec<Stages> {
    let alone = Stage::TABLE.iter().map(|line| Stages::IDEAL.with(line.stage));
    let blended = Stages::IDEAL.with(Stage::Spot).with(Stage::Echoes);
    std::iter::once(Stages::IDEAL).chain(alone).chain([blended, Stages::device()]).collect()
}

/// A row's numbers under one rung of the ladder.
type Values = Vec<Option<f64>>;

/// Tries everything; `done` hears of every row that is through.
///
/// # Errors
/// The first row that could not be tried.
pub fn physics(
    asked: &Physics,
    archive: &Archive,
    done: &(dyn Fn() + Sync),
) -> Result<Vec<Effect>, TrialError> {
    let places: Vec<(AnyModel, f64)> = asked
        .models
        .iter()
        .flat_map(|model| asked.distances_m.iter().map(|distance_m| (*model, *distance_m)))
        .collect();
    let tries: Vec<(AnyModel, f64, u64)> = places
        .iter()
        .flat_map(|(model, distance_m)| asked.seeds.iter().map(|seed| (*model, *distance_m, *seed)))
        .collect();
    let rows: Vec<TriedRow> = tries
        .par_iter()
        .map(|(model, distance_m, seed)| {
            let scene = placed(&asked.scene, *model, *distance_m, *seed);
            let depends = || Some(Depends::on_pass(&scene, model.name()));
            let row = archive.row("physics", depends, |_| TriedRow::of(scene.clone(), *model));
            done();
            row
        })
        .collect::<Result<_, _>>()?;
    let mut effects = Vec::new();
    for ((model, distance_m), rows) in places.iter().zip(rows.chunks(asked.seeds.len().max(1))) {
        for (rung, stages) in ladder().iter().enumerate() {
            for (at, output) in Output::ALL.into_iter().enumerate() {
                let of = |row: &TriedRow, rung: usize| *row.rungs.get(rung)?.get(at)?;
                let known: Vec<f64> = rows.iter().filter_map(|row| of(row, rung)).collect();
                let against = |base: &dyn Fn(&TriedRow) -> Option<f64>| {
                    let ratio = |row: &TriedRow| Some(of(row, rung)? / base(row).filter(|b| *b > 0.0)? - 1.0);
                    let ratios: Vec<f64> = rows.iter().filter_map(ratio).collect();
                    (!ratios.is_empty()).then(|| moments(&ratios))
                };
                let change = against(&|row| of(row, 0));
                let error = against(&|row| *row.truths.get(at)?);
                effects.push(Effect {
                    scene: asked.scene.name.clone(),
                    model: model.name(),
                    distance_m: *distance_m,
                    stages: stages.to_string(),
                    output,
                    n: known.len(),
                    mean: moments(&known).0,
                    change: change.map(|(mean, _)| mean),
                    change_sd: change.and_then(|(_, sd)| sd),
                    error: error.map(|(mean, _)| mean),
                    error_sd: error.and_then(|(_, sd)| sd),
                });
            }
        }
    }
    Ok(effects)
}

/// One row before one scanner at one distance.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
struct TriedRow {
    /// By rung, then by output.
    rungs: Vec<Values>,
    truths: Values,
}

impl TriedRow {
    fn of(scene: Scene, model: AnyModel) -> Result<Self, TrialError> {
        let mut set = Set::grow(scene, &|_, _| {})?;
        let mount = set.rig.scanners.first().cloned().unwrap_or_default();
        let appraisal = Appraisal::of((&set.orchard, set.row_seen(0)), &mount, set.rig.ground_clearance_m);
        let start_m = set.rig.start_m;
        let row = appraisal.stretch(start_m, start_m + set.orchard.length_m());
        let truth = |output: Output| output.truth().and_then(|quantity| row.value(quantity, None));
        let truths = Output::ALL.into_iter().map(truth).collect();
        let mut rungs = Vec::new();
        for stages in ladder() {
            let mut scene = set.scene.clone();
            scene.optics.stages = stages;
            set = set.with_scene(scene);
            rungs.push(values(&set, model)?);
        }
        Ok(Self { rungs, truths })
    }
}

/// One pass under the stage's optics.
fn values(set: &Set, model: AnyModel) -> Result<Values, TrialError> {
    let rig = rig_with(&set.rig, 0, model.name());
    let reading = Reading::of(Some(&rig), 0, true, CalibrationChoice::OfRig)?;
    let asked = StartUpRequests { cola: reading.cola, lms2xx: reading.lms2xx };
    let shapes: Vec<_> =
        ["gap", "height", "width", "volume", "trv", "lwa"].into_iter().filter_map(by_name).collect();
    let mut raw = spot_left_in(&rig)?.with_estimators(&shapes);
    let mut leaves = spot_left_in(&rig)?;
    let mut corrected = reading.pipeline;
    let mut told_apart = true;
    each_scan_met(set, model, asked, &mut |scan, met| {
        raw.push(scan);
        corrected.push(scan);
        let mut scan = scan.clone();
        for range_m in scan.echoes.iter_mut().take(1).map(|echo| &mut echo.range_m) {
            told_apart &= range_m.len() == met.len();
            for (range_m, met) in range_m.iter_mut().zip(met) {
                if met.class != Class::Leaf {
                    *range_m = NO_ECHO;
                }
            }
        }
        leaves.push(&scan);
    })?;
    let (raw, corrected, leaves) = (raw.finish(), corrected.finish(), leaves.finish());
    let leaves_m2 = leaves.impacted_total_area_m2.filter(|_| told_apart);
    Ok(Output::ALL.into_iter().map(|output| value(output, &raw, &corrected, leaves_m2)).collect())
}

fn value(output: Output, raw: &Estimate, corrected: &Estimate, leaves_m2: Option<f64>) -> Option<f64> {
    let measure = |estimator: &str, quantity: Quantity| {
        let same = |m: &&rowscan_canopy::Measure| {
            m.estimator == estimator && m.quantity == quantity && m.band_m().is_none()
        };
        raw.measures.iter().find(same)?.value
    };
    match output {
        Output::ImpactedTotal => raw.impacted_total_area_m2,
        Output::ImpactedLeaf => leaves_m2,
        Output::Contact => raw.leaf.areas.contact_raw_m2().ok(),
        Output::Gap => measure("gap", Quantity::LeafArea),
        // The percentile that is highest.
        Output::Height => measure("height", Quantity::Height),
        Output::Width => measure("width", Quantity::Width),
        Output::Volume => measure("volume", Quantity::Volume),
        Output::TreeRowVolume => measure("trv", Quantity::TreeRowVolume),
        Output::LeafWallArea => measure("lwa", Quantity::LeafWallArea),
        Output::LeafArea => corrected.leaf.areas.best_m2().ok(),
        Output::Lai => corrected.leaf.areas.lai().ok(),
    }
}
