//! What a row's own scans say of its clumps: the law of leaf area by wide beams over what blocks of beams meet, fitted on rows of known density, and tried on
//! training systems that it was not fitted on.
//!
//! The truth of it is what rays read of the same row: wood and hidden leaves are another matter, which calibrations hold.

use rayon::prelude::*;
use rowscan_canopy::Estimate;
use rowscan_canopy::regression::FittedLine;
use rowscan_emulator::stage::Stage;
use rowscan_protocol::model::AnyModel;
use rowscan_scenes::Scene;
use rowscan_scenes::optics::Stages;
use serde::{Deserialize, Serialize};

use crate::archive::{Archive, Depends};
use crate::eye::placed;
use crate::name::{self, Name};
use crate::notes::RowNotes;
use crate::reading::{CalibrationChoice, Reading, rig_with};
use crate::trial::{StartUpRequests, TrialError, each_scan};
use crate::{median, rms};

/// What is tried.
#[derive(Clone, Debug)]
pub struct ClumpingStudy {
    /// Scenes, one a training system; by rays, and with all stages of the eye.
    pub scenes: Vec<Scene>,
    /// Leaf area indices of their rows.
    pub lais: Vec<f64>,
    /// Rows of each.
    pub seeds: Vec<u64>,
    /// Scanners.
    pub models: Vec<AnyModel>,
    /// From the mirror to the row plane, metres.
    pub distances_m: Vec<f64>,
}

/// One row.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ClumpingRow {
    /// The scene's preset.
    pub scene: String,
    /// The scanner.
    #[serde(deserialize_with = "name::of_model")]
    pub model: Name,
    /// Leaf area index.
    pub lai: f64,
    /// From the mirror to the row plane, metres.
    pub distance_m: f64,
    /// The row's seed.
    pub seed: u64,
    /// Its leaves, m².
    pub truth_m2: f64,
    /// What rays read of it, no calibration, m².
    pub rays_m2: f64,
    /// What the eye reads with a constant for clumps, no calibration, m².
    pub eye_m2: f64,
    /// Contact of blocks of beams over that of the beams.
    pub closed: f64,
}

impl ClumpingRow {
    /// What the constant leaves, ln.
    fn ln_factor(&self) -> f64 {
        (self.rays_m2 / self.eye_m2).ln()
    }

    fn ln_closed(&self) -> f64 {
        self.closed.ln()
    }
}

/// A scanner's law: the first six columns are those that estimates read.
#[derive(Clone, Debug, Serialize)]
pub struct ClumpingFit {
    /// The scanner.
    pub model: &'static str,
    /// ln of the factor where the measure is 1.
    pub constant: f64,
    /// Its slope over ln `closed`.
    pub slope: f64,
    /// Root mean square of eye / rays − 1 over training systems that were left out of the fit.
    pub relative_sd: f64,
    /// The smallest `closed`.
    pub closed_low: f64,
    /// The largest.
    pub closed_high: f64,
    /// Rows.
    pub rows: usize,
    /// Median of |eye / rays − 1| over training systems left out.
    pub left_out_median: f64,
    /// The same of the constant.
    pub constant_median: f64,
    /// Root mean square of eye / rays − 1 by the constant.
    pub constant_sd: f64,
}

/// How wrong a part of the rows is by the constant, and by a law that was fitted without its training system: means of eye / rays − 1.
#[derive(Clone, Debug, Serialize)]
pub struct ClumpingPart {
    /// The scanner.
    pub model: &'static str,
    /// What the rows share.
    pub part: String,
    /// Rows.
    pub rows: usize,
    /// By the constant.
    pub constant: f64,
    /// By the law.
    pub law: f64,
}

/// All that is found.
#[derive(Clone, Debug, Serialize)]
pub struct ClumpingReport {
    /// A law a scanner.
    pub laws: Vec<ClumpingFit>,
    /// By training system, leaf area index and distance.
    pub parts: Vec<ClumpingPart>,
    /// The rows.
    pub rows: Vec<ClumpingRow>,
}

/// Why no law was found.
#[derive(Debug, thiserror::Error)]
pub enum ClumpingError {
    /// A row that could not be tried.
    #[error(transparent)]
    Trial(#[from] TrialError),
    /// Rows that fit no law.
    #[error(
        "{model}: expected three rows and more of either of two training systems at least, whose measures differ, found {rows} of {systems}: name more scenes, densities or seeds"
    )]
    TooAlike {
        /// The scanner.
        model: &'static str,
        /// Its rows that were told.
        rows: usize,
        /// Their training systems.
        systems: usize,
    },
}

/// Rows that [`try_clumping`] tries.
pub fn rows(asked: &ClumpingStudy) -> usize {
    places(asked).count()
}

fn places(asked: &ClumpingStudy) -> impl Iterator<Item = (&Scene, AnyModel, f64, f64, u64)> {
    let ClumpingStudy { scenes, lais, seeds, models, distances_m } = asked;
    let of_scene = move |scene| models.iter().map(move |model| (scene, *model));
    let of_density = move |(scene, model)| lais.iter().map(move |lai| (scene, model, *lai));
    let of_place =
        move |(scene, model, lai)| distances_m.iter().map(move |metres| (scene, model, lai, *metres));
    scenes.iter().flat_map(of_scene).flat_map(of_density).flat_map(of_place).flat_map(
        move |(scene, model, lai, metres)| seeds.iter().map(move |seed| (scene, model, lai, metres, *seed)),
    )
}

/// Tries everything; `done` hears of every row that is through.
///
/// # Errors
/// The first row that could not be tried, and rows that fit no law.
pub fn try_clumping(
    asked: &ClumpingStudy,
    archive: &Archive,
    done: &(dyn Fn() + Sync),
) -> Result<ClumpingReport, ClumpingError> {
    let places: Vec<_> = places(asked).collect();
    let found: Vec<Option<ClumpingRow>> = places
        .par_iter()
        .map(|(scene, model, lai, distance_m, seed)| {
            let mut scene = (*scene).clone();
            scene.orchard.target_lai = Some(*lai);
            let scene = placed(&scene, *model, *distance_m, *seed);
            let depends = || {
                let pass = Depends::on_pass(&scene, model.name());
                Some(pass.and("lai", lai).and("distance_m", distance_m))
            };
            let row = archive.row("clumping", depends, |notes| {
                row(scene.clone(), *model, *lai, *distance_m, *seed, notes)
            });
            done();
            row
        })
        .collect::<Result<_, TrialError>>()?;
    let rows: Vec<ClumpingRow> = found.into_iter().flatten().collect();
    let (mut laws, mut parts) = (Vec::new(), Vec::new());
    for model in &asked.models {
        let of_model: Vec<&ClumpingRow> = rows.iter().filter(|row| row.model == model.name()).collect();
        let (law, left_out) = fit(model.name(), &of_model)?;
        laws.push(law);
        parts.extend(parted(model.name(), &of_model, &left_out));
    }
    Ok(ClumpingReport { laws, parts, rows })
}

/// None where an estimate is withheld, or beams have no width.
fn row(
    mut scene: Scene,
    model: AnyModel,
    lai: f64,
    distance_m: f64,
    seed: u64,
    notes: &mut RowNotes,
) -> Result<Option<ClumpingRow>, TrialError> {
    let name = scene.orchard.preset.to_string();
    let grown = Stage::grow(scene.clone(), &|_, _| {})?;
    let truth_m2 = grown.truth(0).leaf_area_m2;
    let mut pass = |stages| -> Result<Estimate, TrialError> {
        scene.optics.stages = stages;
        let stage = grown.beside(scene.clone());
        let rig = rig_with(&stage.rig, 0, model.name());
        let Reading { mut pipeline, cola, lms2xx } =
            Reading::of(Some(&rig), 0, true, CalibrationChoice::Given(None))?;
        each_scan(&stage, model, StartUpRequests { cola, lms2xx }, &mut |scan| pipeline.push(scan))?;
        Ok(pipeline.finish())
    };
    let (rays, eye) = (pass(Stages::default())?, pass(Stages::device())?);
    [&rays, &eye].into_iter().for_each(|estimate| notes.add(estimate));
    let raw = |estimate: &Estimate| estimate.leaf.areas.contact_raw_m2().ok().filter(|m2| *m2 > 0.0);
    let clumping = eye.contact.and_then(|contact| contact.clumping);
    let told = raw(&rays).zip(raw(&eye)).zip(clumping);
    Ok(told.map(|((rays_m2, eye_m2), clumping)| ClumpingRow {
        scene: name,
        model: model.name(),
        lai,
        distance_m,
        seed,
        truth_m2,
        rays_m2,
        eye_m2,
        closed: clumping.closed,
    }))
}

/// The law of a scanner's rows, and what each row reads over rays by a law that was fitted without its training system.
fn fit(model: &'static str, rows: &[&ClumpingRow]) -> Result<(ClumpingFit, Vec<f64>), ClumpingError> {
    let mut systems: Vec<&str> = rows.iter().map(|row| row.scene.as_str()).collect();
    systems.sort_unstable();
    systems.dedup();
    let too_alike = ClumpingError::TooAlike { model, rows: rows.len(), systems: systems.len() };
    let law_of = |rows: &[&ClumpingRow]| -> Option<FittedLine> {
        let (x, y): (Vec<f64>, Vec<f64>) = rows.iter().map(|row| (row.ln_closed(), row.ln_factor())).unzip();
        FittedLine::fit(&x, &y)
    };
    let without = |system: &str| -> Option<FittedLine> {
        let others: Vec<&ClumpingRow> = rows.iter().filter(|row| row.scene != system).copied().collect();
        law_of(&others)
    };
    let laws: Option<Vec<(&str, FittedLine)>> =
        systems.iter().map(|system| Some((*system, without(system)?))).collect();
    let (Some(law), Some(laws)) = (law_of(rows), laws) else { return Err(too_alike) };
    let by_law = |row: &&ClumpingRow| {
        let of_system = laws.iter().find(|(system, _)| *system == row.scene);
        of_system.map_or(f64::NAN, |(_, law)| (law.at(row.ln_closed()) - row.ln_factor()).exp() - 1.0)
    };
    let left_out: Vec<f64> = rows.iter().map(by_law).collect();
    let constant: Vec<f64> = rows.iter().map(|row| row.eye_m2 / row.rays_m2 - 1.0).collect();
    let typical =
        |errors: &[f64]| median(errors.iter().map(|error| error.abs()).collect()).unwrap_or(f64::NAN);
    let low = |of: fn(&ClumpingRow) -> f64| rows.iter().map(|row| of(row)).fold(f64::INFINITY, f64::min);
    let high = |of: fn(&ClumpingRow) -> f64| rows.iter().map(|row| of(row)).fold(0.0, f64::max);
    let law = ClumpingFit {
        model,
        constant: law.intercept,
        slope: law.slope,
        relative_sd: rms(&left_out),
        closed_low: low(|row| row.closed),
        closed_high: high(|row| row.closed),
        rows: rows.len(),
        left_out_median: typical(&left_out),
        constant_median: typical(&constant),
        constant_sd: rms(&constant),
    };
    Ok((law, left_out))
}

/// By training system, leaf area index and distance.
fn parted(model: &'static str, rows: &[&ClumpingRow], left_out: &[f64]) -> Vec<ClumpingPart> {
    let names: [fn(&ClumpingRow) -> String; 3] =
        [|row| row.scene.clone(), |row| format!("LAI {}", row.lai), |row| format!("{} m", row.distance_m)];
    let mut parts = Vec::new();
    for name in names {
        let mut of_kind: Vec<String> = Vec::new();
        for row in rows {
            let name = name(row);
            if !of_kind.contains(&name) {
                of_kind.push(name);
            }
        }
        parts.extend(of_kind.into_iter().map(|part| {
            let of_part: Vec<[f64; 2]> = rows
                .iter()
                .zip(left_out)
                .filter(|(row, _)| name(row) == part)
                .map(|(row, by_law)| [row.eye_m2 / row.rays_m2 - 1.0, *by_law])
                .collect();
            let mean = |of: usize| of_part.iter().map(|pair| pair[of]).sum::<f64>() / of_part.len() as f64;
            ClumpingPart { model, rows: of_part.len(), constant: mean(0), law: mean(1), part }
        }));
    }
    parts
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(scene: &str, closed: f64, factor: f64) -> ClumpingRow {
        ClumpingRow {
            scene: scene.to_owned(),
            model: "lms111",
            lai: 1.2,
            distance_m: 2.0,
            seed: 1,
            truth_m2: 20.0,
            rays_m2: 20.0 * factor,
            eye_m2: 20.0,
            closed,
        }
    }

    /// Rows that follow a law to the last digit.
    fn lawful() -> Vec<ClumpingRow> {
        let of = |(at, closed): (usize, &f64)| {
            let scene = ["spindle", "vase", "hedge"][at % 3];
            row(scene, *closed, (0.3 + 1.1 * closed.ln()).exp())
        };
        [0.6, 0.5, 0.7, 0.65, 0.75, 0.55].iter().enumerate().map(of).collect()
    }

    #[test]
    fn a_law_is_found_again_and_holds_for_systems_left_out() {
        let rows = lawful();
        let (law, left_out) = fit("lms111", &rows.iter().collect::<Vec<_>>()).expect("a law");
        assert!((law.constant - 0.3).abs() < 1e-9 && (law.slope - 1.1).abs() < 1e-9, "{law:?}");
        assert!(law.relative_sd < 1e-9, "{law:?}");
        assert_eq!((law.closed_low, law.closed_high, law.rows), (0.5, 0.75, 6));
        assert!(left_out.iter().all(|error| error.abs() < 1e-9) && law.constant_median > 0.1);
    }

    #[test]
    fn a_system_of_its_own_kind_is_told_by_what_the_others_make_of_it() {
        let mut rows = lawful();
        for row in rows.iter_mut().filter(|row| row.scene == "hedge") {
            row.rays_m2 *= 1.3;
        }
        let (law, left_out) = fit("lms111", &rows.iter().collect::<Vec<_>>()).expect("a law");
        let hedge = rows.iter().zip(&left_out).filter(|(row, _)| row.scene == "hedge");
        assert!(hedge.clone().all(|(_, error)| (error - (1.0 / 1.3 - 1.0)).abs() < 1e-9), "{left_out:?}");
        assert!(law.relative_sd > 0.1, "{law:?}");
    }

    #[test]
    fn rows_of_one_system_are_no_law() {
        let rows: Vec<ClumpingRow> =
            lawful().into_iter().map(|row| ClumpingRow { scene: "vase".to_owned(), ..row }).collect();
        let refused = fit("lms111", &rows.iter().collect::<Vec<_>>()).expect_err("one system");
        assert!(matches!(refused, ClumpingError::TooAlike { rows: 6, systems: 1, .. }), "{refused}");
    }

    #[test]
    fn parts_are_means_over_what_their_rows_share() {
        let rows = lawful();
        let refs: Vec<&ClumpingRow> = rows.iter().collect();
        let parts = parted("lms111", &refs, &[0.1, 0.2, 0.3, 0.3, 0.4, 0.5]);
        let names: Vec<&str> = parts.iter().map(|part| part.part.as_str()).collect();
        assert_eq!(names, ["spindle", "vase", "hedge", "LAI 1.2", "2 m"]);
        assert!((parts[0].law - 0.2).abs() < 1e-12 && parts[3].rows == 6, "{parts:?}");
    }
}
