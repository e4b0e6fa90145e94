//! From a description to a rig that runs.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::time::Duration;

use rowscan_bus::link::candump::LogCut;
use rowscan_bus::link::{Found, Link};
use rowscan_bus::nmea::{GnssEpochs, NmeaAddress, NmeaLine, NmeaPlace};
use rowscan_bus::tractor::TractorEcu;
use rowscan_bus::{Bus, BusAddress};
use rowscan_emulator::clock::SimClock;
use rowscan_emulator::lockstep::{Lockstep, LockstepError};
use rowscan_emulator::stage::Stage;
use rowscan_emulator::{Hold, Rig, RigControl, Running, SeenRig, StageRow, StartWhen};
use rowscan_faults::{FaultControl, FaultEvents};
use rowscan_ports::task;
use rowscan_vehicle::Tractor;
use tokio::task::JoinSet;

use crate::endpoint::At;
use crate::scanner::{BenchScanner, Wiring};
use crate::spec::{BenchSpec, TimeSpec};
use crate::{BenchError, Place};

/// How long what faults held back has to leave once they are healed, host time.
const LET_GO_TIMEOUT: Duration = Duration::from_secs(2);

/// A rig that is set up: everything listens, and time goes from [`Bench::run`] on. Dropping it ends it.
#[derive(Debug)]
pub struct Bench {
    scanners: Vec<BenchScanner>,
    places: Vec<Place>,
    control: RigControl,
    clock: Arc<SimClock>,
    tractor: Tractor,
    row: Arc<StageRow>,
    faults: Option<Faults>,
    logs: Vec<LogCut>,
    hold: Option<Hold>,
    rig: Option<Rig>,
    running: Option<Running>,
}

/// Faults that may come, and the task that lets them act.
#[derive(Debug)]
struct Faults {
    control: FaultControl,
    events: Option<FaultEvents>,
    _driving: JoinSet<()>,
}

impl Bench {
    /// Sets up what `spec` describes; called within the runtime that it runs in.
    ///
    /// # Errors
    /// The first part that cannot be: a scanner that does not fit the rig, a port that is taken. What was opened before it is closed again.
    pub async fn open(spec: BenchSpec<'_>) -> Result<Self, BenchError> {
        named_apart(&spec)?;
        seen_in_lockstep(&spec)?;
        let (clock, tractor) = (spec.clock(), spec.tractor());
        let BenchSpec {
            stage, time, scanners, buses, nmea, nmea_taps, taps, faults, watched, moments, ..
        } = spec;
        let scale = clock.scale();
        let (mut rig, hold) = rig(time, &clock, &tractor);
        if let Some(moments) = moments {
            rig = rig.with_moments(moments);
        }
        let row = Arc::new(StageRow::new(tractor.clone(), &stage.orchard));
        let faults = faults.then(|| Faults::start(stage, &clock, &row));
        if let Some(faults) = &faults {
            rig.set_faults(&faults.control);
        }
        let (mut places, mut untaken, mut logs) = (Vec::new(), Vec::new(), Vec::new());
        let mut lines = Vec::new();
        for port in &nmea {
            let line = NmeaLine::open(&port.at, stage.scene.gnss.rate_hz).await?;
            places.push(place_of(&port.id, &line));
            lines.push(line);
        }
        if !lines.is_empty() {
            rig.gnss(GnssEpochs::new(tractor.clone(), stage.receiver()), lines, &nmea_taps);
        }
        for (number, spec) in buses.into_iter().enumerate() {
            let mut tell = |link: &Link| {
                places.push(Place { part: spec.id.clone(), kind: link.kind(), at: at_of(link) });
            };
            let bus = Bus::open(&spec.ports, &mut tell).await?;
            logs.extend(bus.0.logs());
            let ecu = TractorEcu::new(tractor.clone(), stage.receiver());
            let ecu = if number == 0 { ecu } else { ecu.elsewhere() };
            rig.bus_with(&spec.id, (ecu, spec.functions), bus, spec.news, &spec.taps);
        }
        let (mut opened, mut serial_numbers) = (Vec::new(), BTreeMap::new());
        for spec in &scanners {
            let control = faults.as_ref().map(|faults| &faults.control);
            let mut wiring = Wiring {
                stage,
                scale,
                taps: &taps,
                faults: control,
                watched,
                rig: &mut rig,
                places: &mut places,
                serial_numbers: &mut serial_numbers,
                untaken: &mut untaken,
            };
            opened.push(wiring.add(spec).await?);
        }
        rig.read_by(untaken);
        let control = rig.control();
        Ok(Self {
            scanners: opened,
            places,
            control,
            clock,
            tractor,
            row,
            faults,
            logs,
            hold,
            rig: Some(rig),
            running: None,
        })
    }

    /// Lets time go. A second call changes nothing.
    pub fn run(&mut self) {
        if let Some(rig) = self.rig.take() {
            self.running = Some(rig.run());
        }
    }

    /// Waits until time ends by itself: at the end it was given, or because a clock in lockstep fails. Cancel safe.
    ///
    /// # Errors
    /// Why a clock in lockstep failed.
    pub async fn ended(&mut self) -> Result<(), LockstepError> {
        match &mut self.running {
            Some(running) => running.ended().await,
            None => std::future::pending().await,
        }
    }

    /// Once its time has ended and its faults are healed: waits until what is told as sent has left, and counts what has not after two seconds as dropped.
    pub async fn let_go(&self) {
        let left = async {
            for held in self.scanners.iter().flat_map(BenchScanner::held) {
                held.flushed().await;
            }
        };
        let _ = rowscan_ports::clock::within(LET_GO_TIMEOUT, left).await;
        self.scanners.iter().for_each(BenchScanner::give_up_held);
    }

    /// Ends it, and returns once its timeline does nothing any more: what is recorded and logged of it is then all that was sent.
    pub async fn close(mut self) {
        if let Some(running) = self.running.take() {
            running.stop().await;
        }
    }

    /// Lets the drive start, where it was held.
    pub fn release(&self) {
        if let Some(hold) = &self.hold {
            hold.release();
        }
    }

    /// The handle that releases the drive, where it was held.
    pub fn hold(&self) -> Option<&Hold> {
        self.hold.as_ref()
    }

    /// Its scanners, in the order of the description.
    pub fn scanners(&self) -> &[BenchScanner] {
        &self.scanners
    }

    /// Where everything is found, in the order in which it was opened: GNSS, buses, scanners.
    pub fn places(&self) -> &[Place] {
        &self.places
    }

    /// Where the part of this name is found.
    pub fn places_of<'a>(&'a self, part: &'a str) -> impl Iterator<Item = &'a Place> {
        self.places.iter().filter(move |place| place.part == part)
    }

    /// The source that reads the scanner of this name, as `rowscan estimate` takes it: over REST where it has that, else the first.
    pub fn source_of(&self, scanner: &str) -> Option<String> {
        let over_rest = self.places_of(scanner).find(|place| place.kind == "rest");
        over_rest.and_then(Place::source).or_else(|| self.places_of(scanner).find_map(Place::source))
    }

    /// The handle to its time, which works once it runs.
    pub fn control(&self) -> &RigControl {
        &self.control
    }

    /// Its clock.
    pub fn clock(&self) -> Arc<SimClock> {
        Arc::clone(&self.clock)
    }

    /// The tractor that everything rides on.
    pub fn tractor(&self) -> &Tractor {
        &self.tractor
    }

    /// Where the tractor is along the row.
    pub fn row(&self) -> &Arc<StageRow> {
        &self.row
    }

    /// The handle to what goes wrong; none unless faults were asked for.
    pub fn faults(&self) -> Option<&FaultControl> {
        self.faults.as_ref().map(|faults| &faults.control)
    }

    /// What faults do, as they do it; handed out once.
    pub fn take_fault_events(&mut self) -> Option<FaultEvents> {
        self.faults.as_mut()?.events.take()
    }

    /// Whether all candump logs are whole so far.
    pub fn logs(&self) -> &[LogCut] {
        &self.logs
    }

    /// The rig as those see it who look on and change nothing.
    pub fn seen<'a>(&self, title: String, stage: &'a Stage) -> SeenRig<'a> {
        let scanners = self.scanners.iter().map(BenchScanner::seen).collect();
        SeenRig { title, stage, tractor: self.tractor.clone(), clock: self.clock(), scanners, map: None }
    }
}

impl Faults {
    fn start(stage: &Stage, clock: &Arc<SimClock>, row: &Arc<StageRow>) -> Self {
        let clock: Arc<SimClock> = Arc::clone(clock);
        let (control, events) = FaultControl::new(stage.scene.seed, clock, Some(Arc::<StageRow>::clone(row)));
        let mut driving = JoinSet::new();
        let driven = control.clone();
        driving.spawn(task(async move { driven.drive().await }));
        Self { control, events: Some(events), _driving: driving }
    }
}

/// Where a port of a bus is found.
pub(crate) fn at_of(link: &Link) -> At {
    match link.found() {
        Found::Address(address) => At::Address(address),
        Found::Path(path) => At::Path(path),
        Found::Name(name) => At::Name(name),
    }
}

/// Where the sentences of this part are found.
pub(crate) fn place_of(part: &str, line: &NmeaLine) -> Place {
    let at = match line.place() {
        NmeaPlace::Path(path) => At::Path(path.to_owned()),
        NmeaPlace::Address(address) => At::Name(address.to_string()),
    };
    Place { part: part.to_owned(), kind: "nmea", at }
}

/// The rig without its parts, and what holds its drive.
fn rig(time: TimeSpec, clock: &Arc<SimClock>, tractor: &Tractor) -> (Rig, Option<Hold>) {
    let TimeSpec { timer, start, end, step, lockstep, held } = time;
    let start = start.unwrap_or(StartWhen::default_at(clock.scale()));
    let mut rig = Rig::with_clock(Arc::clone(clock), tractor.clone(), start).with_timer(timer);
    if let Some(step) = step {
        rig = rig.with_step(step);
    }
    if let Some(lockstep) = lockstep {
        rig = rig.in_lockstep(lockstep);
    }
    if let Some(end) = end {
        rig = rig.until(end);
    }
    let hold = held.then(|| rig.hold());
    (rig, hold)
}

/// Refuses lines where a clock in lockstep waits for what the kernel tells: it does not tell what has been read from one.
fn seen_in_lockstep(spec: &BenchSpec<'_>) -> Result<(), BenchError> {
    if !spec.time.lockstep.as_ref().is_some_and(Lockstep::asks_only_the_kernel) {
        return Ok(());
    }
    let of_bus = spec.buses.iter().flat_map(|bus| &bus.ports).find_map(|port| match port {
        BusAddress::Slcan(link) => Some((format!("slcan:{}", link.display()), "socketcand:127.0.0.1:0")),
        BusAddress::Lines(link) => Some((format!("lines:{}", link.display()), "lines-tcp:127.0.0.1:0")),
        _ => None,
    });
    let of_nmea = spec.nmea.iter().find_map(|nmea| match &nmea.at {
        NmeaAddress::Pty(link, _) => Some((format!("pty:{}", link.display()), "tcp:127.0.0.1:0")),
        NmeaAddress::Serial(device, _) => Some((format!("serial:{}", device.display()), "tcp:127.0.0.1:0")),
        NmeaAddress::Tcp(_) | NmeaAddress::Udp(_) => None,
    });
    match of_bus.or(of_nmea) {
        Some((port, instead)) => Err(BenchError::UnseenLine { port, instead }),
        None => Ok(()),
    }
}

/// Refuses two parts of one name.
fn named_apart(spec: &BenchSpec<'_>) -> Result<(), BenchError> {
    let scanners = spec.scanners.iter().map(|scanner| &scanner.id);
    let buses = spec.buses.iter().map(|bus| &bus.id);
    let mut seen = BTreeSet::new();
    match scanners.chain(buses).find(|id| !seen.insert(*id)) {
        Some(id) => Err(BenchError::SameName { id: id.clone() }),
        None => Ok(()),
    }
}
