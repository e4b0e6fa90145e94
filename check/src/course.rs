//! Whether runs took the course that their scenario sets out: every fault began, and the end was reached.

use rowscan_faults::At;

use crate::ending;
use crate::fault::ScenarioFault;
use crate::journal::over_at_once;
use crate::judge::Runs;
use crate::judged::Judged;
use crate::runner::RunRecord;
use crate::scenario::{Expect, OnExit, RunSpec, Scenario};
use crate::what::Kind;

/// What was to happen and did not, in words, and what is told of it.
pub(crate) struct Shortfall {
    /// What was to happen.
    pub(crate) name: String,
    pub(crate) judged: Judged,
}

/// What did not happen in these runs, though the scenario says so. Empty where a run broke off: that is told already.
pub(crate) fn shortfalls(scenario: &Scenario, runs: &Runs) -> Vec<Shortfall> {
    let all = || runs.all.iter().chain(&runs.without_faults);
    if all().any(|run| run.error.is_some()) {
        return Vec::new();
    }
    let faults = scenario.faults.iter().filter_map(|fault| {
        never_began(scenario, fault, runs.all.iter())
            .or_else(|| never_acted(scenario, fault, runs.all.iter()))
    });
    let end = all().find_map(|run| left_early(scenario, run));
    let silence = all().find_map(|run| ends_unheard(scenario, run).or_else(|| ends_unread(scenario, run)));
    faults.chain(end).chain(silence).collect()
}

/// Whether an expectation wants that this fault does nothing.
fn wants_none(scenario: &Scenario, id: &str) -> bool {
    scenario.expects.iter().any(|expect| {
        expect.what.kind == Kind::FaultActs
            && expect.on.as_deref() == Some(id)
            && expect.bounds.hold(0.0)
            && !expect.bounds.hold(1.0)
    })
}

/// A fault that could act on nothing that it was tried on, as on a checksum in CoLa A.
fn never_acted<'a>(
    scenario: &Scenario,
    fault: &ScenarioFault,
    mut runs: impl Iterator<Item = &'a RunRecord>,
) -> Option<Shortfall> {
    let id = fault.id().filter(|id| !wants_none(scenario, id))?;
    let (acted, skipped) = (format!("{id}.act"), format!("{id}.skipped"));
    let why = runs.find_map(|run| {
        let began = run.events.iter().any(|event| event.event == *id);
        let met_nothing = began && !fault.is_by_chance() && run.fault_acts.get(id) == Some(&0);
        let first = run.events.iter().find(|event| event.event == skipped).map(|event| event.detail.clone());
        let over = "it was over at the instant at which it began: its `until` was there already (of a `row_m`: the tractor was there, or farther)";
        let at_once = fault.has_until() && over_at_once(&run.events, id);
        let why = first
            .or_else(|| at_once.then(|| over.to_owned()))
            .or_else(|| run.unmet(fault).filter(|_| began))
            .or_else(|| met_nothing.then(|| "what it acts on never came".to_owned()))?;
        run.events.iter().all(|event| event.event != acted).then_some(why)
    })?;
    let message = format!(
        "fault `{id}` could act on nothing: {why}; have it act, take another fault, or expect `fault_acts` of `{id}` to equal 0"
    );
    Some(Shortfall { name: format!("fault {id} acts"), judged: Judged::error(message) })
}

fn never_began<'a>(
    scenario: &Scenario,
    fault: &ScenarioFault,
    mut runs: impl Iterator<Item = &'a RunRecord>,
) -> Option<Shortfall> {
    let id = fault.id()?;
    if fault.is_by_chance() || wants_none(scenario, id) {
        return None;
    }
    let run = runs.find(|run| !run.events.iter().any(|event| event.event == *id))?;
    let before = fault.at().map_or(String::new(), |at| format!(", before {}", moment(&at)));
    let message = format!(
        "fault `{id}` never began: the run ended at {}{before}; move `end` or `at`, or expect `fault_acts` of `{id}` to equal 0",
        run.place()
    );
    Some(Shortfall { name: format!("fault {id} begins"), judged: Judged::error(message) })
}

/// Whether an expectation is of who takes this device's scans.
fn expects_silence(scenario: &Scenario, id: &str) -> bool {
    let of = |expect: &Expect| expect.on.as_ref().is_none_or(|on| on == id);
    scenario.expects.iter().any(|expect| expect.what.kind == Kind::Unheard && of(expect))
}

/// Whether the end of a child was expected, and came: what it no longer takes is known.
fn ends_as_expected(scenario: &Scenario, run: &RunRecord) -> bool {
    let is_expected = |spec: &RunSpec| {
        let is_tried = spec.on_exit == OnExit::DriveOn || ending::expects_exit(scenario, &spec.id);
        is_tried && ending::exit_before_end(run, &spec.id).is_some()
    };
    scenario.runs.iter().any(is_expected) || run.left.is_some()
}

/// A run at whose end nobody takes a scanner's scans any more, and nobody expects that.
fn ends_unheard(scenario: &Scenario, run: &RunRecord) -> Option<Shortfall> {
    if ends_as_expected(scenario, run) {
        return None;
    }
    let unheard = run.streams.iter().filter(|(id, _)| !expects_silence(scenario, id));
    let (id, silence) = unheard
        .filter_map(|(id, stream)| Some((id, stream.unheard?.at_end)))
        .find(|(_, silence)| !silence.is_zero())?;
    let message = format!(
        "the run ended at {} without a taker: nobody had taken scans of `{id}` for {:.3} s; expect its `unheard_s` if that is right",
        run.place(),
        silence.as_secs_f64()
    );
    Some(Shortfall { name: "somebody listens at the end".to_owned(), judged: Judged::error(message) })
}

/// A run at whose end a client takes a scanner's scans and reads them no more, or far too late. One that a fault pauses cannot.
fn ends_unread(scenario: &Scenario, run: &RunRecord) -> Option<Shortfall> {
    let is_paused = scenario.faults.iter().any(|fault| matches!(fault, ScenarioFault::Pause(_)));
    if is_paused || ends_as_expected(scenario, run) {
        return None;
    }
    let (id, bytes) = run.unread.first_key_value()?;
    let message = format!(
        "the run ended at {} with {bytes} bytes of `{id}` unread, a second of scans and more: its client reads no more, or slower than scans come; let it \
         read them, or hang up",
        run.place()
    );
    Some(Shortfall { name: "somebody listens at the end".to_owned(), judged: Judged::error(message) })
}

/// A run that its last child ended by leaving, and whose exit nobody expects.
fn left_early(scenario: &Scenario, run: &RunRecord) -> Option<Shortfall> {
    let child = run.left.as_deref()?;
    if ending::expects_exit(scenario, child) {
        return None;
    }
    let message = format!(
        "{}; move `end`, or expect the `exit_code` of `{child}`",
        run.early(scenario).unwrap_or_default()
    );
    Some(Shortfall { name: "the end is reached".to_owned(), judged: Judged::error(message) })
}

/// What a fault waits for.
fn moment(at: &At) -> String {
    match at {
        At::Start => "it could".to_owned(),
        At::Time(at) => format!("{} s", at.as_secs_f64()),
        At::Scan(scan) => format!("scan {scan} of a connection"),
        At::Command(command) => format!("the client sent `{command}`"),
        At::RowM(row_m) => format!("row {row_m} m"),
        At::Tree(tree) => format!("tree {tree}"),
        At::After { id, end, plus } => {
            let event = if *end { format!("{id}.end") } else { id.clone() };
            format!("`{event}` and {} s more", plus.as_secs_f64())
        }
    }
}

#[cfg(test)]
mod tests;
