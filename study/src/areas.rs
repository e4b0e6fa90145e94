//! The paper's twenty orchards: impacted areas from beside and from above, regressed on the true leaf area.

mod fits;
mod gates;
mod report;

use rowscan_canopy::Sample;
use rowscan_canopy::calibration::{CalibrationClass, CanopyClass, ClumpingBy, EchoRule};
use rowscan_protocol::angle::exact_step_deg;
use rowscan_protocol::model;
use rowscan_scenes::orchard::Preset;
use rowscan_scenes::scan::{ScanAreas, ScanKind, ScanPlan, ScanSettings, Target};
use rowscan_scenes::{GeneratorKind, Scene};
use serde::{Deserialize, Serialize};

pub use fits::{Fit, PowerFit, View, impacted, symbol, views};
pub use gates::{Gate, Rule, gates};
pub use report::{AreasReport, report};

use super::{Nursery, Study, UnitError, fingerprint};
use crate::archive::Depends;
use crate::notes::RowNotes;
use crate::trial::Trial;
use rowscan_emulator::stage::Stage;

/// Orchards of every number of iterations at every shady threshold, each scanned twice.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AreasStudy {
    /// Layout, tree parameters and seed; iterations, threshold and each orchard's seed are replaced.
    pub scene: Scene,
    /// Iterations of growth.
    pub iterations: Vec<u32>,
    /// Shady thresholds, percent.
    pub shady_percent: Vec<f64>,
    /// The scan from beside the row.
    pub lateral: ScanSettings,
    /// The scan from above.
    pub zenith: ScanSettings,
    /// The lateral sensor stands farther off than its distance where the canopy would otherwise come nearer than this, metres.
    pub clearance_m: f64,
    /// Count the leaves of all rows, not of the first alone.
    pub whole_orchard: bool,
}

/// One orchard.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Orchard {
    /// Its own seed.
    pub seed: u64,
    /// Iterations of growth.
    pub iterations: u32,
    /// Shady threshold, percent.
    pub shady_percent: f64,
    /// True one-sided leaf area, m².
    pub leaf_area_m2: f64,
    /// True lateral surface of the wood, m².
    pub wood_area_m2: f64,
    /// Distance of the lateral sensor from the axis, metres.
    pub distance_m: f64,
    /// From beside.
    pub lateral: ScanAreas,
    /// From above.
    pub zenith: ScanAreas,
    /// The same row driven past by the rig's scanner, for a calibration: None where it saw nothing.
    pub sample: Option<Sample>,
}

impl AreasStudy {
    /// The paper's study on a scene.
    pub fn new(scene: Scene) -> Self {
        let lateral = super::lateral_of(&scene);
        Self {
            scene,
            iterations: (7..=11).collect(),
            shady_percent: vec![60.0, 70.0, 80.0, 101.0],
            zenith: ScanSettings { kind: ScanKind::ZenithOrthogonal, ..lateral.clone() },
            lateral,
            clearance_m: 0.5,
            whole_orchard: false,
        }
    }

    /// True if the orchards are readings of the paper's: only then its numbers and gates stand beside them.
    pub fn is_of_paper(&self) -> bool {
        self.scene.orchard.preset == Preset::Paper && self.scene.orchard.generator() == GeneratorKind::Hmt
    }

    /// Iterations and threshold of a unit.
    fn case(&self, index: usize) -> (u32, f64) {
        let thresholds = self.shady_percent.len().max(1);
        let iterations = self.iterations.get(index / thresholds).copied().unwrap_or_default();
        (iterations, self.shady_percent.get(index % thresholds).copied().unwrap_or_default())
    }

    /// What a calibration made of the drives past these orchards is valid for.
    pub fn class(&self) -> CalibrationClass {
        let rig = self.scene.resolved_rig();
        let mount = rig.scanners.first();
        let scanner = mount.and_then(|mount| model::by_name(&mount.model));
        let list = |values: Vec<String>| values.join(", ");
        CalibrationClass {
            preset: self.scene.orchard.training_system(),
            shady_threshold_percent: self.shady_percent.iter().copied().fold(0.0, f64::max),
            growth_stage: format!(
                "{} iterations, shady thresholds {} %",
                list(self.iterations.iter().map(u32::to_string).collect()),
                list(self.shady_percent.iter().map(f64::to_string).collect()),
            ),
            tree_spacing_m: self.scene.orchard.layout().tree_spacing_m,
            scanner_model: mount.map(|mount| mount.model.clone()).unwrap_or_default(),
            resolution_deg: mount
                .and_then(|mount| mount.resolution_deg)
                .or(scanner.map(|model| exact_step_deg(model.default_mode.step)))
                .unwrap_or_default(),
            echo_rule: EchoRule::First,
            optics: rig.optics.into(),
            distance_m: mount.map(|mount| mount.distance_m),
            height_m: mount.map(|mount| mount.height_m),
            yaw_deg: mount.map(|mount| mount.yaw_deg).filter(|deg| *deg != 0.0),
            pitch_deg: mount.map(|mount| mount.pitch_deg).filter(|deg| *deg != 0.0),
            line_spacing_m: None,
            crown_depth_m: None,
            voxel_m: None,
            canopy: CanopyClass::default(),
        }
    }
}

impl Study for AreasStudy {
    const NAME: &'static str = "areas";
    type Result = Orchard;

    fn units(&self) -> usize {
        self.iterations.len() * self.shady_percent.len()
    }

    fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Leaves multiply by about 1.6 a season, and what costs time goes with them: shade while growing, beams while scanning.
    fn effort(&self, index: usize) -> f64 {
        1.6_f64.powf(f64::from(self.case(index).0))
    }

    fn depends(&self, index: usize) -> Option<Depends> {
        let Self { scene: _, iterations: _, shady_percent: _, lateral, zenith, clearance_m, whole_orchard } =
            self;
        let scans = Depends::on_scene(&self.scene_of(index)).and("lateral", lateral).and("zenith", zenith);
        Some(scans.and("clearance_m", clearance_m).and("whole_orchard", whole_orchard))
    }

    fn unit(&self, index: usize, _nursery: &Nursery, _notes: &mut RowNotes) -> Result<Orchard, UnitError> {
        let stage = Stage::grow(self.scene_of(index), &|_, _| {})?;
        let sample = drive_past(&stage, stage.truth(0).leaf_area_m2)?;
        Ok(Orchard { sample, ..self.measured(index, &stage.orchard)? })
    }
}

impl AreasStudy {
    /// The scene of one orchard.
    fn scene_of(&self, index: usize) -> Scene {
        let (iterations, shady_percent) = self.case(index);
        let mut scene = self.scene.clone();
        scene.seed = fingerprint::seed(Self::NAME, self.scene.seed, index);
        scene.orchard.tree.iterations = Some(iterations);
        scene.orchard.tree.shady_percent = Some(shady_percent);
        scene
    }

    /// Grows and scans one orchard, without driving past it.
    pub(super) fn scanned(&self, index: usize) -> Result<Orchard, UnitError> {
        let scene = self.scene_of(index);
        self.measured(index, &rowscan_scenes::Orchard::grow(&scene.orchard, scene.seed, &|_, _| {})?)
    }

    fn measured(&self, index: usize, orchard: &rowscan_scenes::Orchard) -> Result<Orchard, UnitError> {
        let (iterations, shady_percent) = self.case(index);
        let target = if self.whole_orchard { Some(Target::whole(orchard)) } else { Target::row(orchard, 0) };
        let target =
            target.ok_or(rowscan_scenes::scan::ScanError::NothingThere { kind: self.lateral.kind })?;
        let lateral = self.clear_of(&target);
        let distance_m = lateral.distance_m;
        let areas = |settings: &ScanSettings| -> Result<ScanAreas, UnitError> {
            let caster = settings.wood.caster(orchard)?;
            let areas = ScanPlan::new(&target, settings)?.areas(caster.as_ref());
            if areas.total_m2 > 0.0 { Ok(areas) } else { Err(UnitError::SeesNothing { kind: settings.kind }) }
        };
        let (lateral, zenith) = (areas(&lateral)?, areas(&self.zenith)?);
        let rows = if self.whole_orchard { orchard.rows() } else { 1 };
        let truths: Vec<_> = (0..rows).map(|row| orchard.truth_of_row(row, Default::default())).collect();
        Ok(Orchard {
            seed: orchard.seed().unwrap_or_default(),
            iterations,
            shady_percent,
            leaf_area_m2: truths.iter().map(|truth| truth.leaf_area_m2).sum(),
            wood_area_m2: truths.iter().map(|truth| truth.wood_area_m2).sum(),
            distance_m,
            lateral,
            zenith,
            sample: None,
        })
    }

    fn clear_of(&self, target: &Target) -> ScanSettings {
        let reach_m = target.extent.map_or(0.0, |extent| target.near_axis_x_m - extent.low[0]);
        let distance_m = self.lateral.distance_m.max(reach_m + self.clearance_m);
        ScanSettings { distance_m, ..self.lateral.clone() }
    }
}

fn drive_past(stage: &Stage, leaf_area_m2: f64) -> Result<Option<Sample>, UnitError> {
    let Some(scanner) = stage.rig.scanners.first().and_then(|mount| model::by_name(&mount.model)) else {
        return Ok(None);
    };
    let trial = Trial::drive_past(stage, scanner, None, &[])?;
    Ok(Sample::of(&trial.estimate, leaf_area_m2, ClumpingBy::Constant))
}
