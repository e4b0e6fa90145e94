//! The handle to all faults: list, add, remove, reset.

use std::sync::Arc;
use std::time::Duration;

use rowscan_settings::suggestion;
use serde::Serialize;
use tokio::sync::mpsc;

use crate::clock::Clock;
use crate::event::{FaultEvents, QUEUE, What};
use crate::fault::{Action, Layer};
use crate::handle::{Shared, StreamFaults};
use crate::instance::{Instance, Phase};
use crate::part::{Fit, Part};
use crate::plan::{Medium, Plan, Row};
use crate::spec::FaultSpec;
use crate::telegram::Language;
use crate::when::At;

/// All faults of one process. Clones share them. Every call returns at once: the lock is held for no I/O and across no await.
#[derive(Clone, Debug)]
pub struct FaultControl {
    pub(crate) shared: Arc<Shared>,
}

/// Why a fault cannot be part of the plan.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum FaultError {
    /// Two faults of one id.
    #[error("there are two faults `{0}`; give one of them another `id`")]
    SameId(String),
    /// A stream that is not there.
    #[error("fault `{id}`: there is no stream `{found}`{}", suggestion(.found, &.streams.iter().map(String::as_str).collect::<Vec<_>>()))]
    NoStream {
        /// The fault.
        id: String,
        /// What `on` says.
        found: String,
        /// The streams there are.
        streams: Vec<String>,
    },
    /// `after` names a fault that is not there.
    #[error("fault `{id}`: `after` names `{found}`, and there is no such fault")]
    NoFault {
        /// The fault.
        id: String,
        /// What `after` says.
        found: String,
    },
    /// `row_m` or `tree`, and nothing here drives along a row.
    #[error("fault `{0}`: `row_m` and `tree` need a row, and there is none here; use `s`, `scan` or `after`")]
    NoRow(String),
    /// A fault of connections on serial wires only.
    #[error(
        "fault `{id}`: `{name}` is a fault of TCP connections, and {streams} is a serial wire; leave it out"
    )]
    Wire {
        /// The fault.
        id: String,
        /// Its name in the table.
        name: &'static str,
        /// The streams it would act on.
        streams: String,
    },
    /// Nothing here is what it acts on.
    #[error(
        "fault `{id}`: `{name}` is a fault of the {family}, and {}", match .parts.as_slice() {
            [] if *.family == "sprayer" => "nothing here has one: use it in a scenario of `rowscan check` that has `sprayer = { … }`".to_owned(),
            [] => "nothing here has one: a recording and a real device's byte path have no such part; use it with `rowscan emulate` or `rowscan check`".to_owned(),
            parts => format!("`on` must be one of {}", parts.join(", ")),
        }
    )]
    NoPart {
        /// The fault.
        id: String,
        /// Its name in the table.
        name: &'static str,
        /// What it acts on.
        family: &'static str,
        /// What would take it.
        parts: Vec<String>,
    },
    /// What it acts on cannot do so.
    #[error("fault `{id}`: {why}")]
    Refused {
        /// The fault.
        id: String,
        /// The reason, with what to do.
        why: String,
    },
    /// Scans or commands, and nothing passes there.
    #[error(
        "fault `{0}`: scans and commands pass on a scanner's stream, and this acts elsewhere; use `s`, `row_m`, `tree` or `after`"
    )]
    NoScans(String),
    /// Parameters that fit no fault.
    #[error("fault `{id}`: {message}")]
    Parameters {
        /// The fault.
        id: String,
        /// What is wrong.
        message: String,
    },
    /// Nothing to remove.
    #[error("there is no fault `{found}`{}", suggestion(.found, &.known.iter().map(String::as_str).collect::<Vec<_>>()))]
    Unknown {
        /// What was named.
        found: String,
        /// The faults there are.
        known: Vec<String>,
    },
}

/// A fault of the plan on one stream, and how far it is.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FaultStatus {
    /// Its id.
    pub id: String,
    /// Its name in the table.
    pub name: &'static str,
    /// The stream.
    pub on: String,
    /// `waiting`, `active` or `done`.
    pub state: &'static str,
    /// Telegrams or connections acted on so far; of a fault that acts on no single one, how often it has begun.
    pub acts: u64,
}

impl FaultControl {
    /// A plan without faults and streams, and what will be told of it. `row` is needed for `row_m` and `tree`.
    pub fn new(seed: u64, clock: Arc<dyn Clock>, row: Option<Arc<dyn Row>>) -> (Self, FaultEvents) {
        let (sender, receiver) = mpsc::channel(QUEUE);
        let shared = Shared::new(seed, clock, Plan::new(row, sender));
        (Self { shared }, FaultEvents(receiver))
    }

    /// The stream called `name`, made if it is not there. Faults know streams that were there when they were added.
    pub fn stream(&self, name: &str, medium: Medium, language: Language) -> StreamFaults {
        let stream = self.shared.plan().stream(name, medium, language);
        StreamFaults::new(Arc::clone(&self.shared), stream)
    }

    /// Names a part that faults act on, beside or without bytes of its own. Faults know parts that were there when they were added.
    pub fn part(&self, name: &str, part: Arc<dyn Part>) {
        let mut plan = self.shared.plan();
        let stream = plan.stream(name, Medium::Part, Language::Cola);
        if let Some(stream) = plan.streams.get_mut(stream) {
            stream.part = Some(part);
        }
    }

    /// When a fault is due next, as far as time tells; the row is looked at meanwhile.
    pub fn next_due(&self) -> Option<Duration> {
        let now = self.shared.clock.now();
        self.shared.plan().next_due(now)
    }

    /// Begins and ends what is due by `at`, whose time has come.
    pub fn advance_to(&self, at: Duration) {
        self.shared.plan().advance(at);
        self.shared.spread();
    }

    /// Adds a fault to what runs: its times count from now. Gives its id.
    ///
    /// # Errors
    /// It does not fit the plan; then nothing is added.
    pub fn add(&self, spec: FaultSpec) -> Result<String, FaultError> {
        let mut ids = self.add_from_now(vec![spec])?;
        Ok(ids.pop().unwrap_or_default())
    }

    /// Adds faults to what runs, which may name each other: their times count from now.
    ///
    /// # Errors
    /// As [`add_all`](Self::add_all).
    pub fn add_from_now(&self, specs: Vec<FaultSpec>) -> Result<Vec<String>, FaultError> {
        let now = self.shared.clock.now();
        self.add_all(specs.into_iter().map(|spec| spec.later_by(now)).collect())
    }

    /// Adds faults that may name each other. Their times are those of the faults' clock; none begins before now.
    ///
    /// # Errors
    /// One of them does not fit the plan; then none is added.
    pub fn add_all(&self, specs: Vec<FaultSpec>) -> Result<Vec<String>, FaultError> {
        let now = self.shared.clock.now();
        let mut plan = self.shared.plan();
        let known = |id: &str, plan: &Plan| plan.instances.iter().any(|instance| instance.id == id);
        let mut named: Vec<(String, FaultSpec)> = Vec::new();
        for spec in specs {
            let taken = |id: &str| known(id, &plan) || named.iter().any(|(other, _)| other == id);
            let id = match &spec.id {
                Some(id) if taken(id) => return Err(FaultError::SameId(id.clone())),
                Some(id) => id.clone(),
                None => free_id(spec.fault.name, taken),
            };
            named.push((id, spec));
        }
        let ids: Vec<String> = named.iter().map(|(id, _)| id.clone()).collect();
        let mut instances = Vec::new();
        for (id, spec) in named {
            let exists = |other: &str| known(other, &plan) || ids.iter().any(|id| id == other);
            instances.extend(make(&plan, (id, spec), exists, (self.shared.seed, now))?);
        }
        plan.instances.extend(instances);
        plan.advance(now);
        plan.wake_all();
        drop(plan);
        self.shared.spread();
        Ok(ids)
    }

    /// Ends a fault and forgets it; what it holds back goes at once.
    ///
    /// # Errors
    /// There is none of this id.
    pub fn remove(&self, id: &str) -> Result<(), FaultError> {
        let known = self.heal(|instance| instance.id == id);
        if known.iter().any(|known| known == id) {
            return Ok(());
        }
        Err(FaultError::Unknown { found: id.to_owned(), known })
    }

    /// Ends and forgets all faults; what they hold back goes at once. Connections that were cut stay cut.
    pub fn reset(&self) {
        self.heal(|_| true);
    }

    /// Ends what `which` says; the ids there were.
    fn heal(&self, which: impl Fn(&Instance) -> bool) -> Vec<String> {
        let now = self.shared.clock.now();
        let mut plan = self.shared.plan();
        plan.advance(now);
        let mut known: Vec<String> = plan.instances.iter().map(|instance| instance.id.clone()).collect();
        known.dedup();
        for number in 0..plan.instances.len() {
            if plan.instances.get(number).is_some_and(&which) {
                plan.end(number, now, What::Healed);
            }
        }
        let before = plan.instances.len();
        plan.instances.retain(|instance| !which(instance));
        if plan.instances.len() < before {
            plan.flushes += 1;
            plan.cut_trails(now, |_, _| true);
        }
        plan.wake_all();
        drop(plan);
        self.shared.spread();
        known
    }

    /// The names of all streams.
    pub fn streams(&self) -> Vec<String> {
        self.shared.plan().streams.iter().map(|stream| stream.name.clone()).collect()
    }

    /// Every fault on every stream.
    pub fn list(&self) -> Vec<FaultStatus> {
        let mut plan = self.shared.plan();
        plan.advance(self.shared.clock.now());
        let status = |instance: &Instance| FaultStatus {
            id: instance.id.clone(),
            name: instance.spec.fault.name,
            on: plan.streams.get(instance.stream).map(|stream| stream.name.clone()).unwrap_or_default(),
            state: match instance.phase {
                Phase::Waiting => "waiting",
                Phase::Active(_) => "active",
                Phase::Done => "done",
            },
            acts: instance.acted_on(),
        };
        plan.instances.iter().map(status).collect()
    }

    /// Events that nobody took in time.
    pub fn events_lost(&self) -> u64 {
        self.shared.plan().events_lost
    }

    /// Begins and ends faults on time, also while nothing passes. Runs until it is dropped.
    pub async fn drive(&self) {
        let mut changed = self.shared.changed.subscribe();
        loop {
            changed.borrow_and_update();
            let next = self.shared.advance();
            let wait = async {
                match next {
                    Some(at) => Arc::clone(&self.shared.clock).wait_until(at).await,
                    None => std::future::pending().await,
                }
            };
            tokio::select! {
                () = wait => {}
                // The sender is part of this.
                _ = changed.changed() => {}
            }
        }
    }
}

impl StreamFaults {
    /// The control of all faults, this stream's among them.
    pub fn control(&self) -> FaultControl {
        FaultControl { shared: Arc::clone(&self.shared) }
    }
}

/// What a fault without an id is called: its name, numbered where that is taken.
pub fn free_id(name: &str, taken: impl Fn(&str) -> bool) -> String {
    let numbered = (2_u32..).map(|number| format!("{name}-{number}"));
    std::iter::once(name.to_owned()).chain(numbered).find(|id| !taken(id)).unwrap_or_default()
}

/// A fault on each of its streams.
fn make(
    plan: &Plan,
    (id, spec): (String, FaultSpec),
    exists: impl Fn(&str) -> bool,
    (seed, now): (u64, Duration),
) -> Result<Vec<Instance>, FaultError> {
    if spec.needs_row() && !plan.has_row() {
        return Err(FaultError::NoRow(id));
    }
    for at in [Some(&spec.at), spec.until.as_ref()].into_iter().flatten() {
        if let At::After { id: other, .. } = at
            && !exists(other)
        {
            return Err(FaultError::NoFault { id, found: other.clone() });
        }
    }
    let names = || plan.streams.iter().map(|stream| stream.name.clone());
    if let Some(on) = &spec.on
        && !names().any(|name| name == *on)
    {
        return Err(FaultError::NoStream { id, found: on.clone(), streams: names().collect() });
    }
    let spec = Arc::new(spec);
    let made = match spec.action() {
        Ok(Action::Part(_)) => on_parts(plan, &id, &spec),
        _ => on_streams(plan, &id, &spec),
    }?;
    let mut instances = Vec::new();
    for (number, name) in made {
        let action = spec.action();
        let action =
            action.map_err(|error| FaultError::Parameters { id: id.clone(), message: error.message })?;
        instances.push(Instance::new((id.clone(), Arc::clone(&spec), action), (number, name), seed, now));
    }
    Ok(instances)
}

/// The streams that a fault of the byte path acts on.
fn on_streams<'a>(plan: &'a Plan, id: &str, spec: &FaultSpec) -> Result<Vec<(usize, &'a str)>, FaultError> {
    let (mut made, mut wires, mut others) = (Vec::new(), Vec::new(), Vec::new());
    for (number, stream) in plan.streams.iter().enumerate() {
        let asked = spec.on.as_ref().is_none_or(|on| *on == stream.name);
        let is_connection = matches!(spec.fault.layer, Layer::Connection | Layer::Accept);
        match stream.medium {
            Medium::Part => {}
            _ if !asked => others.push(stream.name.clone()),
            Medium::Wire if is_connection && !spec.fault.on_wires => wires.push(stream.name.clone()),
            Medium::Wire | Medium::Tcp => made.push((number, stream.name.as_str())),
        }
    }
    let (id, name) = (id.to_owned(), spec.fault.name);
    match (made.is_empty(), wires.is_empty(), &spec.on) {
        (true, false, _) => Err(FaultError::Wire { id, name, streams: wires.join(", ") }),
        (true, true, Some(_)) => Err(FaultError::NoPart { id, name, family: "byte path", parts: others }),
        _ => Ok(made),
    }
}

/// The parts that a fault of theirs acts on.
fn on_parts<'a>(plan: &'a Plan, id: &str, spec: &FaultSpec) -> Result<Vec<(usize, &'a str)>, FaultError> {
    let refuse = |error: rowscan_settings::TomlError| FaultError::Parameters {
        id: id.to_owned(),
        message: error.message,
    };
    let Action::Part(fault) = spec.action().map_err(refuse)? else { return Ok(Vec::new()) };
    let (mut made, mut reasons, mut others) = (Vec::new(), Vec::new(), Vec::new());
    for (number, stream) in plan.streams.iter().enumerate() {
        let Some(part) = &stream.part else { continue };
        let asked = spec.on.as_ref().is_none_or(|on| *on == stream.name);
        match part.fits(&fault) {
            Fit::Acts if asked => made.push((number, stream.name.as_str())),
            Fit::Refuses(why) if asked => reasons.push(format!("{}: {why}", stream.name)),
            Fit::Acts => others.push(stream.name.clone()),
            Fit::Foreign | Fit::Refuses(_) => {}
        }
    }
    let (id, name) = (id.to_owned(), spec.fault.name);
    let has_scanned =
        |(number, _): &(usize, &str)| plan.streams.get(*number).is_some_and(|stream| stream.scans > 0);
    if fault.is_foreseen() && made.iter().any(has_scanned) {
        let why = format!(
            "`{name}` sets where the scanner's clock starts, and this one has sent scans: give it before the first one, in `--faults FILE` or in a scenario"
        );
        return Err(FaultError::Refused { id, why });
    }
    let has_streams = made
        .iter()
        .all(|(number, _)| plan.streams.get(*number).is_some_and(|stream| stream.medium != Medium::Part));
    match (made.is_empty(), reasons.is_empty()) {
        (true, false) => Err(FaultError::Refused { id, why: reasons.join("; ") }),
        (true, true) => Err(FaultError::NoPart { id, name, family: spec.fault.layer.name(), parts: others }),
        (false, _) if spec.needs_stream() && !has_streams => Err(FaultError::NoScans(id)),
        (false, _) => Ok(made),
    }
}
