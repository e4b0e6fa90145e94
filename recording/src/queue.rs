//! The bounded queue between the taps of a recorder and its thread.

use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::tap::{Tap, Taps};
use crate::wall_clock::WallClock;
use crate::writer::About;
use crate::{Side, StreamKind};

/// Packets that may wait for the writer; at 50 Hz twenty seconds of one scanner.
const ROOM: usize = 1024;

/// What the recorder's thread takes in.
#[derive(Debug)]
pub(crate) enum Item {
    Open { stream: u32, name: String, kind: StreamKind },
    About(Box<About>),
    Packet { stream: u32, from: Side, at_ns: u64, lost_before: u32, bytes: Vec<u8> },
}

/// The end of the queue that the taps of one recorder share.
#[derive(Debug)]
pub(crate) struct Queue {
    /// None once it is closed. Held from the reading of the clock until the packet is queued, so that no packet overtakes an earlier one: readers of
    /// bags refuse a file without chunks whose times go back.
    items: Mutex<Option<SyncSender<Item>>>,
    clock: WallClock,
    /// Wait for room in the queue instead of losing packets.
    waits: bool,
    lost: AtomicU64,
    names: Mutex<Vec<String>>,
    next: AtomicU32,
}

impl Queue {
    /// A queue, and its other end. If it is full packets are lost and counted, unless it `waits`.
    pub(crate) fn new(clock: WallClock, waits: bool) -> (Arc<Self>, Receiver<Item>) {
        let (sender, items) = sync_channel(ROOM);
        let queue = Self {
            items: Mutex::new(Some(sender)),
            clock,
            waits,
            lost: AtomicU64::new(0),
            names: Mutex::default(),
            next: AtomicU32::new(0),
        };
        (Arc::new(queue), items)
    }

    /// Taps that send copies through the queue.
    pub(crate) fn taps(self: &Arc<Self>) -> Taps {
        let queue = Arc::clone(self);
        Taps::new(move |name, kind| queue.open(name, kind))
    }

    /// Nothing more is queued: what comes now comes after the recording, and is not lost.
    pub(crate) fn close(&self) {
        self.items().take();
    }

    /// What the recording says of itself from here on. A recorder that has ended says no more.
    pub(crate) fn describe(&self, about: About) {
        if let Some(items) = self.items().as_ref() {
            // It has failed, and that was told.
            let _ = items.send(Item::About(Box::new(about)));
        }
    }

    /// Packets lost so far.
    pub(crate) fn lost(&self) -> u64 {
        self.lost.load(Ordering::Relaxed)
    }

    fn items(&self) -> MutexGuard<'_, Option<SyncSender<Item>>> {
        self.items.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn open(self: &Arc<Self>, name: &str, kind: StreamKind) -> Tap {
        let name = self.free_name(name);
        let stream = self.next.fetch_add(1, Ordering::Relaxed);
        // Rare, and nothing of the stream can be kept without it: worth waiting for.
        let open = Item::Open { stream, name, kind };
        if self.items().as_ref().is_none_or(|items| items.send(open).is_err()) {
            return Tap::default();
        }
        let queue = Arc::clone(self);
        // Packets lost since the last one that was kept.
        let lost = AtomicU32::new(0);
        Tap::new(move |from, bytes| queue.record(stream, &lost, from, bytes))
    }

    /// The name, with a number behind it if it is taken.
    fn free_name(&self, name: &str) -> String {
        let mut names = self.names.lock().unwrap_or_else(PoisonError::into_inner);
        let is_free = |names: &[String], name: &str| names.iter().all(|taken| taken != name);
        let mut free = name.to_owned();
        let mut number = 2;
        while !is_free(&names, &free) {
            free = format!("{name}-{number}");
            number += 1;
        }
        names.push(free.clone());
        free
    }

    fn record(&self, stream: u32, lost: &AtomicU32, from: Side, bytes: &[u8]) {
        let lost_before = lost.swap(0, Ordering::Relaxed);
        let bytes = bytes.to_vec();
        let items = self.items();
        let Some(items) = items.as_ref() else { return };
        let item = Item::Packet { stream, from, at_ns: self.clock.now_ns(), lost_before, bytes };
        // A recorder that has failed keeps nothing either.
        let kept =
            if self.waits { items.send(item).map_err(TrySendError::from) } else { items.try_send(item) };
        if kept.is_err() {
            lost.fetch_add(lost_before.saturating_add(1), Ordering::Relaxed);
            self.lost.fetch_add(1, Ordering::Relaxed);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::thread;
    use std::time::Duration;

    use super::*;

    #[test]
    fn packets_of_many_threads_are_queued_in_the_order_of_their_times() {
        // A thread that has read this clock is often overtaken by another before it goes on.
        let now_ns = AtomicU64::new(0);
        let clock = WallClock::new(move || {
            let read = now_ns.fetch_add(1, Ordering::SeqCst);
            thread::sleep(Duration::from_micros(read % 3 * 50));
            read
        });
        let (queue, items) = Queue::new(clock, true);
        thread::scope(|scope| {
            for _ in 0..4 {
                let tap = queue.taps().open("scanner", StreamKind::Bytes);
                scope.spawn(move || (0..50).for_each(|_| tap.record(Side::Device, b"x")));
            }
        });
        queue.close();
        let times: Vec<u64> = items
            .iter()
            .filter_map(|item| match item {
                Item::Packet { at_ns, .. } => Some(at_ns),
                _ => None,
            })
            .collect();
        assert_eq!(times, (0..200).collect::<Vec<_>>());
    }

    #[test]
    fn what_does_not_fit_is_lost_and_what_comes_after_the_end_is_not() {
        let (queue, items) = Queue::new(WallClock::new(|| 0), false);
        let tap = queue.taps().open("scanner", StreamKind::Bytes);
        // The stream itself takes a place.
        (0..ROOM + 4).for_each(|_| tap.record(Side::Device, b"x"));
        assert_eq!(queue.lost(), 5);
        assert_eq!(items.try_iter().count(), ROOM);
        tap.record(Side::Device, b"y");
        let after = items.try_recv();
        assert!(matches!(after, Ok(Item::Packet { lost_before: 5, .. })), "{after:?}");
        queue.close();
        tap.record(Side::Device, b"z");
        assert!(items.recv().is_err());
        assert_eq!(queue.lost(), 5);
    }
}
