//! One row, scanned in memory and estimated, beside its truth: what calibrations and accuracy tables are made of.

use rayon::prelude::*;
use rowscan_canopy::{Calibration, CutMethod, Estimate, EstimatorInfo, Pipeline, RowClass};
use rowscan_protocol::client::ColaConfig;
use rowscan_protocol::lms2xx::client::Lms2xxConfig;
use rowscan_protocol::lms2xx::{self, Rate};
use rowscan_protocol::model::{AnyModel, Model};
use rowscan_protocol::rig::Rig;
use rowscan_protocol::scan::Scan;
use rowscan_protocol::validity::ScanFault;
use rowscan_scenes::{GrowError, Return, Scene, Truth};

use serde::Serialize;
use serde::de::DeserializeOwned;

use rowscan_emulator::offline::{Offline, SetUpError};
use rowscan_emulator::offline_lms2xx::OfflineLms2xx;
use rowscan_emulator::stage::{Stage, StageError};

use crate::archive::{Archive, Depends};
use crate::class::row_class;
use crate::notes::RowNotes;
use crate::reading::{CalibrationChoice, Reading, ReadingError, reading_remission, rig_with};

/// What came out of one row.
#[derive(Clone, Debug)]
pub struct Trial {
    /// The row's seed.
    pub seed: u64,
    /// Metres of row.
    pub length_m: f64,
    /// What the scans say.
    pub estimate: Estimate,
    /// What is there.
    pub truth: Truth,
    /// What canopy that is.
    pub class: RowClass,
}

/// Why a row could not be tried.
#[derive(Debug, thiserror::Error)]
pub enum TrialError {
    /// The orchard did not grow.
    #[error(transparent)]
    Grow(#[from] GrowError),
    /// The scanner does not fit the rig.
    #[error(transparent)]
    Stage(#[from] StageError),
    /// The rig allows no estimate.
    #[error(transparent)]
    Reading(#[from] ReadingError),
    /// The device refused what a client asks of it at start-up.
    #[error(transparent)]
    SetUp(#[from] SetUpError),
    /// The device made a telegram that holds no scan.
    #[error("the device made a telegram without a scan: {0}")]
    Scan(#[from] ScanFault),
}

impl Trial {
    /// Grows the scene's row, drives past it once, and estimates.
    pub fn run(
        scene: Scene,
        model: impl Into<AnyModel>,
        calibration: Option<Calibration>,
    ) -> Result<Self, TrialError> {
        Self::drive_past(&Stage::grow(scene, &|_, _| {})?, model, calibration, &[])
    }

    /// Drives past a grown row once, and estimates; with estimators, by these as well, and the trees found in the data.
    pub fn drive_past(
        stage: &Stage,
        model: impl Into<AnyModel>,
        calibration: Option<Calibration>,
        estimators: &[&'static EstimatorInfo],
    ) -> Result<Self, TrialError> {
        Self::drive_past_told(stage, &stage.rig, model, calibration, estimators)
    }

    /// The same by an estimator that believes in another rig.
    pub fn drive_past_told(
        stage: &Stage,
        told: &Rig,
        model: impl Into<AnyModel>,
        calibration: Option<Calibration>,
        estimators: &[&'static EstimatorInfo],
    ) -> Result<Self, TrialError> {
        let model = model.into();
        let rig = rig_with(told, 0, model.name());
        let truth = stage.truth(0);
        let class = row_class(&stage.scene, &truth);
        let reading = Reading::of(Some(&rig), 0, true, CalibrationChoice::Given(calibration.map(Box::new)))?;
        let asked = StartUpRequests { cola: reading.cola, lms2xx: reading.lms2xx };
        let mut pipeline = reading.pipeline.with_estimators(estimators).of_class(class.clone());
        if !estimators.is_empty() {
            pipeline = pipeline.with_trees_found(&CutMethod::ALL);
        }
        each_scan(stage, model, asked, &mut |scan| {
            pipeline.push(scan);
        })?;
        Ok(Self {
            seed: stage.scene.seed,
            length_m: stage.orchard.length_m(),
            estimate: pipeline.finish(),
            truth,
            class,
        })
    }
}

/// Tries one row a scene, on all cores, and takes of each what is wanted; the order of the scenes is the order of the results. `done` hears of every row.
///
/// # Errors
/// The first row that could not be tried.
pub fn run_all<T>(
    scenes: &[Scene],
    model: AnyModel,
    calibration: Option<&Calibration>,
    wanted: &Wanted<'_, T>,
    archive: &Archive,
    done: &(dyn Fn() + Sync),
) -> Result<Vec<T>, TrialError>
where
    T: Serialize + DeserializeOwned + PartialEq + Send,
{
    scenes
        .par_iter()
        .map(|scene| {
            let depends = || Some(Depends::on_pass(scene, model.name()).and("calibration", &calibration));
            let work = |notes: &mut RowNotes| {
                let trial = Trial::run(scene.clone(), model, calibration.cloned())?;
                notes.add(&trial.estimate);
                Ok((wanted.take)(&trial))
            };
            let row = archive.row(wanted.name, depends, work);
            done();
            row
        })
        .collect()
}

/// What is wanted of a row that was tried.
#[derive(Clone, Copy)]
pub struct Wanted<'a, T> {
    /// What kept rows are found again by: another one for what takes anything else.
    pub name: &'a str,
    /// What is taken.
    pub take: &'a (dyn Fn(&Trial) -> T + Sync),
}

/// What a device is asked at its start-up.
#[derive(Clone, Debug)]
pub struct StartUpRequests {
    /// Of a CoLa device.
    pub cola: ColaConfig,
    /// Of an LMS2xx.
    pub lms2xx: Lms2xxConfig,
}

/// The estimators of a pass by the rig's first scanner, and what the device is asked for them.
pub(crate) struct ByHitsAndShares {
    /// By hits.
    pub(crate) by_hits: Pipeline,
    /// By shares of spots; none where they are not wanted, and of a scanner whose remission tells no power.
    pub(crate) by_shares: Option<Pipeline>,
    pub(crate) asked: StartUpRequests,
}

impl ByHitsAndShares {
    /// As the rig says, with the calibration that it names.
    pub(crate) fn of(rig: &Rig, wants_shares: bool) -> Result<Self, ReadingError> {
        let reading = Reading::of(Some(rig), 0, true, CalibrationChoice::OfRig)?;
        let of_shares = reading_remission(rig, 0)
            .filter(|_| wants_shares)
            .map(|rig| Reading::of(Some(&rig), 0, true, CalibrationChoice::OfRig))
            .transpose()?;
        let cola = ColaConfig { remission: of_shares.is_some(), ..reading.cola };
        Ok(Self {
            by_hits: reading.pipeline,
            by_shares: of_shares.map(|reading| reading.pipeline),
            asked: StartUpRequests { cola, lms2xx: reading.lms2xx },
        })
    }
}

/// Hands out the scans of one pass by the rig's first scanner, a device of `model`.
///
/// # Errors
/// A scanner that does not fit the rig, a refused start-up, a telegram without a scan.
pub fn each_scan(
    stage: &Stage,
    model: AnyModel,
    asked: StartUpRequests,
    take: &mut dyn FnMut(&Scan),
) -> Result<(), TrialError> {
    each_scan_met(stage, model, asked, &mut |scan, _| take(scan))
}

/// The same, with what the beams of the mirror met: of a wide beam, the surface that returned most of its first echo. For studies that tell
/// surfaces apart; no estimate sees it.
///
/// # Errors
/// As [`each_scan`].
pub fn each_scan_met(
    stage: &Stage,
    model: AnyModel,
    asked: StartUpRequests,
    take: &mut dyn FnMut(&Scan, &[Return]),
) -> Result<(), TrialError> {
    match model {
        AnyModel::Cola(model) => each_cola(stage, model, asked.cola, take),
        AnyModel::Lms2xx(model) => each_lms2xx(stage, model, asked.lms2xx, take),
    }
}

fn each_cola(
    stage: &Stage,
    model: &'static Model,
    config: ColaConfig,
    take: &mut dyn FnMut(&Scan, &[Return]),
) -> Result<(), TrialError> {
    let (device, world) = stage.scanner(0, model)?;
    let scans = stage.scans_per_row(&device);
    let mut offline = Offline::new(device, world);
    offline.set_up(config)?;
    let mut scan = Scan::default();
    for _ in 0..scans {
        if offline.scan_into(&mut scan)? {
            take(&scan, offline.returns());
        }
    }
    Ok(())
}

/// The same of an LMS2xx, on the fastest line: no scan is left out.
fn each_lms2xx(
    stage: &Stage,
    model: &'static lms2xx::model::Model,
    config: Lms2xxConfig,
    take: &mut dyn FnMut(&Scan, &[Return]),
) -> Result<(), TrialError> {
    let (device, world) = stage.serial_scanner(0, model, lms2xx::device::Options::default())?;
    let turns = model.turns(device.variant());
    let scans = stage.scans_of_row(f64::from(lms2xx::model::TURNS_PER_SECOND) / f64::from(turns));
    let mut offline = OfflineLms2xx::set_up(device, world, Lms2xxConfig { rate: Rate::R500000, ..config })?;
    for _ in 0..scans {
        if let Some((scan, met)) = offline.scan_met() {
            take(scan, met);
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use rowscan_emulator::stage::Stage;
    use rowscan_scenes::files::scene_from_text;

    use super::*;

    /// Two rows of which one has a gap: the truth, its class and its error are of the row that the scanner looks at.
    #[test]
    fn the_truth_is_that_of_the_row_that_is_seen() {
        for (row, side, alley) in [(0, "right", 0), (1, "right", 1), (0, "left", 1), (1, "left", 2)] {
            let text = format!(
                "version = 2\n[orchard]\nrows = 2\ntrees = 4\nmissing = [[1, 2], []]\n[orchard.tree]\niterations = 6\n[drive]\nalley = {alley}\n[[rig.scanner]]\nrow = \"{side}\"\n"
            );
            let stage =
                Stage::grow(scene_from_text(&text, |_| {}).expect("a scene"), &|_, _| {}).expect("grows");
            let truths = [0, 1].map(|row| stage.orchard.truth_of_row(row, Default::default()).leaf_area_m2);
            assert!(truths[1] > 1.5 * truths[0], "{truths:?}");
            let trial = Trial::drive_past(&stage, AnyModel::by_name("lms111").expect("a model"), None, &[]);
            let trial = trial.expect("scanned");
            assert_eq!(trial.truth.leaf_area_m2, truths[row], "{side} of alley {alley}");
            let raw_m2 = trial.estimate.leaf.areas.contact_raw_m2().expect("told");
            assert!(
                (raw_m2 / truths[row] - 1.0).abs() < 0.35,
                "{side} of alley {alley}: {raw_m2} for {truths:?}"
            );
        }
    }
}
