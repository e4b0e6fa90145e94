//! Rate control: how far the flow was off what the speed wants, and how it settled after steps of speed and sections.
//!
//! The wanted flow of an open nozzle is its nominal one times speed / `at_m_s`. Flow and wanted flow are means over windows of `window_s`; a nozzle counts in those in
//! which its valve is open from end to end: one that gives nothing then is as far off as can be.

use serde::{Deserialize, Serialize};

use crate::flow::Flow;
use crate::hydraulics::RateTable;
use crate::pass::Pass;
use crate::span::{Span, Spans, total};

/// Steps that are nearer to each other are one, seconds.
const ONE_STEP_S: f64 = 0.5;
/// What rounding, and a drive's finest pieces about a jump of speed, leave between an instant and a window's end, seconds.
const ROUNDING_S: f64 = 1e-6;
/// A speed that changes faster is changing, m/s²; one that jumps, if it does by more than that makes in a window.
const CHANGING_M_S2: f64 = 0.02;

/// How well a rate was kept. What cannot be told is none.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Rate {
    /// Litres of the nozzles whose valves were open, in the windows that count.
    pub litres: f64,
    /// What their rate would have been.
    pub wanted_litres: f64,
    /// `litres` / `wanted_litres` − 1.
    pub mean: Option<f64>,
    /// Below it is the error, without its sign, in 95 of 100 windows.
    pub p95: Option<f64>,
    /// Steps of speed and sections that can be judged: all but `unjudged`.
    pub steps: usize,
    /// Those after which the rate had not settled when the next step came.
    pub unsettled: usize,
    /// Those after which it had not settled when the run ended.
    pub unsettled_at_end: usize,
    /// Steps that say nothing: behind them no valve was open for a whole window, or the next step or the run's end came
    /// within half a second, before it had settled.
    pub unjudged: usize,
    /// What `settling_s` means.
    pub settling: Settling,
    /// From a step until the rate stays within `band`: the longest, seconds. None where `settling` is another word than `settled`.
    pub settling_s: Option<f64>,
    /// It took at least so long, the longest, seconds; of steps that were cut short what could be seen. None where there was no step.
    pub at_least_s: Option<f64>,
    /// How far the error went to the other side after a step, the farthest, as a share.
    pub overshoot: Option<f64>,
}

/// How the rate settled after steps.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Settling {
    /// After every step; `settling_s` says how long it took.
    Settled,
    /// Not after each: the next step came before.
    NotSettled,
    /// Not after the last one: the run ended before.
    RunEnded,
    /// There was no step that can be judged.
    NoStep,
}

impl Settling {
    /// In words: what stands in the place of a number of seconds.
    pub fn words(self) -> &'static str {
        match self {
            Self::Settled => "settled",
            Self::NotSettled => "not settled",
            Self::RunEnded => "not settled at the end",
            Self::NoStep => "no step",
        }
    }
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
        let mut after = After::default();
        for step in &steps {
            let next = steps.iter().map(|next| next.from).filter(|from| *from > step.to);
            after.add(*step, next.reduce(f64::min), (pass.time().to, keys.band, &windows));
        }
        let litres = total(windows.iter().map(|window| window.litres));
        let wanted_litres = total(windows.iter().map(|window| window.wanted_litres));
        let mut errors: Vec<f64> = windows.iter().map(|window| window.error().abs()).collect();
        errors.sort_by(f64::total_cmp);
        Self {
            litres,
            wanted_litres,
            mean: (wanted_litres > 0.0).then(|| litres / wanted_litres - 1.0),
            // The nearest rank.
            p95: errors.get((errors.len() * 95).div_ceil(100).saturating_sub(1)).copied(),
            steps: after.steps,
            unsettled: after.unsettled,
            unsettled_at_end: after.unsettled_at_end,
            unjudged: after.unjudged,
            settling: after.settling(),
            settling_s: after.longest_s.filter(|_| after.settling() == Settling::Settled),
            at_least_s: after.longest_s,
            overshoot: after.overshoot,
        }
    }
}

/// What came after steps.
#[derive(Default)]
struct After {
    steps: usize,
    unsettled: usize,
    unsettled_at_end: usize,
    unjudged: usize,
    longest_s: Option<f64>,
    overshoot: Option<f64>,
}

impl After {
    /// After `step`, until the next one comes at `next_s`, or the run ends.
    fn add(&mut self, step: Span, next_s: Option<f64>, (end_s, band, windows): (f64, f64, &[Window])) {
        let until_s = next_s.unwrap_or(end_s);
        let since = |from_s: f64| {
            let within = move |window: &&Window| {
                window.span.from >= from_s - ROUNDING_S && window.span.to <= until_s + ROUNDING_S
            };
            windows.iter().filter(within).collect::<Vec<&Window>>()
        };
        // The wanted rate changes all through a ramp: the clock starts where the ramp begins.
        let (during, behind) = (since(step.from), since(step.to));
        let is_off = |window: &&&Window| window.error().abs() > band;
        let (last, off) = (behind.last(), during.iter().rev().find(is_off));
        let longer = |longest: Option<f64>, s: f64| Some(longest.unwrap_or(0.0).max(s));
        match (last, off) {
            (None, _) => return self.unjudged += 1,
            (Some(last), Some(off)) if off.span == last.span => {
                if until_s < step.to + ONE_STEP_S {
                    return self.unjudged += 1;
                } else if next_s.is_some() {
                    self.unsettled += 1;
                } else {
                    self.unsettled_at_end += 1;
                }
            }
            _ => {}
        }
        self.steps += 1;
        self.longest_s = longer(self.longest_s, off.map_or(0.0, |off| off.span.to - step.from));
        let side = behind.iter().find(is_off).map_or(0.0, |window| window.error().signum());
        let beyond = behind.iter().map(|window| -side * window.error()).filter(|beyond| *beyond > 0.0);
        let beyond = beyond.fold(0.0, f64::max);
        self.overshoot = longer(self.overshoot, beyond);
    }

    fn settling(&self) -> Settling {
        match (self.steps, self.unsettled, self.unsettled_at_end) {
            (0, ..) => Settling::NoStep,
            (_, 0, 0) => Settling::Settled,
            (_, 0, _) => Settling::RunEnded,
            _ => Settling::NotSettled,
        }
    }
}

/// The windows in which a nozzle's valve is open from end to end while the tractor goes ahead.
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
            let open = flows.iter().filter(|flow| is_all(&flow.valve, span));
            let (litres, full_l_s) = open.fold((0.0, 0.0), |(litres, full_l_s), flow| {
                (litres + flow.litres_in(&Spans::of([span])), full_l_s + flow.full_l_s)
            });
            let wanted_litres = full_l_s * way_m / keys.at_m_s;
            (wanted_litres > 0.0).then_some(Window { span, litres, wanted_litres })
        })
        .collect()
}

/// Steps of sections and steps of speed, whether it jumps or takes its time, each from the first change to the last of those that follow each other closely, in the
/// order in which they begin. A step of sections is one of its own beside a ramp of speed, and within one.
fn steps(pass: &Pass, keys: &RateTable, flows: &[Flow], from_s: f64) -> Vec<Span> {
    let edges = pass.section_valves(flows);
    let edges = edges.iter().flat_map(|open| open.iter().flat_map(|span| [span.from, span.to]));
    let jumps = pass.drive().jumps().into_iter();
    let least_m_s = CHANGING_M_S2 * keys.window_s;
    let mut speeds: Vec<Span> =
        jumps.filter(|(_, change)| change.abs() > least_m_s).map(|(at, _)| at).collect();
    for piece in pass.drive().pieces() {
        let parts = (piece.time.length() / keys.window_s).ceil().max(1.0);
        let long_s = piece.time.length() / parts;
        for part in 0..parts as u32 {
            let from = piece.time.from + f64::from(part) * long_s;
            let change = piece.along_m_s(from + long_s) - piece.along_m_s(from);
            if change.abs() > CHANGING_M_S2 * long_s {
                speeds.push(Span::new(from, from + long_s));
            }
        }
    }
    let run = Span::new(from_s, pass.time().to);
    let mut steps = joined(edges.map(|at| Span::new(at, at)).collect(), run);
    steps.extend(joined(speeds, run));
    steps.sort_by(|a, b| a.from.total_cmp(&b.from));
    steps
}

/// Changes that are nearer to each other than [`ONE_STEP_S`] as one.
fn joined(mut changes: Vec<Span>, run: Span) -> Vec<Span> {
    changes.sort_by(|a, b| a.from.total_cmp(&b.from));
    let mut steps: Vec<Span> = Vec::new();
    // What is cut by the run's end is no step: nothing changes there.
    for change in
        changes.into_iter().filter(|change| change.to >= run.from && change.from < run.to - ROUNDING_S)
    {
        match steps.last_mut() {
            Some(last) if change.from < last.to + ONE_STEP_S => last.to = last.to.max(change.to),
            _ => steps.push(change),
        }
    }
    steps
}
