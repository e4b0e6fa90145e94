//! From what was seen to verdicts.

use rowscan_protocol::time::SimTime;

use crate::runner::RunRecord;
use crate::scenario::{Expect, Scenario};
use crate::verdict::Verdict;
use crate::what::{Count, Kind, Measure};
use crate::witness::Stream;

/// An expectation that has been judged.
#[derive(Debug)]
pub(crate) struct Judged {
    pub(crate) verdict: Verdict,
    pub(crate) message: String,
    /// When it was decided; the end of the run where absent.
    pub(crate) at: Option<SimTime>,
}

impl Judged {
    fn new(verdict: Verdict, message: impl Into<String>) -> Self {
        Self { verdict, message: message.into(), at: None }
    }

    fn error(message: impl Into<String>) -> Self {
        Self::new(Verdict::Error, message)
    }

    fn holds(holds: bool, message: impl Into<String>) -> Self {
        Self::new(if holds { Verdict::Passed } else { Verdict::Failed }, message)
    }

    fn at(self, at: SimTime) -> Self {
        Self { at: Some(at), ..self }
    }
}

/// Judges expectation number `number`, on the first of `runs`; the others have the same seed.
pub(crate) fn judge(scenario: &Scenario, number: usize, expect: &Expect, runs: &[RunRecord]) -> Judged {
    if expect.what.kind == Kind::Sprayer {
        return Judged::error(format!("`{}` needs the sprayer, which is not there yet", expect.what.name));
    }
    let Some(run) = runs.first() else { return Judged::error("it was not run") };
    if let Some(error) = runs.iter().find_map(|run| run.error.as_ref()) {
        return Judged::error(error);
    }
    if expect.equals_run_without.is_some() {
        return Judged::error("`equals_run_without` needs faults, which land separately");
    }
    let judged = match expect.what.kind {
        Kind::NextScan => next_scan(scenario, expect, run),
        Kind::Count(count) => counted(scenario, expect, count, run),
        Kind::Measure(measure) => measured(scenario, expect, measure, run),
        Kind::Log => log(scenario, number, expect, run),
        Kind::BytesOf => bytes_of(scenario, expect, run),
        Kind::SameBytes => same_bytes(expect, runs),
        Kind::ExitCode => exit_code(scenario, expect, run),
        Kind::Sprayer => Err(String::new()),
    };
    judged.unwrap_or_else(Judged::error)
}

type Result = std::result::Result<Judged, String>;

/// The one that is meant: the one named, or the only one.
fn the_one<'a>(
    what: &str,
    named: Option<&'a String>,
    all: impl Iterator<Item = &'a String> + Clone,
) -> std::result::Result<&'a str, String> {
    let known = || all.clone().map(String::as_str).collect::<Vec<_>>().join(", ");
    match (named, all.clone().count()) {
        (Some(name), _) if all.clone().any(|id| id == name) => Ok(name),
        (Some(name), _) => Err(format!("there is no {what} `{name}`; known are {}", known())),
        (None, 1) => all.clone().next().map(String::as_str).ok_or_else(String::new),
        (None, 0) => Err(format!("there is no {what}")),
        (None, _) => Err(format!("there are several {what}s: name one of {}", known())),
    }
}

fn stream<'a>(
    scenario: &'a Scenario,
    expect: &'a Expect,
    run: &'a RunRecord,
) -> std::result::Result<(&'a str, &'a Stream), String> {
    let id = the_one("device", expect.on.as_ref(), scenario.devices.iter().map(|device| &device.id))?;
    run.streams.get(id).map(|stream| (id, stream)).ok_or_else(|| format!("nothing is known of `{id}`"))
}

fn child<'a>(scenario: &'a Scenario, expect: &'a Expect) -> std::result::Result<&'a str, String> {
    the_one("run", expect.on.as_ref(), scenario.runs.iter().map(|run| &run.id))
}

/// When the event was that an expectation counts from; the start of time without one.
fn from_event(event: Option<&String>, run: &RunRecord) -> std::result::Result<SimTime, String> {
    let Some(name) = event else { return Ok(SimTime::ZERO) };
    match run.events.iter().find(|event| event.event == *name) {
        Some(event) => Ok(SimTime((event.t_s * 1e9).round() as u64)),
        None => {
            let mut known: Vec<&str> = run.events.iter().map(|event| event.event.as_str()).collect();
            known.sort_unstable();
            known.dedup();
            Err(format!("there was no event `{name}`; there were {}", known.join(", ")))
        }
    }
}

fn seconds_after(from: SimTime, seconds: f64) -> SimTime {
    SimTime(from.0.saturating_add((seconds.max(0.0) * 1e9).round() as u64))
}

fn next_scan(scenario: &Scenario, expect: &Expect, run: &RunRecord) -> Result {
    let (id, stream) = stream(scenario, expect, run)?;
    let from = from_event(expect.after.as_ref(), run)?;
    let within_s = expect.within_s.unwrap_or_default();
    let due = seconds_after(from, within_s);
    let next = stream.scan_times.iter().find(|time| **time >= from).copied();
    let told = |at: SimTime| format!("{:.3} s", at.as_secs_f64() - from.as_secs_f64());
    Ok(match next {
        Some(at) if at <= due => Judged::holds(true, format!("a scan from {id} after {}", told(at))).at(at),
        Some(at) => Judged::holds(
            false,
            format!("expected a scan from {id} within {within_s} s, found one after {}", told(at)),
        )
        .at(due),
        None if run.ended < due => {
            let why = format!(
                "expected a scan from {id} within {within_s} s, found none until the end after {}",
                told(run.ended)
            );
            Judged::holds(false, why)
        }
        None => {
            Judged::holds(false, format!("expected a scan from {id} within {within_s} s, found none")).at(due)
        }
    })
}

fn counted(scenario: &Scenario, expect: &Expect, count: Count, run: &RunRecord) -> Result {
    let (id, stream) = stream(scenario, expect, run)?;
    if let Some(text) = &expect.equals_text {
        return Err(format!("`equals = \"{text}\"` needs the fault `power`, which lands separately"));
    }
    let (from, to) = match (&expect.between_events, &expect.after) {
        (Some((from, to)), _) => (from_event(Some(from), run)?, Some(from_event(Some(to), run)?)),
        (None, Some(after)) => (from_event(Some(after), run)?, None),
        (None, None) => (SimTime::ZERO, None),
    };
    let name = expect.what.name;
    if stream.counts().connections == 0 || (stream.scan_times.is_empty() && count != Count::Reconnects) {
        return Ok(Judged::holds(false, format!("{name} of {id}: unknown: no scan was delivered")));
    }
    let before = match (&expect.between_events, &expect.after) {
        (None, None) => 0,
        _ => stream.counts_at(from).of(count),
    };
    let after = to.map_or(stream.counts(), |to| stream.counts_at(to)).of(count);
    let found = after.saturating_sub(before);
    let message = format!("{name} of {id}: expected {}, found {found}", expect.bounds.words());
    let judged = Judged::holds(expect.bounds.hold(found as f64), message);
    // When it last changed.
    let changes = stream.changes.windows(2).rev();
    let changed =
        changes.filter_map(|pair| (pair[0].1.of(count) != pair[1].1.of(count)).then_some(pair[1].0));
    Ok(match changed.into_iter().next() {
        Some(at) => judged.at(at),
        None => judged,
    })
}

fn measured(scenario: &Scenario, expect: &Expect, measure: Measure, run: &RunRecord) -> Result {
    let (id, stream) = stream(scenario, expect, run)?;
    let estimate = stream.estimate.as_ref();
    let found = match measure {
        Measure::ImpactedTotalArea => estimate.and_then(|estimate| estimate.impacted_total_area_m2),
        Measure::LeafAreaError => {
            estimate.zip(run.truth.as_ref()).and_then(|(estimate, truth)| truth.leaf_area_error(estimate))
        }
    };
    let name = expect.what.name;
    Ok(match found {
        Some(found) => {
            let message = format!("{name} of {id}: expected {}, found {found:.6}", expect.bounds.words());
            Judged::holds(expect.bounds.hold(found), message)
        }
        None => {
            let scans = stream.scan_times.len();
            let warnings = estimate.map(|estimate| &estimate.warnings[..]).unwrap_or_default();
            let why: Vec<String> = warnings.iter().map(ToString::to_string).collect();
            Judged::holds(false, format!("{name} of {id}: unknown after {scans} scans; {}", why.join("; ")))
        }
    })
}

fn log(scenario: &Scenario, number: usize, expect: &Expect, run: &RunRecord) -> Result {
    let id = child(scenario, expect)?;
    let from = from_event(expect.after.as_ref(), run)?;
    let due = expect.within_s.map(|seconds| seconds_after(from, seconds));
    let times = run.children.get(id).and_then(|child| child.matches.get(&number));
    let first = times.into_iter().flatten().find(|time| **time >= from).copied();
    let pattern = expect.matches.as_ref().map_or("", |pattern| pattern.0.as_str());
    Ok(match (first, due) {
        (Some(at), Some(due)) if at > due => Judged::holds(
            false,
            format!("a line of {id} matches `{pattern}` only at {:.3} s", at.as_secs_f64()),
        )
        .at(due),
        (Some(at), _) => Judged::holds(true, format!("a line of {id} matches `{pattern}`")).at(at),
        (None, _) => {
            Judged::holds(false, format!("expected a line of {id} that matches `{pattern}`, found none"))
        }
    })
}

/// Where two texts of bytes differ, in words; nothing where they do not.
fn difference(found: &[u8], expected: &[u8]) -> Option<String> {
    if found == expected {
        return None;
    }
    let byte = found.iter().zip(expected).take_while(|(a, b)| a == b).count();
    let line = found[..byte].iter().filter(|byte| **byte == b'\n').count() + 1;
    Some(format!(
        "differs from byte {byte}, line {line}; {} bytes found, {} expected",
        found.len(),
        expected.len()
    ))
}

fn bytes_of(scenario: &Scenario, expect: &Expect, run: &RunRecord) -> Result {
    let file = expect.file.as_deref().unwrap_or_default();
    let other = expect.equals_text.as_deref().ok_or("`equals`: expected the name of a file")?;
    let path = scenario.folder().join(other);
    let expected =
        std::fs::read(&path).map_err(|cause| format!("cannot read {}: {cause}", path.display()))?;
    let Ok(found) = std::fs::read(run.folder.join(file)) else {
        return Ok(Judged::holds(false, format!("{file}: the run left no such file")));
    };
    Ok(match difference(&found, &expected) {
        None => Judged::holds(true, format!("{file} equals {other}")),
        Some(how) => Judged::holds(false, format!("{file} {how} in {other}")),
    })
}

fn same_bytes(expect: &Expect, runs: &[RunRecord]) -> Result {
    let file = expect.file.as_deref().unwrap_or_default();
    let wanted = usize::try_from(expect.runs).unwrap_or(usize::MAX);
    if runs.len() < wanted {
        return Err(format!("{} of {wanted} runs were made", runs.len()));
    }
    let mut contents = Vec::new();
    for run in &runs[..wanted] {
        match std::fs::read(run.folder.join(file)) {
            Ok(content) => contents.push(content),
            Err(_) => return Ok(Judged::holds(false, format!("{file}: a run left no such file"))),
        }
    }
    for (number, content) in contents.iter().enumerate().skip(1) {
        if let Some(how) = difference(content, &contents[0]) {
            return Ok(Judged::holds(false, format!("{file} of run {} {how} by run 1", number + 1)));
        }
    }
    Ok(Judged::holds(true, format!("{file} is the same in {wanted} runs")))
}

fn exit_code(scenario: &Scenario, expect: &Expect, run: &RunRecord) -> Result {
    let id = child(scenario, expect)?;
    let wanted = expect.bounds.equals.unwrap_or(0.0);
    let code = run.children.get(id).and_then(|child| child.exit_code);
    let told = code.map_or("none".to_owned(), |code| code.to_string());
    let message = format!("exit code of {id}: expected {wanted}, found {told}");
    Ok(Judged::holds(code.is_some_and(|code| f64::from(code) == wanted), message))
}
