//! One connection: moves bytes between a stream and a session.

use std::future::poll_fn;
use std::io;
use std::pin::Pin;
use std::task::{Context, Poll, ready};
use std::time::Duration;

use rowscan_protocol::host::{HostEvent, HostSession, Transmit};
use rowscan_protocol::lms2xx::Rate;
use rowscan_recording::{Side, Tap};
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};

use crate::clock::{LATE_HOST, Stopwatch, Timer};

/// Bytes taken from the stream at a time: a few scan telegrams, or the largest datagram.
const READ_CHUNK: usize = 66 * 1024;

/// A session `S` on any byte stream `T`: TCP, a serial line, a pair in a test.
#[derive(Debug)]
pub struct Connection<T, S> {
    stream: T,
    set_rate: fn(&mut T, Rate) -> io::Result<()>,
    session: S,
    received: Vec<u8>,
    output: Output,
    tap: Tap,
    watch: Stopwatch,
    timer: Timer,
    last_received: Duration,
}

/// What is to be sent.
#[derive(Debug, Default)]
struct Output {
    bytes: Vec<u8>,
    /// So many of them are written.
    written: usize,
    /// Something was written and not flushed.
    unflushed: bool,
    /// The session wants this rate once everything before it has left.
    rate: Option<Rate>,
}

/// What [`Connection::next_event`] found.
#[derive(Debug)]
#[non_exhaustive]
pub enum ConnectionEvent {
    /// The session has an event.
    Session(HostEvent),
    /// The peer closed its side.
    Closed,
    /// Nothing arrived for as long as the caller allows.
    Stalled,
}

impl<T, S> Connection<T, S> {
    /// Puts `session` on `stream`; the session's clock starts now. Changes of the line's rate are ignored.
    pub fn new(stream: T, session: S) -> Self {
        Self::on_line(stream, session, |_, _| Ok(()), Stopwatch::start())
    }

    /// Puts `session` on a line whose rate can be changed; time is that of `watch`.
    pub(crate) fn on_line(
        stream: T,
        session: S,
        set_rate: fn(&mut T, Rate) -> io::Result<()>,
        watch: Stopwatch,
    ) -> Self {
        Self {
            stream,
            set_rate,
            session,
            received: vec![0; READ_CHUNK],
            output: Output::default(),
            tap: Tap::default(),
            watch,
            timer: Timer::new(watch),
            last_received: watch.now(),
        }
    }

    /// Hands a copy of all bytes, both ways, to `tap`.
    pub fn tapped(self, tap: Tap) -> Self {
        Self { tap, ..self }
    }

    /// The session.
    pub fn session(&self) -> &S {
        &self.session
    }

    /// Host time at which the last bytes arrived, since this connection was made.
    pub fn last_received(&self) -> Duration {
        self.last_received
    }
}

impl<T: AsyncRead + AsyncWrite + Unpin, S: HostSession> Connection<T, S> {
    /// Asks the session for a clean stop; go on calling [`Connection::next_event`] until it gives [`HostEvent::Stopped`].
    pub fn stop(&mut self) {
        self.session.stop(self.watch.now());
    }

    /// Runs the connection until there is an event. Cancel safe: no byte is lost if the future is dropped.
    ///
    /// Gives [`ConnectionEvent::Stalled`] if no byte arrived for `stall`; without a limit, silence is the session's business alone.
    pub async fn next_event(&mut self, stall: Option<Duration>) -> io::Result<ConnectionEvent> {
        poll_fn(|cx| self.poll_event(cx, stall)).await
    }

    /// [`next_event`](Self::next_event) for a caller that is polled itself. All state is in `self`.
    pub(crate) fn poll_event(
        &mut self,
        cx: &mut Context<'_>,
        stall: Option<Duration>,
    ) -> Poll<io::Result<ConnectionEvent>> {
        loop {
            if let Some(event) = self.session.poll_event() {
                return Poll::Ready(Ok(ConnectionEvent::Session(event)));
            }
            self.queue_output();
            let due = self.session.poll_timeout();
            let now = self.watch.now();
            // What has arrived counts before what has not arrived in time: a late host must not blame the device. But a device that
            // never stops sending must not keep a deadline from passing.
            if due.is_some_and(|due| now >= due.saturating_add(LATE_HOST)) {
                self.session.handle_timeout(now);
                continue;
            }
            match self.poll_write(cx)? {
                Poll::Ready(0) => return Poll::Ready(Ok(ConnectionEvent::Closed)),
                Poll::Ready(_) => continue,
                Poll::Pending => {}
            }
            match self.poll_read(cx)? {
                Poll::Ready(0) => return Poll::Ready(Ok(ConnectionEvent::Closed)),
                Poll::Ready(_) => continue,
                Poll::Pending => {}
            }
            let stalled = stall.map(|limit| self.last_received.saturating_add(limit));
            let next = due.into_iter().chain(stalled).min();
            ready!(self.timer.poll(cx, next));
            let now = self.watch.now();
            if due.is_some_and(|due| now >= due) {
                self.session.handle_timeout(now);
            } else if stalled.is_some_and(|stalled| now >= stalled) {
                return Poll::Ready(Ok(ConnectionEvent::Stalled));
            }
        }
    }

    /// Takes the session's output, up to a change of the rate.
    fn queue_output(&mut self) {
        while self.output.rate.is_none() {
            match self.session.poll_transmit() {
                Some(Transmit::Frame(frame)) => {
                    self.tap.record(Side::Host, &frame);
                    self.output.bytes.extend_from_slice(&frame);
                }
                Some(Transmit::Rate(rate)) => self.output.rate = Some(rate),
                None => break,
            }
        }
    }

    /// Writes what is queued, flushes it, then changes the rate. Ready with 0 if the stream takes nothing any more; pending while there is
    /// nothing to do.
    fn poll_write(&mut self, cx: &mut Context<'_>) -> Poll<io::Result<usize>> {
        let output = &mut self.output;
        let rest = output.bytes.get(output.written..).unwrap_or_default();
        if !rest.is_empty() {
            let written = ready!(Pin::new(&mut self.stream).poll_write(cx, rest))?;
            output.written += written;
            output.unflushed = true;
            return Poll::Ready(Ok(written));
        }
        output.bytes.clear();
        output.written = 0;
        if output.unflushed {
            ready!(Pin::new(&mut self.stream).poll_flush(cx))?;
            output.unflushed = false;
        }
        match output.rate.take() {
            Some(rate) => Poll::Ready((self.set_rate)(&mut self.stream, rate).map(|()| 1)),
            None => Poll::Pending,
        }
    }

    /// Reads once and hands the bytes to the session.
    fn poll_read(&mut self, cx: &mut Context<'_>) -> Poll<io::Result<usize>> {
        let mut buffer = ReadBuf::new(&mut self.received);
        ready!(Pin::new(&mut self.stream).poll_read(cx, &mut buffer))?;
        let bytes = buffer.filled();
        if !bytes.is_empty() {
            self.last_received = self.watch.now();
            self.tap.record(Side::Device, bytes);
            self.session.handle_bytes(self.last_received, bytes);
        }
        Poll::Ready(Ok(bytes.len()))
    }
}
