//! Leaf area through the device's eye: every estimator against the truth, by model and distance, before and after the spot is taken out.

use rowscan_canopy::estimator::by_name;
use rowscan_canopy::{Estimate, Parameters, Pipeline, Quantity};
use rowscan_protocol::model::AnyModel;
use rowscan_protocol::rig::Rig;
use rowscan_scenes::Scene;
use rowscan_scenes::optics::Stages;
use serde::Serialize;

use crate::archive::{Archive, Depends};
use crate::class::row_class;
use crate::notes::RowNotes;
use crate::nursery::{self, Nursery};
use crate::reading::{ReadingError, rig_with};
use crate::trial::{ByHitsAndShares, TrialError, each_scan};
use crate::wilson::wilson;
use crate::{median, moments};

/// What is tried.
#[derive(Clone, Debug)]
pub struct ThroughTheEye {
    /// Scenes; all stages of the eye are on.
    pub scenes: Vec<Scene>,
    /// Rows of each.
    pub seeds: Vec<u64>,
    /// Scanners.
    pub models: Vec<AnyModel>,
    /// From the mirror to the row plane, metres.
    pub distances_m: Vec<f64>,
}

/// A way to the leaf area.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Way {
    /// Contact frequency, the spot left in, no calibration.
    ContactBefore,
    /// Contact frequency, the spot taken out, no calibration.
    ContactRaw,
    /// The same times the calibration's factor.
    Contact,
    /// By the shares of spots that remission tells, no calibration.
    ShareRaw,
    /// The same times the calibration's factor.
    Share,
    /// Density in voxels, the spot taken out.
    Voxel,
    /// The polar gap fraction, the spot taken out.
    Polar,
    /// The gap fraction, the spot taken out.
    Gap,
    /// The calibration's regression on impacted area.
    Regression,
    /// The calibration's mean: no scan at all.
    Null,
    /// What the estimate calls the leaf area.
    LeafArea,
}

impl Way {
    /// All of them, in the order of the table.
    pub const ALL: [Self; 11] = [
        Self::ContactBefore,
        Self::ContactRaw,
        Self::Contact,
        Self::ShareRaw,
        Self::Share,
        Self::Voxel,
        Self::Polar,
        Self::Gap,
        Self::Regression,
        Self::Null,
        Self::LeafArea,
    ];

    /// Its name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::ContactBefore => "contact_raw, spot left in",
            Self::ContactRaw => "contact_raw",
            Self::Contact => "contact",
            Self::ShareRaw => "share_raw",
            Self::Share => "share",
            Self::Voxel => "voxel",
            Self::Polar => "polar",
            Self::Gap => "gap",
            Self::Regression => "I_T",
            Self::Null => "null",
            Self::LeafArea => "leaf_area_m2",
        }
    }
}

/// One way over all rows of a place.
#[derive(Clone, Debug, Serialize)]
pub struct Seen {
    /// The scene.
    pub scene: String,
    /// The scanner.
    pub model: &'static str,
    /// From the mirror to the row plane, metres.
    pub distance_m: f64,
    /// The way.
    pub way: Way,
    /// Rows.
    pub rows: usize,
    /// Rows with a value: the others were withheld.
    pub n: usize,
    /// Median of value / truth − 1.
    pub median: Option<f64>,
    /// Mean of it.
    pub mean: Option<f64>,
    /// Standard deviation of it.
    pub sd: Option<f64>,
    /// Share of the intervals that hold the truth, with Wilson's 95 % interval; `null` for a way without intervals.
    pub holds: Option<[f64; 3]>,
    /// Half of an interval's width over the value, mean.
    pub half_width: Option<f64>,
}

/// A row's value of one way over the truth, with its interval's ends.
type Ratio = Option<(f64, Option<[f64; 2]>)>;

/// Tries everything; `done` hears of every pass that is through.
///
/// # Errors
/// The first row that could not be tried.
pub fn through_the_eye(
    asked: &ThroughTheEye,
    archive: &Archive,
    done: &(dyn Fn() + Sync),
) -> Result<Vec<Seen>, TrialError> {
    let mut places = Vec::new();
    for scene in &asked.scenes {
        for model in &asked.models {
            places.extend(asked.distances_m.iter().map(|distance_m| (scene, *model, *distance_m)));
        }
    }
    let passes: Vec<_> =
        places.iter().flat_map(|place| asked.seeds.iter().map(move |seed| (*place, *seed))).collect();
    let scene_of = |((scene, model, distance_m), seed): &((&Scene, AnyModel, f64), u64)| {
        let mut scene = placed(scene, *model, *distance_m, *seed);
        scene.optics.stages = Stages::device();
        scene
    };
    let rows: Vec<Vec<Ratio>> = nursery::each(&passes, scene_of, |((_, model, _), _), scene, nursery| {
        let depends = || Some(Depends::on_pass(&scene, model.name()));
        let row = archive.row("eye", depends, |notes| row(scene.clone(), *model, nursery, notes));
        done();
        row
    })?;
    let mut seen = Vec::new();
    for ((scene, model, distance_m), rows) in places.iter().zip(rows.chunks(asked.seeds.len().max(1))) {
        for (at, way) in Way::ALL.into_iter().enumerate() {
            let ratios: Vec<_> = rows.iter().filter_map(|row| row.get(at).copied().flatten()).collect();
            seen.push(summed_up((&scene.name, model.name(), *distance_m), way, rows.len(), &ratios));
        }
    }
    Ok(seen)
}

/// A scene's row with its first scanner of this model so far from the row plane. Rows stand farther apart if they must, for the tractor drives in
/// the middle of its alley or nearer to the row.
pub(crate) fn placed(scene: &Scene, model: AnyModel, distance_m: f64, seed: u64) -> Scene {
    let mut scene = Scene { seed, ..scene.clone() };
    let spacing_m = scene.resolved_rig().row_spacing_m.unwrap_or(0.0);
    if let Some(mount) = scene.rig.scanners.first_mut() {
        mount.distance_m = distance_m;
        model.name().clone_into(&mut mount.model);
    }
    let wider_m = spacing_m.max(2.0 * distance_m);
    (scene.orchard.row_spacing_m, scene.rig.row_spacing_m) = (Some(wider_m), Some(wider_m));
    // The trees stay what they are: their leaf area, and so less of it on more ground.
    if let Some(lai) = scene.orchard.target_lai.as_mut().filter(|_| spacing_m > 0.0) {
        *lai *= spacing_m / wider_m;
    }
    scene
}

fn row(
    scene: Scene,
    model: AnyModel,
    nursery: &Nursery,
    notes: &mut RowNotes,
) -> Result<Vec<Ratio>, TrialError> {
    let set = nursery.grow(scene)?;
    let truth = set.truth(0);
    let rig = rig_with(&set.rig, 0, model.name());
    let ByHitsAndShares { by_hits, by_shares, asked } = ByHitsAndShares::of(&rig, true)?;
    let wanted: Vec<_> = ["voxel", "polar", "gap"].into_iter().filter_map(by_name).collect();
    let class = row_class(&set.scene, &truth);
    let mut shares = by_shares.map(|pipeline| pipeline.of_class(class.clone()));
    let mut corrected = by_hits.with_estimators(&wanted).of_class(class);
    let mut before = spot_left_in(&rig)?;
    each_scan(&set, model, asked, &mut |scan| {
        before.push(scan);
        corrected.push(scan);
        if let Some(shares) = &mut shares {
            shares.push(scan);
        }
    })?;
    let seen = SeenRow {
        before: before.finish(),
        after: corrected.finish(),
        shares: shares.map(|mut shares| shares.finish()),
    };
    notes.add(&seen.after);
    let truth_m2 = truth.leaf_area_m2;
    let ratio = |way| {
        let (value_m2, ends_m2) = value(way, &seen);
        let value_m2 = value_m2.filter(|_| truth_m2 > 0.0)?;
        Some((value_m2 / truth_m2, ends_m2.map(|ends| ends.map(|end_m2| end_m2 / truth_m2))))
    };
    Ok(Way::ALL.into_iter().map(ratio).collect())
}

/// A pipeline that knows nothing of the spot.
pub(crate) fn spot_left_in(rig: &Rig) -> Result<Pipeline, ReadingError> {
    Ok(Pipeline::with_parameters(Some(rig), 0, None, Parameters::default())?)
}

/// One row's estimates.
struct SeenRow {
    /// The spot left in.
    before: Estimate,
    after: Estimate,
    /// With remission; `None` of a scanner whose remission tells no power.
    shares: Option<Estimate>,
}

/// A way's leaf area and its interval, m².
fn value(way: Way, row: &SeenRow) -> (Option<f64>, Option<[f64; 2]>) {
    let SeenRow { before, after, shares } = row;
    let by_shares = |of: fn(&Estimate) -> Option<f64>| shares.as_ref().and_then(of);
    let measure = |estimator: &str| {
        let of_row = |m: &&rowscan_canopy::Measure| {
            m.estimator == estimator && m.quantity == Quantity::LeafArea && m.band_m().is_none()
        };
        let found = after.measures.iter().find(of_row);
        let ends = found.and_then(|m| Some([m.low?, m.high?]));
        (found.and_then(|m| m.value), ends)
    };
    match way {
        Way::ContactBefore => (before.leaf.areas.contact_raw_m2().ok(), None),
        Way::ContactRaw => (after.leaf.areas.contact_raw_m2().ok(), None),
        Way::Contact => (after.leaf.areas.contact_m2().ok().filter(|_| after.calibration.is_some()), None),
        Way::ShareRaw => (by_shares(|estimate| estimate.leaf.areas.share_raw_m2().ok()), None),
        Way::Share => {
            let ends = shares.as_ref().filter(|estimate| estimate.leaf.areas.share_m2().ok().is_some());
            (by_shares(|estimate| estimate.leaf.areas.share_m2().ok()), ends.and_then(|e| e.leaf.interval_m2))
        }
        Way::Voxel => measure("voxel"),
        Way::Polar => measure("polar"),
        Way::Gap => measure("gap"),
        Way::Regression => (after.leaf.areas.regression_m2().ok(), None),
        Way::Null => (after.leaf.null_m2, None),
        Way::LeafArea => (after.leaf.areas.best_m2().ok(), after.leaf.interval_m2),
    }
}

fn summed_up(
    (scene, model, distance_m): (&str, &'static str, f64),
    way: Way,
    rows: usize,
    ratios: &[(f64, Option<[f64; 2]>)],
) -> Seen {
    let errors: Vec<f64> = ratios.iter().map(|(ratio, _)| ratio - 1.0).collect();
    let n = errors.len();
    let spread = (n > 0).then(|| moments(&errors));
    let ends: Vec<(f64, [f64; 2])> =
        ratios.iter().filter_map(|(ratio, ends)| Some((*ratio, (*ends)?))).collect();
    let held = ends.iter().filter(|(_, [low, high])| (*low..=*high).contains(&1.0)).count();
    let [least, most] = wilson(held, ends.len());
    let widths: f64 = ends.iter().map(|(ratio, [low, high])| (high - low) / 2.0 / ratio).sum();
    let of_intervals = |value: f64| (!ends.is_empty()).then_some(value / ends.len() as f64);
    Seen {
        scene: scene.to_owned(),
        model,
        distance_m,
        way,
        rows,
        n,
        median: median(errors),
        mean: spread.map(|(mean, _)| mean),
        sd: spread.and_then(|(_, sd)| sd),
        holds: of_intervals(held as f64).map(|share| [share, least, most]),
        half_width: of_intervals(widths),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLACE: (&str, &str, f64) = ("row", "lms111", 2.0);

    #[test]
    fn a_way_is_summed_up_by_its_errors_and_what_its_intervals_hold() {
        let ratios = [(0.9, Some([0.8, 1.0])), (1.1, Some([1.05, 1.2])), (1.3, None)];
        let seen = summed_up(PLACE, Way::LeafArea, 4, &ratios);
        assert_eq!((seen.rows, seen.n), (4, 3));
        assert!((seen.median.expect("a median") - 0.1).abs() < 1e-12);
        assert!((seen.sd.expect("two and more") - 0.2).abs() < 1e-12);
        let [share, least, most] = seen.holds.expect("intervals");
        assert!(share == 0.5 && least < 0.5 && most > 0.5);
        let half = f64::midpoint(0.1 / 0.9, 0.075 / 1.1);
        assert!((seen.half_width.expect("intervals") - half).abs() < 1e-12);
    }

    #[test]
    fn what_was_withheld_is_unknown_and_not_zero() {
        let seen = summed_up(PLACE, Way::Regression, 2, &[]);
        assert_eq!((seen.rows, seen.n), (2, 0));
        assert_eq!([seen.median, seen.mean, seen.sd, seen.half_width], [None; 4]);
        assert_eq!(seen.holds, None);
    }

    fn with_lai(scene: &Scene, lai: f64) -> Scene {
        let mut scene = scene.clone();
        scene.orchard.target_lai = Some(lai);
        scene
    }

    #[test]
    fn a_scanner_farther_than_half_the_alley_moves_the_next_row_away() {
        let scene = rowscan_scenes::files::load_scene("spindle", |_| {}).expect("built in");
        let model = AnyModel::by_name("lms511").expect("a model");
        let far = placed(&scene, model, 4.0, 7);
        assert_eq!((far.seed, far.orchard.row_spacing_m, far.rig.row_spacing_m), (7, Some(8.0), Some(8.0)));
        let dressed = placed(&with_lai(&scene, 1.6), model, 4.0, 7);
        assert_eq!(dressed.orchard.target_lai, Some(0.8));
        let near = placed(&with_lai(&scene, 1.6), model, 1.0, 7);
        assert_eq!(near.orchard.target_lai, Some(1.6));
        assert_eq!(near.orchard.row_spacing_m, Some(4.0));
        assert!(
            near.rig.scanners.first().is_some_and(|mount| mount.distance_m == 1.0 && mount.model == "lms511")
        );
    }
}
