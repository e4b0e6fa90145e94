//! A nozzle's share of full flow as plateaus, so that the node sees what is constant between two events.
//!
//! Where a plateau ends early, as a ramp does that a command cuts, its height stays: it never follows from what comes later.

use crate::flow::{Course, Piece};
use crate::span::Span;

/// Plateaus of a ramp from shut to open.
const OF_RAMP: f64 = 2.0;
/// Length of one that stands for settling, in time constants.
const OF_TAU: f64 = 0.1;
/// After so many of these nothing is left to settle: a thousandth.
const SETTLED: u32 = 70;

/// A share that holds for some time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Plateau {
    /// When.
    pub span: Span,
    /// Share of full flow.
    pub share: f64,
}

/// The plateaus of pieces from `from_s` on.
pub(super) fn plateaus(pieces: &[Piece], from_s: f64) -> Vec<Plateau> {
    let first = pieces.partition_point(|piece| piece.span.to <= from_s);
    let mut all = Vec::new();
    for Piece { span, course } in pieces.iter().skip(first) {
        match *course {
            Course::Ramp { from, to } if from == to => all.push(Plateau { span: *span, share: from }),
            Course::Ramp { from, to } => {
                // A ramp goes on to open or shut unless a command cuts it: how long that takes the slope tells, also of one that was cut.
                let rest = if to > from { 1.0 - from } else { -from };
                let count = (rest.abs() * OF_RAMP).ceil().max(1.0);
                let (long_s, step) = (span.length() / (to - from) * rest / count, rest / count);
                cut(*span, long_s, u32::MAX, |number| from + (number + 0.5) * step, &mut all);
            }
            Course::Settling { from, towards, tau_s } => {
                // Mean over a plateau of what decays.
                let mean = -libm::expm1(-OF_TAU) / OF_TAU;
                let share = |number: f64| towards + (from - towards) * libm::exp(-number * OF_TAU) * mean;
                let last = cut(*span, OF_TAU * tau_s, SETTLED, share, &mut all);
                all.push(Plateau { span: Span::new(last, span.to), share: towards });
            }
        }
    }
    all.retain(|plateau| plateau.span.length() > 0.0 && plateau.span.to > from_s);
    all
}

/// Cuts a span into plateaus, `most` at most, and returns where the last of them ends.
fn cut(span: Span, long_s: f64, most: u32, share: impl Fn(f64) -> f64, all: &mut Vec<Plateau>) -> f64 {
    let mut from = span.from;
    for number in 0..most {
        if from >= span.to {
            break;
        }
        let end = span.from + f64::from(number + 1) * long_s;
        // What rounding leaves behind the last one belongs to it.
        let to = if end > span.to - 1e-12 { span.to } else { end };
        all.push(Plateau { span: Span::new(from, to), share: share(f64::from(number)) });
        from = to;
    }
    from
}
