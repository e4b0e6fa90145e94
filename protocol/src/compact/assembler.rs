//! Puts the segments of turns together, as datagrams bring them: lost, late, twice, in any order.
//!
//! Segments of a turn have its number; telegrams are counted over all turns, and a gap in the counter is what was lost. A turn is given once all its
//! segments are there, or once more than [`REORDER`] telegrams behind its end have come; what comes later than that is lost. Memory is bounded: at most
//! [`MAX_OPEN`] turns are waited for.
//!
//! A segment that comes again is left out. If what it says is not what the first one said, nobody knows which of them is right: its turn gives no scan, in
//! whatever order they came, and the fault is told.

use alloc::collections::{BTreeMap, VecDeque};
use alloc::format;
use core::time::Duration;

use super::frame::{Frame, Layout};
use super::scan::ScanTelegram;
use super::segment::Segment;
use super::segment_counts::SegmentCounts;
use crate::uptime::Uptime;
use crate::validity::ScanFault;
use crate::window::{REMEMBERED, Window};

/// A telegram may be overtaken by so many others.
pub const REORDER: u64 = 4;
/// Turns that are waited for at once.
pub const MAX_OPEN: usize = 4;
/// Turns that one telegram may stand for: the scanner's interval filter sends every 50th at least.
const MAX_INTERVAL: u64 = 50;

/// Puts segments together.
#[derive(Clone, Debug, Default)]
pub struct Assembler {
    /// By the turn's number.
    open: BTreeMap<u64, Open>,
    ready: VecDeque<Result<Frame, ScanFault>>,
    /// What came last, to compare with what comes again.
    remembered: VecDeque<Remembered>,
    window: Option<Window>,
    closed: Option<Closed>,
    layout: Layout,
    /// Turns from one that is sent to the next.
    interval: Option<u64>,
    counts: SegmentCounts,
    /// The turn that had begun when the stream ended.
    unfinished: Option<u64>,
    /// Lost before the counter began anew.
    lost_before: u64,
    /// The counter began anew, and no turn has been given since.
    begins_anew: bool,
    uptime: Uptime,
    /// When the newest telegram was sent, by the scanner's clock, µs.
    sent_us: u64,
}

/// A telegram that has come.
#[derive(Clone, Copy, Debug)]
struct Remembered {
    counter: u64,
    turn: u64,
    digest: u64,
    /// One with other contents has come.
    contradicted: bool,
}

/// A turn whose segments are coming.
#[derive(Clone, Debug)]
struct Open {
    segments: BTreeMap<u64, Segment>,
    /// One of its segments that came with two contents.
    contradicted: Option<u64>,
    /// Its least and its greatest telegram counter.
    counters: [u64; 2],
}

/// The turn that was closed last.
#[derive(Clone, Copy, Debug)]
struct Closed {
    number: u64,
    /// The counter of its first line.
    counter: u16,
    lines: u16,
    /// Its greatest telegram counter.
    last: u64,
    /// It gave no scan, because a segment of it came with two contents.
    contradicted: bool,
}

impl Assembler {
    /// Takes the next telegram, received at this time of any epoch, if that is known.
    ///
    /// # Errors
    /// It is no segment that a scan can be made of; see [`Segment::of`].
    pub fn push(&mut self, telegram: ScanTelegram, received: Option<Duration>) -> Result<(), ScanFault> {
        let segment = Segment::of(telegram)?;
        let was_off = self.was_off(&segment, received);
        if was_off || self.begins_anew(&segment) {
            // What went on meanwhile is told by counters that go on; those that go back tell of a restart.
            let went_back = |newest: u64| segment.telegram_counter < newest;
            let restarted = was_off || self.window.as_ref().map(Window::newest).is_some_and(went_back);
            self.close_all();
            self.lost_before += self.window.take().map_or(0, |window| window.missing());
            self.closed = None;
            self.begins_anew |= restarted;
        }
        self.note_time(&segment, received);
        let window = self.window.get_or_insert_with(|| Window::new(segment.telegram_counter));
        if window.has_seen(segment.telegram_counter) {
            self.counts.repeated += 1;
            return self.compare(&segment);
        }
        if self.closed.is_some_and(|closed| segment.frame_number <= closed.number) {
            // Too late: it stays lost.
            return Ok(());
        }
        window.take(segment.telegram_counter);
        self.remember(&segment);
        self.insert(segment)?;
        self.close_passed();
        Ok(())
    }

    /// No more telegrams will come. The last turn is given if its last segment is there, or if it is the only one.
    pub fn finish(&mut self) {
        self.close_all();
    }

    /// The next turn, in the order of their numbers; of one that gives no scan, why.
    pub fn next_frame(&mut self) -> Option<Result<Frame, ScanFault>> {
        self.ready.pop_front()
    }

    /// The number of the turn that had begun when the stream ended, and was not given.
    pub fn unfinished(&self) -> Option<u64> {
        self.unfinished
    }

    /// What became of segments so far. Those that may still come late count as lost until they do.
    pub fn counts(&self) -> SegmentCounts {
        let missing = self.window.as_ref().map_or(0, Window::missing);
        SegmentCounts { lost: self.lost_before + missing, ..self.counts }
    }

    /// True if the scanner was off, and its counters happen to stand beyond where they stood: its clock has gone on by less than the host's.
    fn was_off(&self, segment: &Segment, received: Option<Duration>) -> bool {
        let ahead = self.window.as_ref().map(|window| window.ahead(segment.telegram_counter));
        // The next one may have waited on its way.
        ahead.is_some_and(|ahead| ahead != Ok(1))
            && self.uptime.is_too_short(received, self.passed_s(segment))
    }

    /// The scanner's time since the newest telegram, seconds.
    fn passed_s(&self, segment: &Segment) -> f64 {
        segment.transmit_time_us.saturating_sub(self.sent_us) as f64 * 1e-6
    }

    fn note_time(&mut self, segment: &Segment, received: Option<Duration>) {
        let ahead = self.window.as_ref().map(|window| window.ahead(segment.telegram_counter));
        let passed_s = (ahead == Some(Ok(1))).then(|| self.passed_s(segment));
        self.uptime.take(received, passed_s);
        if ahead != Some(Ok(0)) {
            self.sent_us = segment.transmit_time_us;
        }
    }

    /// True if counters tell of another stream: the scanner has restarted, or its numbers are no continuation.
    fn begins_anew(&self, segment: &Segment) -> bool {
        let Some(window) = &self.window else { return false };
        let newest = self.open.keys().next_back().copied().or(self.closed.map(|closed| closed.number));
        match window.ahead(segment.telegram_counter) {
            Err(_far) => true,
            Ok(0) => false,
            // Later telegrams are of the same turn or of later ones.
            Ok(ahead) => newest.is_some_and(|newest| {
                let most = newest.saturating_add(ahead.saturating_mul(MAX_INTERVAL));
                !(newest..=most).contains(&segment.frame_number)
            }),
        }
    }

    fn remember(&mut self, segment: &Segment) {
        self.remembered.truncate(REMEMBERED as usize - 1);
        self.remembered.push_front(Remembered {
            counter: segment.telegram_counter,
            turn: segment.frame_number,
            digest: segment.digest(),
            contradicted: false,
        });
    }

    /// Compares a telegram that has come before with the first one of its counter.
    ///
    /// # Errors
    /// They say different things, and the turn has been given.
    fn compare(&mut self, segment: &Segment) -> Result<(), ScanFault> {
        let counter = segment.telegram_counter;
        let first = self.remembered.iter_mut().find(|first| first.counter == counter);
        let Some(first) = first.filter(|first| first.digest != segment.digest() && !first.contradicted)
        else {
            return Ok(());
        };
        first.contradicted = true;
        let turn = first.turn;
        self.contradict(segment, [turn, segment.frame_number])
    }

    /// A segment of one of these turns came with two contents.
    fn contradict(&mut self, segment: &Segment, turns: [u64; 2]) -> Result<(), ScanFault> {
        self.counts.contradicted += 1;
        let mut is_open = false;
        for turn in turns {
            if let Some(open) = self.open.get_mut(&turn) {
                open.contradicted.get_or_insert(segment.number);
                is_open = true;
            }
        }
        let is_told = self.closed.is_some_and(|closed| closed.contradicted && turns.contains(&closed.number));
        if is_open || is_told {
            return Ok(());
        }
        Err(ScanFault::Contradicted { segment: segment.number, turn: segment.frame_number })
    }

    fn insert(&mut self, segment: Segment) -> Result<(), ScanFault> {
        let counter = segment.telegram_counter;
        let open = self.open.entry(segment.frame_number).or_insert_with(|| Open {
            segments: BTreeMap::new(),
            contradicted: None,
            counters: [counter, counter],
        });
        if open.segments.contains_key(&segment.number) {
            // Counted as two by the scanner.
            self.counts.repeated += 1;
            let turn = segment.frame_number;
            return self.contradict(&segment, [turn, turn]);
        }
        if !open.has_room_for(&segment) {
            return Err(ScanFault::Fields {
                reason: format!(
                    "segment {} of turn {} does not fit the other segments of it",
                    segment.number, segment.frame_number
                ),
            });
        }
        open.counters = [open.counters[0].min(counter), open.counters[1].max(counter)];
        open.segments.insert(segment.number, segment);
        self.counts.taken += 1;
        Ok(())
    }

    /// Closes turns, the oldest first, of which nothing more will come.
    fn close_passed(&mut self) {
        while let Some((&number, oldest)) = self.open.first_key_value() {
            let behind: usize = self.open.values().skip(1).map(|open| open.segments.len()).sum();
            let is_passed = behind as u64 > REORDER;
            let is_whole = self.layout.is_all(&oldest.segments) && self.follows(oldest);
            if !is_whole && !is_passed && self.open.len() <= MAX_OPEN {
                break;
            }
            self.close(number);
        }
    }

    fn close_all(&mut self) {
        while let Some((&number, oldest)) = self.open.first_key_value() {
            let is_over = self.layout.last().is_none_or(|last| oldest.segments.contains_key(&last));
            if self.open.len() == 1 && !is_over {
                self.counts.cut += oldest.segments.len() as u64;
                self.unfinished = Some(number);
                self.open.clear();
                return;
            }
            self.close(number);
        }
    }

    /// True if no telegram is missing between the turn that was closed last and this one.
    fn follows(&self, open: &Open) -> bool {
        self.closed.is_none_or(|closed| closed.last.checked_add(1) == Some(open.counters[0]))
    }

    fn close(&mut self, number: u64) {
        let Some(open) = self.open.remove(&number) else { return };
        let follows = self.follows(&open);
        let [first, last] = open.counters;
        let is_unbroken = follows && (last - first).checked_add(1) == Some(open.segments.len() as u64);
        let is_ended = self.open.first_key_value().is_some_and(|(_, next)| next.counters[0] == last + 1);
        let found = Layout::of(&open.segments);
        if let (Some(closed), true) = (self.closed, follows) {
            self.interval = Some(number - closed.number);
        }
        let turns = self.closed.map(|closed| (number - closed.number) / self.interval.unwrap_or(1).max(1));
        // A turn is a scan a line.
        let lines = open.segments.values().next().map_or(0, |segment| segment.lines.len()) as u16;
        let counter = match (self.closed, turns) {
            (Some(closed), Some(turns)) => {
                let between = (turns.max(1) as u16).wrapping_sub(1).wrapping_mul(lines);
                closed.counter.wrapping_add(closed.lines).wrapping_add(between)
            }
            _ => (number as u16).wrapping_mul(lines),
        };
        let is_cut = self.closed.is_none() && !open.segments.contains_key(&0);
        let contradicted = open.contradicted.is_some();
        self.closed = Some(Closed { number, counter, lines, last, contradicted });
        if is_cut {
            self.counts.cut += open.segments.len() as u64;
            return;
        }
        if let Some(segment) = open.contradicted {
            self.ready.push_back(Err(ScanFault::Contradicted { segment, turn: number }));
            return;
        }
        // Segments that the scanner's filter hides are not sent: where nothing is missing, these are all there are.
        self.layout = if is_unbroken && is_ended { found.whole() } else { self.layout.and(found) };
        let lines = self.layout.beams();
        let begins_anew = core::mem::take(&mut self.begins_anew);
        self.ready.push_back(Ok(Frame { number, counter, begins_anew, segments: open.segments, lines }));
    }
}

impl Open {
    /// True if the segment is of the same grids as the others and lies between its neighbours.
    fn has_room_for(&self, segment: &Segment) -> bool {
        let before = self.segments.range(..segment.number).next_back();
        let after = self.segments.range(segment.number..).next();
        before.is_none_or(|(_, other)| segment.comes_behind(other))
            && after.is_none_or(|(_, other)| other.comes_behind(segment))
    }
}
