//! Events for scripts beside the endpoints: that all of these are there, and what had been done by the end.

use rowscan_emulator::{ConnectionCounts, ScannerCounts};
use serde::Serialize;

use super::output::{print_event, print_json};
use super::{Failure, Format, service};

#[derive(Serialize)]
struct Ready {
    event: &'static str,
}

/// Tells scripts, and the service manager, that every endpoint has been announced.
pub(super) fn ready(format: Format) -> Result<(), Failure> {
    service::ready();
    print_event(format, &Ready { event: "ready" })
}

/// What one scanner had done by the end.
#[derive(Serialize)]
pub(super) struct End<'a> {
    event: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    stream: Option<&'a str>,
    #[serde(flatten)]
    counted: Counted,
}

/// What one scanner has done, as far as its family counts it.
#[derive(Serialize)]
pub(super) struct Counted {
    scans_sent: u64,
    /// Telegrams that clients were too slow to take.
    #[serde(skip_serializing_if = "Option::is_none")]
    scans_dropped: Option<u64>,
    /// Telegrams, of those sent, that faults have kept from their client.
    #[serde(skip_serializing_if = "Option::is_none")]
    scans_kept_by_faults: Option<u64>,
    /// Scans left out because the host was too slow.
    #[serde(skip_serializing_if = "Option::is_none")]
    scans_missed: Option<u64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    connections_refused: Option<u64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    connections_silent: Option<u64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    connections_idle: Option<u64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    bytes_lost: Option<u64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    datagrams_sent: Option<u64>,
    /// Not sent, because nobody has allowed their destination.
    #[serde(skip_serializing_if = "Option::is_none")]
    datagrams_withheld: Option<u64>,
    /// Sent to a port of this machine where nobody listened.
    #[serde(skip_serializing_if = "Option::is_none")]
    datagrams_unheard: Option<u64>,
    /// Refused by the system.
    #[serde(skip_serializing_if = "Option::is_none")]
    datagrams_failed: Option<u64>,
    /// Where scans would go, and may not.
    #[serde(skip_serializing_if = "Option::is_none")]
    destination_not_allowed: Option<String>,
}

impl From<ScannerCounts> for Counted {
    fn from(counts: ScannerCounts) -> Self {
        let ScannerCounts { connections, datagrams, .. } = counts;
        Self {
            scans_sent: counts.scans_sent,
            scans_dropped: counts.scans_dropped,
            scans_kept_by_faults: counts.scans_kept_by_faults,
            scans_missed: counts.scans_missed,
            connections_refused: connections.map(|of| of.refused),
            connections_silent: connections.map(|of| of.silent),
            connections_idle: connections.map(|of| of.idle),
            bytes_lost: counts.bytes_lost,
            datagrams_sent: datagrams.map(|of| of.sent),
            datagrams_withheld: datagrams.map(|of| of.withheld),
            datagrams_unheard: datagrams.map(|of| of.unheard),
            datagrams_failed: datagrams.map(|of| of.failed),
            destination_not_allowed: datagrams.and_then(|of| of.foreign).map(|to| to.to_string()),
        }
    }
}

impl<'a> End<'a> {
    /// Of the scanner of this stream.
    pub(super) fn of(stream: Option<&'a str>, counts: ScannerCounts) -> Self {
        Self { event: "end", stream, counted: counts.into() }
    }
}

/// All that ended, where that is one document.
#[derive(Serialize)]
struct Ends<'a> {
    streams: &'a [End<'a>],
}

/// Tells scripts what every stream has done: an event each for jsonl, the one document for json.
pub(super) fn tell_ends(format: Format, streams: &[End<'_>]) -> Result<(), Failure> {
    match format {
        Format::Json => print_json(format, &Ends { streams }),
        _ => streams.iter().try_for_each(|end| print_event(format, end)),
    }
}

/// What a scanner has done, for people.
pub(super) fn told(counts: &ScannerCounts) -> String {
    let mut text = format!("{} scans sent", counts.scans_sent);
    let mut add = |count: &Option<u64>, what: &str| {
        if let Some(count) = count {
            text += &format!(", {count} {what}");
        }
    };
    add(&counts.scans_kept_by_faults, "of them kept from clients by faults");
    let dropped = match counts.scans_kept_by_faults {
        Some(_) => "dropped because clients, or faults before them, were slow",
        None => "dropped for slow clients",
    };
    add(&counts.scans_dropped, dropped);
    add(&counts.scans_missed, "missed by a slow host");
    add(&counts.bytes_lost, "bytes not taken");
    if let Some(datagrams) = counts.datagrams {
        add(&Some(datagrams.sent), "datagrams sent");
        let unsent = [
            (datagrams.withheld, "withheld"),
            (datagrams.unheard, "where nobody listened"),
            (datagrams.failed, "refused by the system"),
        ];
        unsent.iter().filter(|(count, _)| *count > 0).for_each(|(count, what)| add(&Some(*count), what));
    }
    if let Some(ConnectionCounts { refused, silent, idle }) = counts.connections {
        text += &format!("; connections: {refused} refused, {silent} closed as silent, {idle} as idle");
    }
    text
}
