//! Who is connected, and who wants scans.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use bytes::Bytes;
use rowscan_protocol::device::{DeviceEvent as Event, Session, Subscriptions};
use rowscan_protocol::frame::Dialect;
use std::time::Duration;

use tokio::sync::{Notify, mpsc};

use rowscan_ports::Delivery;
use rowscan_ports::clock::Stopwatch;
use rowscan_ports::in_flight::Pending;

/// Scan telegrams a client may lag behind where time waits for it: the clock is to stay near.
const PATIENT_QUEUE: usize = 2;
/// Scan telegrams a client may lag behind; at 50 Hz a little over a second.
pub(crate) const QUEUE: usize = 64;

/// The connected clients of one scanner.
#[derive(Debug)]
pub(crate) struct Roster {
    members: Mutex<Vec<Arc<Member>>>,
    limit: usize,
    /// Telegrams that wait for a client at most.
    queue: usize,
    /// In a full house, who is idle for longer makes room.
    idle_limit: Duration,
    next: AtomicU64,
    watch: Stopwatch,
}

/// Why a client was turned out of a full house.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum TurnedOut {
    /// It never sent a valid telegram.
    Silent,
    /// Nothing passed for so long.
    Idle(Duration),
}

/// A client taken in.
#[derive(Debug)]
pub(crate) struct Joined {
    pub(crate) member: Arc<Member>,
    /// Its scans come through here.
    pub(crate) scans: mpsc::Receiver<QueuedTelegram>,
    /// Who made room for it.
    pub(crate) instead_of: Option<(Arc<Member>, TurnedOut)>,
}

/// One connected client, as the mirror sees it.
#[derive(Debug)]
pub(crate) struct Member {
    id: u64,
    queue: mpsc::Sender<QueuedTelegram>,
    /// What is wanted of the scans, if anything.
    wants: Mutex<Option<Wants>>,
    /// Who it is, for messages.
    peer: String,
    /// It has sent at least one valid telegram.
    spoke: AtomicBool,
    /// When bytes last passed in either direction, ms on the roster's watch.
    passed_ms: AtomicU64,
    /// Something is being written to it.
    writing: AtomicBool,
    /// It is turned out: what it still asks is not answered.
    is_out: AtomicBool,
    /// Notified to turn this client out.
    leave: Notify,
}

/// What a client wants of what the scanner sends by itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Wants {
    pub(crate) dialect: Dialect,
    pub(crate) subscriptions: Subscriptions,
}

/// One telegram on its way to a client.
#[derive(Clone, Debug)]
pub(crate) struct QueuedTelegram {
    /// What it tells; none if it goes to everyone.
    pub(crate) event: Option<Event>,
    pub(crate) frame: Bytes,
    /// Kept until it is written, or is not wanted any more.
    pub(crate) pending: Pending,
}

impl Wants {
    /// What `session` has subscribed to.
    pub(crate) fn of(session: &Session) -> Option<Self> {
        let subscriptions = session.subscriptions();
        (!subscriptions.is_empty()).then(|| Self { dialect: session.dialect(), subscriptions })
    }

    /// No event by name: what a client of a verbatim replay wants.
    pub(crate) fn no_events() -> Self {
        Self { dialect: Dialect::B, subscriptions: Subscriptions::default() }
    }

    /// Every scan, as LMDscandata.
    pub(crate) fn scans(&self) -> bool {
        self.subscriptions.has(Event::ScanData)
    }

    /// Every scan, as LMDscandatamon.
    pub(crate) fn monitor(&self) -> bool {
        self.subscriptions.has(Event::Monitor)
    }

    /// Scans under either name.
    pub(crate) fn takes_scans(&self) -> bool {
        self.scans() || self.monitor()
    }
}

impl Roster {
    pub(crate) fn new(limit: usize, idle_limit: Duration, delivery: Delivery) -> Self {
        let (members, next) = (Mutex::default(), AtomicU64::new(0));
        let queue = if delivery.is_patient() { PATIENT_QUEUE } else { QUEUE };
        Self { members, limit: limit.max(1), queue, idle_limit, next, watch: Stopwatch::start() }
    }

    /// Takes a client in. When the house is full, the client that has been connected longest without a single valid telegram is turned
    /// out; if all have spoken, the one that is idle longest, beyond the limit; if none is, the newcomer is refused.
    pub(crate) fn join(&self, peer: String) -> Option<Joined> {
        let mut members = self.lock();
        let mut instead_of = None;
        if members.len() >= self.limit {
            let (index, why) = self.dispensable(&members)?;
            let member = members.remove(index);
            member.is_out.store(true, Ordering::Release);
            member.leave.notify_one();
            instead_of = Some((member, why));
        }
        let (queue, scans) = mpsc::channel(self.queue);
        let member = Arc::new(Member {
            id: self.next.fetch_add(1, Ordering::Relaxed),
            queue,
            wants: Mutex::new(None),
            peer,
            spoke: AtomicBool::new(false),
            passed_ms: AtomicU64::new(self.now_ms()),
            writing: AtomicBool::new(false),
            is_out: AtomicBool::new(false),
            leave: Notify::new(),
        });
        members.push(Arc::clone(&member));
        Some(Joined { member, scans, instead_of })
    }

    /// Who may go.
    fn dispensable(&self, members: &[Arc<Member>]) -> Option<(usize, TurnedOut)> {
        if let Some(silent) = members.iter().position(|member| !member.spoke.load(Ordering::Relaxed)) {
            return Some((silent, TurnedOut::Silent));
        }
        let now_ms = self.now_ms();
        let idle = |(index, member): (usize, &Arc<Member>)| Some((index, member.idle(now_ms)?));
        let longest = members.iter().enumerate().filter_map(idle).max_by_key(|(_, idle)| *idle);
        longest
            .filter(|(_, idle)| *idle >= self.idle_limit)
            .map(|(index, idle)| (index, TurnedOut::Idle(idle)))
    }

    /// Clients connected.
    pub(crate) fn size(&self) -> usize {
        self.lock().len()
    }

    /// Clients at most.
    pub(crate) fn limit(&self) -> usize {
        self.limit
    }

    /// Bytes pass between a client and the scanner.
    pub(crate) fn passes(&self, member: &Member) {
        member.passed_ms.store(self.now_ms(), Ordering::Relaxed);
    }

    /// Something is being written to a client, or has been.
    pub(crate) fn writes(&self, member: &Member, writing: bool) {
        member.writing.store(writing, Ordering::Relaxed);
        self.passes(member);
    }

    fn now_ms(&self) -> u64 {
        u64::try_from(self.watch.elapsed().as_millis()).unwrap_or(u64::MAX)
    }

    pub(crate) fn leave(&self, member: &Member) {
        self.lock().retain(|other| other.id != member.id);
    }

    /// The clients that want scans now, with what each wants.
    pub(crate) fn audience(&self, out: &mut Vec<(Arc<Member>, Wants)>) {
        self.listeners(out);
        out.retain(|(_, wants)| wants.takes_scans());
    }

    /// Whether anybody wants scans now.
    pub(crate) fn has_audience(&self) -> bool {
        self.lock().iter().any(|member| member.wants().is_some_and(|wants| wants.takes_scans()))
    }

    /// The clients that want anything, with what each wants.
    pub(crate) fn listeners(&self, out: &mut Vec<(Arc<Member>, Wants)>) {
        out.clear();
        out.extend(
            self.lock().iter().filter_map(|member| member.wants().map(|wants| (Arc::clone(member), wants))),
        );
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, Vec<Arc<Member>>> {
        self.members.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Member {
    pub(crate) fn wants(&self) -> Option<Wants> {
        *self.wants.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Says what is wanted of the scans.
    pub(crate) fn set_wants(&self, wants: Option<Wants>) {
        *self.wants.lock().unwrap_or_else(PoisonError::into_inner) = wants;
    }

    /// How long nothing has passed; none for one that waits for scans and takes what comes.
    fn idle(&self, now_ms: u64) -> Option<Duration> {
        let waits = self.wants().is_some() && !self.writing.load(Ordering::Relaxed);
        let passed_ms = self.passed_ms.load(Ordering::Relaxed);
        (!waits).then(|| Duration::from_millis(now_ms.saturating_sub(passed_ms)))
    }

    /// Who it is, for messages.
    pub(crate) fn peer(&self) -> &str {
        &self.peer
    }

    pub(crate) fn has_spoken(&self) {
        self.spoke.store(true, Ordering::Relaxed);
    }

    /// Whether this client is turned out. Its task may be busy, and not have been notified yet.
    pub(crate) fn is_out(&self) -> bool {
        self.is_out.load(Ordering::Acquire)
    }

    /// Resolves when this client is turned out.
    pub(crate) async fn turned_out(&self) {
        self.leave.notified().await;
    }

    pub(crate) fn queue(&self) -> &mpsc::Sender<QueuedTelegram> {
        &self.queue
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tokio::time::advance;

    const LIMIT: Duration = Duration::from_secs(60);

    fn join(roster: &Roster) -> (Joined, Option<TurnedOut>) {
        let joined = roster.join("a client".to_owned()).expect("room");
        let why = joined.instead_of.as_ref().map(|(_, why)| *why);
        (joined, why)
    }

    #[tokio::test(start_paused = true)]
    async fn a_full_house_turns_out_the_longest_silent_client_and_no_other() {
        let roster = Roster::new(2, LIMIT, Delivery::Paced);
        let (speaker, _) = join(&roster);
        speaker.member.has_spoken();
        let (silent, _) = join(&roster);
        let (newcomer, why) = join(&roster);
        assert_eq!(why, Some(TurnedOut::Silent));
        let ids: Vec<u64> = roster.lock().iter().map(|member| member.id).collect();
        assert_eq!(ids, [speaker.member.id, newcomer.member.id]);
        assert!(!ids.contains(&silent.member.id));
        assert!(silent.member.is_out() && !speaker.member.is_out() && !newcomer.member.is_out());
        newcomer.member.has_spoken();
        assert!(
            roster.join(String::new()).is_none(),
            "all have spoken, and none is idle: the newcomer is refused"
        );
    }

    #[tokio::test(start_paused = true)]
    async fn clients_that_spoke_once_make_room_after_the_limit_and_takers_of_scans_do_not() {
        let roster = Roster::new(3, LIMIT, Delivery::Paced);
        let all = [join(&roster).0, join(&roster).0, join(&roster).0];
        all.iter().for_each(|joined| joined.member.has_spoken());
        let [taker, stuck, asker] = &all;
        let wants = Wants { dialect: Dialect::B, subscriptions: Subscriptions::default() };
        taker.member.set_wants(Some(wants));
        stuck.member.set_wants(Some(wants));
        advance(LIMIT / 2).await;
        // Its machine does not read: the write never ends.
        roster.writes(&stuck.member, true);
        advance(LIMIT / 2).await;
        roster.passes(&asker.member);
        assert!(roster.join(String::new()).is_none());
        advance(LIMIT / 2).await;
        let (next, why) = join(&roster);
        assert_eq!(why, Some(TurnedOut::Idle(LIMIT)));
        assert_eq!(next.instead_of.expect("somebody").0.id, stuck.member.id);
        next.member.has_spoken();
        advance(LIMIT / 2).await;
        let (next, _) = join(&roster);
        assert_eq!(next.instead_of.expect("somebody").0.id, asker.member.id);
        next.member.has_spoken();
        advance(LIMIT * 100).await;
        roster.lock().iter().for_each(|member| roster.passes(member));
        assert!(roster.join(String::new()).is_none(), "who waits for scans stays");
    }
}
