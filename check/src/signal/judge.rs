//! What a signal did, beside what it must do.

use rowscan_protocol::time::SimTime;

use super::course::Course;
use super::{Must, Sample, Source, series};
use crate::judged::{Judged, Window, in_time, seconds_after, the_one};
use crate::runner::RunRecord;
use crate::scenario::{Expect, Scenario};
use crate::verdict::Verdict;

type Result = std::result::Result<Judged, String>;

/// Judges what a signal did.
pub(crate) fn judge(number: usize, expect: &Expect, run: &RunRecord, without: Option<&RunRecord>) -> Result {
    let (Some(keys), Some(source)) = (&expect.signal, &expect.source) else {
        return Err("`signal` is missing".to_owned());
    };
    let name = &keys.words();
    let window = Window::of(expect.after.as_ref(), run)?;
    let samples = source.samples(number, run, rig_from(expect, window))?;
    let course = Course(&samples);
    if let Some(without) = without {
        let rig_from = rig_from(expect, Window::of(expect.after.as_ref(), without)?);
        return as_without(
            expect,
            (name, course, window),
            &source.samples(number, without, rig_from)?,
            without,
        );
    }
    let Must { change, be_silent, never, for_s, every_s } = keys.must;
    let words = words(expect, source);
    match (be_silent, every_s) {
        (true, _) => return silent(expect, (name, course, window), for_s),
        (_, Some(every_s)) => return regular((name, course, window), every_s, expect),
        _ => {}
    }
    if samples.is_empty() && (never || expect.within_s.is_none()) {
        return Err(format!("nobody sent {name} in this run: nothing is known of it"));
    }
    let judged = match (never, change) {
        (true, change) => never_so((name, course, window), expect, change, &words)?,
        (false, true) => return changes((name, course, window), expect),
        (false, false) if expect.bounds.is_empty() => return comes((name, course, window), expect),
        (false, false) => holds((name, course, window), expect, &words)?,
    };
    // What was wrong once has failed, whatever it was before.
    let is_of_all_time =
        expect.within_s.is_none() && judged.verdict == Verdict::Passed && source.is_a_state();
    match course.unknown_until(window.from).filter(|_| is_of_all_time) {
        None => Ok(judged),
        Some(first) => Err(format!(
            "{name} was heard first at {:.3} s, and nobody knows what it was from {:.3} s until then: expect it `within_s`, or `after` an event from which it is known",
            first.as_secs_f64(),
            window.from.as_secs_f64()
        )),
    }
}

/// From when on counts what the rig's machines say: of the drive, where that is what is judged. On a paced clock they speak before, of a tractor that stands.
fn rig_from(expect: &Expect, window: Window<'_>) -> SimTime {
    if expect.after.is_none() { window.from } else { SimTime::ZERO }
}

/// What its value must be, in words.
fn words(expect: &Expect, source: &Source) -> String {
    let named = expect.equals_text.as_ref().map(|name| format!("\"{name}\" ("));
    let close = if named.is_some() { ")" } else { "" };
    let unit = source.unit();
    let space = if unit.is_empty() { "" } else { " " };
    format!("{}{}{space}{unit}{close}", named.unwrap_or_default(), expect.bounds.words())
}

fn told(sample: Option<Sample>) -> String {
    match sample {
        Some(Sample { at, value: Some(value) }) => format!("{value} at {:.3} s", at.as_secs_f64()),
        Some(Sample { at, value: None }) => format!("\"not available\" at {:.3} s", at.as_secs_f64()),
        None => "nothing".to_owned(),
    }
}

type Heard<'a> = (&'a str, Course<'a>, Window<'a>);

/// The value must be so: within a time, for a time, or all the time.
fn holds((name, course, window): Heard<'_>, expect: &Expect, words: &str) -> Result {
    let (from, ended) = (window.from, window.end.at);
    let hold = |value| expect.bounds.hold(value);
    let long = expect.signal.as_ref().and_then(|keys| keys.must.for_s);
    let of_long = long.map_or(String::new(), |seconds| format!(" for {seconds} s"));
    let Some(within_s) = expect.within_s else {
        // From the start on.
        let due = long.map_or(ended, |seconds| seconds_after(from, seconds));
        let wrong = course
            .before(from)
            .map(|held| Sample { at: from, ..held })
            .into_iter()
            .chain(course.within(from, due).iter().copied());
        let wrong = wrong.clone().find(|sample| !sample.value.is_some_and(hold));
        return Ok(match wrong {
            None if due > ended => return Err(past_end(name, due, window)),
            None if course.before(from).is_none() && course.within(from, due).is_empty() => {
                return Err(format!("{name} was not heard in that time: nothing is known of it"));
            }
            None => Judged::holds(true, format!("{name} is {words}{of_long}")).decided_at(due),
            Some(sample) => Judged::holds(
                false,
                format!("expected {name} {words}{of_long}, found {}", told(Some(sample))),
            )
            .at(sample.at),
        });
    };
    let due = seconds_after(from, within_s);
    let stretches = course.stretches(from, ended, hold);
    let long_enough = |(begin, end): &&(SimTime, SimTime)| {
        long.is_none_or(|seconds| *end >= seconds_after(*begin, seconds))
    };
    let found = stretches.iter().find(long_enough);
    let after = |at: SimTime| at.as_secs_f64() - from.as_secs_f64();
    Ok(match found {
        Some((begin, _)) if in_time(*begin, due) => {
            Judged::holds(true, format!("{name} is {words}{of_long} after {:.3} s", after(*begin)))
                .at(*begin)
                .due(due, *begin)
        }
        Some((begin, _)) => Judged::holds(
            false,
            format!(
                "expected {name} {words}{of_long} within {within_s} s, found it so only after {:.3} s",
                after(*begin)
            ),
        )
        .at(due)
        .due(due, *begin),
        None if ended < due => return Err(past_end(name, due, window)),
        None => {
            // It holds still, and nobody knows for how long it would have.
            let is_open = |(begin, end): &&(SimTime, SimTime)| *end == ended && in_time(*begin, due);
            if let Some((begin, _)) = stretches.last().filter(is_open) {
                return Err(past_end(name, seconds_after(*begin, long.unwrap_or_default()), window));
            }
            let last = course.0.last().copied();
            let lengths = stretches.iter().map(|(begin, end)| end.0 - begin.0);
            let found = match lengths.max() {
                None => "never so to the end of the run".to_owned(),
                Some(longest) => format!("so for {:.3} s at the longest", longest as f64 / 1e9),
            };
            Judged::holds(
                false,
                format!(
                    "expected {name} {words}{of_long} within {within_s} s, found it {found}; its last value is {}",
                    last.map_or("unknown, for it was never heard".to_owned(), |last| told(Some(last)))
                ),
            )
            .at(due)
        }
    })
}

/// A message must come.
fn comes((name, course, window): Heard<'_>, expect: &Expect) -> Result {
    let within_s = expect.within_s.unwrap_or_default();
    let due = window.due(within_s);
    let next = course.within(window.opens, window.end.at).first();
    Ok(match next {
        Some(sample) if in_time(sample.at, due) => {
            Judged::holds(true, format!("{name} is heard {}", window.told(sample.at)))
                .at(sample.at)
                .due(due, sample.at)
        }
        Some(sample) => Judged::holds(
            false,
            format!("expected {name} within {within_s} s, heard only {}", window.told(sample.at)),
        )
        .at(due)
        .due(due, sample.at),
        None if window.end.at < due => return Err(past_end(name, due, window)),
        None => Judged::holds(false, format!("expected {name} within {within_s} s, heard nothing")).at(due),
    })
}

/// The value must become another one.
fn changes((name, course, window): Heard<'_>, expect: &Expect) -> Result {
    let (from, ended) = (window.from, window.end.at);
    let due = expect.within_s.map_or(ended, |seconds| seconds_after(from, seconds));
    let all = course.within(from, ended);
    let base = course.before(from).or(all.first().copied());
    let first = all.iter().find(|sample| base.is_some_and(|base| base.value != sample.value)).copied();
    Ok(match first {
        Some(sample) if in_time(sample.at, due) => {
            Judged::holds(true, format!("{name} changes: from {} to {}", told(base), told(Some(sample))))
                .at(sample.at)
                .due(due, sample.at)
        }
        Some(sample) => Judged::holds(
            false,
            format!(
                "expected {name} to change by {:.3} s, found {} only",
                due.as_secs_f64(),
                told(Some(sample))
            ),
        )
        .at(due)
        .due(due, sample.at),
        None if ended < due => return Err(past_end(name, due, window)),
        None => Judged::holds(false, format!("expected {name} to change, found {} to the end", told(base)))
            .at(due),
    })
}

/// The value must never be so, or never change. What it is while it is not available nobody knows.
fn never_so((name, course, window): Heard<'_>, expect: &Expect, change: bool, words: &str) -> Result {
    let (from, ended) = (window.from, window.end.at);
    let all = course.within(from, ended);
    let base = course.before(from);
    let held = || base.map(|sample| Sample { at: from, ..sample }).into_iter().chain(all.iter().copied());
    let found = if change {
        let base = base.or(all.first().copied());
        all.iter().find(|sample| base.is_some_and(|base| base.value != sample.value)).copied()
    } else {
        held().find(|sample| sample.value.is_some_and(|value| expect.bounds.hold(value)))
    };
    let what = if change { "change".to_owned() } else { format!("be {words}") };
    let unknown = held().find(|sample| sample.value.is_none());
    Ok(match (found, unknown) {
        (None, Some(unknown)) => {
            return Err(format!(
                "{name} is not available at {:.3} s, and whether it is {} then nobody knows: expect it over a time in which it is, or `equals` for what it must be",
                unknown.at.as_secs_f64(),
                if change { "another" } else { words }
            ));
        }
        (Some(sample), _) => {
            Judged::holds(false, format!("expected {name} never to {what}, found {}", told(Some(sample))))
                .at(sample.at)
        }
        (None, None) if change => Judged::holds(true, format!("{name} never changes")),
        (None, None) => Judged::holds(true, format!("{name} is never {words}")),
    })
}

/// Nothing may be heard: from a moment after the start of the window on, for a time or to the end.
fn silent(expect: &Expect, (name, course, window): Heard<'_>, for_s: Option<f64>) -> Result {
    if course.0.is_empty() {
        return Err(format!("nobody sent {name} in this run: its silence tells nothing"));
    }
    let from = seconds_after(window.from, expect.within_s.unwrap_or_default());
    let due = for_s.map_or(window.end.at, |seconds| seconds_after(from, seconds));
    let heard = course.within(SimTime(from.0 + 1), due).first().copied();
    Ok(match heard {
        Some(sample) => {
            Judged::holds(false, format!("expected {name} to be silent, heard {}", told(Some(sample))))
                .at(sample.at)
                .due(from, sample.at)
        }
        None if due > window.end.at || from >= window.end.at => {
            return Err(past_end(name, due.max(from), window));
        }
        None => Judged::holds(
            true,
            format!("{name} is silent from {:.3} s to {:.3} s", from.as_secs_f64(), due.as_secs_f64()),
        )
        .decided_at(due),
    })
}

/// Messages must come one after the other at a steady pace.
fn regular((name, course, window): Heard<'_>, every_s: f64, expect: &Expect) -> Result {
    let from = seconds_after(window.from, expect.within_s.unwrap_or_default());
    let due = expect
        .signal
        .as_ref()
        .and_then(|keys| keys.must.for_s)
        .map_or(window.end.at, |seconds| seconds_after(from, seconds));
    if due > window.end.at || from >= due {
        return Err(past_end(name, due.max(from), window));
    }
    let slack_s = expect.bounds.tolerance;
    // A tenth of 0.3 is 0.03, and not 0.030000000000000002.
    let slack = if slack_s > 0.0 { slack_s } else { (0.1 * every_s * 1e9).round() / 1e9 };
    let wanted = format!("each {every_s} s ± {slack} s");
    let all = course.within(from, due);
    let window_s = (due.0 - from.0) as f64 / 1e9;
    if window_s <= every_s + slack {
        return Err(format!(
            "{name} was looked at for {window_s:.3} s, less than a period and its slack: nothing is known of its pace; a longer `for_s`, or a later `end`"
        ));
    }
    let seconds = |from: SimTime, to: SimTime| (to.0 as f64 - from.0 as f64) / 1e9;
    // A nanosecond is lost in decimal places.
    let is_late = |gap_s: f64| gap_s > every_s + slack + 1e-9;
    let mut worst = (0.0_f64, from);
    let mut last = from;
    for (number, sample) in all.iter().enumerate() {
        let gap_s = seconds(last, sample.at);
        let off_s = if number == 0 { (gap_s - every_s).max(0.0) } else { (gap_s - every_s).abs() };
        if off_s > worst.0 {
            worst = (off_s, sample.at);
        }
        if is_late(gap_s) || (number > 0 && gap_s < every_s - slack - 1e-9) {
            let found = format!(
                "expected {name} {wanted}, found {gap_s:.4} s between {:.4} s and {:.4} s",
                last.as_secs_f64(),
                sample.at.as_secs_f64()
            );
            let edge = seconds_after(last, if gap_s > every_s { every_s + slack } else { every_s - slack });
            return Ok(Judged::holds(false, found).at(sample.at).due(edge, sample.at));
        }
        last = sample.at;
    }
    if is_late(seconds(last, due)) {
        let found = format!(
            "expected {name} {wanted}, found nothing from {:.3} s to {:.3} s",
            last.as_secs_f64(),
            due.as_secs_f64()
        );
        return Ok(Judged::holds(false, found).at(seconds_after(last, every_s + slack)));
    }
    let margin = SimTime(((slack - worst.0).max(0.0) * 1e9) as u64);
    let message = format!(
        "{name} comes {wanted}: {} times, off by {:.4} s at most, at {:.3} s",
        all.len(),
        worst.0,
        worst.1.as_secs_f64()
    );
    Ok(Judged::holds(true, message).decided_at(due).due(margin, SimTime::ZERO))
}

/// The same values one after the other as in a run without faults, each at most `within_s` sooner or later where that is given.
fn as_without(
    expect: &Expect,
    (name, course, window): Heard<'_>,
    other: &[Sample],
    without: &RunRecord,
) -> Result {
    let from = Window::of(expect.after.as_ref(), without).map_or(window.from, |window| window.from);
    let pick = |course: Course<'_>, from: SimTime, ended: SimTime| Course(course.within(from, ended)).steps();
    let (found, wanted) =
        (pick(course, window.from, window.end.at), pick(Course(other), from, without.ended));
    if found.is_empty() || wanted.is_empty() {
        return Err(format!("{name} was not heard in both runs: there is nothing to compare"));
    }
    let near = |a: &Sample, b: &Sample| match (a.value, b.value) {
        (Some(a), Some(b)) => (a - b).abs() <= expect.bounds.tolerance,
        (a, b) => a == b,
    };
    let together = |a: &Sample, b: &Sample| {
        expect.within_s.is_none_or(|seconds| {
            let relative = |sample: &Sample, from: SimTime| sample.at.0 as f64 - from.0 as f64;
            (relative(a, window.from) - relative(b, from)).abs() <= seconds * 1e9 + 1.0
        })
    };
    let count = found.len().max(wanted.len());
    let differs = (0..count).find(|place| match (found.get(*place), wanted.get(*place)) {
        (Some(a), Some(b)) => !near(a, b) || !together(a, b),
        _ => true,
    });
    Ok(match differs {
        None => Judged::holds(true, format!("{name} goes as without faults, through {count} values")),
        Some(place) => {
            let at = found.get(place).map_or(window.end.at, |sample| sample.at);
            let message = format!(
                "expected {name} as without faults, found as number {}, counted from 1, {} in place of {}",
                place + 1,
                told(found.get(place).copied()),
                told(wanted.get(place).copied())
            );
            Judged::holds(false, message).at(at)
        }
    })
}

fn past_end(name: &str, due: SimTime, window: Window<'_>) -> String {
    window.end.before(&format!("{name} was due at {:.3} s", due.as_secs_f64()))
}

/// Judges the largest share of a bus that was taken in any second.
pub(crate) fn bus_load(scenario: &Scenario, expect: &Expect, run: &RunRecord) -> Result {
    let bus = the_one("bus", expect.on.as_ref(), scenario.buses.iter().map(|bus| &bus.id))?;
    let (load, at) = series::load(series::carried(bus, run)?)
        .ok_or_else(|| format!("nothing was heard on {bus}: its load is unknown"))?;
    let message = format!(
        "load of {bus}: expected {}, found {load:.4} in the second until {:.3} s",
        expect.bounds.words(),
        at.as_secs_f64()
    );
    Ok(Judged::holds(expect.bounds.hold(load), message).told_at(at))
}
