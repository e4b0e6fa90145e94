//! Who is connected, and who wants scans.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use bytes::Bytes;
use rowscan_protocol::device::{DeviceEvent as Event, Session, Subscriptions};
use rowscan_protocol::frame::Dialect;
use tokio::sync::{Notify, mpsc};

use rowscan_ports::in_flight::Pending;

/// Scan telegrams a client may lag behind; at 50 Hz a little over a second.
pub(crate) const QUEUE: usize = 64;

/// The connected clients of one scanner.
#[derive(Debug)]
pub(crate) struct Roster {
    members: Mutex<Vec<Arc<Member>>>,
    limit: usize,
    next: AtomicU64,
}

/// One connected client, as the mirror sees it.
#[derive(Debug)]
pub(crate) struct Member {
    id: u64,
    queue: mpsc::Sender<QueuedTelegram>,
    /// What is wanted of the scans, if anything.
    wants: Mutex<Option<Wants>>,
    /// It has sent at least one valid telegram.
    spoke: AtomicBool,
    /// Rung to turn this client out.
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
    pub(crate) fn new(limit: usize) -> Self {
        Self { members: Mutex::default(), limit: limit.max(1), next: AtomicU64::new(0) }
    }

    /// Takes a client in, with the queue its scans will come through. When the house is full, the client that has been
    /// connected longest without a single valid telegram is turned out; if all have spoken, the newcomer is refused.
    pub(crate) fn join(&self) -> Option<(Arc<Member>, mpsc::Receiver<QueuedTelegram>)> {
        let mut members = self.lock();
        if members.len() >= self.limit {
            let silent = members.iter().position(|member| !member.spoke.load(Ordering::Relaxed))?;
            members.remove(silent).leave.notify_one();
        }
        let (queue, scans) = mpsc::channel(QUEUE);
        let member = Arc::new(Member {
            id: self.next.fetch_add(1, Ordering::Relaxed),
            queue,
            wants: Mutex::new(None),
            spoke: AtomicBool::new(false),
            leave: Notify::new(),
        });
        members.push(Arc::clone(&member));
        Some((member, scans))
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

    pub(crate) fn has_spoken(&self) {
        self.spoke.store(true, Ordering::Relaxed);
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

    #[test]
    fn a_full_house_turns_out_the_longest_silent_client_and_no_other() {
        let roster = Roster::new(2);
        let (speaker, _a) = roster.join().expect("room");
        speaker.has_spoken();
        let (silent, _b) = roster.join().expect("room");
        let (newcomer, _c) = roster.join().expect("the silent one goes");
        let ids: Vec<u64> = roster.lock().iter().map(|member| member.id).collect();
        assert_eq!(ids, [speaker.id, newcomer.id]);
        assert!(!ids.contains(&silent.id));
        newcomer.has_spoken();
        assert!(roster.join().is_none(), "all have spoken: the newcomer is refused");
    }
}
