//! Where a recorded stream goes: to a scanner's clients, out on GNSS lines, onto a bus.

use std::sync::Arc;
use std::time::Duration;

use rowscan_faults::StreamFaults;
use rowscan_protocol::device::DeviceEvent as Event;
use rowscan_protocol::time::SimTime;
use rowscan_recording::{Side, StreamKind, Tap, Taps};
use tokio::sync::Mutex;
use tokio::task::JoinSet;

use super::playback_queue::PlaybackQueue;
use super::telegram::hand_over;
use crate::clock::{SimClock, TimeScale};
use crate::datagram_outlet::DatagramOutlet;
use crate::replay::{Part, PlaybackEvent};
use crate::roster::{Member, Wants};
use crate::shared::Shared;
use crate::{Emulator, SerialEmulator};
use rowscan_bus::link::PortEvent;
use rowscan_bus::nmea::NmeaLine;
use rowscan_bus::{Bus, CanFrame, Inbox};
use rowscan_ports::{Delivery, Untaken};
use rowscan_ports::{clock as host, task};

/// Where one stream of a recording goes.
#[derive(Debug)]
pub struct Outlet {
    kind: Kind,
    /// Of its pseudo-terminals.
    untaken: Vec<Untaken>,
    /// What may hold its scans back behind it.
    faults: Option<StreamFaults>,
}

#[derive(Debug)]
enum Kind {
    Scanner(ScannerOutlet),
    Datagrams(Box<DatagramOutlet>),
    Lms2xx(PlaybackQueue),
    Nmea(NmeaOutlet),
    Can(CanOutlet),
}

/// A scanner's clients.
#[derive(Debug)]
struct ScannerOutlet {
    shared: Arc<Shared>,
    /// Whoever is connected takes it; else who wants scans.
    anyone: bool,
    audience: Vec<(Arc<Member>, Wants)>,
}

/// Lines that carry sentences, whoever listens.
#[derive(Debug)]
struct NmeaOutlet {
    lines: Vec<NmeaLine>,
    delivery: Delivery,
    tap: Tap,
}

/// A bus, whoever listens.
#[derive(Debug)]
struct CanOutlet {
    bus: Arc<Bus>,
    /// Until someone listens to it.
    inbox: Mutex<Option<Inbox>>,
    delivery: Delivery,
    tap: Tap,
}

impl Outlet {
    /// The clients of a replayed scanner. With `scans` on the recording it waits for somebody who wants them, else for anybody.
    pub fn scanner(emulator: &Emulator, scans: bool) -> Self {
        let shared = Arc::clone(&emulator.shared);
        let anyone = !scans || shared.is_verbatim();
        Self::of(Kind::Scanner(ScannerOutlet { shared, anyone, audience: Vec::new() }))
    }

    /// Where a replayed scanner's datagrams go. It waits until they go somewhere.
    pub fn datagrams(emulator: &Emulator) -> Self {
        Self::of(Kind::Datagrams(Box::new(DatagramOutlet::new(&emulator.shared))))
    }

    /// The line of a replayed LMS2xx; none if it is not replayed. Where the times of its scans are assumed, they are those of the line: it is
    /// waited for.
    pub fn lms2xx(emulator: &SerialEmulator, part: &Part) -> Option<Self> {
        let queue = emulator.playback_queue()?.clone();
        let queue = if part.assumed_hz.is_some() { queue.patient() } else { queue };
        Some(Self::of(Kind::Lms2xx(queue)))
    }

    /// GNSS lines; the stream is recorded again as `name`.
    pub fn nmea(name: &str, lines: Vec<NmeaLine>, scale: TimeScale, taps: &Taps) -> Self {
        let tap = taps.open(name, StreamKind::Nmea);
        Self::of(Kind::Nmea(NmeaOutlet { lines, delivery: scale.delivery(), tap }))
    }

    /// A bus; the stream is recorded again as `name`, with what others say on the bus.
    pub fn can(name: &str, (bus, inbox): (Bus, Inbox), scale: TimeScale, taps: &Taps) -> Self {
        let tap = taps.open(name, StreamKind::Can);
        let (bus, inbox) = (Arc::new(bus), Mutex::new(Some(inbox)));
        Self::of(Kind::Can(CanOutlet { bus, inbox, delivery: scale.delivery(), tap }))
    }

    fn of(kind: Kind) -> Self {
        Self { kind, untaken: Vec::new(), faults: None }
    }

    /// The same with these faults on its way to the clients.
    pub fn through(self, faults: Option<StreamFaults>) -> Self {
        Self { faults, ..self }
    }

    /// The same, which is played to its end only once the clients of these pseudo-terminals have read it.
    pub fn read_by(self, untaken: Vec<Untaken>) -> Self {
        Self { untaken, ..self }
    }

    /// Starts what must hear, too.
    pub(crate) fn listen(&self, clock: &Arc<SimClock>, tasks: &mut JoinSet<()>) {
        if let Kind::Can(outlet) = &self.kind
            && let Ok(Some(inbox)) = outlet.inbox.try_lock().map(|mut inbox| inbox.take())
        {
            let (bus, tap, clock) = (Arc::clone(&outlet.bus), outlet.tap.clone(), Arc::clone(clock));
            tasks.spawn(task(carry(bus, inbox, tap, clock, outlet.delivery)));
        }
    }

    /// Waits until somebody wants what is on the recording. Lines and buses speak whether anybody listens or not. A clock that waits for its clients goes
    /// on meanwhile for what faults hold back: that may be what a client waits for.
    pub(crate) async fn taker(&self, clock: &SimClock) {
        let taken = async {
            match &self.kind {
                Kind::Scanner(outlet) => outlet.taker().await,
                Kind::Datagrams(outlet) => outlet.taker().await,
                Kind::Lms2xx(queue) => queue.taker().await,
                Kind::Nmea(_) | Kind::Can(_) => {}
            }
        };
        match self.faults.as_ref().filter(|_| clock.delivery().is_patient()) {
            None => taken.await,
            Some(faults) => tokio::select! {
                biased;
                () = taken => {}
                () = pass_time(faults, clock) => {}
            },
        }
    }

    /// True if recorded time waits for what is put.
    pub(crate) fn sets_the_pace(&self) -> bool {
        matches!(&self.kind, Kind::Lms2xx(queue) if queue.is_patient())
    }

    /// Sends an event that is due; false if it goes unheard because a client has stopped the scanner, or is lost.
    pub(crate) async fn put(&mut self, event: &PlaybackEvent, due: SimTime) -> bool {
        match &mut self.kind {
            Kind::Scanner(outlet) => return outlet.put(event).await,
            Kind::Datagrams(outlet) => return outlet.put(event, due).await,
            Kind::Lms2xx(queue) => return queue.put(event).await,
            Kind::Nmea(outlet) => {
                let bytes = event.bytes();
                outlet.tap.record(Side::Device, &bytes);
                for line in &outlet.lines {
                    line.send(bytes.clone(), outlet.delivery).await;
                }
            }
            Kind::Can(outlet) => {
                let bytes = event.bytes();
                outlet.tap.record(Side::Device, &bytes);
                match std::str::from_utf8(&bytes).ok().and_then(CanFrame::from_text) {
                    Some(frame) => outlet.bus.send((due, frame), None, outlet.delivery).await,
                    None => tracing::debug!("no classic CAN frame: passed over"),
                }
            }
        }
        true
    }

    /// Waits until everything put has left, where that takes its time whether anybody reads or not.
    pub(crate) async fn leave(&self) {
        if let Kind::Lms2xx(queue) = &self.kind {
            queue.flushed().await;
        }
    }

    /// What is on its way to clients: in their queues, and held back by faults.
    pub(crate) fn on_its_way(&self) -> OnItsWay {
        let queued = match &self.kind {
            Kind::Scanner(outlet) => outlet.shared.in_flight.pending(),
            Kind::Lms2xx(queue) => queue.pending(),
            Kind::Datagrams(_) | Kind::Nmea(_) | Kind::Can(_) => 0,
        };
        let faults = self.faults.as_ref();
        OnItsWay {
            queued,
            held: faults.map_or(0, |faults| faults.held().pending()),
            next: faults.and_then(StreamFaults::first_due),
        }
    }

    /// Counts what no client has taken, and what faults hold back, as dropped: it was sent to nobody.
    pub(crate) fn give_up(&self) {
        let held = self.faults.as_ref().map_or(0, StreamFaults::give_up);
        match &self.kind {
            Kind::Scanner(ScannerOutlet { shared, .. }) => {
                shared.count_as_dropped(shared.in_flight.pending() + held);
            }
            Kind::Lms2xx(queue) => queue.lose(held),
            Kind::Datagrams(_) | Kind::Nmea(_) | Kind::Can(_) => {}
        }
    }

    /// Waits until everything put has gone, and has been read where that can be told.
    pub(crate) async fn drain(&self, clock: &SimClock) {
        match &self.kind {
            Kind::Scanner(outlet) => outlet.shared.in_flight.flushed().await,
            // Its client may have to end the stream over an interface that goes with the tape.
            Kind::Datagrams(outlet) => outlet.left().await,
            Kind::Lms2xx(queue) => queue.flushed().await,
            Kind::Nmea(outlet) => {
                for line in &outlet.lines {
                    line.taken().await;
                }
            }
            Kind::Can(outlet) => outlet.bus.taken().await,
        }
        if let Some(faults) = &self.faults {
            let_go(faults, clock).await;
        }
        for untaken in &self.untaken {
            untaken.taken().await;
        }
    }
}

/// Telegrams that have been put and have not reached anybody.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct OnItsWay {
    pub(crate) queued: u64,
    pub(crate) held: u64,
    /// When the next piece of what is held may leave: a slow one is on its way, too.
    pub(crate) next: Option<Duration>,
}

impl OnItsWay {
    /// What is on its way in both.
    pub(crate) fn and(self, other: Self) -> Self {
        Self {
            queued: self.queued + other.queued,
            held: self.held + other.held,
            next: self.next.max(other.next),
        }
    }
}

/// How long what is due has to leave before it is looked at again, host time.
const LOOK_AGAIN: Duration = Duration::from_millis(1);

/// Waits until faults hold nothing back. Behind a recording's end nothing moves the time of a clock that waits for its clients: it goes on here, from one
/// telegram that is due to the next.
async fn let_go(faults: &StreamFaults, clock: &SimClock) {
    faults.end();
    let held = faults.held();
    while held.pending() > 0 {
        let next = faults.next_due().map(|at| SimTime::ZERO + at);
        match next.filter(|_| clock.delivery().is_patient()) {
            Some(at) if at > clock.now() => clock.reach(at).await,
            // It is being written, or nobody knows when it will be.
            Some(_) | None => drop(host::within(LOOK_AGAIN, held.below(held.pending())).await),
        }
    }
}

/// Lets time come to whatever faults hold back, for ever.
async fn pass_time(faults: &StreamFaults, clock: &SimClock) {
    loop {
        match faults.needs_time().map(|at| SimTime::ZERO + at) {
            Some(at) if at > clock.now() => clock.reach(at).await,
            _ => host::rest(LOOK_AGAIN).await,
        }
    }
}

impl ScannerOutlet {
    async fn taker(&self) {
        let mut audience = Vec::new();
        loop {
            let interest = self.shared.interest.notified();
            self.shared.roster.listeners(&mut audience);
            let polled = self.shared.polls_take_scans();
            let taken = polled || audience.iter().any(|(_, wants)| self.anyone || wants.takes_scans());
            let waits = self.shared.clock.delivery().is_patient() && !self.anyone;
            if taken && (!waits || self.shared.device().is_measuring()) {
                return;
            }
            interest.await;
        }
    }

    async fn put(&mut self, event: &PlaybackEvent) -> bool {
        let Self { shared, audience, .. } = self;
        let is_scan = matches!(event.event, Some(Event::ScanData | Event::Monitor));
        // Stopped by a client: what is recorded goes on unheard.
        if is_scan && !shared.device().is_measuring() {
            return false;
        }
        shared.roster.listeners(audience);
        // A clock that waits for its clients plays one scan a poll.
        let by_polls = shared.polls_take_scans() && !audience.iter().any(|(_, wants)| wants.takes_scans());
        if is_scan && by_polls && shared.clock.delivery().is_patient() {
            shared.next_poll().await;
        }
        let cut = is_scan.then(|| event.scan()).flatten().and_then(|scan| shared.show(scan));
        for (member, wants) in audience.iter() {
            let wanted = event.event.is_none_or(|event| wants.subscriptions.has(event));
            let frame = || match &cut {
                Some(scan) => Some(event.with_scan(wants.dialect, scan)),
                None => event.in_dialect(wants.dialect),
            };
            if let Some(frame) = wanted.then(frame).flatten() {
                hand_over(shared, member, event.event, frame, shared.clock.delivery()).await;
            }
        }
        true
    }
}

/// Carries what others say on a bus from port to port.
async fn carry(bus: Arc<Bus>, mut inbox: Inbox, tap: Tap, clock: Arc<SimClock>, delivery: Delivery) {
    while let Some((port, heard)) = inbox.recv().await {
        if let PortEvent::Frame(frame) = heard {
            tap.record(Side::Host, frame.to_text().as_bytes());
            bus.send((clock.now(), frame), Some(port), delivery).await;
        }
    }
}
