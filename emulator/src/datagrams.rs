//! Compact telegrams on their way to UDP: what waits for its instant, where it may go, and what became of it.
//!
//! Anyone who reaches a scanner can tell it where to send. So a destination that a client has written is obeyed on loopback only, and elsewhere where the
//! operator allows it; else nothing is sent, and log and counts say so.

use std::collections::VecDeque;
use std::net::{IpAddr, Ipv4Addr, SocketAddrV4};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};

use rowscan_protocol::device::{Datagram, Device, Silent, Stream};
use rowscan_protocol::time::SimTime;

/// Destinations and settings that the log tells of, each once.
const MAX_TOLD: usize = 64;

/// The Compact telegrams of one scanner.
#[derive(Debug, Default)]
pub(crate) struct Datagrams {
    /// In the order of their instants.
    waiting: Mutex<VecDeque<Datagram>>,
    /// Addresses that are no loopback and may be sent to.
    allowed: Vec<IpAddr>,
    told: Mutex<Vec<(Stream, Quiet)>>,
    sent: AtomicU64,
    withheld: AtomicU64,
    unheard: AtomicU64,
    failed: AtomicU64,
    /// One more than the number of the last turn that has been sent as a whole; 0 before the first.
    turns: AtomicU64,
    /// Nobody listened where the last scan telegram went.
    deaf: AtomicBool,
    /// In lockstep: nobody listens there yet, or any more.
    absent: AtomicBool,
}

/// What became of a scanner's datagrams.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DatagramCounts {
    /// Sent.
    pub sent: u64,
    /// Not sent, because nobody has allowed their destination.
    pub withheld: u64,
    /// Sent to a port of this machine where nobody listened.
    pub unheard: u64,
    /// Refused by the system.
    pub failed: u64,
    /// The number of the last turn whose last segment was due, lost or not.
    pub last_turn: Option<u64>,
    /// Turns from one that is sent to the next.
    pub interval: u64,
    /// Lines that a turn is sent with, each a scan for who receives it.
    pub lines: u64,
    /// Where scans would go now, if that is not allowed.
    pub foreign: Option<SocketAddrV4>,
}

impl Datagrams {
    pub(crate) fn new(allowed: Vec<IpAddr>) -> Self {
        Self { allowed, ..Self::default() }
    }

    fn may_go_to(&self, address: Ipv4Addr) -> bool {
        address.is_loopback() || self.allowed.contains(&address.into())
    }

    /// Whether a datagram may go to `to`; one that may not is counted.
    pub(crate) fn admits(&self, to: SocketAddrV4) -> bool {
        let may = self.may_go_to(*to.ip());
        self.withheld.fetch_add(u64::from(!may), Ordering::Relaxed);
        may
    }

    /// Where a stream goes; none where it is off or may not go there.
    pub(crate) fn destination(&self, device: &Device, stream: Stream) -> Option<SocketAddrV4> {
        device.destination(stream).ok().filter(|to| self.may_go_to(*to.ip()))
    }

    /// Whether scans go somewhere.
    pub(crate) fn is_streaming(&self, device: &Device) -> bool {
        self.destination(device, Stream::Scan).is_some()
    }

    /// Whether scans go where somebody may take them: in lockstep somebody listens there, if it is on this machine.
    pub(crate) fn has_taker(&self, device: &Device) -> bool {
        self.is_streaming(device) && !self.absent.load(Ordering::Relaxed)
    }

    /// In lockstep: asks who listens on this machine where scans go, unless that is known of a drive under way; true if nobody does.
    pub(crate) fn look_for_receiver(
        &self,
        device: &Device,
        begun: bool,
        has_receiver: impl FnOnce(SocketAddrV4) -> bool,
    ) -> bool {
        let here = self.destination(device, Stream::Scan).filter(|to| to.ip().is_loopback());
        let is_unsure = !begun || !self.is_heard();
        let absent = is_unsure && here.is_some_and(|to| !has_receiver(to));
        self.absent.store(absent, Ordering::Relaxed);
        absent
    }

    pub(crate) fn wait(&self, datagrams: Vec<Datagram>) {
        let mut waiting = self.waiting.lock().unwrap_or_else(PoisonError::into_inner);
        waiting.extend(datagrams);
        waiting.make_contiguous().sort_by_key(|datagram| (datagram.at, datagram.stream));
    }

    pub(crate) fn next(&self) -> Option<SimTime> {
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner).front().map(|datagram| datagram.at)
    }

    pub(crate) fn take(&self, at: SimTime) -> Option<Datagram> {
        let mut waiting = self.waiting.lock().unwrap_or_else(PoisonError::into_inner);
        waiting.front().is_some_and(|datagram| datagram.at <= at).then(|| waiting.pop_front())?
    }

    pub(crate) fn count_sent(&self) {
        self.sent.fetch_add(1, Ordering::Relaxed);
    }

    /// One that was counted as sent was not.
    pub(crate) fn take_back(&self) {
        self.sent.fetch_sub(1, Ordering::Relaxed);
    }

    pub(crate) fn count_unheard(&self) {
        self.unheard.fetch_add(1, Ordering::Relaxed);
    }

    pub(crate) fn count_failed(&self) {
        self.failed.fetch_add(1, Ordering::Relaxed);
    }

    /// A turn's last segment is due.
    pub(crate) fn end_turn(&self, number: u64) {
        self.turns.store(number + 1, Ordering::Relaxed);
    }

    /// Whether somebody listens where scans go, as far as that can be known.
    pub(crate) fn note_heard(&self, is_heard: bool) {
        self.deaf.store(!is_heard, Ordering::Relaxed);
    }

    /// False once nobody listened where the last scan telegram went.
    pub(crate) fn is_heard(&self) -> bool {
        !self.deaf.load(Ordering::Relaxed)
    }

    pub(crate) fn counts(&self, device: &Device) -> Option<DatagramCounts> {
        device.model().compact?;
        let scans = device.destination(Stream::Scan).ok();
        Some(DatagramCounts {
            sent: self.sent.load(Ordering::Relaxed),
            withheld: self.withheld.load(Ordering::Relaxed),
            unheard: self.unheard.load(Ordering::Relaxed),
            failed: self.failed.load(Ordering::Relaxed),
            last_turn: self.turns.load(Ordering::Relaxed).checked_sub(1),
            interval: device.turn_interval(),
            lines: device.lines_a_turn() as u64,
            foreign: scans.filter(|to| !self.may_go_to(*to.ip())),
        })
    }

    /// Tells once what is switched on and goes nowhere.
    pub(crate) fn tell(&self, device: &Device) {
        for stream in Stream::ALL {
            let Some(quiet) = self.quiet(device, stream) else { continue };
            let mut told = self.told.lock().unwrap_or_else(PoisonError::into_inner);
            if told.contains(&(stream, quiet)) || told.len() >= MAX_TOLD {
                continue;
            }
            told.push((stream, quiet));
            tracing::warn!(
                "{} telegrams are on, and nothing is sent: {}",
                stream.name(),
                quiet.because(stream)
            );
        }
    }

    /// Why nothing comes of a stream that is switched on.
    fn quiet(&self, device: &Device, stream: Stream) -> Option<Quiet> {
        match device.destination(stream) {
            Ok(to) if !self.may_go_to(*to.ip()) => Some(Quiet::NotAllowed(to)),
            Ok(_) if stream == Stream::Scan => device.hidden_by().map(Quiet::Hidden),
            Ok(_) | Err(Silent::Off) => None,
            Err(Silent::Otherwise) => Some(Quiet::Otherwise),
        }
    }
}

/// Why nothing comes of a stream that is switched on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Quiet {
    /// Nobody has allowed that it goes there.
    NotAllowed(SocketAddrV4),
    /// It would go out otherwise than as UDP.
    Otherwise,
    /// The filter of this variable leaves nothing.
    Hidden(&'static str),
}

impl Quiet {
    fn because(self, stream: Stream) -> String {
        let [_, place] = stream.variables();
        match self {
            Self::NotAllowed(to) => format!(
                "they are to go to {to}, which is not this machine; --allow-destination {} allows it",
                to.ip()
            ),
            Self::Otherwise => {
                format!("{place} or ScanDataFormat asks for what goes out otherwise or is not emulated")
            }
            Self::Hidden(filter) => format!(
                "{filter} leaves no beam of any turn (a start behind its stop, a range between two beams, all layers off); set another, or switch it off"
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

    use rowscan_protocol::device::Identity;
    use rowscan_protocol::model::SEGMENTED;

    use super::*;

    /// The rule: whatever leaves nothing of a stream that is on is told, over all models; what leaves something is not.
    #[test]
    fn a_filter_that_leaves_nothing_is_told_and_one_that_leaves_something_is_not() {
        for model in SEGMENTED {
            let mut device = Device::new(model, Identity::default());
            device.direct("127.0.0.1:2115".parse().unwrap());
            let datagrams = Datagrams::default();
            let Some(filter) = device.variable("LFPangleRangeFilter") else { continue };
            let told = |device: &mut Device, numbers: [i64; 6]| {
                let value = numbers.map(rowscan_protocol::device::variable::Value::Number).to_vec();
                device.set_value(filter, value, SimTime::ZERO).unwrap();
                datagrams.quiet(device, Stream::Scan)
            };
            let backwards = [1, 100_000, -100_000, -900_000, 900_000, 1];
            assert_eq!(told(&mut device, backwards), None, "{}: scans are off", model.name);
            device.enable_streaming();
            assert_eq!(
                told(&mut device, backwards),
                Some(Quiet::Hidden("LFPangleRangeFilter")),
                "{}",
                model.name
            );
            assert_eq!(
                told(&mut device, [1, -100_000, 100_000, -900_000, 900_000, 1]),
                None,
                "{}",
                model.name
            );
            assert_eq!(
                told(&mut device, [0, 100_000, -100_000, -900_000, 900_000, 1]),
                None,
                "{}",
                model.name
            );
            // The log has it once.
            told(&mut device, backwards);
            (0..3).for_each(|_| datagrams.tell(&device));
            assert_eq!(datagrams.told.lock().unwrap().len(), 1, "{}", model.name);
        }
    }

    #[test]
    fn why_nothing_comes_is_told_with_its_remedy() {
        let because = |quiet: Quiet| quiet.because(Stream::Scan);
        assert!(
            because(Quiet::NotAllowed("10.0.0.7:2115".parse().unwrap()))
                .contains("--allow-destination 10.0.0.7")
        );
        assert!(because(Quiet::Otherwise).starts_with("ScanDataEthSettings or ScanDataFormat asks for"));
        assert!(because(Quiet::Hidden("LFPlayerFilter")).ends_with("set another, or switch it off"));
    }
}
