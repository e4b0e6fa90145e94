//! The tractor's control function on its CAN bus, and what the ports of the bus hear.

use std::collections::VecDeque;
use std::task::{Context, Poll};

use rowscan_bus::link::PortEvent;
use rowscan_bus::tractor::TractorEcu;
use rowscan_bus::troubles::{Carried, Speaker};
use rowscan_bus::{Bus, BusNews, BusWatch, CanFrame, Inbox, Origin};
use rowscan_ports::Delivery;
use rowscan_ports::in_flight::InFlight;
use rowscan_protocol::time::SimTime;
use rowscan_recording::{Side, StreamKind, Tap, Taps};
use tokio::sync::mpsc;

use crate::faulted::BusFaults;
use crate::firing::Firing;
use crate::lockstep::OutputCount;

/// Name of the recorded stream.
const STREAM: &str = "can";

/// The control function with its bus.
#[derive(Debug)]
pub(crate) struct BusOutput {
    ecu: TractorEcu,
    bus: Bus,
    inbox: Inbox,
    /// What the ports have heard and is not answered yet.
    heard: VecDeque<(Origin, PortEvent)>,
    watch: BusWatch,
    /// Where news of the bus go; nobody is waited for.
    news: Option<mpsc::Sender<BusNews>>,
    tap: Tap,
    /// A port is open.
    open: bool,
    /// Nothing is sent before the drive starts.
    held: bool,
    /// To be sent at the next instant.
    first: Vec<CanFrame>,
    /// Who counts the frames that others send.
    counts: Vec<OutputCount>,
    faults: BusFaults,
}

impl BusOutput {
    pub(crate) fn new(
        mut ecu: TractorEcu,
        (bus, inbox): (Bus, Inbox),
        news: Option<mpsc::Sender<BusNews>>,
        delivery: Delivery,
        taps: &Taps,
        faults: BusFaults,
    ) -> Self {
        let (open, held) = (bus.is_open_from_the_start(), delivery.is_patient());
        let mut first = Vec::new();
        if open && !held {
            ecu.open(SimTime::ZERO, &mut first);
        }
        Self {
            ecu,
            bus,
            inbox,
            heard: VecDeque::new(),
            watch: BusWatch::default(),
            news,
            tap: taps.open(STREAM, StreamKind::Can),
            open,
            held,
            first,
            counts: Vec::new(),
            faults,
        }
    }

    /// From now on these count the frames that others send.
    pub(crate) fn count_frames(&mut self, counts: Vec<OutputCount>) {
        self.counts = counts;
    }

    pub(crate) fn next(&self) -> Option<SimTime> {
        match (self.held, self.first.is_empty()) {
            (true, _) => None,
            (false, false) => Some(SimTime::ZERO),
            (false, true) => [self.ecu.next(), self.faults.next()].into_iter().flatten().min(),
        }
    }

    pub(crate) async fn fire(&mut self, firing: Firing) -> bool {
        let changed = self.faults.act(firing.at, &mut self.ecu);
        self.put(firing.at, changed, firing.delivery).await;
        let mut frames = std::mem::take(&mut self.first);
        self.ecu.poll(firing.at, &mut frames);
        self.send(firing.at, frames, firing.delivery).await;
        false
    }

    /// Takes what the ports hear.
    pub(crate) fn poll_input(&mut self, cx: &mut Context<'_>) -> Poll<()> {
        while let Poll::Ready(Some(heard)) = self.inbox.poll_recv(cx) {
            self.heard.push_back(heard);
        }
        if self.heard.is_empty() { Poll::Pending } else { Poll::Ready(()) }
    }

    /// Answers what was heard, and passes frames on from port to port.
    pub(crate) async fn respond(&mut self, at: SimTime, delivery: Delivery) {
        while let Some((origin, heard)) = self.heard.pop_front() {
            let mut replies = Vec::new();
            match heard {
                PortEvent::Opened => {
                    self.open = true;
                    if !self.held {
                        self.ecu.open(at, &mut replies);
                    }
                }
                PortEvent::Frame(frame) => {
                    let said = vec![(Speaker::Port(origin), frame)];
                    let carried = self.faults.carry(at, &mut self.ecu, said);
                    self.put(at, carried, delivery).await;
                    self.counts.iter().for_each(|count| count.frame(frame.id.bits()));
                }
                PortEvent::Lost(_) => {}
            }
            if let (Some(news), Some(told)) =
                (self.watch.news(origin.port, heard, self.ecu.address_state()), &self.news)
            {
                let _ = told.try_send(news);
            }
            self.send(at, replies, delivery).await;
        }
    }

    pub(crate) fn in_flight(&self) -> &InFlight {
        self.bus.in_flight()
    }

    pub(crate) fn has_taker(&self) -> bool {
        self.open
    }

    pub(crate) fn begin(&mut self, at: SimTime) {
        if std::mem::take(&mut self.held) && self.open {
            self.ecu.open(at, &mut self.first);
        }
    }

    /// What the tractor says goes out, as far as the bus is in order.
    async fn send(&mut self, at: SimTime, frames: Vec<CanFrame>, delivery: Delivery) {
        let said = frames.into_iter().map(|frame| (Speaker::Tractor, frame)).collect();
        let carried = self.faults.carry(at, &mut self.ecu, said);
        self.put(at, carried, delivery).await;
    }

    async fn put(&self, at: SimTime, carried: Vec<Carried>, delivery: Delivery) {
        for carried in carried {
            match carried {
                Carried::Frame(speaker, frame) => {
                    let (side, from) = match speaker {
                        Speaker::Port(origin) => (Side::Host, Some(origin)),
                        Speaker::Tractor | Speaker::Ghost(_) => (Side::Device, None),
                    };
                    self.tap.record(side, frame.to_text().as_bytes());
                    self.bus.send((at, frame), from, delivery).await;
                }
                Carried::Error(error) => self.bus.tell(at, error, delivery).await,
            }
        }
    }
}
