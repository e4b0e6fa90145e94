//! A link to an LMS2xx on a serial line that is kept: opened, the rate found and raised, the device set up, and all of it again when lost.

use std::io;
use std::time::Duration;

use bytes::{Buf, BytesMut};
use rowscan_protocol::client::Event;
use rowscan_protocol::lms2xx::Rate;
use rowscan_protocol::lms2xx::client::{self, Client, ClientConfig, DeviceInfo, Transmit};
use rowscan_protocol::scan::Scan;
use rowscan_recording::Side;
use tokio::io::{AsyncReadExt, AsyncWriteExt};

use crate::clock::{HELD_UP, HostTime, Stopwatch};
use crate::config::DriverConfig;
use crate::error::DriverError;
use crate::link_event::{LinkEvent, LinkEvents};
use crate::outage::Outages;
use crate::port::Port;
use crate::source::Source;

/// Bytes taken from the port at a time.
const READ_CHUNK: usize = 4096;

/// One LMS2xx's link. Whenever there is none, the next step opens one.
#[derive(Debug)]
pub(crate) struct SerialLink {
    source: Source,
    place: String,
    config: DriverConfig,
    client_config: ClientConfig,
    live: Option<Live>,
    outages: Outages,
    watch: Stopwatch,
    connections: u64,
    /// Bad frames of the links before this one.
    frames_bad_before: u64,
    last_received: Duration,
}

/// An open port with its session.
#[derive(Debug)]
struct Live {
    port: Port,
    client: Client,
    received: BytesMut,
    sending: BytesMut,
    /// The session wants this rate once everything before it has left.
    rate: Option<Rate>,
    last_heard: Duration,
}

/// What a live link said.
enum Said {
    Event(client::Event),
    Closed,
    Stalled,
}

impl SerialLink {
    /// Opens `source`, a serial port or one over TCP, to stream at `rate`.
    pub(crate) async fn open(
        source: Source,
        rate: Rate,
        config: DriverConfig,
        events: &LinkEvents,
    ) -> Result<Self, DriverError> {
        let watch = Stopwatch::start();
        let mut link = Self {
            place: source.to_string(),
            source,
            client_config: ClientConfig { rate, ..config.lms2xx.clone() },
            outages: Outages::new(config.backoff, watch),
            config,
            live: None,
            watch,
            connections: 0,
            frames_bad_before: 0,
            last_received: Duration::ZERO,
        };
        match link.connect(events).await {
            Err(cause) if link.config.wait => link.lose(cause, events)?,
            outcome => outcome?,
        }
        Ok(link)
    }

    /// The session's next event, in the words of CoLa's; restores the link as often as needed. `None` once the session has stopped. Cancel safe
    /// while the link is up.
    pub(crate) async fn next_event(&mut self, events: &LinkEvents) -> Result<Option<Event>, DriverError> {
        loop {
            let place = self.place.clone();
            let timeout = self.config.stall_timeout;
            let tap = self.config.tap.clone();
            let Some(live) = &mut self.live else {
                self.outages.pause().await;
                if let Err(cause) = self.connect(events).await {
                    self.lose(cause, events)?;
                }
                continue;
            };
            let said = live.next(&self.watch, Some(timeout), &tap).await;
            self.last_received = live.last_heard;
            let cause = match said {
                Ok(Said::Event(client::Event::Scan)) => return Ok(Some(Event::Scan)),
                Ok(Said::Event(client::Event::Malformed { reason })) => {
                    return Ok(Some(Event::Malformed { reason: reason.to_string() }));
                }
                Ok(Said::Event(client::Event::Stopped)) => return Ok(None),
                Ok(Said::Event(client::Event::Restarted)) => DriverError::Restarted { place },
                Ok(Said::Event(_)) => continue,
                Ok(Said::Closed) => DriverError::Closed { address: place, when: "while it streamed" },
                Ok(Said::Stalled) => DriverError::Stalled { address: place, timeout },
                Err(cause) => DriverError::Link { address: place, cause },
            };
            self.lose(cause, events)?;
        }
    }

    /// Asks the device to stop and reads on until it has, for at most `patience`.
    pub(crate) async fn stop(&mut self, patience: Duration) {
        let deadline = self.watch.now() + patience;
        let watch = self.watch;
        let tap = self.config.tap.clone();
        let Some(live) = &mut self.live else { return };
        live.client.stop(watch.now());
        let drained = async {
            while let Ok(Said::Event(event)) = live.next(&watch, Some(patience), &tap).await {
                if event == client::Event::Stopped {
                    break;
                }
            }
        };
        tokio::select! {
            () = drained => {}
            () = watch.until(Some(deadline)) => {}
        }
    }

    pub(crate) fn scan(&self) -> Option<&Scan> {
        self.live.as_ref().map(|live| live.client.scan())
    }

    /// Host time since the link was made.
    pub(crate) fn now(&self) -> HostTime {
        HostTime(self.watch.now())
    }

    /// When the last bytes came, since the link was first opened.
    pub(crate) fn last_received(&self) -> HostTime {
        HostTime(self.last_received)
    }

    pub(crate) fn connections(&self) -> u64 {
        self.connections
    }

    pub(crate) fn frames_bad(&self) -> u64 {
        self.frames_bad_before + self.live.as_ref().map_or(0, |live| live.client.counts().bad)
    }

    /// Opens the port and runs the start-up to its end.
    async fn connect(&mut self, events: &LinkEvents) -> Result<(), DriverError> {
        let fail = |cause| DriverError::Port { place: self.place.clone(), cause };
        let port = match &self.source {
            Source::Rfc2217 { address, .. } => Port::connect(address, self.config.connect_timeout).await,
            Source::Serial { path, .. } => Port::open(path),
            Source::Tcp { .. } | Source::Recording { .. } => Err(io::ErrorKind::Unsupported.into()),
        };
        let mut live = Live {
            port: port.map_err(fail)?,
            client: Client::new(self.client_config.clone()),
            received: BytesMut::with_capacity(READ_CHUNK),
            sending: BytesMut::new(),
            rate: None,
            last_heard: self.watch.now(),
        };
        loop {
            let place = || self.place.clone();
            match live.next(&self.watch, None, &self.config.tap).await {
                Ok(Said::Event(client::Event::Ready(DeviceInfo { ident, software, rate }))) => {
                    events.push(LinkEvent::SerialReady { ident, software, rate });
                    self.client_config.known = Some(rate);
                    self.connections += 1;
                    live.last_heard = self.watch.now();
                    self.live = Some(live);
                    self.outages.over();
                    return Ok(());
                }
                Ok(Said::Event(client::Event::Refused { what, fatal: true })) => {
                    return Err(DriverError::Declined { place: place(), what });
                }
                Ok(Said::Event(client::Event::Refused { what, fatal: false })) => {
                    events.push(LinkEvent::Declined { what });
                }
                Ok(Said::Event(client::Event::NoAnswer { what })) => {
                    let bytes = live.client.counts().skipped_bytes;
                    let heard = crate::Heard { bytes };
                    return Err(DriverError::NoLms2xx { place: place(), what, heard });
                }
                Ok(Said::Event(_) | Said::Stalled) => {}
                Ok(Said::Closed) => {
                    return Err(DriverError::Closed { address: place(), when: "during start-up" });
                }
                Err(cause) => return Err(DriverError::Link { address: place(), cause }),
            }
        }
    }

    fn lose(&mut self, cause: DriverError, events: &LinkEvents) -> Result<(), DriverError> {
        self.frames_bad_before = self.frames_bad();
        self.live = None;
        self.outages.lose(&self.place, cause, events)
    }
}

impl Live {
    /// Runs the line until the session has something to say. Cancel safe: no byte is lost if the future is dropped.
    async fn next(
        &mut self,
        watch: &Stopwatch,
        stall: Option<Duration>,
        tap: &rowscan_recording::Tap,
    ) -> io::Result<Said> {
        loop {
            if let Some(event) = self.client.poll_event() {
                return Ok(Said::Event(event));
            }
            // A change of the rate waits until all before it has left, and all after it waits for the change.
            while self.rate.is_none() {
                match self.client.poll_transmit() {
                    Some(Transmit::Frame(frame)) => {
                        tap.record(Side::Host, &frame);
                        self.sending.extend_from_slice(&frame);
                    }
                    Some(Transmit::Rate(rate)) => self.rate = Some(rate),
                    None => break,
                }
            }
            if self.sending.is_empty()
                && let Some(rate) = self.rate.take()
            {
                self.port.set_rate(rate)?;
                continue;
            }
            let overdue = self.client.poll_timeout().map(|due| due + HELD_UP);
            let stalled = stall.map(|limit| self.last_heard + limit);
            self.received.reserve(READ_CHUNK);
            tokio::select! {
                // What has come counts before what has not come in time: a host that was held up is late itself.
                biased;
                () = watch.until(overdue) => {
                    self.client.handle_timeout(watch.now());
                    continue;
                }
                () = std::future::ready(()), if self.sending.has_remaining() => {}
                read = self.port.read_buf(&mut self.received) => {
                    if read? == 0 {
                        return Ok(Said::Closed);
                    }
                    self.last_heard = watch.now();
                    tap.record(Side::Device, &self.received);
                    self.client.handle_bytes(self.last_heard, &self.received);
                    self.received.clear();
                    continue;
                }
                () = watch.until(self.client.poll_timeout()) => {
                    self.client.handle_timeout(watch.now());
                    continue;
                }
                () = watch.until(stalled) => return Ok(Said::Stalled),
            }
            // Reading and writing share the port, so they take turns.
            let written = self.port.write_buf(&mut self.sending).await?;
            if written == 0 {
                return Ok(Said::Closed);
            }
            self.port.flush().await?;
        }
    }
}
