//! How many pieces of a row must be stripped of their leaves for a factor that is known so well.

use rowscan_canopy::pieces::PieceScatter;
use rowscan_canopy::regression::student_t_95;
use rowscan_canopy::uncertainty::combined;
use serde::Serialize;

/// Pieces that are planned for, metres.
const LENGTHS_M: [f64; 4] = [1.0, 1.5, 2.0, 3.0];
/// No plan asks for more.
const MOST: usize = 100_000;

/// A plan for pieces of one length.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Planned {
    /// Their length, metres.
    pub length_m: f64,
    /// Relative standard deviation of one piece's estimate about what is measured by hand.
    pub sd: f64,
    /// Pieces for a factor within ± 5 %, with 95 % confidence.
    pub for_5_percent: usize,
    /// Within ± 10 %.
    pub for_10_percent: usize,
    /// Within ± 20 %.
    pub for_20_percent: usize,
    /// Metres of row to strip for ± 10 %.
    pub metres_for_10_percent: f64,
}

/// Plans for pieces measured like this, by what the study of pieces saw; `hand_sd` is the relative standard deviation of a measurement by hand. None where nothing like it was studied.
pub fn plan(beams: &str, model: &str, distance_m: f64, hand_sd: f64) -> Option<Vec<Planned>> {
    let scatter = PieceScatter::find("contact", beams, model, distance_m)?;
    let of_length = |length_m: f64| {
        let sd = combined([scatter.error.of(length_m), hand_sd]);
        let for_10_percent = pieces_for(sd, 0.1);
        Planned {
            length_m,
            sd,
            for_5_percent: pieces_for(sd, 0.05),
            for_10_percent,
            for_20_percent: pieces_for(sd, 0.2),
            metres_for_10_percent: for_10_percent as f64 * length_m,
        }
    };
    Some(LENGTHS_M.map(of_length).to_vec())
}

/// The fewest pieces, each off by a relative standard deviation of `sd`, whose mean is known within `half`, with 95 % confidence by Student's t.
pub(super) fn pieces_for(sd: f64, half: f64) -> usize {
    let holds = |n: &usize| student_t_95(*n as f64 - 1.0) * sd / (*n as f64).sqrt() <= half;
    (2..MOST).find(holds).unwrap_or(MOST)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_number_of_pieces_is_that_of_students_t() {
        // t with 3 degrees of freedom is 3.182, with 4 2.776: four pieces of 6 % give ± 9.5 %, three ± 14.9 %.
        assert_eq!(pieces_for(0.06, 0.1), 4);
        // 1.96² · 0.2² / 0.01² = 1537, and a little more for t.
        assert!((1537..1542).contains(&pieces_for(0.2, 0.01)), "{}", pieces_for(0.2, 0.01));
        assert_eq!(pieces_for(0.0, 0.1), 2);
        assert_eq!(pieces_for(f64::INFINITY, 0.1), MOST);
    }

    #[test]
    fn longer_pieces_are_fewer_and_what_was_never_studied_has_no_plan() {
        let plan_of = |hand_sd| plan("eye", "lms111", 2.0, hand_sd).expect("it was studied");
        let plan = plan_of(0.03);
        assert!(plan.windows(2).all(|pair| pair[0].for_10_percent >= pair[1].for_10_percent), "{plan:?}");
        assert!(
            plan[0].for_5_percent > plan[0].for_10_percent && plan[0].for_10_percent > plan[0].for_20_percent
        );
        assert!(plan_of(0.2)[0].for_10_percent > plan[0].for_10_percent);
        assert_eq!(super::plan("radar", "lms111", 2.0, 0.0), None);
    }
}
