//! Rate control: how far the flow was off what the speed wants, and how it settled after steps of speed and sections.
//!
//! The wanted flow of an open nozzle is its nominal one times speed / `at_m_s`. Flow and wanted flow are means over windows of `window_s`; a nozzle counts in those in
//! which it is open from end to end.

use serde::{Deserialize, Serialize};

use crate::flow::Flow;
use crate::hydraulics::RateTable;
use crate::pass::Pass;
use crate::span::{Span, Spans};

/// Steps that are nearer to each other are one, seconds.
const ONE_STEP_S: f64 = 0.5;
/// A speed that changes faster is changing, m/s².
const CHANGING_M_S2: f64 = 0.02;

/// How well a rate was kept. What cannot be told is none.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Rate {
    /// Litres of the nozzles that were open, in the windows that count.
    pub litres: f64,
    /// What their rate would have been.
    pub wanted_litres: f64,
    /// `litres` / `wanted_litres` − 1.
    pub mean: Option<f64>,
    /// Below it is the error, without its sign, in 95 of 100 windows.
    pub p95: Option<f64>,
    /// Steps of speed and sections with windows behind them.
    pub steps: usize,
    /// Those after which the rate had not settled when the next step came, or the run ended.
    pub unsettled: usize,
    /// From a step until the rate stays within `band`: the longest, seconds. None where one has not settled, or there was none.
    pub settling_s: Option<f64>,
    /// How far the error went to the other side after a step, the farthest, as a share.
    pub overshoot: Option<f64>,
}

/// The error in a window.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Window {
    /// When, seconds.
    pub span: Span,
    /// Litres.
    pub litres: f64,
    /// Litres that were wanted.
    pub wanted_litres: f64,
}

impl Window {
    /// Share by which the flow is off.
    pub fn error(&self) -> f64 {
        self.litres / self.wanted_litres - 1.0
    }
}

impl Rate {
    /// How `flows` kept the rate that the boom's `[rate]` wants, from `from_s` on.
    pub fn of(pass: &Pass, keys: &RateTable, flows: &[Flow], from_s: f64) -> Self {
        let windows = windows(pass, keys, flows, from_s);
        let steps = steps(pass, keys, flows, from_s);
        let (mut count, mut unsettled) = (0, 0);
        let (mut longest_s, mut overshoot) = (None::<f64>, None::<f64>);
        for (place, step) in steps.iter().enumerate() {
            let until = steps.get(place + 1).map_or(f64::INFINITY, |next| next.from);
            let behind: Vec<&Window> = windows
                .iter()
                .filter(|window| window.span.from >= step.to && window.span.to <= until)
                .collect();
            let Some(last) = behind.last() else { continue };
            count += 1;
            let is_off = |window: &&&Window| window.error().abs() > keys.band;
            match behind.iter().rev().find(is_off) {
                Some(off) if off.span == last.span => unsettled += 1,
                Some(off) => longest_s = Some(longest_s.unwrap_or(0.0).max(off.span.to - step.to)),
                None => longest_s = Some(longest_s.unwrap_or(0.0)),
            }
            let side = behind.iter().find(is_off).map_or(0.0, |window| window.error().signum());
            let beyond = behind.iter().map(|window| -side * window.error()).fold(0.0, f64::max);
            overshoot = Some(overshoot.unwrap_or(0.0).max(beyond));
        }
        let litres = windows.iter().map(|window| window.litres).sum();
        let wanted_litres = windows.iter().map(|window| window.wanted_litres).sum();
        let mut errors: Vec<f64> = windows.iter().map(|window| window.error().abs()).collect();
        errors.sort_by(f64::total_cmp);
        Self {
            litres,
            wanted_litres,
            mean: (wanted_litres > 0.0).then(|| litres / wanted_litres - 1.0),
            // The nearest rank.
            p95: errors.get((errors.len() * 95).div_ceil(100).saturating_sub(1)).copied(),
            steps: count,
            unsettled,
            settling_s: longest_s.filter(|_| unsettled == 0),
            overshoot,
        }
    }
}

/// The windows in which a nozzle is open from end to end while the tractor goes ahead.
pub fn windows(pass: &Pass, keys: &RateTable, flows: &[Flow], from_s: f64) -> Vec<Window> {
    let run = pass.time();
    let going = pass.drive().going(pass.boom().standstill_m_s);
    let is_all = |spans: &Spans, span: Span| spans.within(span).length() > span.length() - 1e-9;
    let count = ((run.to - from_s) / keys.window_s + 1e-9).floor().max(0.0) as u32;
    let all = (0..count).map(|number| {
        let from = from_s + f64::from(number) * keys.window_s;
        Span::new(from, from + keys.window_s)
    });
    all.filter(|span| is_all(&going, *span))
        .filter_map(|span| {
            let way_m = (pass.drive().y_m(span.to) - pass.drive().y_m(span.from)).abs();
            let open = flows.iter().filter(|flow| is_all(&flow.open, span));
            let (litres, full_l_s) = open.fold((0.0, 0.0), |(litres, full_l_s), flow| {
                (litres + flow.litres_in(&Spans::of([span])), full_l_s + flow.full_l_s)
            });
            let wanted_litres = full_l_s * way_m / keys.at_m_s;
            (wanted_litres > 0.0).then_some(Window { span, litres, wanted_litres })
        })
        .collect()
}

/// Steps of speed and sections: from the first change of each to its last.
fn steps(pass: &Pass, keys: &RateTable, flows: &[Flow], from_s: f64) -> Vec<Span> {
    let run = pass.time();
    let edges = pass.section_open(flows);
    let edges = edges.iter().flat_map(|open| open.iter().flat_map(|span| [span.from, span.to]));
    let mut changes: Vec<Span> = edges.map(|at| Span::new(at, at)).collect();
    for piece in pass.drive().pieces() {
        let parts = (piece.time.length() / keys.window_s).ceil().max(1.0);
        let long_s = piece.time.length() / parts;
        for part in 0..parts as u32 {
            let from = piece.time.from + f64::from(part) * long_s;
            let change = piece.along_m_s(from + long_s) - piece.along_m_s(from);
            if change.abs() > CHANGING_M_S2 * long_s {
                changes.push(Span::new(from, from + long_s));
            }
        }
    }
    changes.sort_by(|a, b| a.from.total_cmp(&b.from));
    let mut steps: Vec<Span> = Vec::new();
    for change in changes.into_iter().filter(|change| change.to >= from_s && change.from < run.to) {
        match steps.last_mut() {
            Some(last) if change.from < last.to + ONE_STEP_S => last.to = last.to.max(change.to),
            _ => steps.push(change),
        }
    }
    steps
}
