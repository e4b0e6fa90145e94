//! The experiments on one row.

use rowscan_canopy::estimator::TABLE;
use rowscan_canopy::{
    Calibration, EdgeBy, Estimate, EstimatorInfo, Parameters, Pipeline, Quantity, VoxelGrid,
};
use rowscan_emulator::stage::Stage;
use rowscan_protocol::model::Model;
use rowscan_protocol::rig::Mount;
use rowscan_scenes::optics::Stages;
use rowscan_scenes::{Orchard, Scene, Tree};

use super::Budget;
use super::scattered::scattered;
use crate::appraisal::Appraisal;
use crate::calibrations;
use crate::fine_scan::fine_scan;
use crate::notes::RowNotes;
use crate::reading::{self, ReadingError, rig_with};
use crate::trial::{Trial, TrialError};

/// Leaves that one is cut into: three times three.
const PIECES: u32 = 9;

/// The estimators that measure leaf area.
fn asked() -> Vec<&'static EstimatorInfo> {
    TABLE.iter().filter(|info| info.quantities.contains(&Quantity::LeafArea)).collect()
}

/// The scene with its first scanner before the first row, which is what the finer scans look at.
fn before_first_row(mut scene: Scene) -> Scene {
    scene.drive.alley = None;
    scene.rig.scanners.truncate(1);
    scene.true_mounts.truncate(1);
    scene
}

/// Every leaf area estimator's budget on one row.
pub(super) fn row(
    scene: Scene,
    model: &'static Model,
    notes: &mut RowNotes,
) -> Result<Vec<Budget>, TrialError> {
    let stage = Stage::grow(before_first_row(scene), &|_, _| {})?;
    let rig = rig_with(&stage.rig, 0, model.name);
    let mount = rig.scanners.first().cloned().unwrap_or_default();
    let calibration = match &rig.calibration {
        Some(name) => calibrations::load_calibration_for(name, model.name, stage.rig.optics)
            .map_err(ReadingError::from)?,
        None => None,
    };
    let asked_for = [Quantity::LeafArea].into_iter();
    let appraisal = Appraisal::of_quantities(
        (&stage.orchard, stage.row_seen(0)),
        &mount,
        rig.ground_clearance_m,
        asked_for,
    );
    let start_m = rig.start_m;
    let whole = appraisal.stretch(start_m, start_m + stage.orchard.length_m());
    let truth_m2 = whole.value(Quantity::LeafArea, None).unwrap_or(0.0);

    let device = |stage: &Stage| -> Result<Estimate, TrialError> {
        Ok(Trial::drive_past(stage, model, calibration.clone(), &asked())?.estimate)
    };
    let as_is = device(&stage)?;
    notes.add(&as_is);
    let mut rays = stage.scene.clone();
    rays.optics.stages = Stages::IDEAL;
    rays.rig.optics = None;
    let ideal = if stage.scene.optics.stages.is_ideal() {
        as_is.clone()
    } else {
        device(&Stage::of_orchard(rays.clone(), stage.orchard.clone()))?
    };
    let bare = Stage::of_orchard(rays.clone(), leaves_of(&stage.orchard));
    let leafy = device(&bare)?;
    let projection = projection_of_leaves(&bare, &mount, rig.ground_clearance_m);

    // From here on the estimator's own settings: rays, and no device.
    let rig = rig_with(&bare.rig, 0, model.name);
    let base = reading::parameters(&rig, &mount, true).map_err(ReadingError::from)?;
    // What voxels of another edge than the calibration's change is a part of the budget.
    let mut of_any_edge = calibration.clone();
    if let Some(calibration) = &mut of_any_edge {
        calibration.class.voxel_m = None;
    }
    let fine = |stage: &Stage, parameters: Parameters| -> Result<Estimate, TrialError> {
        scanned(stage, &mount, of_any_edge.clone(), parameters)
    };
    let sampled = fine(&bare, base)?;
    let turned = base.projection_of(projection);
    let projected = fine(&bare, turned)?;
    let half = turned.with_voxel_edge(base.voxel_m / 2.0, EdgeBy::Given);
    let halved = fine(&bare, half)?;
    let grid = VoxelGrid::of(&rig, &mount, &half).map_err(ReadingError::from)?;
    let seed = stage.scene.seed;
    let loose = |pieces| Stage::of_orchard(rays.clone(), scattered(&bare.orchard, &grid, pieces, seed));
    let even = fine(&loose(1), half)?;
    let small = fine(&loose(PIECES), half)?;

    let all = [&as_is, &ideal, &leafy, &sampled, &projected, &halved, &even, &small];
    let names =
        as_is.side_by_side().into_iter().filter(|m| m.quantity == Quantity::LeafArea && m.band_m().is_none());
    let budgets = names.filter_map(|measure| {
        let estimator = measure.estimator;
        // The calibration's factor is one thing of its own; without it `contact` is `contact_raw`.
        let then = if estimator == "contact" { "contact_raw" } else { estimator };
        let first = [value(&as_is, estimator), value(&as_is, then)];
        let chain: Vec<Option<f64>> =
            first.into_iter().chain(all.iter().skip(1).map(|estimate| value(estimate, then))).collect();
        Budget::of(estimator, seed, truth_m2, &chain)
    });
    Ok(budgets.collect())
}

/// The projection function of an orchard of leaves towards a scanner on this mount: what they face it with, of their area. None without a leaf.
fn projection_of_leaves(leaves: &Stage, mount: &Mount, clearance_m: f64) -> Option<f64> {
    let appraisal = Appraisal::of((&leaves.orchard, leaves.row_seen(0)), mount, clearance_m);
    let start_m = leaves.rig.start_m;
    let whole = appraisal.stretch(start_m, start_m + leaves.orchard.length_m());
    let index = |quantity| whole.value(quantity, None);
    let projection = index(Quantity::TreeAreaIndex)? / index(Quantity::Lai)?;
    (0.01..=1.0).contains(&projection).then_some(projection)
}

/// What an estimator says of the row.
fn value(estimate: &Estimate, estimator: &str) -> Option<f64> {
    let of = |m: &rowscan_canopy::Measure| {
        m.estimator == estimator && m.quantity == Quantity::LeafArea && m.band_m().is_none()
    };
    estimate.side_by_side().into_iter().find(of)?.value
}

/// The orchard without all that is no leaf.
fn leaves_of(orchard: &Orchard) -> Orchard {
    let trees = orchard.trees().map(|tree| Tree { leaves: tree.leaves.clone(), ..Tree::default() });
    Orchard::from_trees(
        trees.collect(),
        orchard.length_m(),
        orchard.tree_spacing_m(),
        orchard.row_spacing_m(),
    )
}

/// A scan so fine that a finer one changes nothing, estimated with these settings.
fn scanned(
    stage: &Stage,
    mount: &Mount,
    calibration: Option<Calibration>,
    parameters: Parameters,
) -> Result<Estimate, TrialError> {
    let asked = asked();
    let make = |rig: &_| {
        let pipeline = Pipeline::with_parameters(Some(rig), 0, calibration, parameters)?;
        Ok(pipeline.with_estimators(&asked))
    };
    Ok(fine_scan(stage, mount, make).map_err(ReadingError::from)?)
}

/// Settings with another projection function.
trait Projected {
    /// The same with G as it is, where it is known.
    fn projection_of(self, projection: Option<f64>) -> Self;
}

impl Projected for Parameters {
    fn projection_of(self, projection: Option<f64>) -> Self {
        Self { projection: projection.filter(|g| g.is_finite()).unwrap_or(self.projection), ..self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::budget::Term;
    use rowscan_protocol::model;
    use rowscan_scenes::files::load_scene;

    fn small(scene: &str) -> Scene {
        let mut scene = load_scene(scene, |_| {}).expect("built in");
        scene.orchard.trees = Some(2);
        scene.orchard.tree.iterations = Some(7);
        scene
    }

    fn budgets(scene: Scene) -> Vec<Budget> {
        row(scene, model::by_name("lms111").expect("known"), &mut RowNotes::default()).expect("it runs")
    }

    fn term(budget: &Budget, term: Term) -> f64 {
        let at = Term::ALL.iter().position(|other| *other == term).expect("listed");
        budget.terms_m2[at].expect("known") / budget.truth_m2
    }

    #[test]
    fn terms_and_rest_add_up_and_every_term_says_what_it_replaces() {
        let budgets = budgets(small("spindle"));
        for name in ["contact", "contact_raw", "voxel", "polar", "gap", "null"] {
            assert!(budgets.iter().any(|budget| budget.estimator == name), "{name}");
        }
        for budget in &budgets {
            let sum: f64 = budget.terms_m2.iter().flatten().sum();
            let error = budget.estimate_m2 - budget.truth_m2;
            assert!((sum + budget.rest_m2 - error).abs() < 1e-9 * budget.truth_m2, "{budget:?}");
        }
        let raw = budgets.iter().find(|budget| budget.estimator == "contact_raw").expect("there");
        assert_eq!((term(raw, Term::Calibration), term(raw, Term::Optics)), (0.0, 0.0));
        assert!(term(raw, Term::Wood) > 0.01, "wood counts as leaf: {raw:?}");
        assert!(term(raw, Term::LeafSize) > 0.0, "few leaves a voxel make too much: {raw:?}");
        let contact = budgets.iter().find(|budget| budget.estimator == "contact").expect("there");
        assert!(term(contact, Term::Calibration) != 0.0);
        assert!((contact.terms_m2[2].unwrap_or(0.0) - raw.terms_m2[2].unwrap_or(1.0)).abs() < 1e-12);
    }

    #[test]
    fn a_slab_of_leaves_turned_any_way_has_no_wood_and_no_clumps() {
        let mut scene = small("slab");
        scene.orchard.analytic.leaf_m = Some(0.03);
        scene.orchard.analytic.density_m2_m3 = Some(1.0);
        let budgets = budgets(scene);
        let raw = budgets.iter().find(|budget| budget.estimator == "contact_raw").expect("there");
        assert_eq!(term(raw, Term::Wood), 0.0);
        assert!(term(raw, Term::Projection).abs() < 0.02, "{raw:?}");
        assert!(term(raw, Term::Clumping).abs() < 0.03, "{raw:?}");
        assert!(raw.rest_m2.abs() < 0.05 * raw.truth_m2, "{raw:?}");
    }
}
