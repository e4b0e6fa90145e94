//! Faults that began and changed nothing that anybody could notice, by what they act on.

use std::time::Duration;

use rowscan_canopy::AdvanceSource;
use rowscan_protocol::time::SimTime;

use crate::fault::ScenarioFault;
use crate::journal::{Event, Journal};
use crate::runner::RunRecord;
use crate::scenario::Scenario;

/// How closely the way is looked at.
const STEP: Duration = Duration::from_millis(20);
/// A tractor that goes less in such a step stands, metres.
const STANDS_M: f64 = 1e-6;

/// Why a fault could change nothing in a run in which it began; `None` where it could.
pub(crate) fn why(scenario: &Scenario, fault: &ScenarioFault, run: &RunRecord) -> Option<&'static str> {
    let ScenarioFault::Rig(spec) = fault else { return None };
    match spec.fault.name {
        "encoder" if !anybody_counts(run) => {
            Some("no scan told what the encoder counts: have a client switch it on")
        }
        "gnss" if scenario.nmea.is_empty() && scenario.buses.is_empty() => {
            Some("nothing carries GNSS: the scenario has no `[[nmea]]` and no `[[bus]]`")
        }
        "reverse" => lasting(run, spec.id.as_deref()?, |way_m| way_m < -STANDS_M)
            .then_some("it was over before the tractor went back: make it longer than the braking takes"),
        "stop" => lasting(run, spec.id.as_deref()?, |way_m| way_m.abs() < STANDS_M)
            .then_some("it was over before the tractor stood: make it longer than the braking takes"),
        _ => None,
    }
}

/// Whether a scanner told the encoder's counts.
fn anybody_counts(run: &RunRecord) -> bool {
    let sources = run.streams.values().filter_map(|stream| stream.estimate.as_ref()?.advance_source);
    sources.into_iter().any(|source| source == AdvanceSource::Encoder)
}

/// Whether a fault had an end, and from its begin to the end of the run no step of the way was so.
fn lasting(run: &RunRecord, id: &str, is_so: impl Fn(f64) -> bool) -> bool {
    let Some(journal) = &run.journal else { return false };
    let end = format!("{id}.end");
    let named = |name: &str| run.events.iter().find(|event| event.event == name).map(Event::at);
    let (Some(from), Some(_)) = (named(id), named(&end)) else { return false };
    !steps(journal, from, run.ended).any(is_so)
}

/// The way of each step, metres.
fn steps(journal: &Journal, from: SimTime, to: SimTime) -> impl Iterator<Item = f64> {
    let times = (0..).map(move |step| from + step * STEP).take_while(move |at| *at <= to);
    let ways = times.map(|at| journal.way_m(at));
    ways.scan(None, |last, way_m| Some(last.replace(way_m).map_or(f64::INFINITY, |last_m| way_m - last_m)))
}
