//! What faults do to connections: those that stand, and those that are being made.

use std::task::Waker;
use std::time::Duration;

use super::{ConnectionState, Detail, Ended, Fate, Link, Medium, Plan};
use crate::event::{Direction, What};
use crate::fault::{Action, Cut, Door};
use crate::instance::{Instance, Trail};

impl Plan {
    /// A new connection of the stream.
    pub(crate) fn open(&mut self, stream: usize, now: Duration) -> u64 {
        self.advance(now);
        let Some(state) = self.streams.get_mut(stream) else { return 0 };
        state.opened += 1;
        let connection = state.opened;
        state.connections.insert(connection, ConnectionState::default());
        let half_open = |instance: &Instance| {
            instance.action.cut() == Some(Cut::HalfOpen) && instance.active(stream, connection).is_some()
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

    pub(crate) fn close(&mut self, link: Link, now: Duration) {
        self.cut_trails(now, |stream, trail| stream == link.stream && trail.connection == link.connection);
        if let Some(stream) = self.streams.get_mut(link.stream) {
            stream.connections.remove(&link.connection);
        }
    }

    /// Telegrams that were still to be lost do not come any more, or pass.
    pub(crate) fn cut_trails(&mut self, now: Duration, which: impl Fn(usize, &Trail) -> bool) {
        for number in 0..self.instances.len() {
            let Some(instance) = self.instances.get_mut(number) else { break };
            let (stream, was_spent) = (instance.stream, instance.is_spent());
            instance.trails.retain(|trail| !which(stream, trail));
            if was_spent && !instance.is_spent() {
                self.end(number, now, What::End);
            }
        }
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

    /// When something that waits to go to the connection's client may leave; none where nothing waits, or nobody knows.
    pub(crate) fn is_due(&mut self, link: Link, at: Option<Duration>) {
        if let Some(state) = self.connection_mut(link) {
            state.due = at;
        }
    }

    /// When something that waits on the connection, either way, may leave; none where nothing waits, or not for time.
    pub(crate) fn set_needs_time(&mut self, link: Link, at: Option<Duration>) {
        if let Some(state) = self.connection_mut(link) {
            state.needs_time = at;
        }
    }

    /// When the first of what waits on a stream, either way, may leave.
    pub(crate) fn needs_time(&self, stream: usize) -> Option<Duration> {
        self.streams.get(stream)?.connections.values().filter_map(|connection| connection.needs_time).min()
    }

    /// No more telegrams come on a stream.
    pub(crate) fn end_stream(&mut self, stream: usize, ended: Ended) {
        if let Some(state) = self.streams.get_mut(stream) {
            state.ended = Some(ended);
        }
        self.wake_all();
    }

    /// True if no more telegrams come on a stream.
    pub(crate) fn has_ended(&self, stream: usize) -> bool {
        self.streams.get(stream).is_some_and(|state| state.ended.is_some())
    }

    /// True if what a stream holds back is lost.
    pub(crate) fn has_lost(&self, stream: usize) -> bool {
        self.streams.get(stream).is_some_and(|state| state.ended == Some(Ended::Lost))
    }

    /// When the first of what waits on a stream may leave.
    pub(crate) fn first_due(&self, stream: usize) -> Option<Duration> {
        let state = self.streams.get(stream)?;
        state.connections.values().filter_map(|connection| connection.due).min()
    }

    /// The waker of the other half, if it waits.
    pub(crate) fn take_waker(&mut self, link: Link, who: usize) -> Option<Waker> {
        self.connection_mut(link)?.wakers.get_mut(who)?.take()
    }

    /// What has become of the connection.
    pub(crate) fn fate(&self, link: Link) -> Fate {
        let fate = self.connection(link).map(|state| state.fate).unwrap_or_default();
        let out = |instance: &Instance| {
            instance.action.cut() == Some(Cut::HalfOpen)
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

    pub(super) fn cut(&mut self, number: usize, at: Duration, connection: u64) {
        let Some(instance) = self.instances.get_mut(number) else { return };
        let Some(cut) = instance.action.cut() else { return };
        let (stream, directions) = (instance.stream, instance.spec.directions.clone());
        instance.tried(true);
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
            let is_last = instance.tried(true);
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
            if matches!(instance.action, Action::Part(_)) {
                return instance.action.cut().is_some() && instance.active(stream, 0).is_some();
            }
            // What is counted, or drawn for, must be taken first.
            matches!(instance.action, Action::Door(Door::Refuse))
                && instance.active(stream, 0).is_some()
                && instance.spec.count.is_none()
                && instance.spec.p.is_none()
        })
    }
}
