//! Single trees and metres against the truth: how far each is off beside its row, how unlike they truly are, and what is gained by drawing them toward the row's mean.

use rayon::prelude::*;
use rowscan_canopy::regression::{FittedLine, mean};
use rowscan_canopy::{BandEstimate, Estimate, PieceLeaf, Pipeline, Withheld};
use rowscan_emulator::stage::Stage as Set;
use rowscan_protocol::model::AnyModel;
use rowscan_scenes::optics::Stages;
use rowscan_scenes::{Scene, TruthGrid};
use serde::{Deserialize, Serialize};

use crate::archive::{Archive, Depends};
use crate::class::row_class;
use crate::eye::placed;
use crate::height_truth::TruthByBand;
use crate::name::{self, Name};
use crate::notes::RowNotes;
use crate::nursery::Nursery;
use crate::reading::{ReadingError, rig_with};
use crate::trial::{ByHitsAndShares, TrialError, each_scan};
use crate::{median, rms};

/// Length of the truth's slabs, metres.
const SLAB_M: f64 = 0.05;
/// Metres that pieces of several metres are made of.
const METRES: [usize; 3] = [1, 2, 3];
/// A metre counts where so much of it was scanned.
const WHOLE: f64 = 0.97;

/// What is tried.
#[derive(Clone, Debug)]
pub struct PiecesStudy {
    /// Scenes; by rays, and with all stages of the eye.
    pub scenes: Vec<Scene>,
    /// Rows of each.
    pub seeds: Vec<u64>,
    /// Scanners.
    pub models: Vec<AnyModel>,
    /// From the mirror to the row plane, metres.
    pub distances_m: Vec<f64>,
    /// Height of a band of the profile, metres.
    pub band_m: f64,
}

/// How pieces were measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Way {
    /// What a hit counts: `contact` or `share`.
    #[serde(deserialize_with = "name::of_way")]
    pub count: Name,
    /// `rays` or `eye`.
    #[serde(deserialize_with = "name::of_way")]
    pub beams: Name,
}

/// All ways, in the order of tables.
const WAYS: [Way; 3] = [
    Way { count: "contact", beams: "rays" },
    Way { count: "contact", beams: "eye" },
    Way { count: "share", beams: "eye" },
];

/// Pieces of one kind, measured one way, over all rows.
#[derive(Clone, Debug, Serialize)]
pub struct PiecesFound {
    /// How.
    #[serde(flatten)]
    pub way: Way,
    /// The scenes that they stand in, with a plus between them.
    pub scenes: String,
    /// The scanner.
    pub model: &'static str,
    /// From the mirror to the row plane, metres.
    pub distance_m: f64,
    /// `tree`, or the piece's length; `band` and `tree band` are bands of height of rows and of trees, all heights taken as one row.
    pub piece: String,
    /// Pieces that have a number.
    pub pieces: usize,
    /// Rows whose leaf area is withheld when measured this way: none of their pieces has a number.
    pub rows_withheld: usize,
    /// Correlation of estimate and truth, both over their row's mean; as measured. As all that follows: `None` where fewer than three pieces have a number.
    pub r: Option<f64>,
    /// Standard deviation of the error of both over their row's mean; as measured.
    pub error_sd: Option<f64>,
    /// Standard deviation of the truth over its row's mean.
    pub truth_sd: Option<f64>,
    /// Share of the variance of measured pieces that is true.
    pub reliability: Option<f64>,
    /// Root mean square of estimate − truth over the row's true mean, as measured; the row's own error is part of it.
    pub rmse_unshrunk: Option<f64>,
    /// The same of what the estimate calls the leaf area.
    pub rmse: Option<f64>,
    /// Share of the intervals that hold the truth; `None` of pieces that an estimate does not list.
    pub holds: Option<f64>,
    /// Half of an interval's width over the row's true mean.
    pub half_width: Option<f64>,
    /// Median of |estimate − truth| over the piece's own truth; of pieces that hold leaf.
    pub median_error: Option<f64>,
}

/// One piece beside its truth.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Pair {
    pub(crate) length_m: f64,
    pub(crate) unshrunk_m2: f64,
    pub(crate) leaf_m2: f64,
    pub(crate) interval_m2: Option<[f64; 2]>,
    pub(crate) truth_m2: f64,
}

/// The pieces of one row, by one way; no kinds where it withholds the row.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct RowPieces {
    way: Way,
    kinds: Vec<(String, Vec<Pair>)>,
}

/// Fewest pieces whose scatter is told.
const FEWEST: usize = 3;

/// Tries everything; `done` hears of every pass that is through.
///
/// # Errors
/// The first row that could not be tried.
pub fn try_pieces(
    asked: &PiecesStudy,
    archive: &Archive,
    done: &(dyn Fn() + Sync),
) -> Result<Vec<PiecesFound>, TrialError> {
    let (mut found, nursery) = (Vec::new(), Nursery::default());
    let scenes = asked.scenes.iter().map(|scene| scene.name.as_str()).collect::<Vec<_>>().join("+");
    for (model, distance_m) in places(asked) {
        let passes: Vec<(&Scene, u64, bool)> = asked
            .scenes
            .iter()
            .flat_map(|scene| asked.seeds.iter().map(move |seed| (scene, *seed)))
            .flat_map(|(scene, seed)| [false, true].map(|eye| (scene, seed, eye)))
            .collect();
        let rows: Vec<Vec<RowPieces>> = passes
            .par_iter()
            .map(|&(scene, seed, eye)| {
                let mut scene = placed(scene, model, distance_m, seed);
                scene.optics.stages = if eye { Stages::device() } else { Stages::default() };
                let depends = || Some(Depends::on_pass(&scene, model.name()).and("band_m", &asked.band_m));
                let look =
                    |notes: &mut RowNotes| pass(scene.clone(), (model, eye), asked.band_m, &nursery, notes);
                let rows = archive.row("pieces", depends, look);
                done();
                rows
            })
            .collect::<Result<_, _>>()?;
        let rows: Vec<RowPieces> = rows.into_iter().flatten().collect();
        for way in WAYS {
            let of_way: Vec<&RowPieces> = rows.iter().filter(|row| row.way == way).collect();
            found.extend(summed_up(way, (&scenes, model.name(), distance_m), &of_way));
        }
    }
    Ok(found)
}

/// Passes that [`try_pieces`] makes.
pub fn passes(asked: &PiecesStudy) -> usize {
    2 * asked.scenes.len() * asked.seeds.len() * places(asked).count()
}

fn places(asked: &PiecesStudy) -> impl Iterator<Item = (AnyModel, f64)> + '_ {
    asked.models.iter().flat_map(|model| asked.distances_m.iter().map(|distance_m| (*model, *distance_m)))
}

fn pass(
    scene: Scene,
    (model, eye): (AnyModel, bool),
    band_m: f64,
    nursery: &Nursery,
    notes: &mut RowNotes,
) -> Result<Vec<RowPieces>, TrialError> {
    let set = nursery.grow(scene)?;
    let rig = rig_with(&set.rig, 0, model.name());
    let ByHitsAndShares { by_hits, by_shares, asked } = ByHitsAndShares::of(&rig, eye)?;
    let class = row_class(&set.scene, &set.truth(0));
    let profiled = |pipeline: Pipeline| pipeline.with_profile(band_m).map_err(ReadingError::from);
    let mut pipelines = vec![("contact", profiled(by_hits.of_class(class.clone()))?)];
    if let Some(pipeline) = by_shares {
        pipelines.push(("share", profiled(pipeline.of_class(class))?));
    }
    each_scan(&set, model, asked, &mut |scan| {
        for (_, pipeline) in &mut pipelines {
            pipeline.push(scan);
        }
    })?;
    let truth = TruthBySlab::of(&set);
    let bands = TruthByBand::of((&set.orchard, set.row_seen(0)), band_m, rig.first_line_m(0));
    let beams = if eye { "eye" } else { "rays" };
    let spacing_m = rig.tree_spacing_m.unwrap_or(1.0);
    Ok(pipelines
        .into_iter()
        .map(|(count, mut pipeline)| (count, pipeline.finish()))
        .inspect(|(_, estimate)| notes.add(estimate))
        // A rig that reads no remission has no shares to go by: it was not tried that way.
        .filter(|(count, estimate)| {
            *count != "share" || estimate.leaf.areas.share_m2() != Err(Withheld::NoShares)
        })
        .map(|(count, estimate)| {
            // A row whose shares contact does not bear out goes by contact: it tells nothing of shares.
            let has_shares = estimate.leaf.areas.share_m2().is_ok();
            let is_told = estimate.leaf.areas.best_m2().is_ok() && (count == "share") == has_shares;
            let kinds = || [kinds(&estimate, &truth, spacing_m), band_kinds(&estimate, &bands)].concat();
            RowPieces { way: Way { count, beams }, kinds: is_told.then(kinds).unwrap_or_default() }
        })
        .collect())
}

/// The true leaf area of the row that the first scanner sees, by slab.
pub(crate) struct TruthBySlab(Vec<f64>);

impl TruthBySlab {
    pub(crate) fn of(set: &Set) -> Self {
        let grid = TruthGrid { slab_m: SLAB_M, ..TruthGrid::default() };
        let row = set.row_seen(0).row;
        Self(set.orchard.truth_of_row(row, grid).slabs.iter().map(|slab| slab.leaf_area_m2).collect())
    }

    /// Between two places of the row, which are faces of slabs; `None` where the row does not reach.
    fn between(&self, [from_m, to_m]: [f64; 2]) -> Option<f64> {
        let at = |y_m: f64| (y_m / SLAB_M).round() as usize;
        if from_m < -1e-9 {
            return None;
        }
        Some(self.0.get(at(from_m)..at(to_m))?.iter().sum())
    }
}

/// A piece of so much row around its middle, beside its truth.
fn pair(leaf: &PieceLeaf, y_m: f64, length_m: f64, truth: &TruthBySlab) -> Option<Pair> {
    Some(Pair {
        length_m,
        unshrunk_m2: leaf.unshrunk.ok()?,
        leaf_m2: leaf.areas.best_m2().ok()?,
        interval_m2: leaf.interval_m2,
        truth_m2: truth.between([y_m - length_m / 2.0, y_m + length_m / 2.0])?,
    })
}

/// The whole trees of an estimate beside their truth.
pub(crate) fn trees(estimate: &Estimate, truth: &TruthBySlab, spacing_m: f64) -> Vec<Pair> {
    let whole = estimate.trees.iter().filter(|tree| tree.complete);
    whole.filter_map(|tree| pair(&tree.leaf, tree.y_m, spacing_m, truth)).collect()
}

fn kinds(estimate: &Estimate, truth: &TruthBySlab, spacing_m: f64) -> Vec<(String, Vec<Pair>)> {
    let whole = estimate.slices.iter().filter(|slice| slice.scanned_m >= WHOLE);
    let metres: Vec<Pair> = whole.filter_map(|slice| pair(&slice.leaf, slice.y_m, 1.0, truth)).collect();
    let mut kinds = vec![("tree".to_owned(), trees(estimate, truth, spacing_m))];
    for count in METRES {
        kinds.push((format!("{count} m"), metres.chunks_exact(count).map(joined).collect()));
    }
    kinds
}

/// The bands of an estimate beside their truth: those of the row, and those of its whole trees. Bands without a leaf are left out.
fn band_kinds(estimate: &Estimate, truth: &TruthByBand) -> Vec<(String, Vec<Pair>)> {
    let Some(profile) = &estimate.profile else { return Vec::new() };
    let pairs = |bands: &[BandEstimate], truth_m2: Option<Vec<f64>>| -> Vec<Pair> {
        let of_truth = truth_m2.into_iter().flatten();
        let beside = bands.iter().zip(of_truth).filter(|(_, truth_m2)| *truth_m2 > 0.0);
        let pair = |(band, truth_m2): (&BandEstimate, f64)| {
            let leaf_m2 = band.leaf_area_m2?;
            let interval_m2 = band.leaf_area_interval_m2;
            Some(Pair { length_m: 1.0, unshrunk_m2: leaf_m2, leaf_m2, interval_m2, truth_m2 })
        };
        beside.filter_map(pair).collect()
    };
    let whole = estimate.trees.iter().filter(|tree| tree.complete);
    let of_trees = whole.filter_map(|tree| {
        let told = profile.trees.iter().find(|told| told.tree == tree.tree)?;
        Some(pairs(&told.bands, truth.of_tree(tree.tree, told.bands.len())))
    });
    vec![
        ("band".to_owned(), pairs(&profile.row, truth.of_row(estimate, profile.row.len()))),
        ("tree band".to_owned(), of_trees.flatten().collect()),
    ]
}

/// Several metres as one piece; an estimate lists single ones only.
fn joined(metres: &[Pair]) -> Pair {
    let sum = |of: fn(&Pair) -> f64| metres.iter().map(of).sum();
    let interval_m2 = metres.first().filter(|_| metres.len() == 1).and_then(|metre| metre.interval_m2);
    Pair {
        length_m: sum(|metre| metre.length_m),
        unshrunk_m2: sum(|metre| metre.unshrunk_m2),
        leaf_m2: sum(|metre| metre.leaf_m2),
        interval_m2,
        truth_m2: sum(|metre| metre.truth_m2),
    }
}

/// The scenes, the scanner, and how far it is from the row plane, metres.
type Place<'a> = (&'a str, &'static str, f64);

fn summed_up(way: Way, place: Place<'_>, rows: &[&RowPieces]) -> Vec<PiecesFound> {
    let withheld = rows.iter().filter(|row| row.kinds.is_empty()).count();
    let told = rows.iter().find(|row| !row.kinds.is_empty());
    let names: Vec<&str> =
        told.map_or(vec!["tree"], |row| row.kinds.iter().map(|kind| kind.0.as_str()).collect());
    // Beams that no row was tried by have no line.
    let names = names.into_iter().filter(|_| !rows.is_empty());
    names
        .map(|name| {
            let of_kind = rows.iter().filter_map(|row| row.kinds.iter().find(|kind| kind.0 == *name));
            let of_kind: Vec<&[Pair]> = of_kind.map(|kind| kind.1.as_slice()).collect();
            kind_summed_up(way, place, name, withheld, &of_kind)
        })
        .collect()
}

fn kind_summed_up(
    way: Way,
    (scenes, model, distance_m): Place<'_>,
    piece: &str,
    rows_withheld: usize,
    rows: &[&[Pair]],
) -> PiecesFound {
    let (mut found, mut truths, mut unshrunk, mut drawn) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    let mut intervals = Vec::new();
    for row in rows {
        let density = |of: fn(&Pair) -> f64| {
            row.iter().map(of).sum::<f64>() / row.iter().map(|pair| pair.length_m).sum::<f64>()
        };
        let (mean_found, mean_truth) = (density(|pair| pair.unshrunk_m2), density(|pair| pair.truth_m2));
        if !(mean_found > 0.0 && mean_truth > 0.0) {
            continue;
        }
        for pair in *row {
            let unit_m2 = mean_truth * pair.length_m;
            found.push(pair.unshrunk_m2 / (mean_found * pair.length_m) - 1.0);
            truths.push(pair.truth_m2 / unit_m2 - 1.0);
            unshrunk.push((pair.unshrunk_m2 - pair.truth_m2) / unit_m2);
            drawn.push((pair.leaf_m2 - pair.truth_m2) / unit_m2);
            intervals
                .extend(pair.interval_m2.map(|[low, high]| {
                    ((low..=high).contains(&pair.truth_m2), (high - low) / 2.0 / unit_m2)
                }));
        }
    }
    let known = |value: f64| (found.len() >= FEWEST).then_some(value);
    let errors: Vec<f64> = found.iter().zip(&truths).map(|(found, truth)| found - truth).collect();
    let (error_sd, truth_sd, seen_sd) = (rms(&errors), rms(&truths), rms(&found));
    let own: Vec<f64> = rows
        .iter()
        .flat_map(|row| row.iter())
        .filter(|pair| pair.truth_m2 > 0.0)
        .map(|pair| (pair.leaf_m2 / pair.truth_m2 - 1.0).abs())
        .collect();
    let products: Vec<f64> = found.iter().zip(&truths).map(|(found, truth)| found * truth).collect();
    let of_intervals = |of: fn(&(bool, f64)) -> f64| {
        let values: Vec<f64> = intervals.iter().map(of).collect();
        (!values.is_empty()).then(|| mean(&values)).and_then(known)
    };
    PiecesFound {
        way,
        scenes: scenes.to_owned(),
        model,
        distance_m,
        piece: piece.to_owned(),
        pieces: found.len(),
        rows_withheld,
        r: known(mean(&products) / (seen_sd * truth_sd)).filter(|r| r.is_finite()),
        error_sd: known(error_sd),
        truth_sd: known(truth_sd),
        reliability: known(truth_sd.powi(2) / (truth_sd.powi(2) + error_sd.powi(2))),
        rmse_unshrunk: known(rms(&unshrunk)),
        rmse: known(rms(&drawn)),
        holds: of_intervals(|interval| f64::from(u8::from(interval.0))),
        half_width: of_intervals(|interval| interval.1),
        median_error: median(own).and_then(known),
    }
}

/// The table that estimates take the error of pieces from: canopy's `pieces.csv`. Laws of the length are fitted to pieces of 1, 2 and 3 m.
pub fn table(found: &[PiecesFound], about: &str) -> String {
    let mut text = format!(
        "{about}count,beams,model,distance_m,error_sd,error_exponent,truth_sd,truth_exponent,pieces\n"
    );
    let metres = |row: &PiecesFound| METRES.iter().copied().find(|metres| row.piece == format!("{metres} m"));
    for first in found.iter().filter(|row| metres(row) == Some(1)) {
        let of_place = || {
            found.iter().filter(|row| {
                row.way == first.way && row.model == first.model && row.distance_m == first.distance_m
            })
        };
        let law = |sd: fn(&PiecesFound) -> Option<f64>| {
            let points = of_place().filter_map(|row| Some(((metres(row)? as f64).ln(), sd(row)?.ln())));
            let (x, y): (Vec<f64>, Vec<f64>) = points.unzip();
            let line = FittedLine::fit(&x, &y)?;
            let exponent = (-line.slope).clamp(0.0, 0.9);
            Some(format!("{:.4},{exponent:.3}", line.intercept.exp()))
        };
        let laws = law(|row| row.error_sd).zip(law(|row| row.truth_sd));
        if let Some((error, truth)) = laws {
            let Way { count, beams } = first.way;
            let (model, distance_m, pieces) = (first.model, first.distance_m, first.pieces);
            text.push_str(&format!("{count},{beams},{model},{distance_m},{error},{truth},{pieces}\n"));
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn metre(unshrunk_m2: f64, truth_m2: f64) -> Pair {
        let interval_m2 = Some([truth_m2 - 0.5, truth_m2 + 0.5]);
        Pair { length_m: 1.0, unshrunk_m2, leaf_m2: truth_m2, interval_m2, truth_m2 }
    }

    #[test]
    fn a_rows_own_error_is_none_of_its_pieces() {
        // Every metre 20 % high: pieces are right beside their row, and wrong by the row's error.
        let row: Vec<Pair> = [4.0, 5.0, 6.0, 5.0].map(|truth_m2| metre(1.2 * truth_m2, truth_m2)).to_vec();
        let found = kind_summed_up(WAYS[1], ("spindle", "lms111", 2.0), "1 m", 0, &[&row]);
        assert!(
            found.error_sd.expect("told") < 1e-12 && (found.r.expect("a correlation") - 1.0).abs() < 1e-12,
            "{found:?}"
        );
        let truths: f64 = (0.04 * 2.0 / 4.0f64).sqrt();
        assert!((found.truth_sd.expect("told") - truths).abs() < 1e-12, "{found:?}");
        assert_eq!(found.reliability, Some(1.0));
        let rmse = found.rmse_unshrunk.expect("told");
        assert!((rmse - 0.2 * (1.0 + truths * truths).sqrt()).abs() < 1e-12, "{found:?}");
        assert_eq!((found.rmse, found.holds, found.half_width), (Some(0.0), Some(1.0), Some(0.1)));
    }

    #[test]
    fn rows_that_are_withheld_are_counted_and_too_few_pieces_have_no_scatter() {
        let row = |kinds: Vec<(String, Vec<Pair>)>| RowPieces { way: WAYS[2], kinds };
        let two = row(vec![("tree".to_owned(), vec![metre(4.0, 4.5), metre(5.0, 6.0)])]);
        let place = ("spindle", "lms111", 2.0);
        let found = summed_up(WAYS[2], place, &[&two, &row(Vec::new()), &row(Vec::new())]);
        assert_eq!((found[0].pieces, found[0].rows_withheld), (2, 2));
        assert_eq!((found[0].r, found[0].rmse, found[0].median_error), (None, None, None));
        let none = summed_up(WAYS[2], place, &[&row(Vec::new())]);
        assert_eq!((none[0].pieces, none[0].rows_withheld, none[0].error_sd), (0, 1, None));
        assert!(summed_up(WAYS[2], place, &[]).is_empty(), "rows without shares were not tried");
    }

    #[test]
    fn joined_metres_have_no_interval_and_the_table_has_a_law_of_the_length() {
        let metres: Vec<Pair> = (0..12).map(|k| metre(5.0 + f64::from(k % 2), 5.0)).collect();
        let of = |count: usize| metres.chunks_exact(count).map(joined).collect::<Vec<_>>();
        assert_eq!(of(2)[0].interval_m2, None);
        let found: Vec<PiecesFound> = METRES
            .iter()
            .map(|&count| {
                let (two, row) =
                    ([metre(4.0, 4.5), metre(5.0, 6.0), metre(6.5, 5.0), metre(4.0, 4.0)], of(count));
                let both = [row, two.to_vec()].concat();
                kind_summed_up(WAYS[0], ("spindle", "lms111", 1.0), &format!("{count} m"), 0, &[&both])
            })
            .collect();
        let text = table(&found, "# made here\n");
        let line = text.lines().last().expect("a line");
        assert!(line.starts_with("contact,rays,lms111,1,0."), "{text}");
        assert_eq!(line.split(',').count(), 9);
    }
}
