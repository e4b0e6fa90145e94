//! What goes wrong with the machine, and the switches that its driver throws: what a log of commands becomes under them.

mod kept;

use rowscan_settings::fault_table::sprayer::{SprayerFault, StuckAt, Valves};
use serde::{Deserialize, Serialize};

use crate::boom::{Boom, Nozzle};
use crate::flow::{Course, Flow, Piece};
use crate::span::{Span, Spans};
use crate::switches::Switches;
use crate::valve::{OPEN_SHARE, Step};

/// A fault for a time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Trouble {
    /// What it is.
    #[serde(with = "kept")]
    pub fault: SprayerFault,
    /// When it began, seconds.
    pub from: f64,
    /// When it ended, seconds; not yet where none.
    pub to: Option<f64>,
}

impl Trouble {
    pub(crate) fn span(&self) -> Span {
        Span::new(self.from, self.to.unwrap_or(f64::INFINITY))
    }
}

/// What goes wrong in a run, in the order in which it began.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Troubles(pub Vec<Trouble>);

/// Whose duties a fault changes, and to what; none where it changes none.
type Change = Option<(Valves, Vec<Step>)>;

impl Troubles {
    /// True where nothing goes wrong.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The duties that reach the valves, by nozzle, of those that were commanded.
    pub(crate) fn duties(&self, boom: &Boom, commanded: Vec<Vec<Step>>) -> Vec<Vec<Step>> {
        let nozzles = boom.nozzles();
        let mut duties = commanded;
        // Wires first, then what drives the coils, then what the valves make of it.
        for trouble in &self.0 {
            if let SprayerFault::SwappedWires(one, other) = trouble.fault
                && let (Some(one), Some(other)) = (boom.section(one), boom.section(other))
            {
                swap(&mut duties, &nozzles, (one, other), trouble.span());
            }
        }
        let mut each = |apply: &dyn Fn(&Trouble, &[Step]) -> Change| {
            for trouble in &self.0 {
                for (nozzle, steps) in nozzles.iter().zip(&mut duties) {
                    if let Some((_, new)) =
                        apply(trouble, steps).filter(|(valves, _)| is_of(boom, nozzle, *valves))
                    {
                        *steps = new;
                    }
                }
            }
        };
        each(&|trouble, steps| match trouble.fault {
            SprayerFault::CoilOpen(valves) => Some((valves, masked(steps, trouble.span(), 0.0))),
            SprayerFault::Undervoltage => Some((Valves::All, masked(steps, trouble.span(), 0.0))),
            _ => None,
        });
        each(&|trouble, steps| match trouble.fault {
            SprayerFault::ValveSlow(valves, late_s) => Some((valves, delayed(steps, trouble.span(), late_s))),
            _ => None,
        });
        each(&|trouble, steps| match trouble.fault {
            SprayerFault::ValveStuck(valves, at) => {
                let duty = match at {
                    StuckAt::Open => 1.0,
                    StuckAt::Shut => 0.0,
                    StuckAt::AsItIs => held(steps, trouble.from),
                };
                Some((valves, masked(steps, trouble.span(), duty)))
            }
            _ => None,
        });
        duties
    }

    /// What the nozzles make of the flows that their valves let through.
    pub(crate) fn flows(&self, boom: &Boom, mut flows: Vec<Flow>, until_s: f64) -> Vec<Flow> {
        let whole = Span::new(0.0, until_s);
        for trouble in &self.0 {
            let Some(span) = trouble.span().common(whole) else { continue };
            for (nozzle, flow) in boom.nozzles().iter().zip(&mut flows) {
                match trouble.fault {
                    SprayerFault::BlockedNozzle(valves, share) if is_of(boom, nozzle, valves) => {
                        block(flow, span, 1.0 - share, whole);
                    }
                    SprayerFault::Drip(valves, share) if is_of(boom, nozzle, valves) => {
                        drip(flow, span, share)
                    }
                    _ => {}
                }
            }
        }
        flows
    }

    /// Shares of the pump's flow.
    pub(crate) fn pump(&self) -> Vec<Step> {
        let mut times: Vec<f64> = Vec::new();
        for trouble in &self.0 {
            if matches!(trouble.fault, SprayerFault::PumpLow(_) | SprayerFault::TankEmpty) {
                times.extend([trouble.from].into_iter().chain(trouble.to));
            }
        }
        times.sort_by(f64::total_cmp);
        times.dedup();
        let share = |at: f64| {
            let now =
                self.0.iter().filter(|trouble| trouble.from <= at && trouble.to.is_none_or(|to| at < to));
            now.map(|trouble| match trouble.fault {
                SprayerFault::PumpLow(share) => share,
                SprayerFault::TankEmpty => 0.0,
                _ => 1.0,
            })
            .product()
        };
        times.into_iter().map(|at| (at, share(at))).collect()
    }

    /// When switches and tank forbid spraying, until `until_s`.
    pub fn switches(&self, until_s: f64) -> Switches {
        let of = |fault: SprayerFault| -> Spans {
            let own = self.0.iter().filter(|trouble| trouble.fault == fault);
            own.filter_map(|trouble| trouble.span().common(Span::new(0.0, until_s))).collect()
        };
        Switches {
            master_off: of(SprayerFault::MasterOff),
            held_shut: of(SprayerFault::HeldShut),
            tank_empty: of(SprayerFault::TankEmpty),
        }
    }
}

/// Why a fault cannot act on this boom, in words; none where it can.
pub fn refusal(boom: &Boom, fault: &SprayerFault) -> Option<String> {
    let section = |number: u16| {
        let known: Vec<String> = boom.numbers().map(|number| number.to_string()).collect();
        let is_known = boom.section(number).is_some();
        (!is_known).then(|| format!("the boom has no section {number}; it has {}", known.join(", ")))
    };
    let nozzles = boom.nozzles().len();
    let of = |valves: Valves| match valves {
        Valves::All => None,
        Valves::Section(number) => section(number),
        Valves::Nozzle(number) => (usize::from(number) >= nozzles)
            .then(|| format!("the boom has no nozzle {number}; it has 0 to {}", nozzles.saturating_sub(1))),
    };
    match *fault {
        SprayerFault::ValveStuck(valves, _)
        | SprayerFault::ValveSlow(valves, _)
        | SprayerFault::CoilOpen(valves)
        | SprayerFault::BlockedNozzle(valves, _)
        | SprayerFault::Drip(valves, _) => of(valves),
        SprayerFault::SwappedWires(one, other) => section(one).or_else(|| section(other)),
        SprayerFault::PumpLow(_) if boom.hydraulics.is_none() => {
            Some("the boom's pressure is constant; add `[hydraulics]` to it".to_owned())
        }
        SprayerFault::FlowMeterOff(_) if boom.sensors.is_none() => {
            Some("nobody hears the boom's flow meter; add `[sensors]` to it".to_owned())
        }
        _ => None,
    }
}

fn is_of(boom: &Boom, nozzle: &Nozzle, valves: Valves) -> bool {
    match valves {
        Valves::All => true,
        Valves::Section(number) => boom.section(number) == Some(nozzle.section),
        Valves::Nozzle(number) => nozzle.number == usize::from(number),
    }
}

/// What holds at `at`; shut before the first step.
fn held(steps: &[Step], at: f64) -> f64 {
    let next = steps.partition_point(|(from, _)| *from <= at);
    steps.get(next.wrapping_sub(1)).map_or(0.0, |(_, duty)| *duty)
}

/// Steps whose times are sorted, without those that change nothing.
fn tidy(steps: impl IntoIterator<Item = Step>) -> Vec<Step> {
    let mut kept: Vec<Step> = Vec::new();
    for (at, duty) in steps {
        if kept.last().is_some_and(|(last, _)| *last >= at) {
            kept.pop();
        }
        if kept.last().map_or(0.0, |(_, last)| *last) != duty {
            kept.push((at, duty));
        }
    }
    kept
}

/// The same with one duty in `span`.
fn masked(steps: &[Step], span: Span, duty: f64) -> Vec<Step> {
    let before = steps.iter().copied().filter(|(at, _)| *at < span.from);
    let after = steps.iter().copied().filter(|(at, _)| *at > span.to);
    let end = span.to.is_finite().then(|| (span.to, held(steps, span.to)));
    tidy(before.chain([(span.from, duty)]).chain(end).chain(after))
}

/// The same with what is told in `span` obeyed so much later.
fn delayed(steps: &[Step], span: Span, late_s: f64) -> Vec<Step> {
    let mut kept: Vec<Step> = Vec::new();
    for (at, duty) in steps {
        let at = if *at >= span.from && *at < span.to { at + late_s } else { *at };
        // What overtakes a command takes its place.
        while kept.last().is_some_and(|(last, _)| *last >= at) {
            kept.pop();
        }
        kept.push((at, *duty));
    }
    tidy(kept)
}

/// Two sections get each other's duties in `span`, nozzle by nozzle.
fn swap(duties: &mut [Vec<Step>], nozzles: &[Nozzle], (one, other): (usize, usize), span: Span) {
    let of = |section: usize| -> Vec<usize> {
        nozzles.iter().filter(|nozzle| nozzle.section == section).map(|nozzle| nozzle.number).collect()
    };
    let (one, other) = (of(one), of(other));
    let before = duties.to_vec();
    for (own, theirs) in [(&one, &other), (&other, &one)] {
        for (place, nozzle) in own.iter().enumerate() {
            // The nozzles of a section share one wire: where the other one has fewer, its last is theirs, too.
            let Some(from) = theirs.get(place).or(theirs.last()) else { continue };
            let (Some(mine), Some(given)) = (before.get(*nozzle), before.get(*from)) else { continue };
            let inside = given.iter().copied().filter(|(at, _)| *at > span.from && *at < span.to);
            let steps = mine.iter().copied().filter(|(at, _)| *at < span.from);
            let steps = steps.chain([(span.from, held(given, span.from))]).chain(inside);
            let end = span.to.is_finite().then(|| (span.to, held(mine, span.to)));
            let after = mine.iter().copied().filter(|(at, _)| *at > span.to);
            if let Some(steps_of) = duties.get_mut(*nozzle) {
                *steps_of = tidy(steps.chain(end).chain(after));
            }
        }
    }
}

/// What comes in `span` times a share.
fn block(flow: &mut Flow, span: Span, left: f64, whole: Span) {
    let outside = Spans::of([span]).gaps(whole);
    let mut pieces: Vec<Piece> = flow
        .pieces
        .iter()
        .flat_map(|piece| outside.iter().filter_map(|outside| piece.part(*outside)).collect::<Vec<_>>())
        .collect();
    if left > 0.0 {
        pieces.extend(flow.pieces.iter().filter_map(|piece| {
            let Piece { span, course } = piece.part(span)?;
            let course = match course {
                Course::Ramp { from, to } => Course::Ramp { from: from * left, to: to * left },
                Course::Settling { from, towards, tau_s } => {
                    Course::Settling { from: from * left, towards: towards * left, tau_s }
                }
            };
            Some(Piece { span, course })
        }));
    }
    pieces.sort_by(|a, b| a.span.from.total_cmp(&b.span.from));
    flow.pieces = pieces;
    if left < OPEN_SHARE {
        flow.open = flow.open.and(&outside);
    }
}

/// What is shut in `span` drips.
fn drip(flow: &mut Flow, span: Span, share: f64) {
    let flowing: Spans = flow.pieces.iter().map(|piece| piece.span).collect();
    let course = Course::Ramp { from: share, to: share };
    flow.pieces.extend(flowing.gaps(span).iter().map(|span| Piece { span: *span, course }));
    flow.pieces.sort_by(|a, b| a.span.from.total_cmp(&b.span.from));
}

#[cfg(test)]
mod tests;
