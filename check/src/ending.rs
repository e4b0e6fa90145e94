//! How children ended, beside how they were expected to.
//!
//! One rule: a child has crashed if it ended before the run with a code other than 0, unless that very code is the one that an `exit_code` of this
//! child expects, or the run drives on without it: then its end is what is tried. What was open by a crash is not judged.

use std::fmt;

use rowscan_protocol::time::SimTime;

use crate::journal::{END, Event};
use crate::runner::RunRecord;
use crate::scenario::{Expect, OnExit, RunSpec, Scenario};
use crate::what::Kind;

/// A child that ended before the run with an error that nobody expects.
#[derive(Clone, Copy)]
pub(crate) struct Crash<'a> {
    pub(crate) child: &'a str,
    pub(crate) code: i32,
    pub(crate) at: SimTime,
    /// The last line of its output; empty where it said nothing.
    last: &'a str,
}

impl fmt::Display for Crash<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { child, code, at, last } = self;
        write!(f, "`{child}` had crashed at {:.3} s, with code {code}", at.as_secs_f64())?;
        if last.is_empty() { Ok(()) } else { write!(f, " (it last said: {last})") }
    }
}

/// The first crash of a run.
pub(crate) fn crash<'a>(scenario: &'a Scenario, run: &'a RunRecord) -> Option<Crash<'a>> {
    let may_crash = scenario.runs.iter().filter(|spec| spec.on_exit == OnExit::End);
    may_crash.filter_map(|spec| crashed(scenario, run, spec)).min_by_key(|crash| crash.at)
}

/// How a child ended, if that was an error that nobody expects.
fn crashed<'a>(scenario: &'a Scenario, run: &'a RunRecord, spec: &'a RunSpec) -> Option<Crash<'a>> {
    let exit = exit_before_end(run, &spec.id)?;
    let child = run.children.get(&spec.id)?;
    let code = child.exit_code.filter(|code| *code != 0)?;
    let is_expected = expected_codes(scenario, &spec.id).any(|wanted| wanted == f64::from(code));
    (!is_expected).then(|| Crash { child: &spec.id, code, at: exit.at(), last: last_line(&child.tail) })
}

/// The children that ended with an error, and without which their runs drove on, in words.
pub(crate) fn driven_on<'a>(
    scenario: &'a Scenario,
    run: &'a RunRecord,
) -> impl Iterator<Item = String> + use<'a> {
    let drives_on = scenario.runs.iter().filter(|spec| spec.on_exit == OnExit::DriveOn);
    drives_on.filter_map(|spec| {
        let crash = crashed(scenario, run, spec)?;
        Some(format!("{crash}; the run drove on without it (`on_exit`), and is judged"))
    })
}

/// The last line that says something, as far as a message shows it.
fn last_line(text: &str) -> &str {
    const SHOWN: usize = 160;
    let line = text.lines().rev().map(str::trim).find(|line| !line.is_empty()).unwrap_or_default();
    line.char_indices().nth(SHOWN).map_or(line, |(end, _)| line.get(..end).unwrap_or(line))
}

/// When a child ended, if it did before the run.
pub(crate) fn exit_before_end<'a>(run: &'a RunRecord, child: &str) -> Option<&'a Event> {
    let name = format!("{child}.exited");
    run.events.iter().take_while(|event| event.event != END).find(|event| event.event == name)
}

/// True if an expectation says how `child` ends: that it ends by itself is then no surprise, whatever its code.
pub(crate) fn expects_exit(scenario: &Scenario, child: &str) -> bool {
    expected_codes(scenario, child).next().is_some()
}

/// The code that an `exit_code` wants.
pub(crate) fn wanted_code(expect: &Expect) -> f64 {
    expect.bounds.equals.unwrap_or(0.0)
}

/// The codes that expectations of `child` want. One that names no child is of the only one.
fn expected_codes<'a>(scenario: &'a Scenario, child: &'a str) -> impl Iterator<Item = f64> + 'a {
    let is_alone = scenario.runs.len() == 1;
    let is_its = move |expect: &&Expect| match expect.on.as_deref() {
        Some(on) => on == child,
        None => is_alone,
    };
    let of_exits = scenario.expects.iter().filter(|expect| expect.what.kind == Kind::ExitCode);
    of_exits.filter(is_its).map(wanted_code)
}
