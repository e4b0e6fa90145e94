//! All faults of all streams, and where each is in its script. Sans I/O: time is handed in, events go to a queue.

use std::collections::BTreeMap;
use std::fmt;
use std::sync::Arc;
use std::task::Waker;
use std::time::Duration;

use tokio::sync::mpsc;

use crate::event::{Direction, FaultEvent, What};
use crate::fault::{Action, Cut, Door, Layer, Piece, Work};
use crate::instance::{Due, Happened, Instance, Phase, Place};
use crate::telegram::{Language, Mark};

/// What a stream runs over.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Medium {
    /// Connections that come and go.
    Tcp,
    /// A serial wire: nobody connects, nothing is closed.
    Wire,
}

/// Where the tractor is.
pub trait Row: Send + Sync + fmt::Debug {
    /// Metres along the row at this time on the faults' clock; none before it starts.
    fn row_m(&self, at: Duration) -> Option<f64>;

    /// The number of the last tree whose trunk it has reached, from 1.
    fn tree(&self, at: Duration) -> Option<u32>;
}

/// How often a place along the row is looked for while nothing passes.
const LOOK: Duration = Duration::from_millis(10);
/// Shorter than any telegram: what bounds how many scans a chunk can hold.
const SHORTEST_SCAN: usize = 8;

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
    scans: u64,
    opened: u64,
    connections: BTreeMap<u64, ConnectionState>,
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

impl Plan {
    pub(crate) fn new(row: Option<Arc<dyn Row>>, events: mpsc::Sender<FaultEvent>) -> Self {
        Self {
            row,
            streams: Vec::new(),
            instances: Vec::new(),
            happened: Happened::new(),
            events,
            events_lost: 0,
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
            scans: 0,
            opened: 0,
            connections: BTreeMap::new(),
        });
        self.streams.len() - 1
    }

    /// Begins and ends what is due by `now`, in the order of its time.
    pub(crate) fn advance(&mut self, now: Duration) {
        if self.instances.is_empty() {
            return;
        }
        loop {
            let place = self.place(now);
            let due = |(number, instance): (usize, &Instance)| {
                let due = match instance.phase {
                    Phase::Waiting => instance.begins(&self.happened, place),
                    Phase::Active(_) => instance.ends(&self.happened, place),
                    Phase::Done => Due::Unknown,
                };
                match due {
                    Due::At(at) if at <= now => Some((at, number)),
                    Due::Row(true) => Some((now, number)),
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
                Due::Row(_) => Some(now.saturating_add(LOOK)),
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

    fn begin(&mut self, number: usize, at: Duration, connection: Option<u64>) {
        let Some(instance) = self.instances.get_mut(number) else { return };
        let stream = instance.stream;
        let scans = self.streams.get(stream).map_or(0, |stream| stream.scans);
        if !instance.begin(at, connection, scans) {
            return;
        }
        let (id, direction) = (instance.id.clone(), instance.spec.directions.first().copied());
        let (cut, instant) = (matches!(instance.action, Action::Cut(_)), instance.is_instant());
        self.happened.entry((id, false)).or_insert(at);
        let detail = self.where_it_is(stream, connection, direction);
        self.tell(number, What::Begin, at, detail);
        if cut {
            let all = self.streams.get(stream).map(|stream| stream.connections.keys().copied().collect());
            let all: Vec<u64> = connection.map(|only| vec![only]).or(all).unwrap_or_default();
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
        let (stream, acts) = (instance.stream, instance.acts);
        let direction = instance.spec.directions.first().copied();
        instance.rest(at);
        let id = instance.id.clone();
        self.happened.entry((id, true)).or_insert(at);
        let detail = self.where_it_is(stream, window.connection, direction);
        self.tell(number, what, at, Detail { acts: Some(acts), ..detail });
        self.wake(stream);
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

    /// A new connection of the stream.
    pub(crate) fn open(&mut self, stream: usize, now: Duration) -> u64 {
        self.advance(now);
        let Some(state) = self.streams.get_mut(stream) else { return 0 };
        state.opened += 1;
        let connection = state.opened;
        state.connections.insert(connection, ConnectionState::default());
        let half_open = |instance: &Instance| {
            matches!(instance.action, Action::Cut(Cut::HalfOpen))
                && instance.active(stream, connection).is_some()
        };
        let out: Vec<usize> = self
            .instances
            .iter()
            .enumerate()
            .filter(|(_, it)| half_open(it))
            .map(|(number, _)| number)
            .collect();
        for number in out {
            self.cut(number, now, connection);
        }
        connection
    }

    pub(crate) fn close(&mut self, link: Link) {
        if let Some(stream) = self.streams.get_mut(link.stream) {
            stream.connections.remove(&link.connection);
        }
    }

    fn connection(&self, link: Link) -> Option<&ConnectionState> {
        self.streams.get(link.stream)?.connections.get(&link.connection)
    }

    fn connection_mut(&mut self, link: Link) -> Option<&mut ConnectionState> {
        self.streams.get_mut(link.stream)?.connections.get_mut(&link.connection)
    }

    pub(crate) fn waits(&mut self, link: Link, who: usize, waker: &Waker) {
        let slot = self.connection_mut(link).and_then(|state| state.wakers.get_mut(who));
        if let Some(slot) = slot {
            match slot {
                Some(known) => known.clone_from(waker),
                None => *slot = Some(waker.clone()),
            }
        }
    }

    /// The waker of the other half, if it waits.
    pub(crate) fn take_waker(&mut self, link: Link, who: usize) -> Option<Waker> {
        self.connection_mut(link)?.wakers.get_mut(who)?.take()
    }

    /// What has become of the connection.
    pub(crate) fn fate(&self, link: Link) -> Fate {
        let fate = self.connection(link).map(|state| state.fate).unwrap_or_default();
        let out = |instance: &Instance| {
            matches!(instance.action, Action::Cut(Cut::HalfOpen))
                && instance.active(link.stream, link.connection).is_some()
        };
        Fate { still_out: fate.dead != [false; 2] && self.instances.iter().any(out), ..fate }
    }

    /// True if nothing goes this way any more.
    pub(crate) fn is_cut(&self, link: Link, direction: Direction) -> bool {
        let fate = self.connection(link).map(|state| state.fate).unwrap_or_default();
        let [closed, dead] =
            [fate.closed, fate.dead].map(|ways| ways.get(direction.index()).is_some_and(|way| *way));
        fate.reset || fate.finished || closed || dead
    }

    fn cut(&mut self, number: usize, at: Duration, connection: u64) {
        let Some(instance) = self.instances.get_mut(number) else { return };
        let Action::Cut(cut) = instance.action else { return };
        let (stream, directions) = (instance.stream, instance.spec.directions.clone());
        instance.acted();
        let is_wire = self.streams.get(stream).is_some_and(|stream| stream.medium == Medium::Wire);
        let link = Link { stream, connection };
        if let Some(state) = self.connection_mut(link) {
            let fate = &mut state.fate;
            let mark = |ways: &mut [bool; 2]| {
                directions.iter().filter_map(|way| ways.get_mut(way.index()).map(|way| *way = true)).count()
            };
            match cut {
                Cut::Reset => fate.reset = true,
                Cut::Finish => fate.finished = true,
                Cut::HalfClose => drop(mark(&mut fate.closed)),
                // On a wire bytes vanish only while it is active: `vanishes`.
                Cut::HalfOpen if is_wire => {}
                Cut::HalfOpen => drop(mark(&mut fate.dead)),
            }
        }
        let detail = self.where_it_is(stream, Some(connection), directions.first().copied());
        self.tell(number, What::Act, at, detail);
    }

    /// How somebody who wants to connect is met; none: as ever.
    pub(crate) fn admit(&mut self, stream: usize, now: Duration) -> Option<Door> {
        self.advance(now);
        for number in 0..self.instances.len() {
            let Some(instance) = self.instances.get_mut(number) else { break };
            let Action::Door(door) = instance.action else { continue };
            if instance.active(stream, 0).is_none() || instance.draw().is_none() {
                continue;
            }
            let is_last = instance.acted();
            self.tell(number, What::Act, now, Detail::default());
            if is_last {
                self.end(number, now, What::End);
            }
            return Some(door);
        }
        None
    }

    /// True while nobody shall listen at all.
    pub(crate) fn refuses(&mut self, stream: usize, now: Duration) -> bool {
        self.advance(now);
        self.instances.iter().any(|instance| {
            // What is counted, or drawn for, must be taken first.
            matches!(instance.action, Action::Door(Door::Refuse))
                && instance.active(stream, 0).is_some()
                && instance.spec.count.is_none()
                && instance.spec.p.is_none()
        })
    }

    /// True if bytes may pass untouched: so many more hold nothing that a fault waits for.
    pub(crate) fn is_quiet(&self, link: Link, direction: Direction, bytes: usize) -> bool {
        self.instances.iter().all(|instance| {
            let acts = instance.goes(direction)
                && !matches!(instance.action, Action::Door(_))
                && instance.active(link.stream, link.connection).is_some();
            !acts && !self.awaits_scan(instance, link, direction, 1 + bytes / SHORTEST_SCAN)
        })
    }

    /// True if telegrams must be taken whole: one is to be acted on, or may begin or end a fault.
    pub(crate) fn assembles(&self, link: Link, direction: Direction) -> bool {
        self.instances.iter().any(|instance| {
            let window = instance.active(link.stream, link.connection);
            let acts = matches!(instance.action, Action::Telegram(_)) && instance.goes(direction);
            let counts =
                direction == Direction::ToClient && window.is_some_and(|window| window.scans_left.is_some());
            (window.is_some() && acts) || counts || self.awaits_scan(instance, link, direction, 1)
        })
    }

    /// True if one of the next `ahead` scans may begin or end the fault.
    fn awaits_scan(&self, instance: &Instance, link: Link, direction: Direction, ahead: usize) -> bool {
        if direction != Direction::ToClient || instance.stream != link.stream {
            return false;
        }
        let ahead = ahead as u64;
        let (here, all) = (self.connection(link).map_or(0, |state| state.scans), self.scans(link.stream));
        let due = match instance.phase {
            Phase::Waiting => instance.begins(&self.happened, Place::default()),
            Phase::Active(_) => instance.ends(&self.happened, Place::default()),
            Phase::Done => return false,
        };
        match due {
            Due::Scan(scan) => here.saturating_add(ahead) >= scan,
            Due::ScansSince(scans) => instance.scans_passed(scans, all.saturating_add(ahead)),
            _ => false,
        }
    }

    fn scans(&self, stream: usize) -> u64 {
        self.streams.get(stream).map_or(0, |stream| stream.scans)
    }

    /// True while nothing leaves.
    pub(crate) fn holds(&self, link: Link, direction: Direction) -> bool {
        self.instances.iter().any(|instance| {
            matches!(instance.action, Action::Hold)
                && instance.goes(direction)
                && instance.active(link.stream, link.connection).is_some()
        })
    }

    /// True while bytes on a wire are lost.
    pub(crate) fn vanishes(&self, link: Link, direction: Direction) -> bool {
        let is_wire = self.streams.get(link.stream).is_some_and(|stream| stream.medium == Medium::Wire);
        is_wire
            && self.instances.iter().any(|instance| {
                matches!(instance.action, Action::Cut(Cut::HalfOpen))
                    && instance.goes(direction)
                    && instance.active(link.stream, link.connection).is_some()
            })
    }

    /// So many bytes have come, before faults.
    pub(crate) fn comes(&mut self, link: Link, direction: Direction, bytes: usize) {
        if let Some(passed) =
            self.connection_mut(link).and_then(|state| state.passed.get_mut(direction.index()))
        {
            *passed += bytes as u64;
        }
    }

    /// A telegram comes; faults act on `work`, if it can still be acted on.
    pub(crate) fn telegram(
        &mut self,
        link: Link,
        direction: Direction,
        mark: &Mark,
        now: Duration,
        work: Option<&mut Work>,
    ) {
        self.advance(now);
        if mark.is_scan {
            self.scan_comes(link, now);
        }
        if let Some(work) = work {
            self.act(link, direction, mark, now, work);
        }
    }

    /// The telegram is queued, or has passed: what lasts for so many scans may end.
    pub(crate) fn telegram_done(&mut self, link: Link, mark: &Mark, now: Duration) {
        if mark.is_scan {
            self.scan_has_come(link, now);
        }
    }

    fn scan_comes(&mut self, link: Link, now: Duration) {
        let Some(stream) = self.streams.get_mut(link.stream) else { return };
        stream.scans += 1;
        if let Some(state) = stream.connections.get_mut(&link.connection) {
            state.scans += 1;
        }
        for number in 0..self.instances.len() {
            let Some(instance) = self.instances.get(number) else { break };
            if !self.awaits_scan(instance, link, Direction::ToClient, 0) {
                continue;
            }
            match instance.phase {
                Phase::Waiting => self.begin(number, now, Some(link.connection)),
                _ => self.end(number, now, What::End),
            }
        }
    }

    fn act(&mut self, link: Link, direction: Direction, mark: &Mark, now: Duration, work: &mut Work) {
        let scan = self.connection(link).map(|state| state.scans).filter(|_| mark.is_scan);
        for number in 0..self.instances.len() {
            let Some(instance) = self.instances.get_mut(number) else { break };
            let active = instance.goes(direction) && instance.active(link.stream, link.connection).is_some();
            if !active || instance.spec.fault.layer != Layer::Telegram {
                continue;
            }
            let Some(mut dice) = instance.draw() else { continue };
            let Action::Telegram(fault) = &instance.action else { continue };
            let (what, reason) = match fault.act(work, &mut dice) {
                Ok(()) => (What::Act, None),
                Err(skipped) => (What::Skipped, Some(skipped.0)),
            };
            let is_last = instance.acted();
            let (connection, offset) = (Some(link.connection), Some(mark.offset));
            let direction = Some(direction);
            self.tell(number, what, now, Detail { connection, direction, offset, scan, reason, acts: None });
            if is_last {
                self.end(number, now, What::End);
            }
        }
    }

    fn scan_has_come(&mut self, link: Link, now: Duration) {
        for number in 0..self.instances.len() {
            let Some(instance) = self.instances.get_mut(number) else { break };
            if instance.active(link.stream, link.connection).is_none() {
                continue;
            }
            let Phase::Active(window) = &mut instance.phase else { continue };
            let Some(left) = &mut window.scans_left else { continue };
            *left = left.saturating_sub(1);
            if *left == 0 {
                self.end(number, now, What::End);
            }
        }
    }

    /// What is queued in place of `piece`; `free` is when the one before it leaves.
    pub(crate) fn shape(
        &mut self,
        link: Link,
        direction: Direction,
        piece: Piece,
        free: Duration,
    ) -> Vec<Piece> {
        let mut pieces = vec![piece];
        for instance in &mut self.instances {
            if !instance.goes(direction) || instance.active(link.stream, link.connection).is_none() {
                continue;
            }
            if !matches!(instance.action, Action::Piece(_)) {
                continue;
            }
            let mut shaped = Vec::new();
            let mut free = free;
            for piece in pieces {
                let dice = instance.draw();
                match (&instance.action, dice) {
                    (Action::Piece(fault), Some(mut dice)) => {
                        fault.shape(piece, free, &mut dice, &mut shaped);
                        instance.acted();
                    }
                    _ => shaped.push(piece),
                }
                free = shaped.last().map_or(free, |last| free.max(last.due));
            }
            pieces = shaped;
        }
        pieces
    }
}
