//! One connection: moves bytes between a stream and the client session.

use std::io;
use std::time::Duration;

use bytes::{Buf, BytesMut};
use rowscan_protocol::client::{Client, Event};
use rowscan_recording::{Side, Tap};
use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt, ReadHalf, WriteHalf};

use crate::clock::{HELD_UP, Stopwatch};

/// Bytes taken from the stream at a time; a few scan telegrams.
const READ_CHUNK: usize = 16 * 1024;

/// A client session on any byte stream: TCP, a serial line, a pair in a test.
#[derive(Debug)]
pub struct Connection<S> {
    reader: ReadHalf<S>,
    writer: WriteHalf<S>,
    received: BytesMut,
    sending: BytesMut,
    client: Client,
    tap: Tap,
    watch: Stopwatch,
    last_received: Duration,
}

/// What [`Connection::next_event`] found.
#[derive(Debug)]
pub enum Happened {
    /// The session says something.
    Event(Event),
    /// The peer closed its side.
    Closed,
    /// Nothing came since the deadline handed in.
    Stalled,
}

impl<S: AsyncRead + AsyncWrite> Connection<S> {
    /// Puts `client` on `stream`; the session's clock starts now.
    pub fn new(stream: S, client: Client) -> Self {
        let (reader, writer) = tokio::io::split(stream);
        Self {
            reader,
            writer,
            received: BytesMut::with_capacity(READ_CHUNK),
            sending: BytesMut::new(),
            client,
            tap: Tap::default(),
            watch: Stopwatch::start(),
            last_received: Duration::ZERO,
        }
    }

    /// Hands a copy of all bytes, both ways, to `tap`.
    pub fn tapped(self, tap: Tap) -> Self {
        Self { tap, ..self }
    }

    /// The session.
    pub fn client(&self) -> &Client {
        &self.client
    }

    /// Host time since this connection was opened, at which the last bytes arrived.
    pub fn last_received(&self) -> Duration {
        self.last_received
    }

    /// Asks the session for a clean stop; go on calling [`Connection::next_event`] until it says `Stopped`.
    pub fn stop(&mut self) {
        self.client.stop(self.watch.now());
    }

    /// Runs the link until the session has something to say. Cancel safe: no byte is lost if the future is dropped.
    ///
    /// Says [`Happened::Stalled`] if no byte came for `stall` (without one, silence is the session's business alone).
    pub async fn next_event(&mut self, stall: Option<Duration>) -> io::Result<Happened> {
        loop {
            if let Some(event) = self.client.poll_event() {
                return Ok(Happened::Event(event));
            }
            while let Some(frame) = self.client.poll_transmit() {
                self.tap.record(Side::Host, &frame);
                self.sending.extend_from_slice(&frame);
            }
            let overdue = self.client.poll_timeout().map(|due| due + HELD_UP);
            let stalled = stall.map(|limit| self.last_received + limit);
            self.received.reserve(READ_CHUNK);
            tokio::select! {
                // What has come counts before what has not come in time: a host that was held up is late itself.
                biased;
                () = self.watch.until(overdue) => self.client.handle_timeout(self.watch.now()),
                written = self.writer.write_buf(&mut self.sending), if self.sending.has_remaining() => {
                    if written? == 0 {
                        return Ok(Happened::Closed);
                    }
                }
                read = self.reader.read_buf(&mut self.received) => match read? {
                    0 => return Ok(Happened::Closed),
                    _ => {
                        self.last_received = self.watch.now();
                        self.tap.record(Side::Device, &self.received);
                        self.client.handle_bytes(self.last_received, &self.received);
                        self.received.clear();
                    }
                },
                () = self.watch.until(self.client.poll_timeout()) => self.client.handle_timeout(self.watch.now()),
                () = self.watch.until(stalled) => return Ok(Happened::Stalled),
            }
        }
    }
}
