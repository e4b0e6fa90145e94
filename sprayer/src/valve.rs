//! Valves: what comes out of them for the duty that they are commanded.

use rowscan_protocol::random::Stream;
use serde::{Deserialize, Serialize};

use crate::flow::{Course, Flow, Piece};
use crate::span::{Span, Spans};

/// Key of the random numbers: phases of valves that run free.
const PURPOSE: u64 = 301;
/// Above this share of full a proportional valve counts as open.
pub(crate) const OPEN_SHARE: f64 = 0.05;

/// What kind of valve it is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// Open for any duty above 0.
    #[default]
    OnOff,
    /// Pulsed: open for the duty's share of each period.
    Pwm,
    /// Flow follows duty.
    Proportional,
}

/// A valve that settles has settled after so many time constants, to the last digit.
pub(crate) const SETTLED: f64 = 40.0;

/// When the periods of a pulsed valve begin.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Phase {
    /// By a clock of its own: a command waits for the next period.
    #[default]
    Free,
    /// With each command.
    Sync,
}

/// A valve: table `[valve]`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Valve {
    /// What it is.
    pub kind: Kind,
    /// From the command to the first flow, ms.
    pub on_ms: f64,
    /// From the command to the beginning of the flow's end, ms.
    pub off_ms: f64,
    /// From no flow to full, ms.
    pub rise_ms: f64,
    /// From full flow to none, ms.
    pub fall_ms: f64,
    /// Pulses of current shorter than this do nothing, ms.
    pub min_pulse_ms: f64,
    /// Periods a second of a pulsed valve.
    #[schemars(extend("x-unit" = "Hz"))]
    pub hz: f64,
    /// When its periods begin.
    pub phase: Phase,
    /// Every other nozzle half a period later.
    pub blended: bool,
    /// Time constant of a proportional valve, seconds.
    pub tau_s: f64,
    /// Duties below this close a proportional valve.
    #[schemars(extend("x-unit" = "1"))]
    pub least: f64,
}

impl Default for Valve {
    fn default() -> Self {
        Self {
            kind: Kind::OnOff,
            on_ms: 15.0,
            off_ms: 10.0,
            rise_ms: 5.0,
            fall_ms: 5.0,
            min_pulse_ms: 0.0,
            hz: 10.0,
            phase: Phase::Free,
            blended: false,
            tau_s: 0.5,
            least: 0.1,
        }
    }
}

/// A number of a valve out of its range.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("`{key}`: expected {expected}, found {found}")]
pub struct ValveError {
    key: &'static str,
    expected: &'static str,
    found: f64,
}

impl ValveError {
    /// The key.
    pub fn key(&self) -> &'static str {
        self.key
    }

    /// The values allowed.
    pub fn expected(&self) -> &'static str {
        self.expected
    }
}

/// A duty that holds from an instant on, seconds.
pub type Step = (f64, f64);

impl Valve {
    /// Without dead times and ramps.
    pub const IDEAL: Self = Self {
        kind: Kind::OnOff,
        on_ms: 0.0,
        off_ms: 0.0,
        rise_ms: 0.0,
        fall_ms: 0.0,
        min_pulse_ms: 0.0,
        hz: 10.0,
        phase: Phase::Free,
        blended: false,
        tau_s: 0.5,
        least: 0.1,
    };

    /// Checks all values.
    ///
    /// # Errors
    /// The first that is wrong.
    pub fn validate(&self) -> Result<(), ValveError> {
        let ms = "0 to 10000 ms";
        let checks = [
            ("on_ms", self.on_ms, 0.0, 10_000.0, ms),
            ("off_ms", self.off_ms, 0.0, 10_000.0, ms),
            ("rise_ms", self.rise_ms, 0.0, 10_000.0, ms),
            ("fall_ms", self.fall_ms, 0.0, 10_000.0, ms),
            ("min_pulse_ms", self.min_pulse_ms, 0.0, 10_000.0, ms),
            ("hz", self.hz, 0.1, 1000.0, "0.1 to 1000"),
            ("tau_s", self.tau_s, 0.001, 60.0, "0.001 to 60 s"),
            ("least", self.least, 0.0, 1.0, "0 to 1"),
        ];
        let wrong = checks.into_iter().find(|(_, value, low, high, _)| !(*low..=*high).contains(value));
        wrong.map_or(Ok(()), |(key, found, _, _, expected)| Err(ValveError { key, expected, found }))
    }

    /// Dead times, seconds: until flow begins, until it begins to end.
    pub(crate) fn dead_s(&self) -> (f64, f64) {
        (self.on_ms / 1e3, self.off_ms / 1e3)
    }

    /// Where the first period of nozzle number `number` begins, seconds: 0 unless the valve is pulsed and runs free, or is blended.
    pub fn phase_s(&self, number: usize, seed: u64) -> f64 {
        if self.kind != Kind::Pwm {
            return 0.0;
        }
        let drawn = match self.phase {
            // Blended valves have one clock.
            Phase::Free if self.blended => Stream::keyed(seed, &[PURPOSE, u64::MAX]).unit(),
            Phase::Free => Stream::keyed(seed, &[PURPOSE, number as u64]).unit(),
            Phase::Sync => 0.0,
        };
        let shifted = if self.blended && number % 2 == 1 { 0.5 } else { 0.0 };
        (drawn + shifted) / self.hz
    }

    /// What comes out of nozzle number `number` for these steps of duty, in the order of time, until `until_s`; before the first it is shut.
    pub fn flow(&self, steps: &[Step], (number, seed): (usize, u64), full_l_s: f64, until_s: f64) -> Flow {
        if self.kind == Kind::Proportional {
            return self.settling(steps, full_l_s, until_s);
        }
        let pulses = self.pulses(steps, self.phase_s(number, seed), until_s);
        let (on_s, off_s) = self.dead_s();
        let least_s = self.min_pulse_ms / 1e3;
        let mut flowing: Vec<Span> = Vec::new();
        let mut envelopes: Vec<(u64, Span)> = Vec::new();
        for Pulse { span, stretch } in pulses {
            // A pulse that the run's end cuts is as long as it is.
            let is_cut = span.to >= until_s;
            let span = Span::new(span.from + on_s, if is_cut { f64::INFINITY } else { span.to + off_s });
            let is_felt = is_cut || span.to - span.from - (off_s - on_s) >= least_s;
            if !(is_felt && span.to > span.from && span.from < until_s) {
                continue;
            }
            flowing.push(span);
            match envelopes.last_mut() {
                Some((last, envelope)) if *last == stretch => envelope.to = envelope.to.max(span.to),
                _ => envelopes.push((stretch, span)),
            }
        }
        let pieces = self.ramped(&Spans::of(flowing), until_s);
        let supports = pieces.iter().map(|piece| piece.span);
        let open = Spans::of(envelopes.into_iter().map(|(_, span)| span).chain(supports));
        let open = open.within(Span::new(0.0, until_s));
        Flow { full_l_s, pieces, valve: open.clone(), open }
    }

    /// When current flows.
    fn pulses(&self, steps: &[Step], phase_s: f64, until_s: f64) -> Vec<Pulse> {
        let ends = steps.iter().skip(1).map(|(at, _)| *at).chain([until_s]);
        let steps =
            steps.iter().zip(ends).map(|((from, duty), to)| (Span::new(*from, to.min(until_s)), *duty));
        let mut out = Vec::new();
        let mut stretch = 0;
        match (self.kind, self.phase) {
            (Kind::Pwm, Phase::Free) => {
                let latched = steps.map(|(span, duty)| {
                    let next = |at: f64| self.next_period(at, phase_s).min(until_s);
                    (Span::new(next(span.from), next(span.to)), duty)
                });
                for (span, duty) in latched.filter(|(span, _)| span.length() > 0.0) {
                    stretch += u64::from(duty <= 0.0);
                    self.periods(span, duty, stretch, &mut out);
                }
            }
            (Kind::Pwm, Phase::Sync) => {
                // The nozzle's own shift stays: blended valves take turns.
                for (span, duty) in steps {
                    stretch += u64::from(duty <= 0.0);
                    let from = if duty < 1.0 { span.from + phase_s } else { span.from };
                    self.periods(Span::new(from.min(span.to), span.to), duty, stretch, &mut out);
                }
            }
            _ => {
                let open = Spans::of(steps.filter(|(_, duty)| *duty > 0.0).map(|(span, _)| span));
                out.extend((0..).zip(open.iter()).map(|(stretch, span)| Pulse { span: *span, stretch }));
            }
        }
        merged(out)
    }

    /// The first period of a valve that runs free that begins at `at` or later, seconds.
    pub(crate) fn next_period(&self, at: f64, phase_s: f64) -> f64 {
        // An instant that is the beginning of a period, but for the digits, is one.
        let number = ((at - phase_s) * self.hz - 1e-9).ceil();
        phase_s + number / self.hz
    }

    /// Pulses from the beginning of `span` on, of one duty.
    fn periods(&self, span: Span, duty: f64, stretch: u64, out: &mut Vec<Pulse>) {
        if duty <= 0.0 || span.length() <= 0.0 {
            return;
        }
        if duty >= 1.0 {
            out.push(Pulse { span, stretch });
            return;
        }
        let period_s = 1.0 / self.hz;
        let count = (span.length() / period_s - 1e-9).ceil() as u64;
        for number in 0..count {
            let from = span.from + number as f64 * period_s;
            out.push(Pulse { span: Span::new(from, (from + duty * period_s).min(span.to)), stretch });
        }
    }

    /// Flow with its ramps: it rises while current acts on the valve and falls afterwards, from wherever it has come to.
    fn ramped(&self, acting: &Spans, until_s: f64) -> Vec<Piece> {
        let (rise_s, fall_s) = (self.rise_ms / 1e3, self.fall_ms / 1e3);
        let mut pieces = Vec::new();
        let mut share: f64 = 0.0;
        let starts = acting.iter().skip(1).map(|span| span.from).chain([f64::INFINITY]);
        for (span, next) in acting.iter().zip(starts) {
            let mut at = span.from;
            let mut go = |from: f64, to: f64, long_s: f64, end: f64| {
                let stop = (at + long_s).min(end).min(until_s);
                let reached = if at + long_s > stop { from + (to - from) * (stop - at) / long_s } else { to };
                if stop > at {
                    pieces.push(Piece {
                        span: Span::new(at, stop),
                        course: Course::Ramp { from, to: reached },
                    });
                }
                at = stop.max(at);
                reached
            };
            share = go(share, 1.0, (1.0 - share) * rise_s, span.to);
            if share >= 1.0 {
                share = go(1.0, 1.0, f64::MAX, span.to);
            }
            share = go(share, 0.0, share * fall_s, next);
        }
        pieces
    }

    fn settling(&self, steps: &[Step], full_l_s: f64, until_s: f64) -> Flow {
        let (on_s, off_s) = self.dead_s();
        let mut last = 0.0;
        let mut acting: Vec<Step> = Vec::new();
        for (at, duty) in steps {
            let duty = if *duty < self.least { 0.0 } else { *duty };
            let at = at + if duty > last { on_s } else { off_s };
            last = duty;
            // What overtakes a command takes its place.
            while acting.last().is_some_and(|(before, _)| *before >= at) {
                acting.pop();
            }
            acting.push((at, duty));
        }
        let ends: Vec<f64> = acting.iter().skip(1).map(|(at, _)| *at).chain([until_s]).collect();
        let (mut share, mut pieces, mut open): (f64, Vec<Piece>, Vec<Span>) = (0.0, Vec::new(), Vec::new());
        let mut shut_before = None;
        for ((from, towards), to) in acting.iter().zip(ends) {
            let span = Span::new(*from, to.min(until_s));
            if span.length() <= 0.0 {
                continue;
            }
            let course = Course::Settling { from: share, towards: *towards, tau_s: self.tau_s };
            // What settles to nothing is shut in the end; who shuts it again meanwhile changes nothing.
            let shut = match shut_before {
                _ if *towards > 0.0 => f64::INFINITY,
                Some(shut) => shut,
                None => span.from + SETTLED * self.tau_s,
            };
            shut_before = (*towards <= 0.0).then_some(shut);
            let piece = Piece { span: Span::new(span.from, span.to.min(shut)), course };
            let after = if span.to < shut { piece.share(span.to) } else { 0.0 };
            let crossing = span.from + self.tau_s * libm::log((share - towards) / (OPEN_SHARE - towards));
            match (share > OPEN_SHARE, after > OPEN_SHARE) {
                (true, true) => open.push(span),
                (true, false) => open.push(Span::new(span.from, crossing)),
                (false, true) => open.push(Span::new(crossing, span.to)),
                (false, false) => {}
            }
            if share > 0.0 || *towards > 0.0 {
                pieces.push(piece);
            }
            share = after;
        }
        let open = Spans::of(open);
        Flow { full_l_s, pieces, valve: open.clone(), open }
    }
}

/// A time in which current flows, and the number of the stretch of duty above 0 that it belongs to.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Pulse {
    span: Span,
    stretch: u64,
}

/// Pulses that touch are one.
fn merged(pulses: Vec<Pulse>) -> Vec<Pulse> {
    let mut kept: Vec<Pulse> = Vec::with_capacity(pulses.len());
    for pulse in pulses {
        match kept.last_mut() {
            Some(last) if pulse.span.from <= last.span.to + 1e-12 => {
                last.span.to = last.span.to.max(pulse.span.to)
            }
            _ => kept.push(pulse),
        }
    }
    kept
}

pub(crate) mod keys;
#[cfg(test)]
mod tests;
