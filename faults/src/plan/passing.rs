//! What faults do to the bytes and telegrams of a connection.

use std::time::Duration;

use super::{Detail, Link, Medium, Plan};
use crate::event::{Direction, What};
use crate::fault::{Action, Cut, Layer, Piece, Work};
use crate::instance::{Due, Instance, Phase, Place, Trail};
use crate::telegram::Mark;

/// Shorter than any telegram: what bounds how many scans a chunk can hold.
const SHORTEST_SCAN: usize = 8;

/// True if the next telegram may be the command that begins or ends the fault.
fn awaits_command(instance: &Instance, link: Link, direction: Direction) -> bool {
    direction == Direction::ToDevice && instance.stream == link.stream && instance.awaits_command().is_some()
}

impl Plan {
    /// True if bytes may pass untouched: so many more hold nothing that a fault waits for.
    pub(crate) fn is_quiet(&self, link: Link, direction: Direction, bytes: usize) -> bool {
        self.instances.iter().all(|instance| {
            let acts = instance.goes(direction)
                && !matches!(instance.action, Action::Door(_))
                && instance.active(link.stream, link.connection).is_some();
            !acts
                && !awaits_command(instance, link, direction)
                && !self.awaits_scan(instance, link, direction, 1 + bytes / SHORTEST_SCAN)
        })
    }

    /// True if telegrams must be taken whole: one is to be acted on, or may begin or end a fault.
    pub(crate) fn assembles(&self, link: Link, direction: Direction) -> bool {
        self.instances.iter().any(|instance| {
            let window = instance.active(link.stream, link.connection);
            let acts = matches!(instance.action, Action::Telegram(_)) && instance.goes(direction);
            let counts =
                direction == Direction::ToClient && window.is_some_and(|window| window.scans_left.is_some());
            let trails = instance.trails.iter().any(|trail| trail.connection == link.connection);
            (window.is_some() && acts)
                || (trails && instance.stream == link.stream && instance.goes(direction))
                || counts
                || awaits_command(instance, link, direction)
                || self.awaits_scan(instance, link, direction, 1)
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
                instance.action.cut() == Some(Cut::HalfOpen)
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
            if direction == Direction::ToDevice {
                self.command_comes(link, work, now);
            }
            self.act(link, direction, mark, now, work);
        }
    }

    /// The telegram is queued, or has passed: what lasts for so many scans may end.
    pub(crate) fn telegram_done(&mut self, link: Link, mark: &Mark, now: Duration) {
        if mark.is_scan {
            self.scan_has_come(link, now);
        }
    }

    fn command_comes(&mut self, link: Link, work: &Work, now: Duration) {
        let payload = work.bytes.get(work.regions.payload.clone()).unwrap_or_default();
        for number in 0..self.instances.len() {
            let Some(instance) = self.instances.get(number) else { break };
            let waits = instance.awaits_command().filter(|_| instance.stream == link.stream);
            if !waits.is_some_and(|command| work.regions.kind.is_command(payload, command)) {
                continue;
            }
            match instance.phase {
                Phase::Waiting => self.begin(number, now, Some(link.connection)),
                _ => self.end(number, now, What::End),
            }
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
            if !active || instance.spec.fault.layer != Layer::Telegram || instance.is_spent() {
                continue;
            }
            let Some(mut dice) = instance.draw() else { continue };
            let Action::Telegram(fault) = &instance.action else { continue };
            let before = work.drop.take();
            let came = work.clone();
            let (what, reason) = match fault.act(work, &mut dice) {
                Ok(()) if *work == came => {
                    (What::Skipped, Some("nothing about the telegram changes by it".to_owned()))
                }
                Ok(()) => (What::Act, None),
                Err(skipped) => (What::Skipped, Some(skipped.0)),
            };
            let further = work.drop.unwrap_or(0);
            work.drop = work.drop.max(before);
            let is_last = instance.tried(what == What::Act);
            if further > 0 {
                instance.trails.push(Trail { connection: link.connection, left: further, ends: is_last });
            }
            let (connection, offset) = (Some(link.connection), Some(mark.offset));
            let direction = Some(direction);
            self.tell(number, what, now, Detail { connection, direction, offset, scan, reason, acts: None });
            if is_last && further == 0 {
                self.end(number, now, What::End);
            }
        }
    }

    /// A telegram is lost because of one before it: an act of the fault that lost that.
    pub(crate) fn lost(&mut self, link: Link, direction: Direction, mark: &Mark, now: Duration) {
        let scan = self.connection(link).map(|state| state.scans).filter(|_| mark.is_scan);
        for number in 0..self.instances.len() {
            let Some(instance) = self.instances.get_mut(number) else { break };
            if instance.stream != link.stream || !instance.goes(direction) {
                continue;
            }
            let Some(ends) = instance.loses(link.connection) else { continue };
            let (connection, offset) = (Some(link.connection), Some(mark.offset));
            let direction = Some(direction);
            let detail = Detail { connection, direction, offset, scan, reason: None, acts: None };
            self.tell(number, What::Act, now, detail);
            if ends {
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
                        instance.tried(true);
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
