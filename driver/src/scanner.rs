//! A scanner as its user sees it: scans, one after another, whatever the link does.

use std::fmt;
use std::future::poll_fn;
use std::time::Duration;

use rowscan_protocol::compact::SegmentCounts;
use rowscan_protocol::host::{HostEvent, SettingNote};
use rowscan_protocol::model::AnyModel;
use rowscan_protocol::reading::{Reading, ReadingCounts};
use rowscan_protocol::scan::Scan;
use rowscan_protocol::validity::{FaultCounts, ScanFault};
use rowscan_recording::StreamKind;

use crate::clock::HostTime;
use crate::config::DriverConfig;
#[cfg(feature = "tcp")]
use crate::endpoint::ColaEndpoint;
#[cfg(any(feature = "tcp", feature = "serial"))]
use crate::endpoint::{Endpoint, Lms2xxEndpoint, Place};
use crate::error::DriverError;
use crate::feed::Feed;
use crate::left_out::StreamsLeftOut;
#[cfg(any(feature = "tcp", feature = "serial"))]
use crate::link::Link;
use crate::link_event::{LinkEvent, LinkEvents};
#[cfg(feature = "tcp")]
use crate::picoscan::PicoEndpoint;
#[cfg(feature = "recordings")]
use crate::recording::Recording;
use crate::source::Source;

/// One scan with the time it arrived.
#[derive(Clone, Copy, Debug)]
pub struct Record<'a> {
    /// The scan; its own fields hold the device's times.
    pub scan: &'a Scan,
    /// When its last byte was read, since the scanner was opened. For a recording, since its first packet; zero if it has no times.
    pub received: HostTime,
    /// False of a recording without times: nobody knows when it was received.
    pub is_timed: bool,
}

impl Record<'_> {
    /// When its last byte was read, seconds; NaN where nobody knows.
    pub fn received_s(&self) -> f64 {
        if self.is_timed { self.received.0.as_secs_f64() } else { f64::NAN }
    }
}

/// What comes from a scanner.
#[derive(Clone, Debug)]
pub enum Arrival<'a> {
    /// A scan.
    Scan(Record<'a>),
    /// A scan telegram in a valid frame that gives no scan.
    Unreadable {
        /// Why.
        fault: ScanFault,
        /// When its last byte was read, as in a [`Record`].
        received: HostTime,
    },
    /// How the scanner moves, or what its encoder counts.
    Reading {
        /// What it says.
        reading: Reading,
        /// When its last byte was read, as in a [`Record`].
        received: HostTime,
    },
}

/// An [`Arrival`] whose scan is still in the feed.
enum Heard {
    Scan,
    Unreadable(ScanFault),
    Reading(Reading),
}

/// Counts of a link since it was opened.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LinkCounts {
    /// Connections that reached streaming, the first included; 0 for a recording.
    pub connections: u64,
    /// Frames refused by checksum or length, and scan telegrams that could not be read.
    pub telegrams_bad: u64,
    /// What became of the parts of scans, where scans come in parts; what the beams of lost ones met is unknown.
    pub segments: SegmentCounts,
    /// Telegrams of other scanners that came in the same stream (two that send to one UDP port), and were left out.
    pub telegrams_foreign: u64,
    /// Telegrams of inertial measurement unit and encoder.
    pub readings: ReadingCounts,
}

/// A live scanner or a recording, opened.
pub struct Scanner {
    feed: Box<dyn Feed>,
    events: LinkEvents,
    faults: FaultCounts,
    readings: ReadingCounts,
}

impl Scanner {
    /// Opens `source`. For a live scanner this returns once it streams, or fails fast (unless `config.wait`).
    pub async fn open(source: &Source, config: DriverConfig) -> Result<Self, DriverError> {
        let events = LinkEvents::default();
        let feed: Box<dyn Feed> = match source {
            #[cfg(feature = "tcp")]
            Source::Tcp { address } => {
                live(ColaEndpoint::new(address.clone(), &config), config, &events).await?
            }
            #[cfg(feature = "tcp")]
            Source::Picoscan(place) => {
                live(PicoEndpoint::new(place.clone(), &config), config, &events).await?
            }
            #[cfg(feature = "serial")]
            Source::Serial { path, rate } => {
                let endpoint = lms2xx(Place::Local(path.clone()), source, *rate, &config);
                live(endpoint, config, &events).await?
            }
            #[cfg(feature = "tcp")]
            Source::Rfc2217 { address, rate } => {
                let endpoint = lms2xx(Place::Remote(address.clone()), source, *rate, &config);
                live(endpoint, config, &events).await?
            }
            #[cfg(feature = "recordings")]
            Source::Recording { path, stream } => {
                Box::new(Recording::open(path, stream.as_deref(), config.cola.max_payload, config.tap)?)
            }
            #[cfg(not(all(feature = "tcp", feature = "serial", feature = "recordings")))]
            source => {
                return Err(DriverError::Feature {
                    source_text: source.to_string(),
                    feature: source.feature(),
                });
            }
        };
        Ok(Self { feed, events, faults: FaultCounts::default(), readings: ReadingCounts::default() })
    }

    /// The models that the scanner can be by what it, or its recording, says; several where it names a family, none where it names nothing that is
    /// modelled. Of a recording that says nothing, those whose scans come in such telegrams and no other ones.
    pub fn models(&self) -> Vec<AnyModel> {
        let device = self.events.device();
        let told =
            device.map_or_else(Vec::new, |device| AnyModel::of_device(&device.ident, &device.firmware));
        let named: Vec<AnyModel> = self.feed.recorded_models().into_iter().chain(told).collect();
        match self.feed.recorded_kind() {
            Some(kind) if named.is_empty() => of_kind(kind),
            _ => named,
        }
    }

    /// What became of its settings, where that is not all that was wanted, or not what was found; each note once, over all connections. None of a
    /// recording.
    pub fn settings(&self) -> Vec<SettingNote> {
        self.events.settings()
    }

    /// The next scan; `None` at the end of a recording. Telegrams that give no scan, and readings, are counted and passed over.
    ///
    /// A lost live link is dialled again and configured anew; the scans missed meanwhile show in the telegram counters.
    ///
    /// Cancel safe at every await: no scan is lost if the future is dropped, and an attempt to restore the link goes on with the next call.
    pub async fn next(&mut self) -> Result<Option<Record<'_>>, DriverError> {
        loop {
            match self.next_heard().await? {
                Some(Heard::Scan) => break,
                Some(Heard::Unreadable(_) | Heard::Reading(_)) => {}
                None => return Ok(None),
            }
        }
        Ok(self.record())
    }

    /// The next scan, scan telegram that gives none, or reading, in the order they came; else as [`next`](Self::next).
    pub async fn arrival(&mut self) -> Result<Option<Arrival<'_>>, DriverError> {
        match self.next_heard().await? {
            Some(Heard::Scan) => Ok(self.record().map(Arrival::Scan)),
            Some(Heard::Unreadable(fault)) => {
                Ok(Some(Arrival::Unreadable { fault, received: self.feed.received() }))
            }
            Some(Heard::Reading(reading)) => {
                Ok(Some(Arrival::Reading { reading, received: self.feed.received() }))
            }
            None => Ok(None),
        }
    }

    async fn next_heard(&mut self) -> Result<Option<Heard>, DriverError> {
        loop {
            match poll_fn(|cx| self.feed.poll_event(cx)).await? {
                Some(HostEvent::Scan) => return Ok(Some(Heard::Scan)),
                Some(HostEvent::Malformed { fault }) => {
                    if self.faults.count(&fault) {
                        self.events.push(LinkEvent::Malformed { fault: fault.clone() });
                    }
                    return Ok(Some(Heard::Unreadable(fault)));
                }
                Some(HostEvent::OtherSender { found, followed }) => warn_of_other(found, followed),
                Some(HostEvent::Reading(reading)) => {
                    self.readings.count(&reading);
                    return Ok(Some(Heard::Reading(reading)));
                }
                Some(_) => {}
                None => return Ok(None),
            }
        }
    }

    fn record(&self) -> Option<Record<'_>> {
        let (received, is_timed) = (self.feed.received(), self.feed.is_timed());
        self.feed.scan().map(|scan| Record { scan, received, is_timed })
    }

    /// Scan telegrams in valid frames that gave no scan, by cause.
    pub fn faults(&self) -> &FaultCounts {
        &self.faults
    }

    /// Of a recording with several streams of scans, of which none was named, the one that is read and those left out; `None` of others, and of a live
    /// scanner.
    pub fn streams_left_out(&self) -> Option<StreamsLeftOut> {
        self.feed.streams_left_out()
    }

    /// Where a recording that was read to its end breaks off, in words; `None` of a whole one, before its end, and of a live scanner.
    pub fn broken_off(&self) -> Option<String> {
        self.feed.broken_off()
    }

    /// True of a capture that does not hold all bytes that passed.
    pub fn lacks_bytes(&self) -> bool {
        self.feed.lacks_bytes()
    }

    /// Time now on the watch that [`Record::received`] was read from; zero for a recording.
    pub fn now(&self) -> HostTime {
        self.feed.now()
    }

    /// Ends the stream at the device and drains the link; waits at most `patience`.
    pub async fn stop(mut self, patience: Duration) -> LinkCounts {
        self.feed.begin_stop(patience);
        poll_fn(|cx| self.feed.poll_stopped(cx)).await;
        self.counts()
    }

    /// Counts of the link so far.
    pub fn counts(&self) -> LinkCounts {
        LinkCounts {
            connections: self.feed.connections(),
            telegrams_bad: self.feed.frames_bad() + self.faults.total(),
            segments: self.feed.segments(),
            telegrams_foreign: self.feed.telegrams_foreign(),
            readings: self.readings,
        }
    }

    /// Events of the link as they happen, also while [`next`](Self::next) restores it.
    pub fn link_events(&self) -> LinkEvents {
        self.events.clone()
    }
}

impl fmt::Debug for Scanner {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Scanner").field("counts", &self.counts()).finish_non_exhaustive()
    }
}

#[cfg(all(test, any(feature = "tcp", feature = "serial")))]
impl Scanner {
    /// A scanner on an endpoint of a test.
    pub(crate) async fn open_endpoint<E: Endpoint + 'static>(
        endpoint: E,
        config: DriverConfig,
    ) -> Result<Self, DriverError> {
        let events = LinkEvents::default();
        let feed = live(endpoint, config, &events).await?;
        Ok(Self { feed, events, faults: FaultCounts::default(), readings: ReadingCounts::default() })
    }
}

/// The models whose scans come in telegrams of this kind alone; none for CoLa, which most of them speak besides.
fn of_kind(kind: StreamKind) -> Vec<AnyModel> {
    let sends = |model: &AnyModel| match (kind, model) {
        (StreamKind::Compact, AnyModel::Cola(model)) => model.compact.is_some(),
        (StreamKind::Lms2xx, AnyModel::Lms2xx(_)) => true,
        _ => false,
    };
    AnyModel::all().filter(sends).collect()
}

/// Tells that another scanner sends to the same place.
fn warn_of_other(found: Option<u32>, followed: Option<u32>) {
    let named =
        |number: Option<u32>| number.map_or_else(|| "without a number".to_owned(), |it| it.to_string());
    tracing::warn!(
        "telegrams of the scanner {} come in the same stream as those of the scanner {}, and are left out; expected a UDP port for each scanner (?udp=PORT)",
        named(found),
        named(followed)
    );
}

#[cfg(any(feature = "tcp", feature = "serial"))]
async fn live<E: Endpoint + 'static>(
    endpoint: E,
    config: DriverConfig,
    events: &LinkEvents,
) -> Result<Box<dyn Feed>, DriverError> {
    let mut link = Link::new(endpoint, config, events.clone());
    poll_fn(|cx| link.poll_open(cx)).await?;
    Ok(Box::new(link))
}

#[cfg(any(feature = "tcp", feature = "serial"))]
fn lms2xx(
    place: Place,
    source: &Source,
    rate: rowscan_protocol::lms2xx::Rate,
    config: &DriverConfig,
) -> Lms2xxEndpoint {
    let config = rowscan_protocol::lms2xx::client::Lms2xxConfig { rate, ..config.lms2xx.clone() };
    Lms2xxEndpoint::new(place, source.to_string(), config)
}
