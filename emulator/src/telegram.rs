//! One scan telegram on its way to all clients: encoded once a dialect and name, handed to every client that wants it.

use std::sync::Arc;
use std::sync::atomic::Ordering;

use bytes::Bytes;
use rowscan_ports::{Delivered, Delivery};
use rowscan_protocol::device::{DeviceEvent as Event, monitor_event, scan_event};
use rowscan_protocol::frame::Dialect;
use rowscan_protocol::telegram::LmdScandata;
use rowscan_protocol::time::SimTime;

use crate::roster::{Member, QueuedTelegram, Wants};
use crate::shared::Shared;
use crate::view::ScannerView;

/// One scan telegram, encoded once a dialect and name, whoever many want it.
#[derive(Debug, Default)]
pub(crate) struct Telegram {
    counter: u16,
    scan: Frames,
    monitor: Frames,
}

/// The same telegram in both dialects, as far as someone wants it.
#[derive(Debug, Default)]
struct Frames {
    a: Option<Bytes>,
    b: Option<Bytes>,
}

impl Frames {
    fn encode(
        scan: &LmdScandata,
        wanted: impl Fn(Dialect) -> bool,
        encode: fn(Dialect, &LmdScandata, &mut Vec<u8>),
    ) -> Self {
        let frame = |dialect| {
            wanted(dialect).then(|| {
                let mut frame = Vec::with_capacity(room(dialect, scan));
                encode(dialect, scan, &mut frame);
                Bytes::from(frame)
            })
        };
        Self { a: frame(Dialect::A), b: frame(Dialect::B) }
    }

    fn in_dialect(&self, dialect: Dialect) -> Option<Bytes> {
        match dialect {
            Dialect::A => self.a.clone(),
            Dialect::B => self.b.clone(),
        }
    }
}

/// Bytes to set aside for a telegram: more than it has, so that it is never moved while it is written.
fn room(dialect: Dialect, scan: &LmdScandata) -> usize {
    const HEAD: usize = 512;
    let values: usize = scan.channels16.iter().map(|channel| channel.values.len()).sum();
    let bytes: usize = scan.channels8.iter().map(|channel| channel.values.len()).sum();
    match dialect {
        Dialect::A => HEAD + 5 * values + 3 * bytes,
        Dialect::B => HEAD + 2 * values + bytes,
    }
}

impl Telegram {
    /// Lets the device turn its line into a telegram; `None` if it does not measure or leaves this turn out.
    pub(crate) fn measure(
        shared: &Shared,
        at: SimTime,
        world: &ScannerView,
        audience: &[(Arc<Member>, Wants)],
    ) -> Option<Self> {
        let mut device = shared.device();
        let measured = device.measure(at, &world.line()).map(|scan| {
            if let Some(lines) = &shared.config.lines {
                lines.show_cola(at, scan, world);
            }
            let wanted = |of: fn(&Wants) -> bool| {
                move |dialect| audience.iter().any(|(_, wants)| wants.dialect == dialect && of(wants))
            };
            Self {
                counter: scan.telegram_counter,
                scan: Frames::encode(scan, wanted(Wants::scans), scan_event),
                monitor: Frames::encode(scan, wanted(Wants::monitor), monitor_event),
            }
        });
        shared.spread(&device);
        measured
    }

    /// Its number.
    pub(crate) fn counter(&self) -> u16 {
        self.counter
    }

    /// Hands it to everyone who wants it. Paced, a full queue drops it for that client alone; else the clock waits.
    pub(crate) async fn deliver(
        &self,
        shared: &Shared,
        audience: &[(Arc<Member>, Wants)],
        delivery: Delivery,
    ) {
        if let Some(latency) = shared.config.latency.as_ref().filter(|_| !audience.is_empty()) {
            latency.sent(self.counter);
        }
        for (member, wants) in audience {
            let scan = wants.scans().then(|| self.scan.in_dialect(wants.dialect)).flatten();
            let monitor = wants.monitor().then(|| self.monitor.in_dialect(wants.dialect)).flatten();
            let scan = scan.map(|frame| (Event::ScanData, frame));
            let monitor = monitor.map(|frame| (Event::Monitor, frame));
            for (event, frame) in scan.into_iter().chain(monitor) {
                hand_over(shared, member, Some(event), frame, delivery).await;
            }
        }
    }
}

/// Puts a telegram into a client's queue, and counts what became of it.
pub(crate) async fn hand_over(
    shared: &Shared,
    member: &Member,
    event: Option<Event>,
    frame: Bytes,
    delivery: Delivery,
) {
    let telegram = QueuedTelegram { event, frame, pending: shared.in_flight.enter() };
    match delivery.put(member.queue(), telegram).await {
        Delivered::Taken => shared.counts.sent.fetch_add(1, Ordering::Relaxed),
        Delivered::Lost => shared.counts.dropped.fetch_add(1, Ordering::Relaxed),
        Delivered::Gone => return,
    };
}
