//! The tap in a byte path: hands copies of the bytes to a recorder, and never waits for it unless told to.

use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};
use std::sync::mpsc::{SyncSender, TrySendError};
use std::sync::{Arc, Mutex, PoisonError};

use crate::recorder::WallClock;
use crate::{Side, StreamKind};

/// Opens taps of one recorder; the default one opens taps that do nothing.
#[derive(Clone, Debug, Default)]
pub struct Taps(Option<Arc<Shared>>);

/// One stream's tap. Cheap to clone; the default one does nothing.
#[derive(Clone, Debug, Default)]
pub struct Tap(Option<Arc<Stream>>);

/// What the taps of one recorder share.
#[derive(Debug)]
struct Shared {
    queue: SyncSender<Item>,
    clock: WallClock,
    /// Wait for room in the queue instead of losing packets.
    waits: bool,
    lost: Arc<AtomicU64>,
    names: Mutex<Vec<String>>,
    next: AtomicU32,
}

#[derive(Debug)]
struct Stream {
    shared: Arc<Shared>,
    number: u32,
    /// Packets lost since the last one that was kept.
    lost: AtomicU32,
}

/// What the recorder's thread takes in.
#[derive(Debug)]
pub(crate) enum Item {
    Open { stream: u32, name: String, kind: StreamKind },
    Packet { stream: u32, from: Side, at_ns: u64, lost_before: u32, bytes: Vec<u8> },
    Finish,
}

impl Taps {
    pub(crate) fn new(queue: SyncSender<Item>, clock: WallClock, waits: bool, lost: Arc<AtomicU64>) -> Self {
        Self(Some(Arc::new(Shared {
            queue,
            clock,
            waits,
            lost,
            names: Mutex::default(),
            next: AtomicU32::new(0),
        })))
    }

    /// A tap for one stream. A name that is taken gets a number behind it.
    pub fn open(&self, name: &str, kind: StreamKind) -> Tap {
        let Some(shared) = &self.0 else { return Tap::default() };
        let name = shared.free_name(name);
        let stream = shared.next.fetch_add(1, Ordering::Relaxed);
        // Rare, and nothing of the stream can be kept without it: worth waiting for.
        match shared.queue.send(Item::Open { stream, name, kind }) {
            Ok(()) => Tap(Some(Arc::new(Stream {
                shared: Arc::clone(shared),
                number: stream,
                lost: AtomicU32::new(0),
            }))),
            Err(_) => Tap::default(),
        }
    }
}

impl Shared {
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
}

impl Tap {
    /// True if something records.
    pub fn is_on(&self) -> bool {
        self.0.is_some()
    }

    /// Records `bytes` sent by `from`, at the time it is now. If the writer lags behind they are lost and counted.
    pub fn record(&self, from: Side, bytes: &[u8]) {
        let Some(stream) = &self.0 else { return };
        if bytes.is_empty() {
            return;
        }
        let shared = &stream.shared;
        let lost_before = stream.lost.swap(0, Ordering::Relaxed);
        let at_ns = shared.clock.now_ns();
        let item = Item::Packet { stream: stream.number, from, at_ns, lost_before, bytes: bytes.to_vec() };
        let kept = match shared.waits {
            true => shared.queue.send(item).is_ok(),
            // A recorder that has stopped keeps nothing either.
            false => !matches!(
                shared.queue.try_send(item),
                Err(TrySendError::Full(_) | TrySendError::Disconnected(_))
            ),
        };
        if !kept {
            stream.lost.fetch_add(lost_before.saturating_add(1), Ordering::Relaxed);
            shared.lost.fetch_add(1, Ordering::Relaxed);
        }
    }
}
