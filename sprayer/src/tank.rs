//! A tank that runs dry: from then on nothing leaves it, and nozzles get what hoses still hold.

use crate::flow::Flow;
use crate::hydraulics::Node;
use crate::span::{Span, Spans};
use crate::valve::Step;

/// To this part of a second.
const EXACT_S: f64 = 1e-12;

/// Time between two looks at the level, seconds. A level that falls to 0 and rises again in between is not seen.
const LOOK_S: f64 = 0.1;

/// What leaves the nozzles as litres: by the pressure where that changes, else at the nominal one.
pub(crate) fn litres_in(flows: &[Flow], node: Option<&Node>, span: Span) -> f64 {
    match node {
        Some(node) => node.balance(span).nozzles_l,
        None => flows.iter().map(|flow| flow.litres_in(&Spans::of([span]))).sum(),
    }
}

/// What leaves the tank as litres: what the pump gives less what comes back, and without a pump what leaves the nozzles. Hoses that give what they
/// held take nothing from it.
pub(crate) fn drawn_l(flows: &[Flow], node: Option<&Node>, span: Span) -> f64 {
    match node {
        Some(node) => {
            let balance = node.balance(span);
            balance.pump_l - balance.returned_l
        }
        None => litres_in(flows, None, span),
    }
}

/// When `left_l` have gone first, if that is in `within`. `drawn_l` tells how much goes in a part of it; it may be less than nothing where hoses give
/// back.
pub(crate) fn runs_dry_s(left_l: f64, within: Span, drawn_l: impl Fn(Span) -> f64) -> Option<f64> {
    let (mut left_l, mut from) = (left_l, within.from);
    while from < within.to {
        let to = within.to.min(from + LOOK_S);
        let drawn = drawn_l(Span::new(from, to));
        if drawn >= left_l {
            return Some(gone_s(left_l, Span::new(from, to), drawn_l));
        }
        (left_l, from) = (left_l - drawn, to);
    }
    None
}

/// When `left_l` have gone in `within`, at whose end they have.
fn gone_s(left_l: f64, within: Span, drawn_l: impl Fn(Span) -> f64) -> f64 {
    let (mut low, mut high) = (within.from, within.to);
    while high - low > EXACT_S * (1.0 + high.abs()) {
        let middle = low.midpoint(high);
        if middle <= low || middle >= high {
            break;
        }
        if drawn_l(Span::new(within.from, middle)) < left_l { low = middle } else { high = middle }
    }
    high
}

/// Shares of the pump's flow where the tank is dry from `dry_s` on.
pub(crate) fn pump(mut steps: Vec<Step>, dry_s: Option<f64>) -> Vec<Step> {
    if let Some(dry_s) = dry_s {
        steps.retain(|(at, _)| *at < dry_s);
        steps.push((dry_s, 0.0));
    }
    steps
}
