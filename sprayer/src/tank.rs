//! A tank that runs dry: from then on nothing leaves the nozzles.

use crate::flow::Flow;
use crate::hydraulics::Node;
use crate::span::{Span, Spans};
use crate::valve::Step;

/// To this part of a second.
const EXACT_S: f64 = 1e-12;

/// What leaves the nozzles as litres: by the pressure where that changes, else at the nominal one.
pub(crate) fn litres_in(flows: &[Flow], node: Option<&Node>, span: Span) -> f64 {
    match node {
        Some(node) => node.balance(span).nozzles_l,
        None => flows.iter().map(|flow| flow.litres_in(&Spans::of([span]))).sum(),
    }
}

/// When `left_l` have gone, if that is in `within`. `litres_in` tells how much goes in a part of it.
pub(crate) fn runs_dry_s(left_l: f64, within: Span, litres_in: impl Fn(Span) -> f64) -> Option<f64> {
    if litres_in(within) < left_l {
        return None;
    }
    let (mut low, mut high) = (within.from, within.to);
    while high - low > EXACT_S * (1.0 + high.abs()) {
        let middle = low.midpoint(high);
        if middle <= low || middle >= high {
            break;
        }
        if litres_in(Span::new(within.from, middle)) < left_l { low = middle } else { high = middle }
    }
    Some(high)
}

/// Shares of the pump's flow where the tank is dry from `dry_s` on.
pub(crate) fn pump(mut steps: Vec<Step>, dry_s: Option<f64>) -> Vec<Step> {
    if let Some(dry_s) = dry_s {
        steps.retain(|(at, _)| *at < dry_s);
        steps.push((dry_s, 0.0));
    }
    steps
}
