//! A scanner as its user sees it: scans, one after another, whatever the link does.

use std::time::Duration;

use rowscan_protocol::client::{Client, Event};
use rowscan_protocol::scan::Scan;
use rowscan_recording::Listener;

use crate::clock::HostTime;
use crate::config::DriverConfig;
use crate::error::DriverError;
use crate::link_event::{LinkEvent, LinkEvents};
use crate::recording::Recording;
use crate::serial_link::SerialLink;
use crate::source::Source;
use crate::tcp_link::TcpLink;

/// One scan with the time it arrived.
#[derive(Clone, Copy, Debug)]
pub struct Record<'a> {
    /// The scan; its own fields hold the device's times.
    pub scan: &'a Scan,
    /// When its last byte was read, since the scanner was opened. For a recording, since its first packet; zero if it has no times.
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
    Serial(Box<SerialLink>),
}

impl Scanner {
    /// Opens `source`. For a live scanner this returns once it streams, or fails fast (unless `config.wait`).
    pub async fn open(source: &Source, config: DriverConfig) -> Result<Self, DriverError> {
        let events = LinkEvents::default();
        let link = match source {
            Source::Recording { path, stream } => Link::Recording(Box::new(Recording::open(
                path,
                stream.as_deref(),
                config.client.max_payload,
            )?)),
            Source::Serial { rate, .. } | Source::Rfc2217 { rate, .. } => {
                Link::Serial(Box::new(SerialLink::open(source.clone(), *rate, config, &events).await?))
            }
            Source::Tcp { address } => {
                Link::Tcp(Box::new(TcpLink::open(address.clone(), config, &events).await?))
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
                Link::Tcp(link) => link.next_event(&self.events).await?,
                Link::Serial(link) => link.next_event(&self.events).await?,
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
            Link::Recording(recording) => recording.received(),
            Link::Tcp(link) => link.last_received(),
            Link::Serial(link) => link.last_received(),
        };
        Ok(self.scan().map(|scan| Record { scan, received }))
    }

    /// What time it is on the watch that [`Record::received`] was read from; zero for a recording.
    pub fn now(&self) -> HostTime {
        match &self.link {
            Link::Recording(_) => HostTime::default(),
            Link::Tcp(link) => link.now(),
            Link::Serial(link) => link.now(),
        }
    }

    /// Ends the stream at the device and drains the link; waits at most `patience`.
    pub async fn stop(mut self, patience: Duration) -> LinkCounts {
        match &mut self.link {
            Link::Recording(_) => {}
            Link::Tcp(link) => link.stop(patience).await,
            Link::Serial(link) => link.stop(patience).await,
        }
        self.counts()
    }

    /// What the link has been through so far.
    pub fn counts(&self) -> LinkCounts {
        let (connections, frames_bad) = match &self.link {
            Link::Recording(recording) => (0, recording.client().map_or(0, |client| client.counts().bad)),
            Link::Tcp(link) => (link.connections(), link.frames_bad()),
            Link::Serial(link) => (link.connections(), link.frames_bad()),
        };
        LinkCounts { connections, telegrams_bad: frames_bad + self.malformed }
    }

    /// What happens to the link, as it happens: while [`next`](Self::next) restores it, too.
    pub fn link_events(&self) -> LinkEvents {
        self.events.clone()
    }

    fn scan(&self) -> Option<&Scan> {
        match &self.link {
            Link::Recording(recording) => recording.client().map(Listener::scan),
            Link::Tcp(link) => link.client().map(Client::scan),
            Link::Serial(link) => link.scan(),
        }
    }
}
