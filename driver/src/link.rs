//! A link that is kept: opened, started up, and restored when lost.
//!
//! The link is a state machine that is polled. A connection being opened, a session in its start-up, the pause before the next attempt and
//! the time since which the link is lost are all in the link and not in a future, so a caller may drop its future at any await and call again.

use std::io;
use std::task::{Context, Poll, ready};
use std::time::Duration;

use rowscan_protocol::compact::SegmentCounts;
use rowscan_protocol::host::{HostEvent, HostSession, OtherSender, SettingNote};
use rowscan_protocol::scan::Scan;

use crate::clock::{HostTime, Stopwatch, Timer};
use crate::config::DriverConfig;
use crate::connection::{Connection, ConnectionEvent};
use crate::endpoint::{Endpoint, Opening};
use crate::error::DriverError;
use crate::feed::Feed;
use crate::link_event::{LinkEvent, LinkEvents};

/// One scanner's link.
pub(crate) struct Link<E: Endpoint> {
    endpoint: E,
    config: DriverConfig,
    phase: Phase<E>,
    /// Since when the link is lost, and how often it was tried to restore it.
    outage: Option<Outage>,
    events: LinkEvents,
    watch: Stopwatch,
    timer: Timer,
    last_received: Duration,
    connections: u64,
    /// Bad frames of the connections before this one.
    frames_bad_before: u64,
    /// What became of parts of scans on those.
    segments_before: SegmentCounts,
    /// Telegrams of others that came on those.
    foreign_before: u64,
    /// A stop that was begun ends at this time, whatever the device does.
    stop_by: Option<Duration>,
}

/// How far a link is.
enum Phase<E: Endpoint> {
    /// No connection; the next attempt begins at this time.
    Down { retry_at: Duration },
    /// The stream is being opened, until this time at the latest.
    Opening { opening: Opening<E::Stream>, deadline: Duration },
    /// The session runs its start-up.
    Starting(Connected<E>),
    /// Scans arrive.
    Streaming { connection: Connected<E>, scanned: bool },
}

type Connected<E> = Box<Connection<<E as Endpoint>::Stream, <E as Endpoint>::Session>>;

#[derive(Clone, Copy, Debug)]
struct Outage {
    since: Duration,
    attempts: u32,
}

impl<E: Endpoint> Link<E> {
    /// A link that is not open yet: its first event opens it.
    pub(crate) fn new(endpoint: E, config: DriverConfig, events: LinkEvents) -> Self {
        let watch = Stopwatch::start();
        Self {
            endpoint,
            config,
            phase: Phase::Down { retry_at: Duration::ZERO },
            outage: None,
            events,
            watch,
            timer: Timer::new(watch),
            last_received: Duration::ZERO,
            connections: 0,
            frames_bad_before: 0,
            segments_before: SegmentCounts::default(),
            foreign_before: 0,
            stop_by: None,
        }
    }

    /// Ready once the device streams, or the first attempt has failed and the configuration says to wait.
    pub(crate) fn poll_open(&mut self, cx: &mut Context<'_>) -> Poll<Result<(), DriverError>> {
        while self.connections == 0 {
            if let Err(cause) = ready!(self.poll_step(cx)) {
                let outcome = if self.config.wait { self.lose(cause) } else { Err(cause) };
                return Poll::Ready(outcome);
            }
        }
        Poll::Ready(Ok(()))
    }

    /// One step of whatever the link is about. `None` says that it got further and has nothing to tell; an error, that the link is lost.
    fn poll_step(&mut self, cx: &mut Context<'_>) -> Poll<Result<Option<HostEvent>, DriverError>> {
        let address = || self.endpoint.address().to_owned();
        match &mut self.phase {
            Phase::Down { retry_at } => {
                ready!(self.timer.poll(cx, Some(*retry_at)));
                self.begin_opening();
            }
            Phase::Opening { opening, deadline } => {
                let opened = match opening.as_mut().poll(cx) {
                    Poll::Ready(opened) => opened,
                    Poll::Pending => {
                        ready!(self.timer.poll(cx, Some(*deadline)));
                        let why = format!("no connection within {:?}", self.config.connect_timeout);
                        Err(io::Error::new(io::ErrorKind::TimedOut, why))
                    }
                };
                self.phase = match opened {
                    Ok(stream) => Phase::Starting(self.connected(stream)),
                    Err(cause) => return Poll::Ready(Err(self.endpoint.cannot_open(cause))),
                };
            }
            Phase::Starting(connection) => match ready!(connection.poll_event(cx, None)) {
                Ok(ConnectionEvent::Session(event)) => return Poll::Ready(self.start_up(event)),
                Ok(ConnectionEvent::Stalled) => {}
                Ok(ConnectionEvent::Closed) => {
                    let counts = connection.session().counts();
                    return Poll::Ready(Err(self.endpoint.closed_early(counts)));
                }
                Err(cause) => return Poll::Ready(Err(DriverError::Link { address: address(), cause })),
            },
            Phase::Streaming { connection, scanned } => {
                let timeout =
                    if *scanned { self.config.stall_timeout } else { self.config.first_scan_timeout };
                let event = ready!(connection.poll_event(cx, Some(timeout)));
                self.last_received = connection.last_received();
                return Poll::Ready(match event {
                    Ok(ConnectionEvent::Session(HostEvent::Restarted)) => {
                        Err(DriverError::Restarted { place: address() })
                    }
                    Ok(ConnectionEvent::Session(event)) => {
                        *scanned |= event == HostEvent::Scan;
                        Ok(Some(event))
                    }
                    Ok(ConnectionEvent::Closed) => {
                        Err(DriverError::Closed { address: address(), when: "while it streamed" })
                    }
                    Ok(ConnectionEvent::Stalled) => Err(DriverError::Stalled { address: address(), timeout }),
                    Err(cause) => Err(DriverError::Link { address: address(), cause }),
                });
            }
        }
        Poll::Ready(Ok(None))
    }

    fn begin_opening(&mut self) {
        let deadline = self.watch.now().saturating_add(self.config.connect_timeout);
        self.phase = Phase::Opening { opening: self.endpoint.open(), deadline };
    }

    fn connected(&self, stream: E::Stream) -> Connected<E> {
        let connection = Connection::on_line(stream, self.endpoint.session(), E::set_rate, self.watch);
        Box::new(connection.tapped(self.endpoint.tap(&self.config.tap)))
    }

    /// What the session says while it starts up.
    fn start_up(&mut self, event: HostEvent) -> Result<Option<HostEvent>, DriverError> {
        match event {
            HostEvent::Ready(info) => {
                self.endpoint.ready(&info);
                self.events.push(LinkEvent::Ready(info));
                self.outage = None;
                self.connections += 1;
                let down = Phase::Down { retry_at: Duration::ZERO };
                if let Phase::Starting(connection) = std::mem::replace(&mut self.phase, down) {
                    self.phase = Phase::Streaming { connection, scanned: false };
                }
            }
            HostEvent::Refused { command, error, fatal: true } => {
                return Err(self.endpoint.refused(command, error));
            }
            HostEvent::NoAnswer { command } => {
                let counts = self.session().map(HostSession::counts).unwrap_or_default();
                self.endpoint.no_answer(command, counts)?;
                self.begin_opening();
            }
            event => {
                let note = SettingNote::of(&event).map(LinkEvent::Setting);
                note.into_iter().for_each(|note| self.events.push(note));
            }
        }
        Ok(None)
    }

    /// Notes that the link is lost; an error once it has been lost for too long.
    fn lose(&mut self, cause: DriverError) -> Result<(), DriverError> {
        self.frames_bad_before = self.frames_bad();
        self.segments_before = self.segments();
        self.foreign_before = self.telegrams_foreign();
        self.endpoint.failed();
        let now = self.watch.now();
        let backoff = self.config.backoff;
        let outage = self.outage.get_or_insert(Outage { since: now, attempts: 0 });
        let pause = backoff.pause(outage.attempts);
        outage.attempts = outage.attempts.saturating_add(1);
        self.phase = Phase::Down { retry_at: now.saturating_add(pause) };
        let after = now.saturating_sub(outage.since);
        if backoff.give_up_after.is_some_and(|limit| after >= limit) {
            let address = self.endpoint.address().to_owned();
            return Err(DriverError::GaveUp { address, after, last: Box::new(cause) });
        }
        self.events.push(LinkEvent::Lost { cause, pause });
        Ok(())
    }

    fn session(&self) -> Option<&E::Session> {
        match &self.phase {
            Phase::Down { .. } | Phase::Opening { .. } => None,
            Phase::Starting(connection) | Phase::Streaming { connection, .. } => Some(connection.session()),
        }
    }
}

impl<E: Endpoint> Feed for Link<E> {
    fn poll_event(&mut self, cx: &mut Context<'_>) -> Poll<Result<Option<HostEvent>, DriverError>> {
        loop {
            match ready!(self.poll_step(cx)) {
                Ok(Some(HostEvent::Stopped)) => return Poll::Ready(Ok(None)),
                Ok(Some(event)) => return Poll::Ready(Ok(Some(event))),
                Ok(None) => {}
                Err(cause) => self.lose(cause)?,
            }
        }
    }

    fn begin_stop(&mut self, patience: Duration) {
        self.stop_by = Some(self.watch.now().saturating_add(patience));
        if let Phase::Streaming { connection, .. } = &mut self.phase {
            connection.stop();
        }
    }

    fn poll_stopped(&mut self, cx: &mut Context<'_>) -> Poll<()> {
        let Phase::Streaming { connection, .. } = &mut self.phase else { return Poll::Ready(()) };
        loop {
            if self.stop_by.is_some_and(|by| self.watch.now() >= by) {
                return Poll::Ready(());
            }
            match connection.poll_event(cx, None) {
                Poll::Ready(Ok(ConnectionEvent::Session(HostEvent::Stopped))) => return Poll::Ready(()),
                Poll::Ready(Ok(ConnectionEvent::Session(_))) => {}
                Poll::Ready(_) => return Poll::Ready(()),
                Poll::Pending => return self.timer.poll(cx, self.stop_by),
            }
        }
    }

    fn scan(&self) -> Option<&Scan> {
        self.session().map(HostSession::scan)
    }

    fn received(&self) -> HostTime {
        HostTime(self.last_received)
    }

    fn now(&self) -> HostTime {
        HostTime(self.watch.now())
    }

    fn connections(&self) -> u64 {
        self.connections
    }

    fn segments(&self) -> SegmentCounts {
        let now = match &self.phase {
            Phase::Streaming { connection, .. } => connection.session().segments(),
            _ => SegmentCounts::default(),
        };
        self.segments_before + now
    }

    fn telegrams_foreign(&self) -> u64 {
        let now = match &self.phase {
            Phase::Streaming { connection, .. } => {
                OtherSender::telegrams_of(connection.session().other_senders())
            }
            _ => 0,
        };
        self.foreign_before + now
    }

    fn frames_bad(&self) -> u64 {
        let now = match &self.phase {
            Phase::Streaming { connection, .. } => connection.session().counts().bad,
            _ => 0,
        };
        self.frames_bad_before + now
    }
}

#[cfg(test)]
mod tests;
