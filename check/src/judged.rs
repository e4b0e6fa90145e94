//! An expectation that has been judged, and what a judge looks for in a run.

use std::time::Duration;

use rowscan_protocol::time::SimTime;

use rowscan_emulator::Sleep;

use crate::ending::Crash;
use crate::jitter::Jitter;
use crate::journal::{Event, row_place};
use crate::run_end::RunEnd;
use crate::runner::RunRecord;
use crate::verdict::Verdict;

/// An expectation that has been judged.
#[derive(Debug)]
pub(crate) struct Judged {
    pub(crate) verdict: Verdict,
    pub(crate) message: String,
    /// The moment that is told with it; the end of the run where absent.
    pub(crate) at: Option<SimTime>,
    /// When nothing could change it any more; the end of the run where absent.
    pub(crate) decided: Option<SimTime>,
    /// How much sooner or later it would have to be for another verdict.
    pub(crate) margin: Option<Duration>,
}

impl Judged {
    fn new(verdict: Verdict, message: impl Into<String>) -> Self {
        Self { verdict, message: message.into(), at: None, decided: None, margin: None }
    }

    pub(crate) fn error(message: impl Into<String>) -> Self {
        Self::new(Verdict::Error, message)
    }

    pub(crate) fn holds(holds: bool, message: impl Into<String>) -> Self {
        Self::new(if holds { Verdict::Passed } else { Verdict::Failed }, message)
    }

    /// Decided at `at`, by what happened then.
    pub(crate) fn at(self, at: SimTime) -> Self {
        Self { at: Some(at), decided: Some(at), ..self }
    }

    /// `at` is told with it.
    pub(crate) fn told_at(self, at: SimTime) -> Self {
        Self { at: Some(at), ..self }
    }

    /// Nothing could change it after `at`.
    pub(crate) fn decided_at(self, at: SimTime) -> Self {
        Self { decided: Some(at), ..self }
    }

    /// It was due at `due`, and was at `at`.
    pub(crate) fn due(self, due: SimTime, at: SimTime) -> Self {
        Self { margin: Some(Duration::from_nanos(due.0.abs_diff(at.0))), ..self }
    }

    /// Where the host wakes as late as that, nothing is said of what was due.
    pub(crate) fn beside_jitter(self, scale: Option<f64>, jitter: Option<Jitter>) -> Self {
        let (Some(margin), Some(jitter), Some(scale)) = (self.margin, jitter, scale) else { return self };
        let coarse = jitter.p99.mul_f64(scale);
        if margin >= coarse || self.verdict == Verdict::Error {
            return self;
        }
        let message = format!(
            "{}: off by {:.3} s, and this machine is late by up to {:.3} s of simulated time ({jitter} of its own): too coarse to judge; use a quieter machine, a slower `scale`, or lockstep",
            self.message,
            margin.as_secs_f64(),
            coarse.as_secs_f64(),
        );
        Self { verdict: Verdict::Error, message, ..self }
    }

    /// A child that slept while time was held for it came as late as it slept: nothing is said of what was due meanwhile, counted from `from`.
    pub(crate) fn beside_sleeps(self, from: SimTime, run: &RunRecord) -> Self {
        let until = self.decided.unwrap_or(run.ended);
        let slept = run.sleeps.iter().find(|sleep| (from..=until).contains(&sleep.at));
        match slept.filter(|_| self.verdict == Verdict::Passed && self.margin.is_some()) {
            Some(sleep) => {
                let message = format!("{}: {}", self.message, asleep(run, sleep));
                Self { verdict: Verdict::Error, message, ..self }
            }
            None => self,
        }
    }

    /// What a controller that had crashed left unanswered tells nothing of it.
    pub(crate) fn after_crash(self, crash: Option<Crash<'_>>) -> Self {
        match crash {
            Some(crash) if self.decided.is_none_or(|at| at >= crash.at) => {
                let message = format!("{crash}; until then: {}", self.message);
                Self { verdict: Verdict::Error, message, ..self }
            }
            _ => self,
        }
    }
}

/// A sleep in words.
pub(crate) fn asleep(run: &RunRecord, sleep: &Sleep) -> String {
    let children = run.children.iter().find(|(_, child)| child.process == Some(sleep.process));
    let who = children.map_or_else(|| format!("process {}", sleep.process), |(id, _)| format!("`{id}`"));
    format!(
        "{who} slept for {:.1} s of this machine's time at {:.3} s, with connections open, and time waited for it: the sleep took no simulated time; give it \
         `time = \"simulated\"`",
        sleep.took.as_secs_f64(),
        sleep.at.as_secs_f64()
    )
}

/// The one that is meant: the one named, or the only one.
pub(crate) fn the_one<'a>(
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

/// The part of a run that an expectation is of.
///
/// One rule: with `after`, it opens at that event and seconds count from there. Without, it opens at the start of time and seconds count from the
/// start of the drive, as those of `end` do: how long the host took to start children is nothing of theirs. What came before the drive is in time;
/// a state is looked at from `from` on.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Window<'a> {
    after: Option<&'a str>,
    /// What comes from here on counts.
    pub(crate) opens: SimTime,
    /// Its seconds count from here on.
    pub(crate) from: SimTime,
    /// When the run ended, and why.
    pub(crate) end: RunEnd<'a>,
}

impl<'a> Window<'a> {
    /// That of an expectation in `run`. A drive that never began would have begun at its end at the earliest.
    pub(crate) fn of(after: Option<&'a String>, run: &'a RunRecord) -> std::result::Result<Self, String> {
        let Some(after) = after else {
            let began = run.journal.as_ref().map(|journal| journal.began().unwrap_or(run.ended));
            return Ok(Self {
                after: None,
                opens: SimTime::ZERO,
                from: began.unwrap_or_default(),
                end: run.end(),
            });
        };
        let at = from_event(after, run)?;
        Ok(Self { after: Some(after), opens: at, from: at, end: run.end() })
    }

    /// So many seconds after its start.
    pub(crate) fn due(self, within_s: f64) -> SimTime {
        seconds_after(self.from, within_s)
    }

    /// How far `at` is from its start, in words.
    pub(crate) fn told(self, at: SimTime) -> String {
        let apart_s = at.as_secs_f64() - self.from.as_secs_f64();
        if at < self.from {
            format!("{:.3} s before the drive", -apart_s)
        } else {
            format!("after {apart_s:.3} s")
        }
    }

    /// What its seconds count from, in words.
    pub(crate) fn start(self) -> String {
        let from_s = self.from.as_secs_f64();
        match self.after {
            Some(event) => format!("`{event}` at {from_s:.3} s"),
            None => format!("the start of the drive at {from_s:.3} s"),
        }
    }
}

/// When the event was that an expectation counts from.
fn from_event(name: &str, run: &RunRecord) -> std::result::Result<SimTime, String> {
    if let Some(row_m) = row_place(name) {
        let passed = run.journal.as_ref().and_then(|journal| journal.passed(row_m, run.ended));
        return passed.ok_or_else(|| run.end().before(&format!("the tractor came to `{name}`")));
    }
    event_number(name, run).map(|number| run.events.get(number).map_or(SimTime::ZERO, Event::at))
}

/// The number of the first event of this name, from 0.
pub(crate) fn event_number(name: &str, run: &RunRecord) -> std::result::Result<usize, String> {
    match run.events.iter().position(|event| event.event == *name) {
        Some(number) => Ok(number),
        None => {
            let mut known: Vec<&str> = run.events.iter().map(|event| event.event.as_str()).collect();
            known.sort_unstable();
            known.dedup();
            Err(format!("there was no event `{name}`; there were {}", known.join(", ")))
        }
    }
}

/// Whether `at` is not late for `due`. C libraries and languages round a time-out up to their next microsecond: who waits 0.02 s comes in time within 0.02 s.
pub(crate) fn in_time(at: SimTime, due: SimTime) -> bool {
    const ROUNDING_NS: u64 = 1000;
    at.0 <= due.0.saturating_add(ROUNDING_NS)
}

pub(crate) fn seconds_after(from: SimTime, seconds: f64) -> SimTime {
    SimTime(from.0.saturating_add((seconds.max(0.0) * 1e9).round() as u64))
}
