//! A rig that runs: the scanners on their endpoints, GNSS and CAN, and the handles to its time and faults.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use rowscan_bus::Bus;
use rowscan_bus::link::Link;
use rowscan_bus::nmea::{GnssEpochs, NmeaLine};
use rowscan_bus::tractor::TractorEcu;
use rowscan_emulator::clock::Timer;
use rowscan_emulator::stage::Stage;
use rowscan_emulator::{
    Counting, Emulator, EmulatorConfig, Rig, RigControl, Running, SerialConfig, SerialEmulator, StageRow,
    faulty_wire, pause_slack,
};
use rowscan_faults::{FaultControl, FaultEvents, Language, Medium, StreamFaults};
use rowscan_ports::Pty;
use rowscan_protocol::device::Profile;
use rowscan_protocol::lms2xx;
use rowscan_protocol::model::{AnyModel, Model};
use rowscan_recording::{StreamKind, Taps};
use tokio::task::JoinSet;

use super::log::Log;
use super::order::Order;
use crate::failure::Failure;

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
    pub(super) streams: Vec<Stream>,
    _timeline: Running,
    _tasks: JoinSet<()>,
}

/// A scanner that is set up.
pub(super) struct Stream {
    pub(super) name: String,
    pub(super) model: AnyModel,
    pub(super) counts: Counting,
    _device: Device,
}

/// What is kept for as long as the scanner runs.
#[expect(dead_code, reason = "dropping them ends them")]
enum Device {
    Cola(Emulator),
    Lms2xx(SerialEmulator),
}

impl Live {
    /// Sets up what was ordered, and starts time. Called within the runtime that it runs in.
    pub(super) async fn open(order: &Order, stage: &Stage, log: Log) -> Result<Self, Failure> {
        let tractor = stage.tractor();
        let mut rig = Rig::new(tractor.clone(), order.scale).with_timer(Timer::system());
        if let Some(start) = order.start {
            rig = rig.with_start(start);
        }
        let row = Arc::new(StageRow::new(tractor.clone(), &stage.orchard));
        let (faults, events) =
            FaultControl::new(stage.scene.seed, rig.clock(), Some(Arc::<StageRow>::clone(&row)));
        rig.set_faults(&faults);
        let mut tasks = JoinSet::new();
        let driven = faults.clone();
        tasks.spawn(async move { driven.drive().await });
        tasks.spawn(tell(events, log.clone()));
        let mut wiring =
            Wiring { order, stage, taps: log.taps(rig.clock()), faults: &faults, places: Vec::new() };
        let (mut streams, mut sources) = (Vec::new(), Vec::new());
        for (index, named) in order.models.iter().enumerate() {
            let mounted = || stage.rig.scanners.get(index).map_or("", |mount| mount.model.as_str());
            let model = named.map_or_else(|| AnyModel::named(mounted()), Ok)?;
            let (stream, source) = match model {
                AnyModel::Cola(model) => wiring.cola(&mut rig, index, model).await?,
                AnyModel::Lms2xx(model) => wiring.lms2xx(&mut rig, index, model)?,
            };
            streams.push(stream);
            sources.push(source);
        }
        wiring.tractor(&mut rig).await?;
        let places = wiring.places;
        faults.add_all(order.faults.clone())?;
        let control = rig.control();
        let timeline = rig.run();
        Ok(Self { control, faults, row, places, sources, streams, _timeline: timeline, _tasks: tasks })
    }
}

/// Writes down what faults do.
async fn tell(mut events: FaultEvents, log: Log) {
    while let Some(event) = events.next().await {
        log.line(format!("{:.3} s fault {} on {}: {:?}", event.at_s, event.id, event.on, event.what));
    }
}

/// What every part is wired to.
struct Wiring<'a> {
    order: &'a Order,
    stage: &'a Stage,
    taps: Taps,
    faults: &'a FaultControl,
    places: Vec<(String, String)>,
}

impl Wiring<'_> {
    async fn cola(
        &mut self,
        rig: &mut Rig,
        index: usize,
        model: &'static Model,
    ) -> Result<(Stream, String), Failure> {
        let (device, view) = self.stage.scanner_on(&rig.tractor(), index, model)?;
        let name = format!("scanner{index}");
        let config = EmulatorConfig {
            taps: self.taps.clone(),
            time_scale: self.order.scale,
            stream: Some(name.clone()),
            faults: Some(self.stream(&name, Medium::Tcp, Language::Cola)),
            ..EmulatorConfig::default()
        };
        let mut emulator = rig.scanner(device, view, config);
        let mut found = Vec::new();
        for address in self.addresses(index) {
            found.push(emulator.listen(address).await?.address.to_string());
        }
        let source = found.first().map(|address| format!("tcp://{address}")).unwrap_or_default();
        let numbered = |number: usize| if number == 0 { name.clone() } else { format!("{name}:{number}") };
        self.places.extend(found.into_iter().enumerate().map(|(number, place)| (numbered(number), place)));
        let counts = Counting::from(&emulator);
        Ok((Stream { name, model: model.into(), counts, _device: Device::Cola(emulator) }, source))
    }

    /// Where the scanner of this number listens: one scanner at all addresses, several at one each.
    fn addresses(&self, index: usize) -> Vec<&str> {
        let tcp = &self.order.tcp;
        match (tcp.is_empty(), self.order.models.len()) {
            (true, _) => vec![FREE_PORT],
            (false, 1) => tcp.iter().map(String::as_str).collect(),
            (false, _) => tcp.get(index).map(String::as_str).into_iter().collect(),
        }
    }

    fn lms2xx(
        &mut self,
        rig: &mut Rig,
        index: usize,
        model: &'static lms2xx::model::Model,
    ) -> Result<(Stream, String), Failure> {
        let pause_slack = pause_slack(Profile::default(), self.order.scale);
        let options = lms2xx::device::Options { pause_slack, ..Default::default() };
        let (device, view) = self.stage.serial_scanner_on(&rig.tractor(), index, model, options)?;
        let pty = Pty::open(&self.order.pty.clone().unwrap_or_else(own_link))?;
        let name = format!("scanner{index}");
        let place = pty.path().to_string_lossy().into_owned();
        let source = format!("serial:{place}");
        self.places.push((name.clone(), place));
        let faults = self.stream(&name, Medium::Wire, Language::Lms2xx);
        let tap = self.taps.open(&name, StreamKind::Lms2xx);
        let wire = faulty_wire(Box::new(pty), &faults, tap);
        let config = SerialConfig { stream: Some(name.clone()), ..SerialConfig::at(self.order.scale) };
        let emulator = rig.lms2xx(device, view, wire, config);
        let counts = Counting::from(&emulator);
        Ok((Stream { name, model: model.into(), counts, _device: Device::Lms2xx(emulator) }, source))
    }

    fn stream(&self, name: &str, medium: Medium, language: Language) -> StreamFaults {
        self.faults.stream(name, medium, language)
    }

    /// GNSS and CAN.
    async fn tractor(&mut self, rig: &mut Rig) -> Result<(), Failure> {
        let Self { order, stage, places, .. } = self;
        let mut lines = Vec::new();
        for (number, address) in order.nmea.iter().enumerate() {
            let line = NmeaLine::open(address, stage.scene.gnss.rate_hz).await?;
            places.push((format!("nmea{number}"), line.place().to_string()));
            lines.push(line);
        }
        if !lines.is_empty() {
            rig.gnss(GnssEpochs::new(rig.tractor(), stage.receiver()), lines, &Taps::default());
        }
        if order.can.is_empty() {
            return Ok(());
        }
        let mut number = 0;
        let mut found = |link: &Link| {
            places.push((format!("can{number}"), link.found().to_string()));
            number += 1;
        };
        let bus = Bus::open(&order.can, &mut found).await?;
        rig.bus(TractorEcu::new(rig.tractor(), stage.receiver()), bus, None, &Taps::default());
        Ok(())
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
