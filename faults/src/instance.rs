//! One fault on one stream: waiting, active or done.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use rowscan_protocol::random::{Stream, mix};

use crate::event::Direction;
use crate::fault::{Action, Cut, Layer};
use crate::spec::FaultSpec;
use crate::when::{At, Lasts};

/// First word of the key of every random stream here.
const PURPOSE: u64 = 0xFA17;

/// When faults began (`false`) and ended (`true`) first, by id.
pub(crate) type Happened = BTreeMap<(String, bool), Duration>;

/// Where the tractor is, as far as it is known.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Place {
    pub(crate) row_m: Option<f64>,
    pub(crate) tree: Option<u32>,
}

#[derive(Debug)]
pub(crate) struct Instance {
    pub(crate) id: String,
    pub(crate) spec: Arc<FaultSpec>,
    pub(crate) action: Action,
    /// Number of its stream.
    pub(crate) stream: usize,
    pub(crate) phase: Phase,
    /// What its part knows the present window by.
    pub(crate) order: u64,
    /// When its beginning was last foretold.
    pub(crate) foretold: Option<Duration>,
    /// Of its random streams.
    key: u64,
    seed: u64,
    /// Events drawn so far.
    event: u64,
    /// Times it has begun, or its probability said no.
    pub(crate) windows: u64,
    /// Times it has begun.
    begun: u64,
    /// Telegrams and connections it has chosen to act on: what `count` limits.
    acts: u64,
    /// Of these, tries on which it could not act.
    skipped: u64,
    /// Telegrams it has acted on because of those.
    further: u64,
    window_acts: u64,
    /// Telegrams still to be lost behind one it has chosen.
    pub(crate) trails: Vec<Trail>,
    /// It does not begin before.
    not_before: Duration,
    last_begin: Duration,
    /// Scans of the stream when it last began.
    scans_at_begin: u64,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Phase {
    Waiting,
    Active(Window),
    Done,
}

/// Telegrams of one connection that are still to be lost.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Trail {
    pub(crate) connection: u64,
    pub(crate) left: u32,
    /// The window ends with the last of them.
    pub(crate) ends: bool,
}

/// A time in which it acts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Window {
    pub(crate) began: Duration,
    /// The one connection it is about, if a scan of that began it.
    pub(crate) connection: Option<u64>,
    /// Ends after so many more scans.
    pub(crate) scans_left: Option<u64>,
}

/// What a wait is for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Due {
    /// This instant.
    At(Duration),
    /// A connection's scan of this number.
    Scan(u64),
    /// So many scans of the stream since it last began.
    ScansSince(u64),
    /// A client sends what the script names.
    Command,
    /// The tractor's place; true if it has come there.
    Row(bool),
    /// Nothing yet known.
    Unknown,
}

impl Instance {
    pub(crate) fn new(
        (id, spec, action): (String, Arc<FaultSpec>, Action),
        (stream, stream_name): (usize, &str),
        seed: u64,
        now: Duration,
    ) -> Self {
        let fold = |key: u64, text: &str| text.bytes().fold(mix(key), |key, byte| mix(key ^ u64::from(byte)));
        let key = fold(fold(0, &id), stream_name);
        Self {
            id,
            spec,
            action,
            stream,
            phase: Phase::Waiting,
            order: 0,
            foretold: None,
            key,
            seed,
            event: 0,
            windows: 0,
            begun: 0,
            acts: 0,
            skipped: 0,
            further: 0,
            window_acts: 0,
            trails: Vec::new(),
            not_before: now,
            last_begin: now,
            scans_at_begin: 0,
        }
    }

    /// The next event's dice; none where its probability says no.
    pub(crate) fn draw(&mut self) -> Option<Stream> {
        let mut dice = Stream::keyed(self.seed, &[PURPOSE, self.key, self.event]);
        self.event += 1;
        let hit = dice.unit() < self.spec.p.unwrap_or(1.0);
        hit.then_some(dice)
    }

    /// True if every telegram or piece draws for itself; else each window does.
    pub(crate) fn draws_each(&self) -> bool {
        matches!(self.spec.fault.layer, Layer::Telegram | Layer::Accept)
            || matches!(self.action, Action::Piece(_))
            || matches!(&self.action, Action::Part(fault) if fault.draws_each())
    }

    /// What it waits for to begin.
    pub(crate) fn begins(&self, happened: &Happened, place: Place) -> Due {
        let due = match (self.windows, self.spec.every) {
            (0, _) => due(&self.spec.at, happened, place),
            (_, Some(Lasts::Time(period))) => Due::At(self.last_begin.saturating_add(period)),
            (_, Some(Lasts::Scans(scans))) => Due::ScansSince(scans),
            (_, None) => Due::Unknown,
        };
        match due {
            Due::At(at) => Due::At(at.max(self.not_before)),
            other => other,
        }
    }

    /// What an active one waits for to end.
    pub(crate) fn ends(&self, happened: &Happened, place: Place) -> Due {
        let Phase::Active(window) = self.phase else { return Due::Unknown };
        match (&self.spec.until, self.spec.lasts) {
            (Some(At::Start), _) => Due::At(window.began),
            (Some(until), _) => match due(until, happened, place) {
                Due::At(at) => Due::At(at.max(window.began)),
                other => other,
            },
            (None, Some(Lasts::Time(time))) => Due::At(window.began.saturating_add(time)),
            (None, Some(Lasts::Scans(_))) => Due::Unknown,
            (None, None) => match &self.action {
                Action::Part(fault) => {
                    fault.lasts().map_or(Due::Unknown, |time| Due::At(window.began.saturating_add(time)))
                }
                _ => Due::Unknown,
            },
        }
    }

    /// Begins; false if its probability says no.
    pub(crate) fn begin(&mut self, at: Duration, connection: Option<u64>, stream_scans: u64) -> bool {
        self.windows += 1;
        self.last_begin = at;
        self.scans_at_begin = stream_scans;
        self.window_acts = 0;
        if !self.draws_each() && self.draw().is_none() {
            self.rest(at);
            return false;
        }
        let scans_left = match self.spec.lasts {
            Some(Lasts::Scans(scans)) => Some(scans),
            _ => None,
        };
        self.phase = Phase::Active(Window { began: at, connection, scans_left });
        self.begun += 1;
        true
    }

    /// Is over for now, or for good.
    pub(crate) fn rest(&mut self, at: Duration) {
        let used = if self.counts_acts() { self.acts } else { self.windows };
        let is_spent = self.spec.count.is_some_and(|most| used >= most);
        self.trails.iter_mut().for_each(|trail| trail.ends = false);
        self.not_before = at;
        self.phase = if self.spec.every.is_some() && !is_spent { Phase::Waiting } else { Phase::Done };
    }

    /// What `count` counts: telegrams and connections, or else windows.
    fn counts_acts(&self) -> bool {
        matches!(self.spec.fault.layer, Layer::Telegram | Layer::Accept)
    }

    /// Telegrams or connections acted on so far; of a fault that acts on no single one, and of one that keeps connections from coming at all, how
    /// often it has begun.
    pub(crate) fn acted_on(&self) -> u64 {
        match (self.spec.fault.layer, self.acts - self.skipped + self.further) {
            (Layer::Telegram, acts) | (Layer::Accept, acts @ 1..) => acts,
            // A cut is of the connections that stood then.
            (Layer::Connection, acts) if self.is_instant() => acts,
            _ => self.begun,
        }
    }

    /// True if it only waits for its last telegrams to be lost.
    pub(crate) fn is_spent(&self) -> bool {
        self.trails.iter().any(|trail| trail.ends)
    }

    /// A telegram of this connection is lost behind one that it has chosen, if it is. Some(true): its window ends with it.
    pub(crate) fn loses(&mut self, connection: u64) -> Option<bool> {
        let place = self.trails.iter().position(|trail| trail.connection == connection)?;
        let trail = self.trails.get_mut(place)?;
        trail.left = trail.left.saturating_sub(1);
        let (is_last, ends) = (trail.left == 0, trail.ends);
        if is_last {
            self.trails.remove(place);
        }
        self.further += 1;
        Some(is_last && ends)
    }

    /// Notes a try, and whether it acted; true if it was the last of its window.
    pub(crate) fn tried(&mut self, acted: bool) -> bool {
        self.acts += 1;
        self.skipped += u64::from(!acted);
        self.window_acts += 1;
        if !self.counts_acts() {
            return false;
        }
        let single = self.spec.is_single() && self.spec.fault.layer == Layer::Telegram;
        let most = match (single, self.spec.every) {
            (true, Some(_)) => Some(1),
            (true, None) => Some(self.spec.count.unwrap_or(1)),
            (false, _) => None,
        };
        most.is_some_and(|most| self.window_acts >= most)
            || self.spec.count.is_some_and(|most| self.acts >= most)
    }

    /// It begins, or ends, no sooner.
    pub(crate) fn earliest(&self) -> Duration {
        match self.phase {
            Phase::Active(window) => window.began,
            Phase::Waiting | Phase::Done => self.not_before,
        }
    }

    /// The command that it waits for.
    pub(crate) fn awaits_command(&self) -> Option<&str> {
        let at = match self.phase {
            Phase::Waiting if self.windows == 0 => &self.spec.at,
            Phase::Active(_) => self.spec.until.as_ref()?,
            Phase::Waiting | Phase::Done => return None,
        };
        match at {
            At::Command(command) => Some(command),
            _ => None,
        }
    }

    /// Seed of what the window that has just begun draws.
    pub(crate) fn window_seed(&self) -> u64 {
        mix(self.seed ^ mix(self.key ^ self.event))
    }

    /// The window, if it is active on this connection.
    pub(crate) fn active(&self, stream: usize, connection: u64) -> Option<Window> {
        match self.phase {
            Phase::Active(window) if self.stream == stream => {
                window.connection.is_none_or(|only| only == connection).then_some(window)
            }
            _ => None,
        }
    }

    /// Whether it acts this way.
    pub(crate) fn goes(&self, direction: Direction) -> bool {
        self.spec.directions.contains(&direction)
    }

    /// True if so many scans of its stream have passed since it last began.
    pub(crate) fn scans_passed(&self, scans: u64, stream_scans: u64) -> bool {
        stream_scans.saturating_sub(self.scans_at_begin) >= scans
    }

    /// Over in the instant it begins.
    pub(crate) fn is_instant(&self) -> bool {
        matches!(self.action, Action::Cut(Cut::Reset | Cut::Finish | Cut::HalfClose))
    }
}

fn due(at: &At, happened: &Happened, place: Place) -> Due {
    match at {
        At::Start => Due::At(Duration::ZERO),
        At::Time(at) => Due::At(*at),
        At::Scan(scan) => Due::Scan(*scan),
        At::Command(_) => Due::Command,
        At::After { id, end, plus } => match happened.get(&(id.clone(), *end)) {
            Some(at) => Due::At(at.saturating_add(*plus)),
            None => Due::Unknown,
        },
        At::RowM(row_m) => Due::Row(place.row_m.is_some_and(|here| here >= *row_m)),
        At::Tree(tree) => Due::Row(place.tree.is_some_and(|here| here >= *tree)),
    }
}
