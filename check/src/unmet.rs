//! Faults that began and changed nothing that anybody could notice, by what they act on.

use std::collections::BTreeMap;
use std::time::Duration;

use rowscan_canopy::AdvanceSource;
use rowscan_protocol::time::SimTime;

use crate::fault::ScenarioFault;
use crate::journal::{Event, Journal};
use crate::run_end::RunEnd;
use crate::witness::Stream;

/// How closely the way is looked at.
const STEP: Duration = Duration::from_millis(20);
/// A tractor that goes less in such a step stands, metres.
const STANDS_M: f64 = 1e-6;
/// A tractor that goes less than so many times its speed before has slowed down.
const SLOWED: f64 = 0.9;

/// What a run has left of its course.
pub(crate) struct Left<'a> {
    pub(crate) streams: &'a BTreeMap<String, Stream>,
    pub(crate) events: &'a [Event],
    pub(crate) journal: &'a Journal,
    pub(crate) end: RunEnd<'a>,
}

/// Why a fault changed nothing in a run in which it began; `None` where it could.
pub(crate) fn why(fault: &ScenarioFault, left: &Left<'_>) -> Option<String> {
    let ScenarioFault::Rig(spec) = fault else { return None };
    match spec.fault.name {
        "encoder" if !anybody_counts(left.streams) => Some(
            "nobody was told what the encoder counts: have a client of a scanner switch it on".to_owned(),
        ),
        "reverse" => never(left, spec.id.as_deref()?, "went back", |_, way_m| way_m < -STANDS_M),
        // Who brakes for a stop that is soon over drives slower all the same.
        "stop" => never(left, spec.id.as_deref()?, "slowed down", |before_m, way_m| {
            way_m < SLOWED * before_m || way_m.abs() < STANDS_M
        }),
        _ => None,
    }
}

/// Whether a scanner told the encoder's counts.
fn anybody_counts(streams: &BTreeMap<String, Stream>) -> bool {
    let mut sources = streams.values().filter_map(|stream| stream.estimate.as_ref()?.advance_source);
    sources.any(|source| source == AdvanceSource::Encoder)
}

/// Why the tractor never did what a fault wants: from its begin to the end of the run no step of the way was so, beside the first one.
fn never(left: &Left<'_>, id: &str, did: &str, is_so: impl Fn(f64, f64) -> bool) -> Option<String> {
    let end = format!("{id}.end");
    let named = |name: &str| left.events.iter().find(|event| event.event == name).map(Event::at);
    let mut steps = steps(left.journal, named(id)?, left.end.at).peekable();
    let before_m = steps.peek().copied().unwrap_or(f64::INFINITY);
    if steps.any(|way_m| is_so(before_m, way_m)) {
        return None;
    }
    Some(match named(&end).filter(|end| *end < left.end.at) {
        Some(_) => format!("it was over before the tractor {did}: make it longer than the braking takes"),
        None => left.end.before(&format!("the tractor {did}")),
    })
}

/// The way of each step, metres.
fn steps(journal: &Journal, from: SimTime, to: SimTime) -> impl Iterator<Item = f64> {
    let times = (1..).map(move |step| from + step * STEP).take_while(move |at| *at <= to);
    let ways = times.map(|at| journal.way_m(at));
    ways.scan(journal.way_m(from), |last_m, way_m| Some(way_m - std::mem::replace(last_m, way_m)))
}
