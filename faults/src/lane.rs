//! One direction of one connection: telegrams found, acted on, queued with the time they may leave. Sans I/O.

use std::collections::VecDeque;
use std::time::Duration;

use crate::event::Direction;
use crate::fault::{Piece, Work};
use crate::in_lane::{InLane, ScanCounts};
use crate::plan::{Link, Plan};
use crate::telegram::{Language, Mark, Tracker};

/// What looks like an unfinished telegram is let go as it is if nothing follows for so long.
const GAP: Duration = Duration::from_millis(500);

#[derive(Debug)]
pub(crate) struct Lane {
    link: Link,
    direction: Direction,
    tracker: Tracker,
    /// Bytes that came so far.
    seen: u64,
    /// The last of them that were not let go: what may be a telegram.
    held: Vec<u8>,
    held_since: Duration,
    queue: VecDeque<Queued>,
    queued: usize,
    /// When the last one queued leaves.
    free: Duration,
    /// Telegrams that leave behind so many others.
    behind: Vec<(u32, Held)>,
    /// Scans that wait, and that are lost.
    scans: ScanCounts,
    joined: Option<Joined>,
    /// So many telegrams are lost.
    dropping: u32,
    /// Where the bytes ended that went nowhere last, as `seen` counts.
    vanished: u64,
    flushes: u64,
}

/// Telegrams that wait to leave in one piece.
#[derive(Debug)]
struct Joined {
    left: u32,
    until: Duration,
    held: Held,
}

/// Bytes, and the scans that are complete with them: each has left with the last of them.
#[derive(Debug, Default)]
struct Held {
    bytes: Vec<u8>,
    scans: Vec<InLane>,
}

/// A piece in the queue, with the scans that are complete with it.
#[derive(Debug)]
struct Queued {
    piece: Piece,
    scans: Vec<InLane>,
}

impl Held {
    fn extend(&mut self, more: Self) {
        self.bytes.extend(more.bytes);
        self.scans.extend(more.scans);
    }
}

impl Lane {
    /// `scans` counts those that wait in it, and those that are lost there.
    pub(crate) fn new(
        link: Link,
        language: Language,
        direction: Direction,
        (flushes, scans): (u64, ScanCounts),
    ) -> Self {
        Self {
            scans,
            link,
            direction,
            tracker: Tracker::new(language, direction),
            seen: 0,
            held: Vec::new(),
            held_since: Duration::ZERO,
            queue: VecDeque::new(),
            queued: 0,
            free: Duration::ZERO,
            behind: Vec::new(),
            joined: None,
            dropping: 0,
            vanished: 0,
            flushes,
        }
    }

    /// True if nothing waits in it.
    pub(crate) fn is_idle(&self) -> bool {
        self.queue.is_empty()
            && self.held.is_empty()
            && self.behind.is_empty()
            && self.joined.is_none()
            && self.dropping == 0
    }

    /// True if nothing is to be written.
    pub(crate) fn is_empty(&self) -> bool {
        self.queue.is_empty()
    }

    /// Bytes that wait.
    pub(crate) fn waiting(&self) -> usize {
        self.queued + self.held.len()
    }

    /// Bytes that pass without us are followed.
    pub(crate) fn observe(&mut self, bytes: &[u8], now: Duration, plan: &mut Plan) {
        self.follow(bytes, now, plan, |_, _| ());
    }

    /// Follows bytes that faults cannot act on any more; `each` hears of every telegram.
    fn follow(&mut self, bytes: &[u8], now: Duration, plan: &mut Plan, each: fn(&Self, &Mark)) {
        self.seen += bytes.len() as u64;
        plan.comes(self.link, self.direction, bytes.len());
        self.tracker.push(bytes);
        while let Some(mark) = self.tracker.next() {
            each(self, &mark);
            self.pass_by(&mark, now, plan);
        }
    }

    /// A telegram that never leaves.
    fn lose_one(&self, mark: &Mark) {
        drop(self.in_lane(mark));
    }

    /// A telegram that faults cannot act on any more.
    fn pass_by(&mut self, mark: &Mark, now: Duration, plan: &mut Plan) {
        plan.telegram(self.link, self.direction, mark, now, None);
        plan.telegram_done(self.link, mark, now);
    }

    /// Bytes that go nowhere, and that no fault acts on any more: the connection is dead or closed, and whoever writes does not know.
    pub(crate) fn swallow(&mut self, bytes: &[u8]) {
        self.seen += bytes.len() as u64;
        self.tracker.push(bytes);
        while let Some(mark) = self.tracker.next() {
            self.lose_one(&mark);
        }
    }

    /// Takes bytes.
    pub(crate) fn push(&mut self, bytes: &[u8], now: Duration, plan: &mut Plan) {
        if plan.vanishes(self.link, self.direction) {
            self.follow(bytes, now, plan, Self::lose_one);
            self.vanished = self.seen;
            return;
        }
        self.seen += bytes.len() as u64;
        plan.comes(self.link, self.direction, bytes.len());
        self.held.extend_from_slice(bytes);
        self.held_since = now;
        self.tracker.push(bytes);
        self.find(now, plan);
        let unfinished = if plan.assembles(self.link, self.direction) { self.tracker.pending() } else { 0 };
        let junk = self.held.len().saturating_sub(unfinished);
        self.let_go(junk, now, plan);
    }

    /// Acts on the telegrams that are whole.
    fn find(&mut self, now: Duration, plan: &mut Plan) {
        while let Some(mark) = self.tracker.next() {
            let base = self.seen - self.held.len() as u64;
            let Some(before) = mark.offset.checked_sub(base) else {
                // Its beginning has passed.
                let rest = (mark.offset + mark.len as u64).saturating_sub(base);
                let bytes = self.take(usize::try_from(rest).unwrap_or(usize::MAX));
                let mut scans = self.in_lane(&mark);
                if mark.offset < self.vanished {
                    // A part of it went nowhere.
                    scans.clear();
                }
                self.pass(Held { bytes, scans }, now, plan);
                self.pass_by(&mark, now, plan);
                continue;
            };
            self.let_go(usize::try_from(before).unwrap_or(usize::MAX), now, plan);
            let bytes: Vec<u8> = self.held.drain(..mark.len.min(self.held.len())).collect();
            self.act(bytes, &mark, now, plan);
        }
    }

    fn act(&mut self, bytes: Vec<u8>, mark: &Mark, now: Duration, plan: &mut Plan) {
        if self.dropping > 0 {
            self.dropping -= 1;
            self.lose_one(mark);
            plan.telegram(self.link, self.direction, mark, now, None);
            plan.lost(self.link, self.direction, mark, now);
            return plan.telegram_done(self.link, mark, now);
        }
        let regions = mark.kind.regions(bytes.len());
        let mut work = Work::new(bytes, regions, mark.kind.foreign(self.direction));
        plan.telegram(self.link, self.direction, mark, now, Some(&mut work));
        let scans = self.in_lane(mark);
        self.place(work, scans, now, plan);
        plan.telegram_done(self.link, mark, now);
    }

    /// What counts a scan as held until it has left, or is lost.
    fn in_lane(&self, mark: &Mark) -> Vec<InLane> {
        mark.is_scan.then(|| self.scans.enter()).into_iter().collect()
    }

    /// Puts a telegram where the faults want it.
    fn place(&mut self, work: Work, scans: Vec<InLane>, now: Duration, plan: &mut Plan) {
        if let Some(further) = work.drop {
            self.dropping = further;
            return;
        }
        let copies = 1 + work.copies as usize;
        if work.behind > 0 {
            self.behind.push((work.behind, Held { bytes: work.bytes.repeat(copies), scans }));
            return;
        }
        match (&mut self.joined, work.joined) {
            (Some(joined), _) => {
                joined.held.extend(Held { bytes: work.bytes.repeat(copies), scans });
                joined.left = joined.left.saturating_sub(1);
                if joined.left == 0 {
                    self.part(now, plan);
                }
            }
            (None, Some((left, wait))) => {
                let until = now.saturating_add(wait);
                let held = Held { bytes: work.bytes.repeat(copies), scans };
                self.joined = Some(Joined { left, until, held });
            }
            (None, None) => {
                let pieces = pieces(&work);
                for _ in 1..copies {
                    self.enqueue(&pieces, Vec::new(), now, plan);
                }
                self.enqueue(&pieces, scans, now, plan);
            }
        }
        self.behind.iter_mut().for_each(|(left, _)| *left -= 1);
        for (_, held) in self.behind.extract_if(.., |(left, _)| *left == 0).collect::<Vec<_>>() {
            self.pass(held, now, plan);
        }
    }

    /// Lets the first `bytes` of what is held go as they are.
    fn let_go(&mut self, bytes: usize, now: Duration, plan: &mut Plan) {
        let bytes = self.take(bytes);
        self.pass(Held { bytes, scans: Vec::new() }, now, plan);
    }

    /// The first `bytes` of what is held.
    fn take(&mut self, bytes: usize) -> Vec<u8> {
        self.held.drain(..bytes.min(self.held.len())).collect()
    }

    /// Queues bytes in their order.
    fn pass(&mut self, held: Held, now: Duration, plan: &mut Plan) {
        match &mut self.joined {
            Some(joined) => joined.held.extend(held),
            None => self.enqueue(&[(held.bytes, Duration::ZERO)], held.scans, now, plan),
        }
    }

    /// Ends the wait of what leaves in one piece.
    fn part(&mut self, now: Duration, plan: &mut Plan) {
        if let Some(joined) = self.joined.take() {
            self.enqueue(&[(joined.held.bytes, Duration::ZERO)], joined.held.scans, now, plan);
        }
    }

    /// Queues pieces, each so long after the one before; `scans` are complete with the last of them.
    fn enqueue(
        &mut self,
        pieces: &[(Vec<u8>, Duration)],
        scans: Vec<InLane>,
        now: Duration,
        plan: &mut Plan,
    ) {
        if plan.is_cut(self.link, self.direction) || plan.vanishes(self.link, self.direction) {
            return;
        }
        // Behind a cut telegram the next one does not count its pieces' gaps from now.
        let mut due = now;
        for (bytes, gap) in pieces {
            due = if gap.is_zero() { due } else { due.max(self.free).saturating_add(*gap) };
            let piece = Piece { due, bytes: bytes.clone() };
            for mut piece in plan.shape(self.link, self.direction, piece, self.free) {
                if piece.bytes.is_empty() {
                    continue;
                }
                piece.due = piece.due.max(self.free);
                self.free = piece.due;
                self.queued += piece.bytes.len();
                self.queue.push_back(Queued { piece, scans: Vec::new() });
            }
        }
        if let Some(last) = self.queue.back_mut() {
            last.scans.extend(scans);
        }
    }

    /// No more bytes come.
    pub(crate) fn finish(&mut self, now: Duration, plan: &mut Plan) {
        self.tracker.finish();
        self.find(now, plan);
        self.let_go(usize::MAX, now, plan);
        self.part(now, plan);
        for (_, held) in std::mem::take(&mut self.behind) {
            self.pass(held, now, plan);
        }
    }

    /// Lets go what has waited long enough.
    pub(crate) fn tick(&mut self, now: Duration, plan: &mut Plan) {
        if self.flushes != plan.flushes {
            self.flushes = plan.flushes;
            self.dropping = 0;
            self.finish(now, plan);
            self.queue.iter_mut().for_each(|queued| queued.piece.due = queued.piece.due.min(now));
            self.free = self.free.min(now);
        }
        // What waits for telegrams that do not come any more waits for nothing.
        if plan.has_ended(self.link.stream) && self.direction == Direction::ToClient {
            self.finish(now, plan);
        }
        if !self.held.is_empty() && now >= self.held_since.saturating_add(GAP) {
            self.tracker.finish();
            self.find(now, plan);
            self.let_go(usize::MAX, now, plan);
        }
        if self.joined.as_ref().is_some_and(|joined| joined.until <= now) {
            self.part(now, plan);
        }
    }

    /// What waits is lost.
    pub(crate) fn lose(&mut self) {
        self.queue.clear();
        self.behind.clear();
        self.joined = None;
        self.queued = 0;
    }

    /// When it wants to be looked at next.
    pub(crate) fn next_due(&self, holds: bool) -> Option<Duration> {
        let front = self.queue.front().filter(|_| !holds).map(|queued| queued.piece.due);
        let held = (!self.held.is_empty()).then(|| self.held_since.saturating_add(GAP));
        let joined = self.joined.as_ref().map(|joined| joined.until);
        [front, held, joined].into_iter().flatten().min()
    }

    /// The bytes that may leave now.
    pub(crate) fn ready(&self, now: Duration) -> Option<&[u8]> {
        let front = self.queue.front().map(|queued| &queued.piece);
        front.filter(|piece| piece.due <= now).map(|piece| piece.bytes.as_slice())
    }

    /// So many of them have left.
    pub(crate) fn left(&mut self, bytes: usize) {
        let Some(front) = self.queue.front_mut().map(|queued| &mut queued.piece) else { return };
        let bytes = bytes.min(front.bytes.len());
        front.bytes.drain(..bytes);
        self.queued -= bytes;
        if front.bytes.is_empty() {
            let gone = self.queue.pop_front().into_iter().flat_map(|queued| queued.scans);
            gone.for_each(InLane::leave);
        }
    }

    /// The first piece has nowhere to go.
    pub(crate) fn lose_first(&mut self) {
        if let Some(lost) = self.queue.pop_front() {
            self.queued -= lost.piece.bytes.len();
        }
    }
}

/// A telegram's bytes, cut where the faults want it.
fn pieces(work: &Work) -> Vec<(Vec<u8>, Duration)> {
    let len = work.bytes.len();
    let mut cuts = work.cuts.clone();
    cuts.retain(|(at, _)| (1..len).contains(at));
    cuts.sort_unstable();
    cuts.dedup_by_key(|(at, _)| *at);
    let mut pieces = Vec::with_capacity(cuts.len() + 1);
    let (mut from, mut gap) = (0, Duration::ZERO);
    for (at, next_gap) in cuts {
        pieces.push((work.bytes.get(from..at).unwrap_or_default().to_vec(), gap));
        (from, gap) = (at, next_gap);
    }
    pieces.push((work.bytes.get(from..).unwrap_or_default().to_vec(), gap));
    pieces
}
