//! The bounded queue between the taps of a recorder and its thread.

use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};
use std::sync::mpsc::SyncSender;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::tap::{Tap, Taps};
use crate::wall_clock::WallClock;
use crate::{Side, StreamKind};

/// What the recorder's thread takes in.
#[derive(Debug)]
pub(crate) enum Item {
    Open { stream: u32, name: String, kind: StreamKind },
    Packet { stream: u32, from: Side, at_ns: u64, lost_before: u32, bytes: Vec<u8> },
    Finish,
}

/// What the taps of one recorder share.
struct Shared {
    /// Held from the reading of the clock until the packet is queued, so that no packet overtakes an earlier one: readers of bags
    /// refuse a file without chunks whose times go back.
    queue: Mutex<SyncSender<Item>>,
    clock: WallClock,
    /// Wait for room in the queue instead of losing packets.
    waits: bool,
    lost: Arc<AtomicU64>,
    names: Mutex<Vec<String>>,
    next: AtomicU32,
}

/// Taps that send copies through `queue`. If it is full they are lost and counted in `lost`, unless the recorder `waits`.
pub(crate) fn taps(queue: SyncSender<Item>, clock: WallClock, waits: bool, lost: Arc<AtomicU64>) -> Taps {
    let (queue, names) = (Mutex::new(queue), Mutex::default());
    let shared = Arc::new(Shared { queue, clock, waits, lost, names, next: AtomicU32::new(0) });
    Taps::new(move |name, kind| shared.open(name, kind))
}

impl Shared {
    fn open(self: &Arc<Self>, name: &str, kind: StreamKind) -> Tap {
        let name = self.free_name(name);
        let stream = self.next.fetch_add(1, Ordering::Relaxed);
        // Rare, and nothing of the stream can be kept without it: worth waiting for.
        if self.queue().send(Item::Open { stream, name, kind }).is_err() {
            return Tap::default();
        }
        let shared = Arc::clone(self);
        // Packets lost since the last one that was kept.
        let lost = AtomicU32::new(0);
        Tap::new(move |from, bytes| shared.record(stream, &lost, from, bytes))
    }

    fn queue(&self) -> MutexGuard<'_, SyncSender<Item>> {
        self.queue.lock().unwrap_or_else(PoisonError::into_inner)
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
        let queue = self.queue();
        let item = Item::Packet { stream, from, at_ns: self.clock.now_ns(), lost_before, bytes };
        // A recorder that has stopped keeps nothing either.
        let kept = match self.waits {
            true => queue.send(item).is_ok(),
            false => queue.try_send(item).is_ok(),
        };
        drop(queue);
        if !kept {
            lost.fetch_add(lost_before.saturating_add(1), Ordering::Relaxed);
            self.lost.fetch_add(1, Ordering::Relaxed);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::sync_channel;
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
        let (queue, items) = sync_channel(1024);
        let taps = taps(queue, clock, true, Arc::default());
        thread::scope(|scope| {
            for _ in 0..4 {
                let tap = taps.open("scanner", StreamKind::Bytes);
                scope.spawn(move || (0..50).for_each(|_| tap.record(Side::Device, b"x")));
            }
        });
        drop(taps);
        let times: Vec<u64> = items
            .iter()
            .filter_map(|item| match item {
                Item::Packet { at_ns, .. } => Some(at_ns),
                _ => None,
            })
            .collect();
        assert_eq!(times, (0..200).collect::<Vec<_>>());
    }
}
