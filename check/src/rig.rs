//! The virtual rig of a scenario: grown, wired, listening; and where a child finds its parts.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use rowscan_bus::Bus;
use rowscan_bus::link::{Found, Link};
use rowscan_bus::nmea::{GnssEpochs, NmeaLine, NmeaPlace};
use rowscan_bus::tractor::TractorEcu;
use rowscan_emulator::clock::{TimeScale, Timer};
use rowscan_emulator::lockstep::{Lockstep, LockstepConfig};
use rowscan_emulator::stage::Stage;
use rowscan_emulator::{
    Counting, Emulator, EmulatorConfig, EndWhen, Hold, LineWatch, Rig, Running, SeenRig, SeenScanner,
    SerialConfig, SerialEmulator, StageRow, faulty_wire, pause_slack,
};
use rowscan_faults::{FaultControl, Language, Medium};
use rowscan_ports::Pty;
use rowscan_protocol::device::{DialectPolicy, Options, Start};
use rowscan_protocol::lms2xx;
use rowscan_protocol::model::Model;
use rowscan_recording::{StreamKind, Taps};
use rowscan_scenes::files::{Warning, load_scene};
use rowscan_study::reading::{CalibrationChoice, Reading, rig_with};
use rowscan_vehicle::Tractor;
use tokio::task::JoinSet;

use crate::fault::ScenarioFault;
use crate::fault_desk::FaultDesk;
use crate::frames::Frames;
use crate::journal::Journal;
use crate::onlooker::Onlooker;
use crate::scenario::{DeviceKind, DeviceSpec, End, Mode, PortSpec, Scenario};
use crate::verdict::name_of;
use crate::witness::Witness;

/// Why a rig cannot be, in words: each is a verdict of its own.
pub(crate) type Failure = Box<dyn std::error::Error + Send + Sync>;

/// A rig whose time runs.
pub(crate) struct Bench {
    pub(crate) stage: Stage,
    pub(crate) journal: Journal,
    pub(crate) witness: Witness,
    pub(crate) running: Running,
    /// Holds the drive until every child is ready.
    pub(crate) hold: Hold,
    /// Where things are, by placeholder.
    pub(crate) places: BTreeMap<String, String>,
    /// What goes wrong.
    pub(crate) desk: FaultDesk,
    /// What everything rides on.
    pub(crate) tractor: Tractor,
    /// What its buses have heard.
    pub(crate) frames: Frames,
    emulators: Vec<Scanner>,
    _driving: JoinSet<()>,
    /// Who looks at it, until it is over.
    _seen: Option<Box<dyn Send>>,
}

/// Grows the scenario's orchard; the seed that counts. `tell` hears what the user should know of its scene.
pub(crate) fn grow(
    scenario: &Scenario,
    seed: Option<u64>,
    tell: impl FnMut(Warning),
) -> Result<Stage, Failure> {
    let beside = scenario.folder().join(&scenario.scene);
    let name = if beside.is_file() { beside.to_string_lossy().into_owned() } else { scenario.scene.clone() };
    let mut scene = load_scene(&name, tell)?;
    scene.seed = seed.unwrap_or(scene.seed);
    Ok(Stage::grow(scene, &|_, _| {})?)
}

impl Bench {
    /// Puts the scenario's rig on `stage` and starts its time, with these of its faults; pseudo-terminals appear in `folder`.
    pub(crate) async fn start(
        scenario: &Scenario,
        stage: Stage,
        folder: &Path,
        (faults, onlooker): (&[ScenarioFault], Option<&dyn Onlooker>),
    ) -> Result<Self, Failure> {
        let scale = scenario.clock.scale.map_or(TimeScale::Max, TimeScale::Paced);
        let tractor = stage.tractor();
        let mut rig = Rig::new(tractor.clone(), scale).with_timer(Timer::system()).until(end(scenario.end));
        let hold = rig.hold();
        let mut places = BTreeMap::new();
        if scenario.clock.mode == Mode::Lockstep {
            let config =
                LockstepConfig { acks: scenario.clock.acks.clone(), deadline: scenario.clock.deadline };
            let lockstep = Lockstep::open(config).await?;
            places.extend(lockstep.address().map(|address| ("ack".to_owned(), address.to_string())));
            rig = rig.in_lockstep(lockstep);
        }
        let journal = Journal::new(rig.clock(), tractor.clone());
        let witness = Witness::new(journal.clone());
        let row = Arc::new(StageRow::new(tractor.clone(), &stage.orchard));
        let (control, events) = FaultControl::new(stage.scene.seed, rig.clock(), Some(row));
        let look = onlooker.map(|onlooker| onlooker.come(rig.clock()));
        let taps = look.as_ref().map_or_else(Taps::default, |look| look.taps()).and(witness.taps());
        let (mut emulators, mut seen, frames) = (Vec::new(), Vec::new(), Frames::default());
        for device in &scenario.devices {
            let lines = LineWatch::default();
            let wiring = Wiring {
                rig: &mut rig,
                stage: &stage,
                scale,
                witness: &witness,
                control: &control,
                taps: &taps,
                lines: &lines,
            };
            let emulator = wiring.add(device, folder, &mut places).await?;
            seen.push(SeenScanner {
                name: device.id.clone(),
                number: device.scanner,
                model: device.kind.model(),
                lines,
                counting: emulator.counting(),
            });
            emulators.push(emulator);
        }
        for port in &scenario.buses {
            add_bus(&mut rig, (&stage, &frames), port, folder, &mut places).await?;
        }
        if !scenario.nmea.is_empty() {
            let mut lines = Vec::new();
            for port in &scenario.nmea {
                lines.push(open_nmea(&stage, port, folder, &mut places).await?);
            }
            let epochs = GnssEpochs::new(tractor.clone(), stage.receiver());
            rig.gnss(epochs, lines, &witness.taps());
        }
        let ids = scenario.devices.iter().map(|device| device.id.clone()).collect();
        let desk = FaultDesk::start((control, events), faults, ids, journal.clone())?;
        witness.beside(desk.clone());
        let mut driving = JoinSet::new();
        driving.spawn(desk.clone().drive());
        let seen = look.map(|look| {
            let seen = SeenRig {
                title: format!("rowscan check {}, seed {}", name_of(&scenario.path), stage.scene.seed),
                stage: &stage,
                tractor: tractor.clone(),
                clock: rig.clock(),
                scanners: seen,
            };
            look.begin(seen, rig.control())
        });
        let running = rig.run();
        Ok(Self {
            stage,
            journal,
            witness,
            running,
            hold,
            places,
            desk,
            tractor,
            frames,
            emulators,
            _driving: driving,
            _seen: seen,
        })
    }

    /// Scans left out because the host was too slow, of all scanners.
    pub(crate) fn scans_missed(&self) -> u64 {
        self.emulators.iter().map(Scanner::missed).sum()
    }
}

fn end(end: End) -> EndWhen {
    match end {
        End::RowM(row_m) => EndWhen::RowM(row_m),
        End::Seconds(seconds) => EndWhen::Driven(std::time::Duration::from_secs_f64(seconds)),
        End::Scans(scans) => EndWhen::Scans(scans),
    }
}

/// A scanner that is set up; dropping it ends it.
enum Scanner {
    Cola(Emulator),
    Lms2xx(SerialEmulator),
}

impl Scanner {
    fn counting(&self) -> Counting {
        match self {
            Self::Cola(emulator) => emulator.into(),
            Self::Lms2xx(emulator) => emulator.into(),
        }
    }

    fn missed(&self) -> u64 {
        match self {
            Self::Cola(emulator) => emulator.counts().scans_missed,
            // It sends what it has, late.
            Self::Lms2xx(_) => 0,
        }
    }
}

/// What a scanner is wired to.
struct Wiring<'a> {
    rig: &'a mut Rig,
    stage: &'a Stage,
    scale: TimeScale,
    witness: &'a Witness,
    control: &'a FaultControl,
    /// Where copies of all bytes go.
    taps: &'a Taps,
    /// Where its lines can be watched.
    lines: &'a LineWatch,
}

impl Wiring<'_> {
    async fn add(
        self,
        spec: &DeviceSpec,
        folder: &Path,
        places: &mut BTreeMap<String, String>,
    ) -> Result<Scanner, Failure> {
        let as_fitted = rig_with(&self.stage.rig, spec.scanner, spec.kind.model().name());
        let reading = Reading::of(Some(&as_fitted), spec.scanner, true, CalibrationChoice::OfRig)?;
        self.witness.watch(&spec.id, reading.pipeline);
        match &spec.kind {
            DeviceKind::Cola { model, tcp, start } => {
                let mut emulator = self.cola(spec, model, *start)?;
                let bound = emulator.listen(tcp).await?;
                places.insert(format!("{}.tcp", spec.id), bound.address.to_string());
                Ok(Scanner::Cola(emulator))
            }
            DeviceKind::Lms2xx { link, .. } => {
                let pty = Pty::open(&folder.join(link))?;
                places.insert(format!("{}.path", spec.id), pty.path().to_string_lossy().into_owned());
                self.lms2xx(spec, pty).map(Scanner::Lms2xx)
            }
        }
    }

    fn cola(self, spec: &DeviceSpec, model: &'static Model, start: Start) -> Result<Emulator, Failure> {
        let (device, view) = self.stage.scanner_on(&self.rig.tractor(), spec.scanner, model)?;
        let device = device.with_options(Options {
            profile: spec.profile,
            start,
            seed: self.stage.scene.seed,
            scanner: u32::try_from(spec.scanner).unwrap_or(u32::MAX),
            ..Options::default()
        });
        let config = EmulatorConfig {
            time_scale: self.scale,
            taps: self.taps.clone(),
            lines: Some(self.lines.clone()),
            stream: Some(spec.id.clone()),
            faults: Some(self.control.stream(&spec.id, Medium::Tcp, Language::Cola)),
            dialects: match start {
                Start::Stored(dialect) => DialectPolicy::Strict(dialect),
                _ => DialectPolicy::Auto,
            },
            ..EmulatorConfig::default()
        };
        let emulator = self.rig.scanner(device, view, config);
        self.witness.hear(&spec.id, emulator.counter());
        Ok(emulator)
    }

    fn lms2xx(self, spec: &DeviceSpec, pty: Pty) -> Result<SerialEmulator, Failure> {
        let DeviceKind::Lms2xx { model, start, rate, .. } = &spec.kind else {
            return Err("a network scanner has no serial line".into());
        };
        let options = lms2xx::device::Options {
            profile: spec.profile,
            start: *start,
            stored_rate: *rate,
            pause_slack: pause_slack(spec.profile, self.scale),
            ..lms2xx::device::Options::default()
        };
        let set_up = self.stage.serial_scanner_on(&self.rig.tractor(), spec.scanner, model, options)?;
        let faults = self.control.stream(&spec.id, Medium::Wire, Language::Lms2xx);
        let tap = self.taps.open(&spec.id, StreamKind::Lms2xx);
        let wire = faulty_wire(Box::new(pty), &faults, tap);
        let config = SerialConfig {
            stream: Some(spec.id.clone()),
            lines: Some(self.lines.clone()),
            ..SerialConfig::at(self.scale)
        };
        Ok(self.rig.lms2xx(set_up.0, set_up.1, wire, config))
    }
}

/// A port with the placeholder `{run}` filled in.
fn in_folder(port: &str, folder: &Path) -> String {
    port.replace("{run}", &folder.to_string_lossy())
}

async fn add_bus(
    rig: &mut Rig,
    (stage, frames): (&Stage, &Frames),
    spec: &PortSpec,
    folder: &Path,
    places: &mut BTreeMap<String, String>,
) -> Result<(), Failure> {
    let address = in_folder(&spec.port, folder).parse()?;
    let mut tell = |link: &Link| {
        let found = link.found();
        let key = if matches!(found, Found::Path(_)) { "path" } else { "address" };
        places.insert(format!("{}.{key}", spec.id), found.to_string());
    };
    let bus = Bus::open(&[address], &mut tell).await?;
    let ecu = TractorEcu::new(rig.tractor(), stage.receiver());
    rig.bus(ecu, bus, None, &frames.taps());
    Ok(())
}

async fn open_nmea(
    stage: &Stage,
    spec: &PortSpec,
    folder: &Path,
    places: &mut BTreeMap<String, String>,
) -> Result<NmeaLine, Failure> {
    let address = in_folder(&spec.port, folder).parse()?;
    let line = NmeaLine::open(&address, stage.scene.gnss.rate_hz).await?;
    let key = if matches!(line.place(), NmeaPlace::Path(_)) { "path" } else { "address" };
    places.insert(format!("{}.{key}", spec.id), line.place().to_string());
    Ok(line)
}
