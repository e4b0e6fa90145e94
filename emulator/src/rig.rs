//! A rig that is emulated: scanners, GNSS and CAN of one tractor, on one timeline.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc::Sender;
use std::time::Duration;

use rowscan_bus::control_function::ControlFunction;
use rowscan_bus::nmea::{GnssEpochs, NmeaLine};
use rowscan_bus::tractor::TractorEcu;
use rowscan_bus::{Bus, BusNews, Inbox};
use rowscan_faults::{FaultControl, Part, StreamFaults};
use rowscan_ports::{Untaken, Wire};
use rowscan_protocol::device::Device;
use rowscan_protocol::lms2xx;
use rowscan_recording::{StreamKind, Tap, Taps};
use rowscan_vehicle::Tractor;
use rowscan_vehicle::trajectory::Trajectory;
use tokio::sync::{Notify, mpsc};

use crate::bus_output::BusOutput;
use crate::clock::{SimClock, TimeScale, Timer};
use crate::datagram_source::DatagramSource;
use crate::end::EndWhen;
use crate::fault_source::FaultSource;
use crate::faulted::{BusFaults, DeviceFaults, Receivers, VehiclePart};
use crate::faulty_wire::faulty_wire;
use crate::gap::GapPacer;
use crate::gnss_output::GnssOutput;
use crate::hold::Hold;
use crate::line_changes::LineChanges;
use crate::lms2xx::{Lms2xxScanner, SerialConfig};
use crate::lockstep::Lockstep;
use crate::mirror::MirrorSource;
use crate::playback_queue::{self, Values};
use crate::rig_control::{ClockMode, RigControl};
use crate::running::Running;
use crate::scan_moment::{Moments, ScanMoment};
use crate::scanner::Emulator;
use crate::serial_emulator::SerialEmulator;
use crate::shared::{EmulatorConfig, Program, Shared};
use crate::source::Source;
use crate::start::StartWhen;
use crate::steps::Steps;
use crate::stride::Stride;
use crate::timeline::Timeline;
use crate::view::ScannerView;

/// What rides on one tractor. Its parts are added one by one; [`Rig::run`] starts them together, from one origin of time.
#[derive(Debug)]
pub struct Rig {
    timeline: Timeline,
    /// What goes wrong, if anything may.
    faults: Option<FaultSource>,
    receivers: Receivers,
    /// Its buses by name, until faults know them.
    buses: Vec<(String, Arc<dyn Part>)>,
}

impl Rig {
    /// An empty rig on `tractor`; called within the runtime it will run in.
    pub fn new(tractor: Tractor, time_scale: TimeScale) -> Self {
        Self::on(Arc::new(SimClock::start(time_scale)), tractor, StartWhen::default_at(time_scale))
    }

    /// An empty rig whose time is on `clock`; called within the runtime it will run in.
    pub fn with_clock(clock: Arc<SimClock>, tractor: Tractor, start: StartWhen) -> Self {
        Self::on(clock, tractor, start)
    }

    /// A rig whose scanners get their values from a recording, by the recording's clock.
    pub(crate) fn playback(clock: Arc<SimClock>) -> Self {
        Self::on(clock, Tractor::new(Trajectory::straight(0.0, 0.0)), StartWhen::Now)
    }

    fn on(clock: Arc<SimClock>, tractor: Tractor, start: StartWhen) -> Self {
        let changed = Arc::new(Notify::new());
        let timeline = Timeline {
            clock,
            timer: Timer::default(),
            sources: Vec::new(),
            start,
            tractor,
            steps: Steps::new(Arc::clone(&changed)),
            changed,
            begun: false,
            lockstep: None,
            end: None,
            gap: GapPacer::default(),
            hold: None,
            scan_instants: 0,
            stride: None,
            moments: Moments::default(),
            untaken: Vec::new(),
        };
        Self { timeline, faults: None, receivers: Receivers::default(), buses: Vec::new() }
    }

    /// Has these faults act on everything of the rig: its tractor and buses, and the scanners that have a stream of theirs. A scanner's own
    /// faults ([`EmulatorConfig::faults`]) do the same for the whole rig; only a rig without scanners needs this.
    pub fn set_faults(&mut self, control: &FaultControl) {
        if self.faults.is_none() {
            VehiclePart::name_all(control, &self.timeline.tractor, &self.receivers);
            for (id, bus) in &self.buses {
                control.part(id, Arc::clone(bus));
            }
            self.faults = Some(FaultSource::new(control.clone()));
        }
    }

    /// The same with this timer.
    #[must_use]
    pub fn with_timer(mut self, timer: Timer) -> Self {
        self.timeline.timer = timer;
        self
    }

    /// The same with this start of the drive.
    #[must_use]
    pub fn with_start(mut self, start: StartWhen) -> Self {
        self.timeline.start = start;
        self
    }

    /// The same in lockstep: time at [`TimeScale::Max`] waits for acknowledgements as well.
    #[must_use]
    pub fn in_lockstep(mut self, lockstep: Lockstep) -> Self {
        if lockstep.needs_grants() {
            self.timeline.steps.by_grant();
        }
        self.timeline.gap = GapPacer::new(lockstep.gaps());
        self.timeline.lockstep = Some(lockstep);
        self
    }

    /// The same with steps of this length, from the start of the drive on.
    #[must_use]
    pub fn with_step(mut self, length: Duration) -> Self {
        self.timeline.stride = Some(Stride::new(length));
        self
    }

    /// The same with an end of time; see [`Running::ended`].
    #[must_use]
    pub fn until(mut self, end: EndWhen) -> Self {
        self.timeline.end = Some(end);
        self
    }

    /// Time ends only once the clients of these pseudo-terminals have read what was sent; on a paced clock the end does not wait for long.
    pub fn read_by(&mut self, untaken: impl IntoIterator<Item = Untaken>) {
        self.timeline.untaken.extend(untaken);
    }

    /// The same; where the tractor truly is goes to `moments` at each scan of the first scanner that went to a taker.
    #[must_use]
    pub fn with_moments(mut self, moments: Sender<ScanMoment>) -> Self {
        self.timeline.moments = Moments::to(moments);
        self
    }

    /// Holds the start of the drive; takers count only from [`Hold::release`] on. Where nothing may be lost, time stands still until then.
    pub fn hold(&mut self) -> Hold {
        let hold = Hold::new(Arc::clone(&self.timeline.changed));
        self.timeline.hold = Some(hold.clone());
        hold
    }

    /// The clock that everything on it acts by.
    pub fn clock(&self) -> Arc<SimClock> {
        Arc::clone(&self.timeline.clock)
    }

    /// The handle to its time, which works from [`Rig::run`] on.
    pub fn control(&self) -> RigControl {
        let Timeline { clock, steps, tractor, lockstep, .. } = &self.timeline;
        let mode = match lockstep {
            Some(lockstep) if lockstep.needs_grants() => ClockMode::Granted,
            Some(_) => ClockMode::Lockstep,
            None if clock.delivery().is_patient() => ClockMode::Max,
            None => ClockMode::Paced,
        };
        let bystanders = lockstep.as_ref().map(Lockstep::bystanders).unwrap_or_default();
        RigControl {
            clock: Arc::clone(clock),
            steps: steps.clone(),
            tractor: tractor.clone(),
            mode,
            bystanders,
        }
    }

    /// The tractor that everything on it rides on.
    pub fn tractor(&self) -> Tractor {
        self.timeline.tractor.clone()
    }

    /// Adds a CoLa scanner. No one can connect until [`Emulator::listen`] or [`Emulator::attach`]. The rig's clock and timer count, not the
    /// configuration's.
    pub fn scanner(&mut self, device: Device, world: ScannerView, mut config: EmulatorConfig) -> Emulator {
        let timeline = &mut self.timeline;
        let changes = std::mem::take(&mut config.line_changes);
        let clock = Arc::clone(&timeline.clock);
        let control = config.faults.as_ref().map(StreamFaults::control);
        let shared = Shared::new(device, Program::Device, clock, Arc::clone(&timeline.changed), config);
        if !changes.is_empty() {
            let changes = LineChanges::new(Arc::clone(&shared), changes);
            timeline.sources.push(Source::LineChanges(changes));
        }
        let mirror = MirrorSource::new(Arc::clone(&shared), world);
        timeline.sources.push(Source::Mirror(Box::new(mirror)));
        if shared.device().model().compact.is_some() {
            timeline.sources.push(Source::Datagrams(DatagramSource::new(Arc::clone(&shared))));
        }
        self.receivers.encoder.store(true, Ordering::Relaxed);
        if let Some(control) = control {
            self.set_faults(&control);
        }
        if let Some(faults) = &mut self.faults {
            faults.add(Arc::clone(&shared));
        }
        Emulator::of(shared)
    }

    /// Adds an LMS2xx on `wire`.
    pub fn lms2xx(
        &mut self,
        device: lms2xx::device::Device,
        world: ScannerView,
        wire: Box<dyn Wire>,
        config: SerialConfig,
    ) -> SerialEmulator {
        let stream = config.stream.as_deref().unwrap_or(device.model().name);
        let tap = config.taps.open(stream, StreamKind::Lms2xx);
        let values = Values::Seen(Box::new(world));
        let clock = Arc::clone(&self.timeline.clock);
        let (wire, tap, troubles) = match &config.faults {
            Some(faults) => {
                self.set_faults(&faults.control());
                let device = DeviceFaults::lms2xx(&self.timeline.changed);
                faults.part(Arc::<DeviceFaults>::clone(&device));
                (faulty_wire(wire, faults, tap), Tap::default(), Some(device))
            }
            None => (wire, tap, None),
        };
        let scanner = Lms2xxScanner::new(device, values, wire, clock, config.state, tap)
            .troubled(troubles)
            .behind(config.faults)
            .watched(config.lines);
        let emulator = SerialEmulator::of(&scanner);
        self.add_lms2xx(scanner);
        emulator
    }

    pub(crate) fn add_lms2xx(&mut self, scanner: Lms2xxScanner) {
        self.timeline.sources.push(Source::Lms2xx(Box::new(scanner)));
    }

    /// Adds a bus, which faults know as `id`, with the tractor's control function on it; what happens on the bus goes to `news`, if anyone wants it.
    pub fn bus(
        &mut self,
        id: &str,
        ecu: TractorEcu,
        bus: (Bus, Inbox),
        news: Option<mpsc::Sender<BusNews>>,
        taps: &Taps,
    ) {
        self.bus_with(id, (ecu, Vec::new()), bus, news, taps);
    }

    /// The same with the rig's other control functions on this bus.
    pub fn bus_with(
        &mut self,
        id: &str,
        ecus: (TractorEcu, Vec<Box<dyn ControlFunction>>),
        bus: (Bus, Inbox),
        news: Option<mpsc::Sender<BusNews>>,
        taps: &Taps,
    ) {
        let faults = BusFaults::new(&self.timeline.changed, bus.0.datagrams());
        if let Some(source) = &self.faults {
            source.control().part(id, faults.part());
        }
        self.buses.push((id.to_owned(), faults.part()));
        self.receivers.gnss.store(true, Ordering::Relaxed);
        let output = BusOutput::new(ecus, bus, news, self.timeline.clock.delivery(), taps, faults);
        self.timeline.sources.push(Source::Bus(Box::new(output)));
    }

    /// Adds the tractor's GNSS receiver with its lines.
    pub fn gnss(&mut self, epochs: GnssEpochs, lines: Vec<NmeaLine>, taps: &Taps) {
        if lines.iter().any(NmeaLine::is_datagrams) {
            self.receivers.sends_datagrams.store(true, Ordering::Relaxed);
        }
        let timeline = &mut self.timeline;
        let output = GnssOutput::new(
            epochs,
            lines,
            timeline.clock.delivery(),
            &timeline.changed,
            taps,
            self.receivers.datagrams.clone(),
        );
        timeline.sources.push(Source::Gnss(Box::new(output)));
        self.receivers.gnss.store(true, Ordering::Relaxed);
    }

    /// Starts time.
    pub fn run(mut self) -> Running {
        self.timeline.sources.extend(self.faults.take().map(Source::Faults));
        // Sources due at one instant fire in this order, however they were added.
        self.timeline.sources.sort_by_key(Source::rank);
        Running::new(self.timeline)
    }
}

/// Scanners that are alone on their tractor.
impl Emulator {
    /// Starts `device` in `world`, alone on its tractor. No one can connect until [`Emulator::listen`] or [`Emulator::attach`].
    pub fn start(device: Device, world: ScannerView, config: EmulatorConfig) -> Self {
        let mut rig = Rig::new(world.tractor().clone(), config.time_scale).with_timer(config.timer.clone());
        let emulator = rig.scanner(device, world, config);
        emulator.with_rig(rig.run())
    }
}

impl SerialEmulator {
    /// Puts `device` in `world` on `wire`; dropping it ends it, and its line goes.
    pub fn start(
        device: lms2xx::device::Device,
        world: ScannerView,
        wire: Box<dyn Wire>,
        config: SerialConfig,
    ) -> Self {
        let mut rig = Rig::new(world.tractor().clone(), config.time_scale);
        let emulator = rig.lms2xx(device, world, wire, config);
        emulator.with_rig(rig.run())
    }

    /// A recorded LMS2xx on `wire`, whose values come from a [`Player`](crate::Player); it is recorded again as `name`.
    pub fn replay(
        device: lms2xx::device::Device,
        name: &str,
        wire: Box<dyn Wire>,
        clock: Arc<SimClock>,
        config: SerialConfig,
    ) -> Self {
        let (queue, values) = playback_queue::queue(clock.delivery());
        let tap = config.taps.open(name, StreamKind::Lms2xx);
        let (wire, tap) = match &config.faults {
            Some(faults) => (faulty_wire(wire, faults, tap), Tap::default()),
            None => (wire, tap),
        };
        let mut rig = Rig::playback(Arc::clone(&clock));
        let scanner =
            Lms2xxScanner::new(device, values, wire, clock, config.state, tap).behind(config.faults);
        let emulator = Self::of(&scanner);
        rig.add_lms2xx(scanner);
        emulator.with_queue(queue).with_rig(rig.run())
    }
}
