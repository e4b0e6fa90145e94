//! A client's connection with the faults in it, seen from the host: what is written goes to the client, what is read comes from it.

mod polling;

use std::fmt;
use std::io;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll, ready};
use std::time::Duration;

use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};

use crate::clock::Timer;
use crate::event::Direction;
use crate::handle::StreamFaults;
use crate::in_lane::ScanCounts;
use crate::lane::Lane;
use crate::plan::{Fate, Link};

/// Bytes a fault holds back each way before whoever writes must wait, as for a full socket. No bound while the clock is patient.
const MOST: usize = 64 * 1024;
/// Bytes taken from a client at a time while a fault is active.
const CHUNK: usize = 4096;
/// Numbers of the two halves, which may be polled by two tasks.
const READER: usize = 0;
const WRITER: usize = 1;

/// Sees the bytes on the client's side of the faults.
type Witness = Box<dyn FnMut(Direction, &[u8]) + Send>;

/// A connection with faults. Reads drive what waits to be written too, so a host that keeps reading need do nothing else.
pub struct FaultyStream<S> {
    inner: S,
    entry: Entry,
    /// To the client.
    out: Lane,
    /// From the client.
    back: Lane,
    timers: [Timer; 2],
    /// When everything was last brought to its time: what was due by then and is still there waits for the socket.
    looked: Duration,
    on_reset: fn(&S),
    witness: Option<Witness>,
    /// Bytes the client was sent, and has sent.
    passed: [u64; 2],
    scratch: Box<[u8]>,
    /// The client has sent its last byte.
    eof: bool,
    /// Our half is closed.
    shut: bool,
    reset: bool,
}

impl StreamFaults {
    /// Puts the faults between the host and a client's connection. `on_reset` makes the connection end with a reset when it is dropped;
    /// where there is no such thing, it does nothing.
    pub fn wrap<S: AsyncRead + AsyncWrite + Unpin>(&self, stream: S, on_reset: fn(&S)) -> FaultyStream<S> {
        FaultyStream::new(self.clone(), stream, on_reset)
    }
}

/// The connection's place in the plan, given up with it.
#[derive(Debug)]
struct Entry {
    faults: StreamFaults,
    link: Link,
}

impl Drop for Entry {
    fn drop(&mut self) {
        let now = self.faults.shared.clock.now();
        self.faults.shared.plan().close(self.link, now);
    }
}

impl<S: fmt::Debug> fmt::Debug for FaultyStream<S> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let link = self.entry.link;
        f.debug_struct("FaultyStream")
            .field("inner", &self.inner)
            .field("link", &link)
            .finish_non_exhaustive()
    }
}

impl<S> FaultyStream<S> {
    pub(crate) fn new(faults: StreamFaults, inner: S, on_reset: fn(&S)) -> Self {
        let (language, scans) = (faults.language(), faults.scans.clone());
        let clock = Arc::clone(&faults.shared.clock);
        let mut plan = faults.shared.plan();
        let link = Link { stream: faults.stream, connection: plan.open(faults.stream, clock.now()) };
        let flushes = plan.flushes;
        drop(plan);
        faults.shared.spread();
        Self {
            inner,
            entry: Entry { faults, link },
            out: Lane::new(link, language, Direction::ToClient, (flushes, scans)),
            back: Lane::new(link, language, Direction::ToDevice, (flushes, ScanCounts::default())),
            timers: [Timer::new(Arc::clone(&clock)), Timer::new(clock)],
            looked: Duration::ZERO,
            on_reset,
            witness: None,
            passed: [0; 2],
            scratch: vec![0; CHUNK].into_boxed_slice(),
            eof: false,
            shut: false,
            reset: false,
        }
    }

    /// Has `witness` see every byte as it is on the client's side: what the client gets, after faults; what it sends, before them.
    #[must_use]
    pub fn witnessed(mut self, witness: impl FnMut(Direction, &[u8]) + Send + 'static) -> Self {
        self.witness = Some(Box::new(witness));
        self
    }

    /// Bytes the client was sent and bytes it has sent.
    pub fn passed(&self) -> [u64; 2] {
        self.passed
    }

    /// Brings everything to now, and has the plan wake this half when something changes.
    fn sync(&mut self, cx: &Context<'_>, half: usize) -> io::Result<Fate> {
        let shared = &self.entry.faults.shared;
        let now = shared.clock.now();
        self.looked = now;
        let mut plan = shared.plan();
        let changes = plan.changes;
        plan.advance(now);
        self.out.tick(now, &mut plan);
        self.back.tick(now, &mut plan);
        plan.waits(self.entry.link, half, cx.waker());
        let fate = plan.fate(self.entry.link);
        let is_lost = fate.dead[Direction::ToClient.index()] || plan.has_lost(self.entry.link.stream);
        let changed = plan.changes != changes;
        drop(plan);
        if changed {
            shared.spread();
        }
        if is_lost {
            self.out.lose();
        }
        if fate.reset {
            self.break_off();
            return Err(io::ErrorKind::ConnectionReset.into());
        }
        Ok(fate)
    }

    /// Has the connection end with a reset.
    pub(crate) fn break_off(&mut self) {
        if !std::mem::replace(&mut self.reset, true) {
            (self.on_reset)(&self.inner);
        }
    }

    /// Ready once there is something to look at again.
    fn poll_due(&mut self, cx: &mut Context<'_>, half: usize) -> Poll<()> {
        let shared = &self.entry.faults.shared;
        let (looked, link) = (self.looked, self.entry.link);
        let mut plan = shared.plan();
        let out = self.out.next_due(plan.holds(link, Direction::ToClient));
        plan.is_due(link, out);
        let back = self.back.next_due(plan.holds(link, Direction::ToDevice));
        let script = plan.next_due(looked);
        let next = [out, back, script].into_iter().flatten().filter(|at| *at > looked).min();
        // Telegrams that wait for each other are in no queue.
        let waits = [out, back].iter().any(Option::is_some) || self.out.waiting() + self.back.waiting() > 0;
        plan.set_needs_time(link, next.filter(|_| waits));
        drop(plan);
        self.timers.get_mut(half).map_or(Poll::Pending, |timer| timer.poll(cx, next))
    }

    fn is_quiet(&self, direction: Direction, bytes: usize) -> bool {
        let lane = if direction == Direction::ToClient { &self.out } else { &self.back };
        lane.is_idle() && self.entry.faults.shared.plan().is_quiet(self.entry.link, direction, bytes)
    }

    /// Notes bytes on the client's side.
    fn pass(&mut self, direction: Direction, bytes: &[u8]) {
        if let Some(passed) = self.passed.get_mut(direction.index()) {
            *passed += bytes.len() as u64;
        }
        if let Some(witness) = &mut self.witness {
            witness(direction, bytes);
        }
    }
}

impl<S: AsyncRead + AsyncWrite + Unpin> FaultyStream<S> {
    /// Writes what may leave now. Ready once nothing that may leave is left.
    fn poll_drain(&mut self, cx: &mut Context<'_>, half: usize) -> Poll<io::Result<()>> {
        let mut moved = false;
        let drained = loop {
            let shared = &self.entry.faults.shared;
            if self.out.is_empty() || shared.plan().holds(self.entry.link, Direction::ToClient) {
                break Poll::Ready(Ok(()));
            }
            let Some(bytes) = self.out.ready(shared.clock.now()) else { break Poll::Ready(Ok(())) };
            if self.shut {
                // The client's half of the connection is closed: there is nowhere to go.
                self.out.lose_first();
                continue;
            }
            match Pin::new(&mut self.inner).poll_write(cx, bytes) {
                Poll::Ready(Ok(0)) => break Poll::Ready(Err(io::ErrorKind::WriteZero.into())),
                Poll::Ready(Ok(written)) => {
                    let gone: Vec<u8> = bytes.iter().take(written).copied().collect();
                    self.pass(Direction::ToClient, &gone);
                    self.out.left(written);
                    moved = true;
                }
                Poll::Ready(Err(cause)) => break Poll::Ready(Err(cause)),
                Poll::Pending => break Poll::Pending,
            }
        };
        if moved {
            // The other half may wait for this room, or for its turn at the socket.
            let other = self.entry.faults.shared.plan().take_waker(self.entry.link, 1 - half);
            if let Some(waker) = other {
                waker.wake();
            }
        }
        drained
    }

    /// Closes our half towards the client, after what was sent before.
    fn poll_close(&mut self, cx: &mut Context<'_>, half: usize) -> Poll<io::Result<()>> {
        if self.shut {
            return Poll::Ready(Ok(()));
        }
        loop {
            ready!(self.poll_drain(cx, half))?;
            if self.out.is_empty() {
                break;
            }
            ready!(self.poll_due(cx, half));
            self.sync(cx, half)?;
        }
        ready!(Pin::new(&mut self.inner).poll_shutdown(cx))?;
        self.shut = true;
        Poll::Ready(Ok(()))
    }

    /// Reads into the void; what a dead connection still does.
    fn poll_dead(&mut self, cx: &mut Context<'_>, fate: Fate) -> Poll<io::Result<()>> {
        while !self.eof {
            let mut room = ReadBuf::new(&mut self.scratch);
            match Pin::new(&mut self.inner).poll_read(cx, &mut room) {
                Poll::Ready(Ok(())) => {}
                // It is gone, and the host cannot know.
                Poll::Ready(Err(_)) => room.clear(),
                Poll::Pending => return Poll::Pending,
            }
            let bytes = room.filled().to_vec();
            self.eof = bytes.is_empty();
            self.pass(Direction::ToDevice, &bytes);
            if !self.eof && !fate.still_out {
                // Back on the net, the device knows no such connection.
                self.break_off();
                return Poll::Ready(Err(io::ErrorKind::ConnectionReset.into()));
            }
        }
        if fate.still_out { Poll::Pending } else { Poll::Ready(Ok(())) }
    }

    /// Takes what the client sends; ready once there is something to look at.
    fn poll_take(&mut self, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        let mut room = ReadBuf::new(&mut self.scratch);
        ready!(Pin::new(&mut self.inner).poll_read(cx, &mut room))?;
        let bytes = room.filled().to_vec();
        self.pass(Direction::ToDevice, &bytes);
        let shared = Arc::clone(&self.entry.faults.shared);
        let now = shared.clock.now();
        let mut plan = shared.plan();
        if bytes.is_empty() {
            self.eof = true;
            self.back.finish(now, &mut plan);
        } else {
            self.back.push(&bytes, now, &mut plan);
        }
        Poll::Ready(Ok(()))
    }

    /// Hands the host what may arrive now; false if there is nothing.
    fn hand_over(&mut self, buf: &mut ReadBuf<'_>) -> bool {
        let shared = &self.entry.faults.shared;
        if shared.plan().holds(self.entry.link, Direction::ToDevice) {
            return false;
        }
        let Some(bytes) = self.back.ready(shared.clock.now()) else { return false };
        let taken = bytes.len().min(buf.remaining());
        buf.put_slice(bytes.get(..taken).unwrap_or_default());
        self.back.left(taken);
        true
    }

    /// Reads past the faults: none is active, and nothing waits.
    fn poll_pass(&mut self, cx: &mut Context<'_>, buf: &mut ReadBuf<'_>) -> Poll<io::Result<()>> {
        let before = buf.filled().len();
        ready!(Pin::new(&mut self.inner).poll_read(cx, buf))?;
        let bytes = buf.filled().get(before..).unwrap_or_default();
        self.eof = bytes.is_empty();
        self.pass(Direction::ToDevice, bytes);
        let shared = &self.entry.faults.shared;
        self.back.observe(bytes, shared.clock.now(), &mut shared.plan());
        Poll::Ready(Ok(()))
    }
}
