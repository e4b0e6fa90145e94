//! A rig that runs: the scanners on their endpoints, GNSS and CAN, and the handles to its time and faults.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use rowscan_bench::{Bench, BenchScanner, BenchSpec, BusSpec, Endpoint, NmeaSpec, Place, ScannerSpec};
use rowscan_emulator::clock::Timer;
use rowscan_emulator::stage::Stage;
use rowscan_emulator::{RigControl, StageRow};
use rowscan_faults::{FaultControl, FaultEvents};
use rowscan_protocol::model::AnyModel;
use tokio::task::JoinSet;

use super::log::Log;
use super::order::Order;
use crate::failure::{Failure, Refusal};

/// A free port on this machine alone.
const FREE_PORT: &str = "127.0.0.1:0";

/// A rig that runs. Dropping it ends it.
pub(super) struct Live {
    pub(super) control: RigControl,
    pub(super) faults: FaultControl,
    pub(super) row: Arc<StageRow>,
    /// Where its parts are, by their names, scanners first.
    pub(super) places: Vec<(String, String)>,
    /// What reads each scanner.
    pub(super) sources: Vec<String>,
    bench: Bench,
    _tasks: JoinSet<()>,
}

impl Live {
    /// Sets up what was ordered, and starts time. Called within the runtime that it runs in.
    pub(super) async fn open(order: &Order, stage: &Stage, log: Log) -> Result<Self, Failure> {
        let mut spec = BenchSpec::new(stage, order.scale);
        (spec.time.timer, spec.time.start) = (Timer::system(), order.start);
        spec.taps = log.taps(spec.clock());
        spec.faults = true;
        for (index, named) in order.models.iter().enumerate() {
            spec.scanners.push(order.scanner(stage, index, *named)?);
        }
        order.direct(&mut spec.scanners)?;
        let nmea = order.nmea.iter().enumerate();
        spec.nmea.extend(nmea.map(|(number, at)| NmeaSpec { id: format!("nmea{number}"), at: at.clone() }));
        if !order.can.is_empty() {
            spec.buses.push(BusSpec::new("can0", order.can.iter().cloned()));
        }
        let mut bench = Bench::open(spec).await?;
        let mut tasks = JoinSet::new();
        if let Some(events) = bench.take_fault_events() {
            tasks.spawn(tell(events, log));
        }
        let faults = bench.faults().cloned().ok_or(Refusal::NotRunning)?;
        faults.add_all(order.faults.clone())?;
        let (control, row) = (bench.control().clone(), Arc::clone(bench.row()));
        let places = places(&bench);
        let ids = bench.scanners().iter().map(|scanner| scanner.id.as_str());
        let sources = ids.map(|id| bench.source_of(id).unwrap_or_default()).collect();
        bench.run();
        Ok(Self { control, faults, row, places, sources, bench, _tasks: tasks })
    }

    /// Its scanners.
    pub(super) fn scanners(&self) -> &[BenchScanner] {
        self.bench.scanners()
    }
}

/// Where the parts of a bench are, by their names: scanners first, then GNSS, then the ports of the bus.
fn places(bench: &Bench) -> Vec<(String, String)> {
    let mut named = Vec::new();
    for scanner in bench.scanners() {
        let name = |number: usize| match number {
            0 => scanner.id.clone(),
            _ => format!("{}:{number}", scanner.id),
        };
        let found = bench.places_of(&scanner.id).enumerate();
        named.extend(found.map(|(number, place)| (name(number), place.at.to_string())));
    }
    let is_nmea = |place: &&Place| place.kind == "nmea";
    let nmea = bench.places().iter().filter(is_nmea);
    named.extend(nmea.map(|place| (place.part.clone(), place.at.to_string())));
    let ports = bench.places_of("can0").enumerate();
    named.extend(ports.map(|(number, place)| (format!("can{number}"), place.at.to_string())));
    named
}

/// Writes down what faults do.
async fn tell(mut events: FaultEvents, log: Log) {
    while let Some(event) = events.next().await {
        log.line(format!("{:.3} s fault {} on {}: {:?}", event.at_s, event.id, event.on, event.what));
    }
}

impl Order {
    /// The scanner of this number.
    fn scanner(&self, stage: &Stage, index: usize, named: Option<AnyModel>) -> Result<ScannerSpec, Failure> {
        let mounted = || stage.rig.scanners.get(index).map_or("", |mount| mount.model.as_str());
        let model = named.map_or_else(|| AnyModel::named(mounted()), Ok)?;
        let spec = ScannerSpec::new(index, model);
        let endpoints = match model {
            AnyModel::Cola(_) => self.addresses(index).into_iter().map(Endpoint::Tcp).collect(),
            AnyModel::Lms2xx(_) => vec![Endpoint::Pty(self.pty.clone().unwrap_or_else(own_link))],
        };
        // The last of its places.
        let rest = model.compact().map(|_| FREE_PORT.to_owned());
        Ok(ScannerSpec { endpoints, rest, stream: Some(spec.id.clone()), ..spec })
    }

    /// Where the scanner of this number listens: one scanner at all addresses, several at one each.
    fn addresses(&self, index: usize) -> Vec<String> {
        match (self.tcp.is_empty(), self.models.len()) {
            (true, _) => vec![FREE_PORT.to_owned()],
            (false, 1) => self.tcp.clone(),
            (false, _) => self.tcp.get(index).cloned().into_iter().collect(),
        }
    }
}

/// A name for a serial port that nobody else of this machine has.
fn own_link() -> PathBuf {
    static NUMBER: AtomicU64 = AtomicU64::new(0);
    let number = NUMBER.fetch_add(1, Ordering::Relaxed);
    std::env::temp_dir().join(format!("rowscan-{}-{number}", std::process::id()))
}

/// Where time is to come to.
#[derive(Clone, Copy, Debug)]
pub(super) enum Goal {
    /// So many trees are reached.
    Tree(u32),
    /// The tractor is so many metres along the row.
    RowM(f64),
    /// It has driven for so long.
    Driven(Duration),
}

/// A rig's time, and where it is to come to.
pub(super) struct Way {
    pub(super) control: RigControl,
    pub(super) row: Arc<StageRow>,
    pub(super) goal: Goal,
}

impl Way {
    fn is_over(&self) -> bool {
        let time = self.control.time();
        match self.goal {
            Goal::Tree(tree) => rowscan_faults::Row::tree(&*self.row, time.at.elapsed()) >= Some(tree),
            Goal::RowM(row_m) => time.row_m >= Some(row_m),
            Goal::Driven(driven) => time.began.is_some_and(|began| time.at >= began + driven),
        }
    }

    /// Where the tractor stands, if it was there before time was to go on.
    pub(super) async fn past_m(&self) -> Option<f64> {
        // Grants nothing more, so that time stops before it is looked at.
        self.control.stepped(self.control.step(0)).await;
        self.is_over().then(|| self.control.time().row_m.unwrap_or_default())
    }

    /// Lets time take step after step until it is there, and leaves it stopped.
    pub(super) async fn go(&self) {
        while !self.is_over() {
            self.control.stepped(self.control.step(1)).await;
        }
    }
}
