//! A TCP link that is kept: dialled, probed for its dialect, set up, and restored when lost.

use std::time::Duration;

use rowscan_protocol::client::{Client, DeviceInfo, Event};
use rowscan_protocol::frame::Dialect;
use tokio::net::TcpStream;

use crate::clock::{HostTime, Stopwatch};
use crate::config::DriverConfig;
use crate::connection::{Connection, Happened};
use crate::dial;
use crate::error::{DriverError, Heard};
use crate::link_event::{LinkEvent, LinkEvents};
use crate::outage::Outages;

/// One scanner's link. Whenever there is no connection, the next step dials one.
#[derive(Debug)]
pub(crate) struct TcpLink {
    address: String,
    config: DriverConfig,
    /// The dialect that answered last.
    dialect: Dialect,
    connection: Option<Live>,
    outages: Outages,
    watch: Stopwatch,
    connections: u64,
    /// Bad frames of the connections before this one.
    frames_bad_before: u64,
}

#[derive(Debug)]
struct Live {
    connection: Connection<TcpStream>,
    opened: Duration,
    scanned: bool,
}

/// How a device took the start-up.
enum Greeting {
    Ready(DeviceInfo),
    /// It did not answer the first command in this dialect; so many bytes came that are no telegram.
    Silent {
        junk: u64,
    },
}

impl TcpLink {
    pub(crate) async fn open(
        address: String,
        config: DriverConfig,
        events: &LinkEvents,
    ) -> Result<Self, DriverError> {
        let watch = Stopwatch::start();
        let mut link = Self {
            address,
            dialect: config.prefer,
            outages: Outages::new(config.backoff, watch),
            config,
            connection: None,
            watch,
            connections: 0,
            frames_bad_before: 0,
        };
        match link.connect(events).await {
            Err(cause) if link.config.wait => link.lose(cause, events)?,
            outcome => outcome?,
        }
        Ok(link)
    }

    /// The session's next event; restores the link as often as needed. `None` once the session has stopped. Cancel safe.
    pub(crate) async fn next_event(&mut self, events: &LinkEvents) -> Result<Option<Event>, DriverError> {
        loop {
            let Some(live) = &mut self.connection else {
                self.restore(events).await?;
                continue;
            };
            let address = self.address.clone();
            let timeout =
                if live.scanned { self.config.stall_timeout } else { self.config.first_scan_timeout };
            let cause = match live.connection.next_event(Some(timeout)).await {
                Ok(Happened::Event(Event::Stopped)) => return Ok(None),
                Ok(Happened::Event(event)) => {
                    live.scanned |= event == Event::Scan;
                    return Ok(Some(event));
                }
                Ok(Happened::Closed) => DriverError::Closed { address, when: "while it streamed" },
                Ok(Happened::Stalled) => DriverError::Stalled { address, timeout },
                Err(cause) => DriverError::Link { address, cause },
            };
            self.lose(cause, events)?;
        }
    }

    /// Asks the device to stop and reads on until it has, for at most `patience`.
    pub(crate) async fn stop(&mut self, patience: Duration) {
        let deadline = self.watch.now() + patience;
        let Some(Live { connection, .. }) = &mut self.connection else { return };
        connection.stop();
        let drained = async {
            while let Ok(Happened::Event(event)) = connection.next_event(Some(patience)).await {
                if matches!(event, Event::Stopped) {
                    break;
                }
            }
        };
        tokio::select! {
            () = drained => {}
            () = self.watch.until(Some(deadline)) => {}
        }
    }

    pub(crate) fn client(&self) -> Option<&Client> {
        self.connection.as_ref().map(|live| live.connection.client())
    }

    /// Host time since the link was made.
    pub(crate) fn now(&self) -> HostTime {
        HostTime(self.watch.now())
    }

    /// When the last bytes came, since the link was first opened.
    pub(crate) fn last_received(&self) -> HostTime {
        HostTime(
            self.connection
                .as_ref()
                .map_or(Duration::ZERO, |live| live.opened + live.connection.last_received()),
        )
    }

    pub(crate) fn connections(&self) -> u64 {
        self.connections
    }

    pub(crate) fn frames_bad(&self) -> u64 {
        self.frames_bad_before + self.client().map_or(0, |client| client.counts().bad)
    }

    /// Dials and runs the start-up, in the dialect that answered last and then in the other one.
    ///
    /// A new connection for each: some devices stay silent on a connection that once spoke the wrong dialect.
    async fn connect(&mut self, events: &LinkEvents) -> Result<(), DriverError> {
        let mut junk_bytes = 0;
        for dialect in [self.dialect, self.dialect.other()] {
            let opened = self.watch.now();
            let stream = dial::tcp(&self.address, self.config.connect_timeout)
                .await
                .map_err(|cause| DriverError::Connect { address: self.address.clone(), cause })?;
            let client = Client::new(self.config.client.clone(), dialect);
            let mut connection = Connection::new(stream, client).tapped(self.config.tap.clone());
            match self.greet(&mut connection, events).await? {
                Greeting::Ready(DeviceInfo { ident, firmware }) => {
                    events.push(LinkEvent::Ready { ident, firmware, dialect });
                    self.dialect = dialect;
                    self.connection = Some(Live { connection, opened, scanned: false });
                    self.outages.over();
                    self.connections += 1;
                    return Ok(());
                }
                Greeting::Silent { junk } => junk_bytes += junk,
            }
        }
        Err(DriverError::NoDialect {
            address: self.address.clone(),
            timeout: self.config.client.reply_timeout,
            heard: Heard { bytes: junk_bytes },
        })
    }

    /// Runs the start-up to its end on a fresh connection.
    async fn greet(
        &self,
        connection: &mut Connection<TcpStream>,
        events: &LinkEvents,
    ) -> Result<Greeting, DriverError> {
        let address = || self.address.clone();
        loop {
            match connection.next_event(None).await {
                Ok(Happened::Event(Event::Ready(info))) => return Ok(Greeting::Ready(info)),
                Ok(Happened::Event(Event::NoAnswer { command, dialect })) => {
                    let counts = connection.client().counts();
                    return if counts.frames == 0 {
                        Ok(Greeting::Silent { junk: counts.skipped_bytes })
                    } else {
                        let timeout = self.config.client.reply_timeout;
                        Err(DriverError::NoAnswer { address: address(), command, dialect, timeout })
                    };
                }
                Ok(Happened::Event(Event::Refused { command, error, fatal: true })) => {
                    return Err(DriverError::Refused { address: address(), command, code: error });
                }
                Ok(Happened::Event(Event::Refused { command, error, fatal: false })) => {
                    events.push(LinkEvent::Refused { command, code: error });
                }
                Ok(Happened::Event(_) | Happened::Stalled) => {}
                Ok(Happened::Closed) => {
                    return Err(DriverError::Closed { address: address(), when: "during start-up" });
                }
                Err(cause) => return Err(DriverError::Link { address: address(), cause }),
            }
        }
    }

    /// One attempt to restore a lost link, after its pause.
    async fn restore(&mut self, events: &LinkEvents) -> Result<(), DriverError> {
        self.outages.pause().await;
        match self.connect(events).await {
            Ok(()) => Ok(()),
            Err(cause) => self.lose(cause, events),
        }
    }

    /// Notes that the link is down; an error once it has been down for too long.
    fn lose(&mut self, cause: DriverError, events: &LinkEvents) -> Result<(), DriverError> {
        self.frames_bad_before = self.frames_bad();
        self.connection = None;
        self.outages.lose(&self.address, cause, events)
    }
}
