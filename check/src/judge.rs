//! From what was seen to verdicts.

use std::path::Path;

use rowscan_files::OutputFile;
use rowscan_protocol::time::SimTime;

use crate::ending::{crash, wanted_code};
use crate::journal::{END, Event, row_place};
use crate::judged::{Judged, Window, event_number, in_time, the_one};
use crate::runner::RunRecord;
use crate::scenario::{Expect, Scenario};
use crate::what::{Count, Kind, Measure};
use crate::witness::Stream;
use crate::{process_value, signal, sprayer, truth};

/// Longest file of a run that is compared.
const MOST_BYTES: u64 = 512 * 1024 * 1024;

/// The runs of one seed.
#[derive(Debug)]
pub(crate) struct Runs {
    /// Those that count: the first is judged, the others must agree with it.
    pub(crate) all: Vec<RunRecord>,
    /// One in which nothing went wrong, if any expectation compares with it.
    pub(crate) without_faults: Option<RunRecord>,
    /// Files that are compared with are written anew.
    pub(crate) bless: bool,
}

/// Judges expectation number `number`.
pub(crate) fn judge(scenario: &Scenario, number: usize, expect: &Expect, tried: &Runs) -> Judged {
    let runs = tried.all.as_slice();
    let Some(run) = runs.first() else { return Judged::error("it was not run") };
    if let Some(error) = runs.iter().find_map(|run| run.error.as_ref()) {
        return Judged::error(error);
    }
    let without = match (&expect.equals_run_without, &tried.without_faults) {
        (None, _) => None,
        (Some(_), _) if scenario.faults.is_empty() => {
            return Judged::error(
                "`equals_run_without`: the scenario has no fault, and a run without faults is the same run; add a `[[fault]]`, or leave the expectation out",
            );
        }
        (Some(_), None) => return Judged::error("the run without faults was not made"),
        (Some(_), Some(RunRecord { error: Some(error), .. })) => {
            return Judged::error(format!("the run without faults: {error}"));
        }
        (Some(_), Some(without)) => Some(without),
    };
    let judged = match expect.what.kind {
        Kind::Signal => signal::judge(number, expect, run, without),
        Kind::BusLoad => signal::bus_load(scenario, expect, run),
        Kind::Unheard => unheard(scenario, expect, run),
        Kind::NextScan => next_scan(scenario, expect, run),
        Kind::Count(count) => counted(scenario, expect, count, run),
        Kind::Measure(measure) => measured(scenario, expect, measure, (run, without)),
        Kind::FaultActs => fault_acts(expect, run),
        Kind::Log => log(scenario, number, expect, run),
        Kind::BytesOf => bytes_of(scenario, expect, tried.bless, (run, without)),
        Kind::SameBytes => same_bytes(expect, runs),
        Kind::ExitCode => exit_code(scenario, expect, run),
        Kind::Sprayer(asked) => sprayer::judge(expect, asked, run),
        Kind::ProcessValue => process_value::judge(expect, run),
    };
    let judged = judged.unwrap_or_else(Judged::error).beside_jitter(scenario.clock.scale, run.jitter);
    let opens = Window::of(expect.after.as_ref(), run).map(|window| window.opens);
    let judged = judged.beside_sleeps(opens.unwrap_or_default(), run);
    match expect.what.kind {
        // What the bench itself did, and how a child ended.
        Kind::FaultActs | Kind::ExitCode => judged,
        _ => judged.after_crash(crash(scenario, run)),
    }
}

type Result = std::result::Result<Judged, String>;

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

/// The number of an event that something is counted from: nothing is counted from the end on.
fn window_start(key: &str, name: &str, run: &RunRecord) -> std::result::Result<usize, String> {
    let (from, end) = (event_number(name, run)?, event_number(END, run)?);
    match from < end {
        true => Ok(from),
        false => Err(format!(
            "`{key}`: expected `{name}` before the end, found it only at the end: the window holds nothing"
        )),
    }
}

/// The numbers of two events that something is counted between.
fn window(from: &str, to: &str, run: &RunRecord) -> std::result::Result<(usize, usize), String> {
    let (start, stop) = (window_start("between", from, run)?, event_number(to, run)?);
    let at = |number: usize| run.events.get(number).map_or(0.0, |event| event.t_s);
    match start < stop {
        true => Ok((start, stop)),
        false => Err(format!(
            "`between`: expected `{from}` before `{to}`, found `{to}` first, at {:.3} s, and `{from}` at {:.3} s: the window holds nothing",
            at(stop),
            at(start)
        )),
    }
}

fn next_scan(scenario: &Scenario, expect: &Expect, run: &RunRecord) -> Result {
    let (id, stream) = stream(scenario, expect, run)?;
    if let Some(after) = expect.after.as_ref().filter(|after| row_place(after).is_none()) {
        window_start("after", after, run)?;
    }
    let window = Window::of(expect.after.as_ref(), run)?;
    let within_s = expect.within_s.unwrap_or_default();
    let due = window.due(within_s);
    let next = stream.scan_times.iter().find(|time| **time >= window.opens).copied();
    let told = |at: SimTime| window.told(at);
    Ok(match next {
        Some(at) if in_time(at, due) => {
            Judged::holds(true, format!("a scan from {id} {}", told(at))).at(at).due(due, at)
        }
        Some(at) => Judged::holds(
            false,
            format!("expected a scan from {id} within {within_s} s, found one {}", told(at)),
        )
        .at(due)
        .due(due, at),
        None if run.ended < due => {
            let why = format!(
                "expected a scan from {id} within {within_s} s, found none until the end {}",
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
    let (from, to) = match (&expect.between_events, &expect.after) {
        (Some((from, to)), _) => window(from, to, run).map(|(from, to)| (Some(from), Some(to)))?,
        (None, Some(after)) => (Some(window_start("after", after, run)?), None),
        (None, None) => (None, None),
    };
    let name = expect.what.name;
    match count {
        Count::Reconnects if stream.counts().connections == 0 => {
            return Err(format!("{name} of {id}: unknown: there was no connection over CoLa"));
        }
        Count::SegmentsLost if !stream.has_segments() => {
            return Err(format!("{name} of {id}: it sends no segments"));
        }
        Count::Reconnects => {}
        _ if stream.scan_times.is_empty() => {
            return Err(format!("{name} of {id}: unknown: no scan was delivered"));
        }
        _ => {}
    }
    let before = from.map(|from| stream.counts_at(from)).unwrap_or_default();
    let after = to.map_or(stream.counts(), |to| stream.counts_at(to));
    let untold = after.untold.saturating_sub(before.untold);
    if count == Count::ScansLost && untold > 0 {
        return Err(format!(
            "{name} of {id}: unknown: {id} does not count its scans, or began to count anew, as after `power`, and nobody can tell how many were lost meanwhile; \
             expect it `after` that or `between` other events, or a `first_scan` or the `log` instead"
        ));
    }
    let found = after.of(count).saturating_sub(before.of(count));
    let not_sent = after.not_sent.saturating_sub(before.not_sent);
    let by_device = expect.equals_text.is_some();
    if by_device && !stream.device_tells() {
        return Err(format!("{name} of {id}: {id} does not tell what it has not sent; expect a number"));
    }
    let from_device = by_device.then(|| format!("{not_sent}, which the device has not sent"));
    let bounds = Some(expect.bounds.words()).filter(|words| !words.is_empty());
    let expected = from_device.into_iter().chain(bounds).collect::<Vec<_>>().join(", ");
    let holds = (!by_device || found == not_sent) && expect.bounds.hold(found as f64);
    let judged = Judged::holds(holds, format!("{name} of {id}: expected {expected}, found {found}"));
    // When it last changed.
    let changes = stream.changes.windows(2).rev();
    let changed = changes
        .filter_map(|pair| (pair[0].counts.of(count) != pair[1].counts.of(count)).then_some(pair[1].at));
    let closed = to.and_then(|to| run.events.get(to)).filter(|event| event.event != END).map(Event::at);
    Ok(Judged { at: changed.into_iter().next(), decided: closed, ..judged })
}

fn unheard(scenario: &Scenario, expect: &Expect, run: &RunRecord) -> Result {
    let (id, stream) = stream(scenario, expect, run)?;
    let name = expect.what.name;
    let unheard =
        stream.unheard.ok_or_else(|| format!("{name} of {id}: {id} does not tell who takes its scans"))?;
    let found_s = unheard.all.as_secs_f64();
    let message = format!("{name} of {id}: expected {}, found {found_s:.3}", expect.bounds.words());
    Ok(Judged::holds(expect.bounds.hold(found_s), message))
}

/// A measure of the delivered scans; none where they do not tell.
fn measure_of(measure: Measure, (id, stream): (&str, &Stream), run: &RunRecord) -> Option<f64> {
    let estimate = stream.estimate.as_ref()?;
    match measure {
        Measure::ImpactedTotalArea => estimate.impacted_total_area_m2,
        Measure::LeafAreaError => run.truths.get(id)?.leaf_area_error(estimate, &stream.passed),
    }
}

fn measured(
    scenario: &Scenario,
    expect: &Expect,
    measure: Measure,
    (run, without): (&RunRecord, Option<&RunRecord>),
) -> Result {
    let mut bounds = expect.bounds;
    if let Some(without) = without {
        let (id, stream) = stream(scenario, expect, without)?;
        let unknown = || format!("the run without faults: {} of {id} is unknown", expect.what.name);
        bounds.equals = Some(measure_of(measure, (id, stream), without).ok_or_else(unknown)?);
    }
    let (id, stream) = stream(scenario, expect, run)?;
    let estimate = stream.estimate.as_ref();
    let name = expect.what.name;
    let unknown = || {
        let scans = estimate.map_or(0, |estimate| estimate.scans);
        let warnings = estimate.map(|estimate| &estimate.warnings[..]).unwrap_or_default();
        let why: Vec<String> = warnings.iter().map(ToString::to_string).collect();
        format!("{name} of {id}: unknown after {scans} scans; {}", why.join("; "))
    };
    let found = measure_of(measure, (id, stream), run).ok_or_else(unknown)?;
    let other_way = |run: &RunRecord| {
        let stream = run.streams.get(id)?;
        truth::other_way(stream.estimate.as_ref()?, &stream.passed)
    };
    // A leaf area's error is taken against the truth, so a wrong way shows in it. In an area alone it does not.
    if measure == Measure::ImpactedTotalArea
        && let Some((estimate_m, way_m)) = without.into_iter().chain([run]).find_map(other_way)
    {
        return Err(format!(
            "{name} of {id}: unknown: no encoder counted in its scans, so the estimate went {estimate_m:.2} m by the rig's constant speed, and the tractor {way_m:.2} m; \
             have the client switch the encoder on, or take the fault that changes the speed out"
        ));
    }
    let found_text = if without.is_some() { found.to_string() } else { format!("{found:.6}") };
    let message = format!("{name} of {id}: expected {}, found {found_text}", bounds.words());
    Ok(Judged::holds(bounds.hold(found), message))
}

fn fault_acts(expect: &Expect, run: &RunRecord) -> Result {
    let id = expect.on.as_deref().unwrap_or_default();
    // One that never began has acted on nothing.
    let found = run.fault_acts.get(id).copied().unwrap_or(0);
    let message = format!("acts of the fault {id}: expected {}, found {found}", expect.bounds.words());
    Ok(Judged::holds(expect.bounds.hold(found as f64), message))
}

fn log(scenario: &Scenario, number: usize, expect: &Expect, run: &RunRecord) -> Result {
    let id = child(scenario, expect)?;
    let window = Window::of(expect.after.as_ref(), run)?;
    let due = expect.within_s.map(|seconds| window.due(seconds));
    let times = run.children.get(id).and_then(|child| child.matches.get(&number));
    let first = times.into_iter().flatten().map(|found| found.at).find(|time| *time >= window.opens);
    let pattern = expect.matches.as_ref().map_or("", |pattern| pattern.0.as_str());
    Ok(match (first, due) {
        (Some(at), Some(due)) if !in_time(at, due) => Judged::holds(
            false,
            format!(
                "a line of {id} matches `{pattern}` only at {:.3} s; expected by {:.3} s, counted from {}",
                at.as_secs_f64(),
                due.as_secs_f64(),
                window.start()
            ),
        )
        .at(due)
        .due(due, at),
        (Some(at), Some(due)) => {
            Judged::holds(true, format!("a line of {id} matches `{pattern}`")).at(at).due(due, at)
        }
        (Some(at), None) => Judged::holds(true, format!("a line of {id} matches `{pattern}`")).at(at),
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
        "differs from byte {byte}, line {line}: found {}, expected {}; {} bytes found, {} expected",
        line_of(found, line),
        line_of(expected, line),
        found.len(),
        expected.len()
    ))
}

/// A line of a text, as far as a message shows it.
fn line_of(text: &[u8], number: usize) -> String {
    const SHOWN: usize = 160;
    match text.split(|byte| *byte == b'\n').nth(number - 1) {
        None | Some([]) => "nothing".to_owned(),
        Some(line) => {
            let shown = String::from_utf8_lossy(line.get(..SHOWN).unwrap_or(line));
            let more = if line.len() > SHOWN { " …" } else { "" };
            format!("`{}`{more}", shown.trim_end())
        }
    }
}

/// Makes what a run left the file that later runs are compared with.
fn blessed(run: &RunRecord, file: &str, golden: &Path) -> Result {
    let found = rowscan_files::read(&run.folder.join(file), MOST_BYTES)
        .map_err(|cause| format!("{file}: the run left no file that could be kept: {cause}"))?;
    run.check_written(file, &found)?;
    let written = OutputFile::create_anew(golden).and_then(|file| file.write_whole(&found));
    written.map_err(|cause| format!("cannot write {}: {cause}", golden.display()))?;
    Ok(Judged::holds(true, format!("{file} of seed {} is kept as {}", run.seed, golden.display())))
}

fn bytes_of(
    scenario: &Scenario,
    expect: &Expect,
    bless: bool,
    (run, without): (&RunRecord, Option<&RunRecord>),
) -> Result {
    let file = expect.file.as_deref().unwrap_or_default();
    let (path, other) = match (without, expect.equals_text.as_deref()) {
        (Some(without), _) => (without.folder.join(file), "the run without faults"),
        (None, Some(other)) if bless => return blessed(run, file, &scenario.folder().join(other)),
        (None, Some(other)) => (scenario.folder().join(other), other),
        (None, None) => return Err("`equals`: expected the name of a file".to_owned()),
    };
    let expected = rowscan_files::read(&path, MOST_BYTES)
        .map_err(|cause| format!("cannot read {}: {cause}", path.display()))?;
    let Ok(found) = rowscan_files::read(&run.folder.join(file), MOST_BYTES) else {
        return Ok(Judged::holds(false, format!("{file}: the run left no such file")));
    };
    if without.is_some() {
        run.check_written(file, &found)?;
    }
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
        match rowscan_files::read(&run.folder.join(file), MOST_BYTES) {
            Ok(content) => {
                run.check_written(file, &content)?;
                contents.push(content);
            }
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
    let wanted = wanted_code(expect);
    let code = run.children.get(id).and_then(|child| child.exit_code);
    let told = code.map_or("none".to_owned(), |code| code.to_string());
    let message = format!("exit code of {id}: expected {wanted}, found {told}");
    Ok(Judged::holds(code.is_some_and(|code| f64::from(code) == wanted), message))
}

#[cfg(test)]
pub(crate) mod tests;
