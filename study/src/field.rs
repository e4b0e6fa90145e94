//! Pieces of real rows whose leaf area was measured by hand, beside what scans of them tell: a calibration from them, tried on pieces that it was not fitted on, and how
//! many pieces it takes.

mod plan;
mod sheet;

use rowscan_canopy::calibration::{
    CalibrationClass, ClumpingBy, FitError, MIN_SAMPLES, Provenance, Sample, fit,
};
use rowscan_canopy::regression::{Z95, mean, student_t_95};
use rowscan_canopy::{Calibration, Estimate, PieceLeaf, Withheld};
use serde::Serialize;

use crate::{moments, rms};

pub use plan::{Planned, plan};
pub use sheet::{MeasuredPiece, SheetError, read};

/// A piece's ends are those of metres or of a tree up to so much, metres.
const AT_FACE_M: f64 = 0.005;
/// A metre, or a tree, counts if so much of it was scanned.
const WHOLE: f64 = 0.99;
/// How many times what scans tell, without a factor, real leaf areas are: through wide beams dense rows read a third, and thin ones twice.
const PLAUSIBLE: std::ops::RangeInclusive<f64> = 0.1..=10.0;
/// Fewest recordings whose means tell how far the factor may be off.
const RECORDINGS: usize = 3;

/// Why measured pieces give no calibration.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FieldError {
    /// The ends of a piece are none of the estimate's.
    #[error(
        "line {line}: from {from_m} to {to_m} m: expected whole metres of the row, or one tree ({trees}); found neither"
    )]
    Ends {
        /// Of the sheet.
        line: u64,
        /// The piece's beginning.
        from_m: f64,
        /// Its end.
        to_m: f64,
        /// Where trees are, in words.
        trees: String,
    },
    /// The scans do not reach over a piece.
    #[error(
        "line {line}: from {from_m} to {to_m} m: {recording} holds scans of {scanned}; leave the piece out, or name the recording that passes it"
    )]
    NotScanned {
        /// Of the sheet.
        line: u64,
        /// The piece's beginning.
        from_m: f64,
        /// Its end.
        to_m: f64,
        /// The file.
        recording: String,
        /// What of the row they reach over, in words.
        scanned: String,
    },
    /// The estimate tells no leaf area of a piece.
    #[error("line {line}: the scans of {recording} tell no leaf area: {why}")]
    Withheld {
        /// Of the sheet.
        line: u64,
        /// The file.
        recording: String,
        /// Why.
        why: Withheld,
    },
    /// Too few pieces to leave any out.
    #[error(
        "expected {expected} pieces or more, so that a fit remains where one is left out; found {found}: measure more"
    )]
    TooFew {
        /// Fewest.
        expected: usize,
        /// Given.
        found: usize,
    },
    /// What was measured is quite another quantity than what was scanned.
    #[error(
        "the measured leaf areas are {factor:.3} times what the scans tell: expected 0.1 to 10 times; are they one-sided, in m², of these pieces and recordings?"
    )]
    Implausible {
        /// How many times.
        factor: f64,
    },
    /// No calibration fits them.
    #[error(transparent)]
    Fit(#[from] FitError),
}

/// A measured piece beside its scans.
#[derive(Clone, Debug)]
pub struct ScannedPiece {
    /// What was measured.
    pub measured: MeasuredPiece,
    /// The same for a fit.
    pub sample: Sample,
    /// What the rig's own calibration makes of the scans, m²; none without one.
    pub before_m2: Option<f64>,
    /// Raw leaf area a metre of the row that it is of, m²/m.
    pub row_raw_m2_per_m: f64,
}

/// A piece in the report.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FieldPiece {
    /// The file of its scans.
    pub recording: String,
    /// Its beginning along the row, metres.
    pub from_m: f64,
    /// Its end, metres.
    pub to_m: f64,
    /// Measured leaf area, m².
    pub measured_m2: f64,
    /// By contact, no factor, m².
    pub raw_m2: f64,
    /// By the rig's own calibration, m²; none without one.
    pub before_m2: Option<f64>,
    /// By a calibration that was fitted without this piece (without its recording, where there are others), m².
    pub left_out_m2: f64,
}

/// How far an estimate of measured pieces is off.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct FieldErrors {
    /// Mean of estimate − measured over the mean measured.
    pub bias: f64,
    /// Root mean square of the same.
    pub rmse: f64,
}

/// What measured pieces say.
#[derive(Clone, Debug, Serialize)]
pub struct FieldReport {
    /// Pieces, in the order of the sheet.
    pub pieces: Vec<FieldPiece>,
    /// What was left out at a time: `recording`, or `piece` where there is one recording.
    pub left_out: &'static str,
    /// With the rig's own calibration; none without one.
    pub before: Option<FieldErrors>,
    /// Of pieces that were left out.
    pub after: FieldErrors,
    /// Factor of contact, at the mean raw leaf area of the pieces.
    pub factor: f64,
    /// Its 95 % interval.
    pub factor_interval: [f64; 2],
    /// Pieces like these that give the factor within ± 10 %; `None` where recordings scatter more than pieces do, and more pieces of them help little.
    pub pieces_for_ten_percent: Option<usize>,
    /// Recordings like these that do; `None` where the interval is that of the pieces.
    pub recordings_for_ten_percent: Option<usize>,
    /// The calibration of all pieces.
    #[serde(skip)]
    pub calibration: Calibration,
}

/// What the scans of a whole recording tell of a measured piece: whole metres, or one tree.
///
/// # Errors
/// A piece that the estimate does not have.
pub fn scanned(
    estimate: &Estimate,
    measured: &MeasuredPiece,
    spacing_m: Option<f64>,
) -> Result<ScannedPiece, FieldError> {
    let MeasuredPiece { line, from_m, to_m, .. } = *measured;
    let is_at = |a: f64, b: f64| (a - b).abs() <= AT_FACE_M;
    let inside = |y_m: f64| y_m > from_m && y_m < to_m;
    let metres: Vec<(f64, &PieceLeaf, f64)> = estimate
        .slices
        .iter()
        .filter(|slice| inside(slice.y_m))
        .map(|slice| (slice.impacted_total_area_m2, &slice.leaf, slice.scanned_m))
        .collect();
    let are_whole = is_at(from_m.round(), from_m) && is_at(to_m.round(), to_m);
    let tree = estimate.trees.iter().find(|tree| {
        spacing_m.is_some_and(|m| is_at(tree.y_m - m / 2.0, from_m) && is_at(tree.y_m + m / 2.0, to_m))
    });
    let parts = match tree {
        _ if are_whole => metres,
        Some(tree) if tree.complete => vec![(tree.impacted_total_area_m2, &tree.leaf, 1.0)],
        Some(_) => Vec::new(),
        None => {
            let trees = match (spacing_m, estimate.trees.first()) {
                (Some(m), Some(tree)) => {
                    format!(
                        "the first from {:.2} to {:.2} m, each {m} m",
                        tree.y_m - m / 2.0,
                        tree.y_m + m / 2.0
                    )
                }
                _ => "the rig names no `tree_spacing_m`".to_owned(),
            };
            return Err(FieldError::Ends { line, from_m, to_m, trees });
        }
    };
    // A metre holds a line more or less.
    let line_m = estimate.scanned_m.unwrap_or(0.0) / estimate.scans.max(1) as f64;
    let least_m = WHOLE - line_m;
    let wanted = if are_whole { (to_m - from_m).round() as usize } else { 1 };
    if parts.len() != wanted || parts.iter().any(|(.., scanned_m)| *scanned_m < least_m) {
        let ends = estimate.slices.first().zip(estimate.slices.last());
        let scanned = ends.map_or("no row".to_owned(), |(first, last)| {
            format!("{:.1} to {:.1} m, the ends not wholly", first.y_m - 0.5, last.y_m + 0.5)
        });
        let recording = measured.recording.clone();
        return Err(FieldError::NotScanned { line, from_m, to_m, recording, scanned });
    }
    let sum = |of: &dyn Fn(&PieceLeaf) -> Result<f64, Withheld>| {
        parts.iter().map(|(_, leaf, _)| of(leaf)).sum::<Result<f64, Withheld>>()
    };
    let contact_m2 = sum(&|leaf| leaf.areas.contact_raw_m2()).map_err(|why| FieldError::Withheld {
        line,
        recording: measured.recording.clone(),
        why,
    })?;
    // Pieces are of one orchard: by the constant they scatter less.
    let clumping = estimate.contact.and_then(|contact| contact.clumping);
    let by_constant = clumping.map(|clumping| clumping.constant_sd);
    let spot_relative_sd = by_constant.or(estimate.leaf.spot_relative_sd).unwrap_or(0.0);
    Ok(ScannedPiece {
        sample: Sample {
            length_m: to_m - from_m,
            impacted_total_area_m2: parts.iter().map(|(impacted_m2, ..)| impacted_m2).sum(),
            contact_leaf_area_m2: contact_m2,
            leaf_area_m2: measured.leaf_area_m2,
            spot_relative_sd,
            // Leaves by the shares of spots need a witness over whole rows.
            share_leaf_area_m2: None,
            clumping: ClumpingBy::Constant,
            wood_area_m2: None,
        },
        before_m2: sum(&|leaf| leaf.unshrunk).ok(),
        row_raw_m2_per_m: match (estimate.leaf.areas.contact_raw_m2(), estimate.canopy_m) {
            (Ok(raw_m2), Some(canopy_m)) if canopy_m > 0.0 => raw_m2 / canopy_m,
            _ => contact_m2 / (to_m - from_m),
        },
        measured: measured.clone(),
    })
}

/// Fits a calibration of this class to the pieces, and tries it on pieces that it was not fitted on.
///
/// # Errors
/// Too few pieces, or pieces that are all alike.
pub fn calibrate(
    pieces: &[ScannedPiece],
    class: &CalibrationClass,
    provenance: Provenance,
) -> Result<FieldReport, FieldError> {
    let mut recordings: Vec<&str> = pieces.iter().map(|piece| piece.measured.recording.as_str()).collect();
    recordings.sort_unstable();
    recordings.dedup();
    // A recording is left out as a whole where what remains can be fitted: pieces of one row are alike.
    let count = |name: &str| pieces.iter().filter(|piece| piece.measured.recording == name).count();
    let by_recording =
        recordings.len() > 1 && recordings.iter().all(|name| pieces.len() - count(name) >= MIN_SAMPLES);
    if pieces.len() <= MIN_SAMPLES {
        return Err(FieldError::TooFew { expected: MIN_SAMPLES + 1, found: pieces.len() });
    }
    let fitted = |without: &dyn Fn(usize, &ScannedPiece) -> bool| {
        let kept = pieces.iter().enumerate().filter(|(place, piece)| !without(*place, piece));
        let samples: Vec<Sample> = kept.map(|(_, piece)| piece.sample).collect();
        fit(&samples, class.clone(), provenance.clone())
    };
    let mut left_out = Vec::with_capacity(pieces.len());
    for (place, piece) in pieces.iter().enumerate() {
        let own = &piece.measured.recording;
        let calibration = match by_recording {
            true => fitted(&|_, other| other.measured.recording == *own)?,
            false => fitted(&|other, _| other == place)?,
        };
        left_out.push(of_contact(&calibration, &piece.sample));
    }
    let mut calibration = fitted(&|_, _| false)?;
    let relative: Vec<f64> = pieces
        .iter()
        .zip(&left_out)
        .map(|(piece, found)| found / piece.measured.leaf_area_m2 - 1.0)
        .collect();
    let of_recordings: Vec<f64> = recordings
        .iter()
        .map(|name| {
            let own = pieces.iter().zip(&relative).filter(|(piece, _)| piece.measured.recording == **name);
            mean(&own.map(|(_, error)| *error).collect::<Vec<_>>())
        })
        .collect();
    let sd_of = |values: &[f64]| moments(values).1.unwrap_or(f64::INFINITY);
    // The factor is as well known as the mean of the pieces' errors, or of the recordings' where those scatter more.
    let of_mean = |values: &[f64]| {
        let n = values.len() as f64;
        (sd_of(values) / n.sqrt(), student_t_95(n - 1.0))
    };
    let by_pieces = of_mean(&relative);
    let by_recordings = (of_recordings.len() >= RECORDINGS)
        .then(|| of_mean(&of_recordings))
        .filter(|other| other.0 * other.1 > by_pieces.0 * by_pieces.1);
    let half = by_recordings.unwrap_or(by_pieces);
    // Pieces scatter more than the rows that they are taken for.
    if let Some(rows) = &mut calibration.contact.fitted {
        rows.scatter = None;
    }
    // Intervals are those of a normal law: by this deviation theirs is as wide as Student's, by which the factor is known.
    calibration.contact.k_sd = Some(half.0 * half.1 / Z95);
    calibration.contact.of_rows(mean(&pieces.iter().map(|piece| piece.row_raw_m2_per_m).collect::<Vec<_>>()));
    let raw_m2_per_m = mean(
        &pieces
            .iter()
            .map(|piece| piece.sample.contact_leaf_area_m2 / piece.sample.length_m)
            .collect::<Vec<_>>(),
    );
    let factor = calibration.contact.factor(raw_m2_per_m);
    if !PLAUSIBLE.contains(&factor) {
        return Err(FieldError::Implausible { factor });
    }
    let errors = |found: &[f64]| {
        let measured: Vec<f64> = pieces.iter().map(|piece| piece.measured.leaf_area_m2).collect();
        let unit_m2 = mean(&measured);
        let errors: Vec<f64> =
            found.iter().zip(&measured).map(|(found, true_m2)| (found - true_m2) / unit_m2).collect();
        FieldErrors { bias: mean(&errors), rmse: rms(&errors) }
    };
    let before: Option<Vec<f64>> = pieces.iter().map(|piece| piece.before_m2).collect();
    Ok(FieldReport {
        before: before.map(|before| errors(&before)),
        after: errors(&left_out),
        left_out: if by_recording { "recording" } else { "piece" },
        factor,
        factor_interval: [-1.0, 1.0].map(|side| factor * (1.0 + side * half.0 * half.1)),
        pieces_for_ten_percent: by_recordings.is_none().then(|| plan::pieces_for(sd_of(&relative), 0.1)),
        recordings_for_ten_percent: by_recordings.map(|_| plan::pieces_for(sd_of(&of_recordings), 0.1)),
        pieces: pieces.iter().zip(left_out).map(|(piece, left_out_m2)| told(piece, left_out_m2)).collect(),
        calibration,
    })
}

fn told(piece: &ScannedPiece, left_out_m2: f64) -> FieldPiece {
    FieldPiece {
        recording: piece.measured.recording.clone(),
        from_m: piece.measured.from_m,
        to_m: piece.measured.to_m,
        measured_m2: piece.measured.leaf_area_m2,
        raw_m2: piece.sample.contact_leaf_area_m2,
        before_m2: piece.before_m2,
        left_out_m2,
    }
}

/// What a calibration makes of the raw contact of a piece, m².
fn of_contact(calibration: &Calibration, sample: &Sample) -> f64 {
    let raw_m2_per_m = sample.contact_leaf_area_m2 / sample.length_m;
    calibration.contact.factor(raw_m2_per_m) * sample.contact_leaf_area_m2
}

#[cfg(test)]
mod tests;
