//! All faults of all streams, and where each is in its script. Sans I/O: time is handed in, events go to a queue.

mod connections;
mod passing;

use std::collections::BTreeMap;
use std::fmt;
use std::sync::Arc;
use std::task::Waker;
use std::time::Duration;

use tokio::sync::mpsc;

use crate::event::{Direction, FaultEvent, What};
use crate::fault::Action;
use crate::instance::{Due, Happened, Instance, Phase, Place};
use crate::part::{Order, Part};
use crate::telegram::Language;
use crate::when::At;

/// What a stream runs over.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Medium {
    /// Connections that come and go.
    Tcp,
    /// A serial wire: nobody connects, nothing is closed.
    Wire,
    /// No bytes: a part of what is emulated that faults of its own act on.
    Part,
}

/// Where the tractor is.
pub trait Row: Send + Sync + fmt::Debug {
    /// Metres along the row at this time on the faults' clock; none before it starts.
    fn row_m(&self, at: Duration) -> Option<f64>;

    /// How long it will have driven when it comes to this metre, if that can be told.
    fn drives_to_row_m(&self, _row_m: f64) -> Option<Duration> {
        None
    }

    /// The same for a tree's trunk.
    fn drives_to_tree(&self, _tree: u32) -> Option<Duration> {
        None
    }

    /// The number of the last tree whose trunk it has reached, from 1.
    fn tree(&self, at: Duration) -> Option<u32>;
}

/// How often a place along the row is looked for while nothing passes.
const LOOK: Duration = Duration::from_millis(10);

/// Who asks.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Link {
    pub(crate) stream: usize,
    pub(crate) connection: u64,
}

/// A stream and its connections.
#[derive(Debug)]
pub(crate) struct StreamState {
    pub(crate) name: String,
    pub(crate) medium: Medium,
    pub(crate) language: Language,
    pub(crate) part: Option<Arc<dyn Part>>,
    pub(crate) scans: u64,
    opened: u64,
    connections: BTreeMap<u64, ConnectionState>,
    /// Its sender has ended, and what became of what it had sent.
    ended: Option<Ended>,
}

/// What becomes of what a stream holds back when no more telegrams come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Ended {
    /// It leaves when it is due.
    Leaves,
    /// It is lost.
    Lost,
}

/// One connection, as the plan knows it.
#[derive(Debug, Default)]
pub(crate) struct ConnectionState {
    scans: u64,
    /// Bytes so far, before faults, each way.
    passed: [u64; 2],
    pub(crate) fate: Fate,
    /// Of its reader and its writer.
    wakers: [Option<Waker>; 2],
    /// When something that waits to go to the client may leave.
    due: Option<Duration>,
    /// When something that waits, either way, may leave, once time has come to it.
    needs_time: Option<Duration>,
}

/// What has become of a connection.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Fate {
    pub(crate) reset: bool,
    pub(crate) finished: bool,
    /// Closed in order, each way.
    pub(crate) closed: [bool; 2],
    /// Bytes vanish, each way, for good.
    pub(crate) dead: [bool; 2],
    /// The fault that made it dead is still active.
    pub(crate) still_out: bool,
}

#[derive(Debug)]
pub(crate) struct Plan {
    row: Option<Arc<dyn Row>>,
    pub(crate) streams: Vec<StreamState>,
    pub(crate) instances: Vec<Instance>,
    happened: Happened,
    events: mpsc::Sender<FaultEvent>,
    pub(crate) events_lost: u64,
    /// What parts were told to begin so far.
    orders: u64,
    /// Counts changes that whoever waits must see.
    pub(crate) changes: u64,
    /// Counts resets: what waits in queues goes at once.
    pub(crate) flushes: u64,
}

/// What an event says beside who and when.
#[derive(Clone, Debug, Default)]
struct Detail {
    connection: Option<u64>,
    direction: Option<Direction>,
    offset: Option<u64>,
    scan: Option<u64>,
    acts: Option<u64>,
    reason: Option<String>,
}

/// How many times a place has been looked for since time zero.
fn looks(now: Duration) -> u32 {
    u32::try_from(now.as_nanos() / LOOK.as_nanos()).unwrap_or(u32::MAX)
}

fn last_look(now: Duration) -> Duration {
    LOOK.saturating_mul(looks(now))
}

fn next_look(now: Duration) -> Duration {
    LOOK.saturating_mul(looks(now).saturating_add(1))
}

impl Plan {
    pub(crate) fn new(row: Option<Arc<dyn Row>>, events: mpsc::Sender<FaultEvent>) -> Self {
        Self {
            row,
            streams: Vec::new(),
            instances: Vec::new(),
            happened: Happened::new(),
            events,
            events_lost: 0,
            orders: 0,
            changes: 0,
            flushes: 0,
        }
    }

    pub(crate) fn has_row(&self) -> bool {
        self.row.is_some()
    }

    /// The number of the stream called `name`; a new one if there is none.
    pub(crate) fn stream(&mut self, name: &str, medium: Medium, language: Language) -> usize {
        if let Some(known) = self.streams.iter().position(|stream| stream.name == name) {
            return known;
        }
        let name = name.to_owned();
        self.streams.push(StreamState {
            name,
            medium,
            language,
            part: None,
            scans: 0,
            opened: 0,
            connections: BTreeMap::new(),
            ended: None,
        });
        self.streams.len() - 1
    }

    /// Begins and ends what is due by `now`, in the order of its time.
    pub(crate) fn advance(&mut self, now: Duration) {
        if self.instances.is_empty() {
            return;
        }
        // On a grid, so that it does not depend on who looks, and when.
        let looked = last_look(now);
        self.foretell(looked);
        loop {
            let place = self.place(looked);
            let due = |(number, instance): (usize, &Instance)| {
                let due = match instance.phase {
                    Phase::Waiting => instance.begins(&self.happened, place),
                    Phase::Active(_) => instance.ends(&self.happened, place),
                    Phase::Done => Due::Unknown,
                };
                match due {
                    Due::At(at) if at <= now => Some((at, number)),
                    Due::Row(true) => Some((looked.max(instance.earliest()), number)),
                    _ => None,
                }
            };
            let next = self.instances.iter().enumerate().filter_map(due).min();
            let Some((at, number)) = next else { return };
            match self.instances.get(number).map(|instance| instance.phase) {
                Some(Phase::Waiting) => self.begin(number, at, None),
                _ => self.end(number, at, What::End),
            }
        }
    }

    /// When there is something to do next, as far as time alone tells.
    pub(crate) fn next_due(&self, now: Duration) -> Option<Duration> {
        if self.instances.is_empty() {
            return None;
        }
        let place = self.place(now);
        let due = |instance: &Instance| {
            let due = match instance.phase {
                Phase::Waiting => instance.begins(&self.happened, place),
                Phase::Active(_) => instance.ends(&self.happened, place),
                Phase::Done => Due::Unknown,
            };
            match due {
                Due::At(at) => Some(at),
                // On a grid, whoever asks and when.
                Due::Row(_) => Some(next_look(now)),
                _ => None,
            }
        };
        self.instances.iter().filter_map(due).min()
    }

    fn place(&self, now: Duration) -> Place {
        let wanted = |instance: &Instance| instance.phase != Phase::Done && instance.spec.needs_row();
        match &self.row {
            Some(row) if self.instances.iter().any(wanted) => {
                Place { row_m: row.row_m(now), tree: row.tree(now) }
            }
            _ => Place::default(),
        }
    }

    /// Tells parts that must know it when their faults will begin: as long as the tractor stands, as if it set out now.
    fn foretell(&mut self, looked: Duration) {
        let Self { instances, streams, row, .. } = self;
        let waits = |instance: &&mut Instance| {
            instance.phase == Phase::Waiting && instance.windows == 0 && instance.foretold != Some(looked)
        };
        for instance in instances.iter_mut().filter(waits) {
            let Action::Part(fault) = &instance.action else { continue };
            if !fault.is_foreseen() {
                continue;
            }
            let stands = row.as_ref().filter(|row| row.row_m(looked).is_none());
            let drives = |to: &dyn Fn(&dyn Row) -> Option<Duration>| {
                stands.and_then(|row| to(&**row)).map(|time| looked.saturating_add(time))
            };
            let at = match &instance.spec.at {
                At::Time(at) => Some(*at).filter(|_| instance.foretold.is_none()),
                At::RowM(row_m) => drives(&|row| row.drives_to_row_m(*row_m)),
                At::Tree(tree) => drives(&|row| row.drives_to_tree(*tree)),
                At::Start | At::Scan(_) | At::Command(_) | At::After { .. } => None,
            };
            let part = streams.get(instance.stream).and_then(|stream| stream.part.as_ref());
            if let (Some(part), Some(at)) = (part, at) {
                part.foresee(fault, looked, at);
                instance.foretold = Some(looked);
            }
        }
    }

    fn begin(&mut self, number: usize, at: Duration, connection: Option<u64>) {
        let Some(instance) = self.instances.get_mut(number) else { return };
        let stream = instance.stream;
        // A part has no connections.
        let connection = connection.filter(|_| !matches!(instance.action, Action::Part(_)));
        let scans = self.streams.get(stream).map_or(0, |stream| stream.scans);
        if !instance.begin(at, connection, scans) {
            return;
        }
        let (id, direction) = (instance.id.clone(), instance.spec.directions.first().copied());
        let (cut, instant) = (instance.action.cut().is_some(), instance.is_instant());
        self.happened.entry((id, false)).or_insert(at);
        let detail = self.where_it_is(stream, connection, direction);
        self.tell(number, What::Begin, at, detail);
        self.order(number, at);
        if cut {
            let all = self.streams.get(stream).map(|stream| stream.connections.keys().copied().collect());
            let all: Vec<u64> = connection.map(|only| vec![only]).or(all).unwrap_or_default();
            if all.is_empty() && instant {
                let reason = Some("no connection stands".to_owned());
                let detail = self.where_it_is(stream, None, direction);
                self.tell(number, What::Skipped, at, Detail { reason, ..detail });
            }
            for connection in all {
                self.cut(number, at, connection);
            }
        }
        self.wake(stream);
        if instant {
            self.end(number, at, What::End);
        }
    }

    pub(crate) fn end(&mut self, number: usize, at: Duration, what: What) {
        let Some(instance) = self.instances.get_mut(number) else { return };
        let Phase::Active(window) = instance.phase else { return };
        let (stream, acts) = (instance.stream, instance.acted_on());
        let direction = instance.spec.directions.first().copied();
        instance.rest(at);
        let (id, order) = (instance.id.clone(), instance.order);
        let is_part = matches!(instance.action, Action::Part(_));
        if let Some(part) =
            self.streams.get(stream).and_then(|stream| stream.part.as_ref()).filter(|_| is_part)
        {
            part.end(order, at);
        }
        self.happened.entry((id, true)).or_insert(at);
        let detail = self.where_it_is(stream, window.connection, direction);
        self.tell(number, what, at, Detail { acts: Some(acts), ..detail });
        self.wake(stream);
    }

    /// Has the part act, if it is a part's.
    fn order(&mut self, number: usize, at: Duration) {
        let Some(instance) = self.instances.get_mut(number) else { return };
        let Action::Part(fault) = &instance.action else { return };
        self.orders += 1;
        instance.order = self.orders;
        let order = Order {
            key: instance.order,
            at,
            fault,
            seed: instance.window_seed(),
            p: instance.spec.p.unwrap_or(1.0),
        };
        if let Some(part) = self.streams.get(instance.stream).and_then(|stream| stream.part.as_ref()) {
            part.begin(&order);
        }
    }

    /// The place in the stream, where it is one connection's.
    fn where_it_is(&self, stream: usize, only: Option<u64>, direction: Option<Direction>) -> Detail {
        let Some(stream) = self.streams.get(stream) else { return Detail::default() };
        let sole = stream.connections.first_key_value().filter(|_| stream.connections.len() == 1);
        let connection = only.or(sole.map(|(number, _)| *number));
        let state = connection.and_then(|number| stream.connections.get(&number));
        let offset = state.zip(direction).and_then(|(state, way)| state.passed.get(way.index()).copied());
        Detail { connection, direction: offset.and(direction), offset, ..Detail::default() }
    }

    fn tell(&mut self, number: usize, what: What, at: Duration, detail: Detail) {
        let Some(instance) = self.instances.get(number) else { return };
        let Detail { connection, direction, offset, scan, acts, reason } = detail;
        let event = FaultEvent {
            what,
            id: instance.id.clone(),
            name: instance.spec.fault.name,
            on: self.streams.get(instance.stream).map(|stream| stream.name.clone()).unwrap_or_default(),
            at_s: at.as_secs_f64(),
            row_m: self.row.as_ref().and_then(|row| row.row_m(at)),
            connection,
            direction,
            offset,
            scan,
            acts,
            reason,
        };
        self.events_lost += u64::from(self.events.try_send(event).is_err());
    }

    /// Whoever waits on the stream looks again.
    fn wake(&mut self, stream: usize) {
        self.changes += 1;
        let Some(stream) = self.streams.get_mut(stream) else { return };
        let wakers = stream.connections.values_mut().flat_map(|state| state.wakers.iter_mut());
        wakers.filter_map(Option::take).for_each(Waker::wake);
    }

    pub(crate) fn wake_all(&mut self) {
        (0..self.streams.len()).for_each(|stream| self.wake(stream));
    }

    fn connection(&self, link: Link) -> Option<&ConnectionState> {
        self.streams.get(link.stream)?.connections.get(&link.connection)
    }

    fn connection_mut(&mut self, link: Link) -> Option<&mut ConnectionState> {
        self.streams.get_mut(link.stream)?.connections.get_mut(&link.connection)
    }
}
