//! The virtual rig of a scenario: grown, wired, listening; and where a child finds its parts.

use std::collections::BTreeMap;
use std::path::Path;

use rowscan_bus::Bus;
use rowscan_bus::link::{Found, Link};
use rowscan_bus::nmea::{GnssEpochs, NmeaLine, NmeaPlace};
use rowscan_bus::tractor::TractorEcu;
use rowscan_emulator::clock::{TimeScale, Timer};
use rowscan_emulator::lockstep::{Lockstep, LockstepConfig};
use rowscan_emulator::stage::Stage;
use rowscan_emulator::{Emulator, EmulatorConfig, EndWhen, Hold, Rig, Running};
use rowscan_protocol::device::Options;
use rowscan_scenes::files::load_scene;
use rowscan_study::reading::{CalibrationChoice, Reading, rig_with};

use crate::journal::Journal;
use crate::scenario::{DeviceSpec, End, Mode, PortSpec, Scenario};
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
    emulators: Vec<Emulator>,
}

/// Grows the scenario's orchard; the seed that counts.
pub(crate) fn grow(scenario: &Scenario, seed: Option<u64>) -> Result<Stage, Failure> {
    let beside = scenario.folder().join(&scenario.scene);
    let name = if beside.is_file() { beside.to_string_lossy().into_owned() } else { scenario.scene.clone() };
    let mut scene = load_scene(&name)?;
    scene.seed = seed.unwrap_or(scene.seed);
    Ok(Stage::grow(scene, &|_, _| {})?)
}

impl Bench {
    /// Puts the scenario's rig on `stage` and starts its time; pseudo-terminals appear in `folder`.
    pub(crate) async fn start(scenario: &Scenario, stage: Stage, folder: &Path) -> Result<Self, Failure> {
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
        let mut emulators = Vec::new();
        for device in &scenario.devices {
            let mut emulator = add_scanner(&mut rig, &stage, device, scale, &witness)?;
            let bound = emulator.listen(&device.tcp).await?;
            places.insert(format!("{}.tcp", device.id), bound.address.to_string());
            emulators.push(emulator);
        }
        for port in &scenario.buses {
            add_bus(&mut rig, &stage, port, folder, &mut places).await?;
        }
        if !scenario.nmea.is_empty() {
            let mut lines = Vec::new();
            for port in &scenario.nmea {
                lines.push(open_nmea(&stage, port, folder, &mut places).await?);
            }
            let epochs = GnssEpochs::new(tractor, stage.receiver());
            rig.gnss(epochs, lines, &witness.taps());
        }
        Ok(Self { stage, journal, witness, running: rig.run(), hold, places, emulators })
    }

    /// Scans left out because the host was too slow, of all scanners.
    pub(crate) fn scans_missed(&self) -> u64 {
        self.emulators.iter().map(|emulator| emulator.counts().scans_missed).sum()
    }
}

fn end(end: End) -> EndWhen {
    match end {
        End::RowM(row_m) => EndWhen::RowM(row_m),
        End::Seconds(seconds) => EndWhen::Driven(std::time::Duration::from_secs_f64(seconds)),
        End::Scans(scans) => EndWhen::Scans(scans),
    }
}

fn add_scanner(
    rig: &mut Rig,
    stage: &Stage,
    spec: &DeviceSpec,
    scale: TimeScale,
    witness: &Witness,
) -> Result<Emulator, Failure> {
    let (device, view) = stage.scanner_on(&rig.tractor(), spec.scanner, spec.model)?;
    let device = device.with_options(Options {
        profile: spec.profile,
        start: spec.start,
        seed: stage.scene.seed,
        scanner: u32::try_from(spec.scanner).unwrap_or(u32::MAX),
        ..Options::default()
    });
    let as_fitted = rig_with(&stage.rig, spec.scanner, spec.model.name);
    let reading = Reading::of(Some(&as_fitted), spec.scanner, true, CalibrationChoice::OfRig)?;
    witness.watch(&spec.id, reading.pipeline);
    let config = EmulatorConfig {
        time_scale: scale,
        taps: witness.taps(),
        stream: Some(spec.id.clone()),
        ..EmulatorConfig::default()
    };
    Ok(rig.scanner(device, view, config))
}

/// A port with the placeholder `{run}` filled in.
fn in_folder(port: &str, folder: &Path) -> String {
    port.replace("{run}", &folder.to_string_lossy())
}

async fn add_bus(
    rig: &mut Rig,
    stage: &Stage,
    spec: &PortSpec,
    folder: &Path,
    places: &mut BTreeMap<String, String>,
) -> Result<(), Failure> {
    let address = in_folder(&spec.port, folder).parse()?;
    let mut tell = |link: &Link| {
        let (key, place) = match link.found() {
            Found::Address(address) => ("address", address.to_string()),
            Found::Path(path) => ("path", path.to_string_lossy().into_owned()),
            Found::Name(name) => ("address", name.to_string()),
        };
        places.insert(format!("{}.{key}", spec.id), place);
    };
    let bus = Bus::open(&[address], &mut tell).await?;
    let ecu = TractorEcu::new(rig.tractor(), stage.receiver());
    rig.bus(ecu, bus, None, &rowscan_recording::Taps::default());
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
    let (key, place) = match line.place() {
        NmeaPlace::Address(address) => ("address", address.to_string()),
        NmeaPlace::Path(path) => ("path", path.to_string_lossy().into_owned()),
    };
    places.insert(format!("{}.{key}", spec.id), place);
    Ok(line)
}
