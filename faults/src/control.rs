//! The handle to all faults: list, add, remove, reset.

use std::sync::Arc;
use std::time::Duration;

use rowscan_strict_toml::suggestion;
use serde::Serialize;
use tokio::sync::mpsc;

use crate::clock::Clock;
use crate::event::{FaultEvents, QUEUE, What};
use crate::fault::Layer;
use crate::handle::{Shared, StreamFaults};
use crate::instance::{Instance, Phase};
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
    /// Telegrams, pieces or connections acted on so far.
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
        StreamFaults { shared: Arc::clone(&self.shared), stream }
    }

    /// Adds a fault; its time begins to count now. Gives its id.
    ///
    /// # Errors
    /// It does not fit the plan; then nothing is added.
    pub fn add(&self, spec: FaultSpec) -> Result<String, FaultError> {
        let mut ids = self.add_all(vec![spec])?;
        Ok(ids.pop().unwrap_or_default())
    }

    /// Adds faults that may name each other.
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
            acts: instance.acts,
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

fn free_id(name: &str, taken: impl Fn(&str) -> bool) -> String {
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
    let mut made = Vec::new();
    let mut wires = Vec::new();
    for (number, stream) in plan.streams.iter().enumerate() {
        if spec.on.as_ref().is_some_and(|on| *on != stream.name) {
            continue;
        }
        let is_connection = matches!(spec.fault.layer, Layer::Connection | Layer::Accept);
        if stream.medium == Medium::Wire && is_connection && !spec.fault.on_wires {
            wires.push(stream.name.clone());
            continue;
        }
        let action = spec.action();
        let action =
            action.map_err(|error| FaultError::Parameters { id: id.clone(), message: error.message })?;
        made.push(Instance::new((id.clone(), Arc::clone(&spec), action), (number, &stream.name), seed, now));
    }
    if made.is_empty() && !wires.is_empty() {
        return Err(FaultError::Wire { id, name: spec.fault.name, streams: wires.join(", ") });
    }
    Ok(made)
}
