//! A scanner as its user sees it: scans, one after another, whatever the link does.

use std::collections::VecDeque;
use std::time::Duration;

use rowscan_protocol::client::{Client, Event};
use rowscan_protocol::frame::Dialect;
use rowscan_protocol::scan::Scan;
use rowscan_protocol::telegram::SopasError;

use crate::clock::HostTime;
use crate::config::DriverConfig;
use crate::error::DriverError;
use crate::recording::Recording;
use crate::source::Source;
use crate::tcp_link::TcpLink;

/// One scan with the time it arrived.
#[derive(Clone, Copy, Debug)]
pub struct Record<'a> {
    /// The scan; its own fields hold the device's times.
    pub scan: &'a Scan,
    /// When its last byte was read, since the scanner was opened. Zero for a recording.
    pub received: HostTime,
}

/// What the link has been through.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LinkCounts {
    /// Connections that reached streaming, the first included; 0 for a recording.
    pub connections: u64,
    /// Frames refused by checksum or length, and scan telegrams that made no sense.
    pub telegrams_bad: u64,
}

/// Something the user may want to be told; taken by [`Scanner::take_link_event`].
#[derive(Debug)]
pub enum LinkEvent {
    /// The device is configured and streams.
    Ready {
        /// Its own identification.
        ident: String,
        /// Its firmware version.
        firmware: String,
        /// The dialect spoken.
        dialect: Dialect,
    },
    /// The device refused an optional setting; it goes on with its own.
    Refused {
        /// The command.
        command: &'static str,
        /// The device's reason.
        code: SopasError,
    },
    /// A scan telegram that passed the checksum and made no sense.
    Malformed {
        /// Why.
        reason: String,
    },
    /// The link was lost and will be dialled again after `pause`.
    Lost {
        /// What happened.
        cause: DriverError,
        /// The pause before the next attempt.
        pause: Duration,
    },
}

/// Link events kept for a user who does not take them.
const EVENTS_KEPT: usize = 64;

/// The newest link events, oldest first.
#[derive(Debug, Default)]
pub(crate) struct LinkEvents(VecDeque<LinkEvent>);

impl LinkEvents {
    pub(crate) fn push(&mut self, event: LinkEvent) {
        if self.0.len() == EVENTS_KEPT {
            self.0.pop_front();
        }
        self.0.push_back(event);
    }
}

/// A live scanner or a recording, opened.
#[derive(Debug)]
pub struct Scanner {
    link: Link,
    events: LinkEvents,
    malformed: u64,
}

#[derive(Debug)]
enum Link {
    Recording(Box<Recording>),
    Tcp(Box<TcpLink>),
}

impl Scanner {
    /// Opens `source`. For a live scanner this returns once it streams, or fails fast (unless `config.wait`).
    pub async fn open(source: &Source, config: DriverConfig) -> Result<Self, DriverError> {
        let mut events = LinkEvents::default();
        let link = match source {
            Source::Recording { path } => {
                Link::Recording(Box::new(Recording::open(path, config.client.max_payload)?))
            }
            Source::Tcp { address } => {
                Link::Tcp(Box::new(TcpLink::open(address.clone(), config, &mut events).await?))
            }
        };
        Ok(Self { link, events, malformed: 0 })
    }

    /// The next scan; `None` at the end of a recording.
    ///
    /// A lost live link is dialled again and configured anew; the scans missed meanwhile show in the telegram counters.
    /// Cancel safe.
    pub async fn next(&mut self) -> Result<Option<Record<'_>>, DriverError> {
        loop {
            let event = match &mut self.link {
                Link::Recording(recording) => recording.next_event()?,
                Link::Tcp(link) => link.next_event(&mut self.events).await?,
            };
            match event {
                Some(Event::Scan) => break,
                Some(Event::Malformed { reason }) => {
                    self.malformed += 1;
                    self.events.push(LinkEvent::Malformed { reason });
                }
                Some(_) => {}
                None => return Ok(None),
            }
        }
        let received = match &self.link {
            Link::Recording(_) => HostTime::default(),
            Link::Tcp(link) => link.last_received(),
        };
        Ok(self.client().map(|client| Record { scan: client.scan(), received }))
    }

    /// Ends the stream at the device and drains the link; waits at most `patience`.
    pub async fn stop(mut self, patience: Duration) -> LinkCounts {
        if let Link::Tcp(link) = &mut self.link {
            link.stop(patience).await;
        }
        self.counts()
    }

    /// What the link has been through so far.
    pub fn counts(&self) -> LinkCounts {
        let (connections, frames_bad) = match &self.link {
            Link::Recording(recording) => (0, recording.client().counts().bad),
            Link::Tcp(link) => (link.connections(), link.frames_bad()),
        };
        LinkCounts { connections, telegrams_bad: frames_bad + self.malformed }
    }

    /// The oldest link event not yet taken.
    pub fn take_link_event(&mut self) -> Option<LinkEvent> {
        self.events.0.pop_front()
    }

    fn client(&self) -> Option<&Client> {
        match &self.link {
            Link::Recording(recording) => Some(recording.client()),
            Link::Tcp(link) => link.client(),
        }
    }
}
