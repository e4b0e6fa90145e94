//! Faults at work in a run: what they do becomes events of the journal, and so does the first good scan after each.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use rowscan_faults::{FaultControl, FaultError, FaultEvent, FaultEvents, What};
use rowscan_protocol::time::SimTime;

use crate::fault::{ScenarioFault, Sweep};
use crate::journal::Journal;
use crate::run_end::RunEnd;

/// Faults of a sweep that wait for their scan at the same time.
const AHEAD: i64 = 4;

/// The faults of a run. Clones share it.
#[derive(Clone, Debug)]
pub(crate) struct FaultDesk {
    control: FaultControl,
    journal: Journal,
    work: Arc<Mutex<Work>>,
}

#[derive(Debug)]
struct Work {
    events: FaultEvents,
    /// Devices by name.
    devices: Vec<String>,
    /// Faults that have ended and no good scan has come since, by the stream they were on.
    ended: Vec<(String, Option<String>)>,
    sweeps: Vec<Sweeping>,
    /// How often each pause has begun.
    pauses: BTreeMap<String, u64>,
}

#[derive(Debug)]
struct Sweeping {
    sweep: Sweep,
    /// Values handed to the faults so far.
    added: i64,
    /// Values that have acted.
    done: i64,
    /// Values that are over: some may have changed nothing.
    tried: i64,
    /// Why the first of those changed nothing.
    idle: Option<String>,
    /// The fault of the last one that is over: one that loses several telegrams acts several times.
    last: Option<String>,
    phase: Phase,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    Waiting,
    Acting,
    Done,
}

impl FaultDesk {
    /// Plans the faults of a scenario on the streams that `control` knows.
    pub(crate) fn start(
        (control, events): (FaultControl, FaultEvents),
        faults: &[ScenarioFault],
        devices: Vec<String>,
        journal: Journal,
    ) -> Result<Self, FaultError> {
        let mut specs = Vec::new();
        let mut sweeps = Vec::new();
        for fault in faults {
            match fault {
                ScenarioFault::Rig(spec) => specs.push((**spec).clone()),
                ScenarioFault::Sweep(sweep) => {
                    let first = (0..AHEAD).filter_map(|number| sweep.step(number));
                    specs.extend(first);
                    sweeps.push(Sweeping {
                        sweep: sweep.clone(),
                        added: AHEAD,
                        done: 0,
                        tried: 0,
                        idle: None,
                        last: None,
                        phase: Phase::Waiting,
                    });
                }
                ScenarioFault::Pause(_) | ScenarioFault::NotHere(_) => {}
            }
        }
        control.add_all(specs)?;
        let work = Work { events, devices, ended: Vec::new(), sweeps, pauses: BTreeMap::new() };
        Ok(Self { control, journal, work: Arc::new(Mutex::new(work)) })
    }

    /// Notes what faults have done. Called before bytes are counted, so that events and counts have one order.
    pub(crate) fn note(&self) {
        let mut work = self.lock();
        while let Some(event) = work.events.take() {
            if !work.sweeps_on(&event, &self.control, &self.journal) {
                let at = time(&event);
                self.journal.note_at(name(&event), detail(&event), at);
                if matches!(event.what, What::End | What::Healed) {
                    let on = Some(event.on.clone()).filter(|on| work.devices.contains(on));
                    work.ended.push((event.id, on));
                }
            }
        }
    }

    /// Something other than the plan's faults begins.
    pub(crate) fn has_begun(&self, id: &str) {
        *self.lock().pauses.entry(id.to_owned()).or_default() += 1;
    }

    /// It has ended: the next good scan of any device follows it.
    pub(crate) fn has_ended(&self, id: &str) {
        self.lock().ended.push((id.to_owned(), None));
    }

    /// How often each fault acted, by id, on all streams together, as the list of faults tells it.
    pub(crate) fn acts(&self) -> BTreeMap<String, u64> {
        let mut acts = BTreeMap::new();
        for fault in self.control.list() {
            *acts.entry(fault.id).or_default() += fault.acts;
        }
        let work = self.lock();
        acts.extend(work.pauses.clone());
        let swept = work.sweeps.iter();
        acts.extend(swept.map(|sweeping| (sweeping.sweep.id.clone(), sweeping.done.unsigned_abs())));
        acts
    }

    /// `device` has delivered a good scan.
    pub(crate) fn good_scan(&self, device: &str, at: SimTime) {
        let mut work = self.lock();
        work.ended.retain(|(id, on)| {
            let follows = on.as_ref().is_none_or(|on| on == device);
            if follows {
                self.journal.note_at(format!("{id}.recovered"), format!("a scan of {device}"), at);
            }
            !follows
        });
    }

    /// Why the faults' script is not done, if a sweep is not.
    pub(crate) fn unfinished(&self, end: RunEnd<'_>) -> Option<String> {
        let work = self.lock();
        let sweeping = work.sweeps.iter().find(|sweeping| sweeping.phase != Phase::Done)?;
        let Sweep { id, key, .. } = &sweeping.sweep;
        let done = sweeping.done;
        Some(format!(
            "{} ({done} values of `{key}` so far)",
            end.before(&format!("the sweep `{id}` was through"))
        ))
    }

    /// Ends all faults; what they hold back goes at once.
    pub(crate) fn heal(&self) {
        self.control.reset();
        self.note();
    }

    /// Events that came too fast to be noted.
    pub(crate) fn events_lost(&self) -> u64 {
        self.control.events_lost()
    }

    fn lock(&self) -> MutexGuard<'_, Work> {
        self.work.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Work {
    /// True if the event is one of a sweep's: then the sweep goes on.
    fn sweeps_on(&mut self, event: &FaultEvent, control: &FaultControl, journal: &Journal) -> bool {
        let is_its = |sweeping: &&mut Sweeping| {
            let number = event.id.strip_prefix(sweeping.sweep.id.as_str());
            number.is_some_and(|number| number.starts_with('[') && number.ends_with(']'))
        };
        let Some(sweeping) = self.sweeps.iter_mut().find(is_its) else { return false };
        if sweeping.phase == Phase::Done {
            return true;
        }
        let id = sweeping.sweep.id.clone();
        match event.what {
            What::Begin if sweeping.phase == Phase::Waiting => {
                sweeping.phase = Phase::Acting;
                journal.note_at(id, detail(event), time(event));
                return true;
            }
            What::Act | What::Skipped if sweeping.last.as_ref() == Some(&event.id) => return true,
            // The telegram has no such byte: all were swept.
            What::Skipped if sweeping.sweep.to.is_none() => sweeping.phase = Phase::Done,
            What::Act | What::Skipped => {
                sweeping.tried += 1;
                sweeping.done += i64::from(event.what == What::Act);
                sweeping.last = Some(event.id.clone());
                sweeping.idle = sweeping.idle.take().or_else(|| event.reason.clone());
            }
            _ => return true,
        }
        // Whoever acts here was checked when the scenario was read; a later one differs in a number.
        if let Some(next) = sweeping.sweep.step(sweeping.added).filter(|_| sweeping.phase == Phase::Acting)
            && control.add_all(vec![next]).is_ok()
        {
            sweeping.added += 1;
        } else if sweeping.tried > sweeping.sweep.to.unwrap_or(i64::MAX).saturating_sub(sweeping.sweep.from) {
            sweeping.phase = Phase::Done;
        }
        if sweeping.phase == Phase::Done {
            let told = format!("{} values of {}", sweeping.done, sweeping.sweep.key);
            journal.note_at(format!("{id}.end"), told, time(event));
            if let Some(why) = sweeping.idle.take().filter(|_| sweeping.done == 0) {
                journal.note_at(format!("{id}.skipped"), why, time(event));
            }
            self.ended.push((id, Some(event.on.clone())));
        }
        true
    }
}

fn time(event: &FaultEvent) -> SimTime {
    SimTime((event.at_s * 1e9).round() as u64)
}

/// As expectations name it.
fn name(event: &FaultEvent) -> String {
    let id = &event.id;
    match event.what {
        What::Begin => id.clone(),
        What::Act => format!("{id}.act"),
        What::Skipped => format!("{id}.skipped"),
        What::End | What::Healed => format!("{id}.end"),
    }
}

fn detail(event: &FaultEvent) -> String {
    let facts: BTreeMap<&str, Option<String>> = [
        ("acts", event.acts.map(|acts| acts.to_string())),
        ("byte", event.offset.map(|offset| offset.to_string())),
        ("connection", event.connection.map(|connection| connection.to_string())),
        ("on", Some(event.on.clone())),
        ("scan", event.scan.map(|scan| scan.to_string())),
    ]
    .into();
    let facts = facts.into_iter().filter_map(|(key, value)| value.map(|value| format!("{key} {value}")));
    let reason = event.reason.clone();
    [event.name.to_owned()].into_iter().chain(facts).chain(reason).collect::<Vec<_>>().join(", ")
}
