//! The tractor's control function on its CAN bus, and what the ports of the bus hear.

use std::collections::VecDeque;
use std::task::{Context, Poll};
use std::time::Duration;

use rowscan_bus::control_function::ControlFunction;
use rowscan_bus::link::PortEvent;
use rowscan_bus::tractor::TractorEcu;
use rowscan_bus::troubles::{Carried, Speaker};
use rowscan_bus::{Bus, BusNews, BusWatch, CanFrame, Inbox, Origin};
use rowscan_ports::Delivery;
use rowscan_ports::in_flight::InFlight;
use rowscan_protocol::time::SimTime;
use rowscan_recording::{Side, StreamKind, Tap, Taps};
use tokio::sync::mpsc;

use crate::compute::Compute;
use crate::faulted::BusFaults;
use crate::firing::Firing;
use crate::lockstep::OutputCount;

/// Frames that the rig's control functions answer at one instant; more is a quarrel without end.
const MOST_ANSWERS: usize = 256;
/// Name of the recorded stream.
const STREAM: &str = "can";

/// The control function with its bus.
#[derive(Debug)]
pub(crate) struct BusOutput {
    ecu: TractorEcu,
    /// The rig's control functions here beside the tractor's.
    functions: Vec<Box<dyn ControlFunction>>,
    bus: Bus,
    inbox: Inbox,
    /// What the ports have heard and is not answered yet.
    heard: VecDeque<(Origin, PortEvent)>,
    /// Of that, what takes effect only later.
    later: VecDeque<(SimTime, Origin, PortEvent)>,
    /// How much later that is.
    compute: Compute,
    watch: BusWatch,
    /// Where news of the bus go; nobody is waited for.
    news: Option<mpsc::Sender<BusNews>>,
    tap: Tap,
    /// A port is open.
    open: bool,
    /// Nothing is sent before the drive starts.
    held: bool,
    /// To be sent at the next instant.
    first: Vec<(Speaker, CanFrame)>,
    /// Who counts the frames that others send.
    counts: Vec<OutputCount>,
    faults: BusFaults,
}

impl BusOutput {
    pub(crate) fn new(
        (ecu, functions): (TractorEcu, Vec<Box<dyn ControlFunction>>),
        (bus, inbox): (Bus, Inbox),
        news: Option<mpsc::Sender<BusNews>>,
        delivery: Delivery,
        taps: &Taps,
        faults: BusFaults,
    ) -> Self {
        let (open, held) = (bus.is_open_from_the_start(), delivery.is_patient());
        let mut output = Self {
            ecu,
            functions,
            bus,
            inbox,
            heard: VecDeque::new(),
            later: VecDeque::new(),
            compute: Compute::default(),
            watch: BusWatch::default(),
            news,
            tap: taps.open(STREAM, StreamKind::Can),
            open,
            held,
            first: Vec::new(),
            counts: Vec::new(),
            faults,
        };
        if !held {
            output.first = output.opened(SimTime::ZERO);
        }
        output
    }

    /// What is said when a port opens. The tractor has been on its bus for long, whoever comes to it and on whatever clock: its address stands, and
    /// it speaks at once.
    fn opened(&mut self, at: SimTime) -> Vec<(Speaker, CanFrame)> {
        let mut frames = Vec::new();
        self.ecu.open_settled(at, &mut frames);
        let mut said: Vec<_> = frames.drain(..).map(|frame| (Speaker::Tractor, frame)).collect();
        for (place, function) in self.functions.iter_mut().enumerate() {
            function.open(at, &mut frames);
            said.extend(frames.drain(..).map(|frame| (Speaker::Function(place), frame)));
        }
        said
    }

    /// From now on what others say takes effect so much later.
    pub(crate) fn set_compute(&mut self, compute: Compute) {
        self.compute = compute;
    }

    /// From now on these count the frames that others send.
    pub(crate) fn count_frames(&mut self, counts: Vec<OutputCount>) {
        self.counts = counts;
    }

    pub(crate) fn next(&self) -> Option<SimTime> {
        match (self.held, self.first.is_empty()) {
            (true, _) => None,
            (false, false) => Some(SimTime::ZERO),
            (false, true) => {
                let later = self.later.front().map(|(at, ..)| *at);
                let own = self.functions.iter().filter_map(|function| function.next()).min();
                [self.ecu.next(), own, self.faults.next(), later].into_iter().flatten().min()
            }
        }
    }

    pub(crate) async fn fire(&mut self, firing: Firing) -> bool {
        let changed = self.faults.act(firing.at, &mut self.ecu);
        let changed = self.answered(firing.at, changed);
        self.put(firing.at, changed, firing.delivery).await;
        while self.later.front().is_some_and(|(due, ..)| *due <= firing.at) {
            let Some((_, origin, heard)) = self.later.pop_front() else { break };
            self.take(firing.at, (origin, heard), firing.delivery).await;
        }
        let mut said = std::mem::take(&mut self.first);
        let mut frames = Vec::new();
        self.ecu.poll(firing.at, &mut frames);
        said.extend(frames.drain(..).map(|frame| (Speaker::Tractor, frame)));
        for (place, function) in self.functions.iter_mut().enumerate() {
            function.poll(firing.at, &mut frames);
            said.extend(frames.drain(..).map(|frame| (Speaker::Function(place), frame)));
        }
        self.send(firing.at, said, firing.delivery).await;
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
            if matches!(heard, PortEvent::Frame(_)) {
                // It is an acknowledgement as soon as it is there.
                self.count(&heard);
                // Before the start time stands.
                let delay = if self.held { Duration::ZERO } else { self.compute.delay() };
                if !delay.is_zero() {
                    // One behind the other: a later frame that took less time does not overtake.
                    let due = self.later.back().map_or(SimTime::ZERO, |(due, ..)| *due).max(at + delay);
                    self.later.push_back((due, origin, heard));
                    continue;
                }
            }
            self.take(at, (origin, heard), delivery).await;
        }
    }

    fn count(&self, heard: &PortEvent) {
        if let PortEvent::Frame(frame) = heard {
            self.counts.iter().for_each(|count| count.frame(frame.id.bits()));
        }
    }

    /// What a port has heard takes effect.
    async fn take(&mut self, at: SimTime, (origin, heard): (Origin, PortEvent), delivery: Delivery) {
        let first = std::mem::take(&mut self.first);
        self.send(at, first, delivery).await;
        let mut replies = Vec::new();
        match heard {
            PortEvent::Opened => {
                self.open = true;
                if !self.held {
                    replies = self.opened(at);
                }
            }
            PortEvent::Frame(frame) => {
                let said = vec![(Speaker::Port(origin), frame)];
                self.send(at, said, delivery).await;
            }
            PortEvent::Lost(_) | PortEvent::Refused(_) => {}
        }
        if let (Some(news), Some(told)) =
            (self.watch.news(origin.port, heard, self.ecu.address_state()), &self.news)
        {
            let _ = told.try_send(news);
        }
        self.send(at, replies, delivery).await;
    }

    pub(crate) fn in_flight(&self) -> &InFlight {
        self.bus.in_flight()
    }

    pub(crate) fn has_taker(&self) -> bool {
        self.open
    }

    /// The drive has started. A machine speaks on its bus even if nobody listens.
    pub(crate) fn begin(&mut self, at: SimTime) {
        if std::mem::take(&mut self.held) {
            self.first = self.opened(at);
        }
    }

    /// What is said goes out, as far as the bus is in order, with the answers to it.
    async fn send(&mut self, at: SimTime, said: Vec<(Speaker, CanFrame)>, delivery: Delivery) {
        let carried = self.faults.carry(at, &mut self.ecu, said);
        let carried = self.answered(at, carried);
        self.put(at, carried, delivery).await;
    }

    /// What passed, with what the rig's control functions answer to it.
    fn answered(&mut self, at: SimTime, carried: Vec<Carried>) -> Vec<Carried> {
        if self.functions.is_empty() {
            return carried;
        }
        let (mut all, mut next, mut answers) = (carried, 0, 0);
        while let Some(passed) = all.get(next).copied() {
            next += 1;
            let Carried::Frame(speaker, frame) = passed else { continue };
            for (place, function) in self.functions.iter_mut().enumerate() {
                let mut said = Vec::new();
                if speaker != Speaker::Function(place) {
                    // What is due by now comes before what is heard now.
                    if function.next().is_some_and(|due| due <= at) {
                        function.poll(at, &mut said);
                    }
                    function.handle(at, &frame, &mut said);
                }
                answers += said.len();
                if answers <= MOST_ANSWERS {
                    let said = said.into_iter().map(|frame| (Speaker::Function(place), frame)).collect();
                    all.extend(self.faults.carry(at, &mut self.ecu, said));
                }
            }
        }
        all
    }

    async fn put(&self, at: SimTime, carried: Vec<Carried>, delivery: Delivery) {
        for carried in carried {
            match carried {
                Carried::Frame(speaker, frame) => {
                    let (side, from) = match speaker {
                        Speaker::Port(origin) => (Side::Host, Some(origin)),
                        Speaker::Tractor | Speaker::Function(_) | Speaker::Ghost(_) => (Side::Device, None),
                    };
                    self.tap.record(side, frame.to_text().as_bytes());
                    self.bus.send((at, frame), from, delivery).await;
                }
                Carried::Error(error) => self.bus.tell(at, error, delivery).await,
            }
        }
    }
}
