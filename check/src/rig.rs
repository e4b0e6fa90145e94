//! The virtual rig of a scenario: grown, wired, listening; and where a child finds its parts.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use rowscan_bench::{
    At, Bench, BenchSpec, BusSpec, DeviceSpec, Endpoint, NmeaSpec, ScannerSpec, StartState, TimeSpec,
};
use rowscan_bus::control_function::ControlFunction;
use rowscan_bus::isobus::role::{ClientLog, SectionLog};
use rowscan_bus::isobus::trouble::TroubleDesk;
use rowscan_bus::nmea::{NmeaAddress, NmeaAddressError};
use rowscan_bus::{BusAddress, BusAddressError};
use rowscan_emulator::clock::{TimeScale, Timer};
use rowscan_emulator::lockstep::{ChildClock, Lockstep, LockstepConfig};
use rowscan_emulator::stage::Stage;
use rowscan_emulator::{Compute, EndWhen, Gaps, SeenRig, Sleeps};
use rowscan_protocol::device::{DialectPolicy, Start};
use rowscan_protocol::time::SimTime;
use rowscan_recording::{About, Taps};
use rowscan_scenes::files::{Warning, load_scene, rig_text};
use rowscan_scenes::optics;
use rowscan_sprayer::plumes::plumes;
use rowscan_study::reading::{CalibrationChoice, Reading, rig_with};
use rowscan_vehicle::Tractor;

use crate::bus_news::RefusedOnBuses;
use crate::child_clock;
use crate::fault::ScenarioFault;
use crate::fault_desk::FaultDesk;
use crate::frames::Frames;
use crate::journal::Journal;
use crate::onlooker::Onlooker;
use crate::run_file::RunFile;
use crate::scenario::{ComputeSpec, DeviceKind, DeviceSpec as ScenarioDevice, End, Mode, Scenario};
use crate::sentences::Sentences;
use crate::signal::Source;
use crate::sprayer::{
    BoomHearing, BoomSensors, BoomSpray, Machine, NAME, SprayerPart, SprayerSpec, live_map,
};
use crate::task_controller::{self, TaskControllerPart, TaskSpec};
use crate::verdict::name_of;
use crate::witness::Witness;

/// Why a rig cannot be, in words: each is a verdict of its own.
pub(crate) type Failure = Box<dyn std::error::Error + Send + Sync>;

/// A rig whose time runs, and who looks at it.
pub(crate) struct ScenarioRig {
    pub(crate) stage: Stage,
    pub(crate) bench: Bench,
    pub(crate) journal: Journal,
    pub(crate) witness: Witness,
    /// Where things are, by placeholder.
    pub(crate) places: BTreeMap<String, String>,
    /// What it is recorded to, where its folder is kept.
    pub(crate) file: Option<RunFile>,
    /// What goes wrong.
    pub(crate) desk: FaultDesk,
    /// What was refused on its buses.
    pub(crate) refused: RefusedOnBuses,
    /// When nobody took scans in lockstep.
    pub(crate) gaps: Gaps,
    /// When a child slept by the host's time in lockstep, and held time.
    pub(crate) sleeps: Sleeps,
    /// How long its controller computes.
    pub(crate) compute: Compute,
    /// What its buses have heard.
    pub(crate) frames: Frames,
    /// What sections of the sprayer were told, where it is a task controller's client.
    pub(crate) sections: SectionLog,
    /// What happened to the clients of its task controller.
    pub(crate) clients: ClientLog,
    /// What its GNSS receiver has said, if an expectation is of that.
    pub(crate) sentences: Sentences,
    /// The clock of children whose time is simulated, if there are any.
    pub(crate) child_clock: Option<ChildClock>,
    /// The sprayer, if there is one.
    pub(crate) sprayer: Option<Arc<SprayerPart>>,
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

impl ScenarioRig {
    /// Puts the scenario's rig on `stage` and starts its time, with these of its faults; pseudo-terminals appear in `folder`.
    pub(crate) async fn start(
        scenario: &Scenario,
        stage: Stage,
        folder: &Path,
        (faults, onlooker, is_kept): (&[ScenarioFault], Option<&dyn Onlooker>, bool),
    ) -> Result<Self, Failure> {
        let stage = match &scenario.sprayer {
            Some(spec) => sprayed(stage, spec)?,
            None => stage,
        };
        let scale = scenario.clock.scale.map_or(TimeScale::Max, TimeScale::Paced);
        let mut places = BTreeMap::new();
        let compute = compute(scenario);
        let child_clock = child_clock::clock(scenario, &stage, folder, &mut places)?;
        let lockstep = lockstep(scenario, child_clock.clone(), (&mut places, &compute)).await?;
        let gaps = lockstep.as_ref().map(Lockstep::gaps).unwrap_or_default();
        let sleeps = lockstep.as_ref().map(Lockstep::sleeps).unwrap_or_default();
        let mut spec = BenchSpec::new(&stage, scale);
        spec.time = TimeSpec {
            timer: Timer::system(),
            end: Some(end(scenario.end)),
            lockstep,
            held: true,
            ..TimeSpec::default()
        };
        check_end(scenario.end, &spec.tractor())?;
        let journal = Journal::new(spec.clock(), spec.tractor());
        let (witness, frames, sentences) =
            (Witness::new(journal.clone()), Frames::default(), Sentences::default());
        let look = onlooker.map(|onlooker| onlooker.come(spec.clock()));
        let about = About {
            scene: Some(scenario.scene.clone()),
            seed: Some(stage.scene.seed),
            rig: rig_text(&stage.rig).ok(),
            ..About::default()
        };
        let scanners: Vec<ScannerSpec> =
            scenario.devices.iter().map(|device| scanner(device, folder)).collect();
        let about =
            about.of_scanners(scanners.iter().map(|spec| (spec.model.name(), spec.mount, spec.streams())));
        let file = is_kept.then(|| RunFile::start(folder, spec.clock(), about)).transpose()?;
        let recorded = || file.as_ref().map_or_else(Taps::default, RunFile::taps);
        spec.taps =
            look.as_ref().map_or_else(Taps::default, |look| look.taps()).and(witness.taps()).and(recorded());
        let wants_sentences =
            scenario.expects.iter().any(|expect| matches!(expect.source, Some(Source::Sentence { .. })));
        spec.nmea_taps =
            if wants_sentences { sentences.taps(&journal).and(witness.taps()) } else { witness.taps() };
        spec.nmea_taps = spec.nmea_taps.and(recorded());
        (spec.faults, spec.watched, spec.scanners) = (true, true, scanners);
        for device in &scenario.devices {
            let as_fitted = rig_with(&stage.rig, device.scanner, device.kind.model().name());
            let reading = Reading::of(Some(&as_fitted), device.scanner, true, CalibrationChoice::OfRig)?;
            witness.watch(&device.id, reading.pipeline);
        }
        let (desks, mut refused) = (Desks::default(), RefusedOnBuses::default());
        let sprayer = scenario.sprayer.as_ref().map(|spec| {
            let client = spec.client.map(|_| desks.client.clone());
            Arc::new(SprayerPart::new(spec.boom.clone(), client))
        });
        for bus in &scenario.buses {
            let (task, ports) = (&bus.task, bus.ports.iter().map(|port| bus_in_folder(port, folder)));
            let bus = BusSpec::new(&bus.id, ports.collect::<Result<Vec<_>, _>>()?);
            let own = scenario.sprayer.as_ref().zip(sprayer.clone()).filter(|(own, _)| own.bus == bus.id);
            let functions = desks.functions(own, task.as_ref(), (&stage, spec.tractor()));
            let taps = frames.taps(&bus.id, &journal).and(recorded());
            let news = Some(refused.of(&bus.id));
            spec.buses.push(BusSpec { taps, functions, news, ..bus });
        }
        for port in &scenario.nmea {
            spec.nmea.push(NmeaSpec { id: port.id.clone(), at: nmea_in_folder(&port.port, folder)? });
        }
        let mut bench = Bench::open(spec).await?;
        placeholders(scenario, &bench, &mut places);
        for scanner in bench.scanners() {
            witness.hear(&scanner.id, scanner.counts());
        }
        let ids = scenario.devices.iter().map(|device| device.id.clone()).collect();
        let plan = bench.faults().cloned().zip(bench.take_fault_events());
        let plan = plan.ok_or("the bench was opened without faults")?;
        if let Some(part) = &sprayer {
            plan.0.part(NAME, Arc::<SprayerPart>::clone(part));
        }
        if scenario.buses.iter().any(|bus| bus.task.is_some()) {
            plan.0.part(task_controller::NAME, Arc::new(TaskControllerPart(desks.server)));
        }
        let desk = FaultDesk::start(plan, faults, ids, journal.clone())?;
        witness.beside(desk.clone());
        let seen = look.map(|look| {
            let title = format!("rowscan check {}, seed {}", name_of(&scenario.path), stage.scene.seed);
            let map = scenario.sprayer.as_ref().zip(sprayer.clone()).map(|(spec, part)| {
                let heard = (part, frames.clone(), desks.sections.clone());
                live_map(spec, &stage, (bench.tractor().clone(), bench.clock()), heard)
            });
            look.begin(SeenRig { map, ..bench.seen(title, &stage) }, bench.control().clone())
        });
        bench.run();
        Ok(Self {
            stage,
            bench,
            journal,
            witness,
            places,
            file,
            desk,
            refused,
            gaps,
            sleeps,
            compute,
            frames,
            sections: desks.sections,
            clients: desks.clients,
            sentences,
            child_clock,
            sprayer,
            _seen: seen,
        })
    }

    /// Scans left out because the host was too slow, of all scanners. An LMS2xx sends what it has, late.
    pub(crate) fn scans_missed(&self) -> u64 {
        let missed =
            self.bench.scanners().iter().filter_map(|scanner| scanner.counts().counts()?.scans_missed);
        missed.sum()
    }
}

/// What the rig's control functions on its buses share with those who order them, and those who judge.
#[derive(Default)]
struct Desks {
    /// What sections of a task controller's client were told.
    sections: SectionLog,
    /// What is wrong with that client.
    client: TroubleDesk,
    /// What is wrong with the rig's own task controller.
    server: TroubleDesk,
    /// What happened to the clients of that one.
    clients: ClientLog,
}

impl Desks {
    /// The control functions on a bus: those of a sprayer that is on it, and a task controller with its task.
    fn functions(
        &self,
        sprayer: Option<(&SprayerSpec, Arc<SprayerPart>)>,
        task: Option<&TaskSpec>,
        (stage, tractor): (&Stage, Tractor),
    ) -> Vec<Box<dyn ControlFunction>> {
        let mut functions: Vec<Box<dyn ControlFunction>> = Vec::new();
        functions.extend(
            task.map(|task| Box::new(task.role((self.clients.clone(), self.server.clone()))) as Box<_>),
        );
        let Some((own, part)) = sprayer else { return functions };
        let boom = &own.boom;
        if own.client.is_none() && boom.drops.is_none() && boom.sensors.is_none() {
            return functions;
        }
        let machine = Machine::new(boom.clone(), stage.scene.seed, part, tractor);
        // Before those who look: what is commanded now is seen now.
        functions.push(Box::new(BoomHearing::new(machine.clone(), own)));
        functions.extend(own.client.map(|client| {
            let desks = (self.sections.clone(), self.client.clone());
            Box::new(client.role((boom, machine.clone()), stage.rig.row_spacing_m, desks)) as Box<_>
        }));
        functions.extend(boom.drops.map(|_| Box::new(BoomSpray::new(machine.clone())) as Box<_>));
        functions.extend(boom.sensors.map(|_| Box::new(BoomSensors::new(machine, boom)) as Box<_>));
        functions
    }
}

/// The stage with the spray of the boom's nozzles before its scanners, where the boom says which drops it makes.
fn sprayed(stage: Stage, spec: &SprayerSpec) -> Result<Stage, String> {
    if spec.boom.drops.is_none() {
        return Ok(stage);
    }
    let optics = &stage.scene.optics;
    if !optics.stages.has(optics::Stage::Air) {
        return Err(format!(
            "`sprayer.boom`: its `[drops]` let scanners see the spray, and the scene's optics have no stage `air`, found \"{}\"; add \
             `stages = \"device\"` to `[optics]` of the scene, or leave out `[drops]`",
            optics.stages
        ));
    }
    if !optics.air.plumes.is_empty() {
        return Err("`sprayer.boom`: its nozzles are seen as plumes, by `[drops]`, and the scene has plumes of its own; leave out \
                    `[drops]` of the boom, or `[[optics.air.plume]]` of the scene"
            .to_owned());
    }
    Ok(stage.with_plumes(|mount| plumes(&spec.boom, mount)))
}

/// Refuses an end where the tractor is before it starts, or to which its drive does not come: as far as that is known, which of one that stands is nothing.
fn check_end(end: End, tractor: &Tractor) -> Result<(), String> {
    const DAY_S: u32 = 86_400;
    let End::RowM(row_m) = end else { return Ok(()) };
    let starts_m = tractor.motion(SimTime::ZERO).place.y_m;
    let is_near = |y_m: f64| tractor.drives_within(y_m, DAY_S).is_some();
    if starts_m >= row_m {
        return Err(format!(
            "`end`: expected `row_m` above {starts_m}, where the tractor starts, found {row_m}: the run would be over at once; move `end`"
        ));
    }
    if is_near(starts_m + 1e-3) && !is_near(row_m) {
        return Err(format!(
            "`end`: expected a `row_m` that the tractor comes to within a day, found {row_m}: it does not come there; move `end`, or give it in `s`"
        ));
    }
    Ok(())
}

fn end(end: End) -> EndWhen {
    match end {
        End::RowM(row_m) => EndWhen::RowM(row_m),
        End::Seconds(seconds) => EndWhen::Driven(Duration::from_secs_f64(seconds)),
        End::Scans(scans) => EndWhen::Scans(scans),
    }
}

/// How long the scenario's controller computes.
fn compute(scenario: &Scenario) -> Compute {
    match scenario.runs.iter().find_map(|run| run.compute) {
        Some(ComputeSpec::Fixed(time)) => Compute::fixed(time),
        Some(ComputeSpec::Measured(factor)) => Compute::measured(factor),
        None => Compute::default(),
    }
}

/// The acknowledgements that time waits for, with the place of their endpoint.
async fn lockstep(
    scenario: &Scenario,
    children: Option<ChildClock>,
    (places, compute): (&mut BTreeMap<String, String>, &Compute),
) -> Result<Option<Lockstep>, Failure> {
    if scenario.clock.mode != Mode::Lockstep {
        return Ok(None);
    }
    let (acks, deadline) = (scenario.clock.acks.clone(), scenario.clock.deadline);
    let config = LockstepConfig { acks, deadline, compute: compute.clone() };
    let lockstep = Lockstep::open(config).await?;
    places.extend(lockstep.address().map(|address| ("ack".to_owned(), address.to_string())));
    Ok(Some(match children {
        Some(children) => lockstep.with_children(children),
        None => lockstep,
    }))
}

/// A scanner of the scenario as a bench has it.
fn scanner(device: &ScenarioDevice, folder: &Path) -> ScannerSpec {
    let spec = ScannerSpec {
        id: device.id.clone(),
        stream: Some(device.id.clone()),
        ..ScannerSpec::new(device.scanner, device.kind.model())
    };
    let of = DeviceSpec { profile: device.profile, ..DeviceSpec::default() };
    match &device.kind {
        DeviceKind::Cola { tcp, rest, udp, allowed, start, .. } => {
            let dialects = match start {
                Start::Stored(dialect) => DialectPolicy::Strict(*dialect),
                _ => DialectPolicy::Auto,
            };
            let of = DeviceSpec { start: Some(StartState::Cola(*start)), ..of };
            let (rest, udp) = (rest.clone(), *udp);
            let allowed_destinations = allowed.iter().copied().map(Into::into).collect();
            ScannerSpec { device: of, dialects, rest, udp, allowed_destinations, ..spec }
                .at(Endpoint::Tcp(tcp.clone()))
        }
        DeviceKind::Lms2xx { link, start, rate, .. } => {
            let of = DeviceSpec { start: Some(StartState::Lms2xx(*start)), rate: *rate, ..of };
            ScannerSpec { device: of, ..spec }.at(Endpoint::Pty(folder.join(link)))
        }
    }
}

/// Where each part is found: `ID.tcp`, `ID.rest`, `ID.udp` and `ID.path` of scanners, `ID.path` and `ID.address` of the rest; of several ports of one bus the first under its kind
/// of place, all under `ID.0`, `ID.1` and so on.
fn placeholders(scenario: &Scenario, bench: &Bench, places: &mut BTreeMap<String, String>) {
    let mut ports: BTreeMap<&str, u32> = BTreeMap::new();
    for place in bench.places() {
        let is_scanner = scenario.devices.iter().any(|device| device.id == place.part);
        let kind = match &place.at {
            At::Path(_) => "path",
            At::Address(_) | At::Name(_) if is_scanner && ["rest", "udp"].contains(&place.kind) => place.kind,
            At::Address(_) | At::Name(_) if is_scanner => "tcp",
            At::Address(_) | At::Name(_) => "address",
        };
        let number = ports.entry(&place.part).or_default();
        if !is_scanner {
            places.insert(format!("{}.{number}", place.part), for_child(&place.at));
        }
        *number += 1;
        places.entry(format!("{}.{kind}", place.part)).or_insert_with(|| for_child(&place.at));
    }
}

/// A place as a child is told it. A child has a folder of its own: paths are told from the root.
fn for_child(at: &At) -> String {
    match at {
        // A place that is there has a name.
        At::Path(path) => std::path::absolute(path).unwrap_or_else(|_| path.clone()).display().to_string(),
        At::Address(_) | At::Name(_) => at.to_string(),
    }
}

/// A port with the placeholder `{run}` filled in.
fn filled(port: &str, folder: &Path) -> String {
    port.replace("{run}", &folder.to_string_lossy())
}

/// A bus's port. A link to a pseudo-terminal lies in the run's folder, as that of a scanner does: runs side by side have one each.
fn bus_in_folder(port: &str, folder: &Path) -> Result<BusAddress, BusAddressError> {
    Ok(match filled(port, folder).parse()? {
        BusAddress::Slcan(link) => BusAddress::Slcan(folder.join(link)),
        BusAddress::Lines(link) => BusAddress::Lines(folder.join(link)),
        other => other,
    })
}

/// The same of a GNSS receiver's.
fn nmea_in_folder(port: &str, folder: &Path) -> Result<NmeaAddress, NmeaAddressError> {
    Ok(match filled(port, folder).parse()? {
        NmeaAddress::Pty(link, rate) => NmeaAddress::Pty(folder.join(link), rate),
        other => other,
    })
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use rowscan_vehicle::trajectory::Trajectory;

    use super::*;

    #[test]
    fn an_end_where_the_tractor_is_already_or_never_comes_is_refused() {
        let from = |y_m: f64, speed_m_s: f64| Tractor::new(Trajectory::straight(y_m, speed_m_s));
        let check = |row_m: f64, tractor: &Tractor| check_end(End::RowM(row_m), tractor);
        for start_m in [-2.0, 0.0, 1.75] {
            let tractor = from(start_m, 1.5);
            for behind in [start_m - 1.0, start_m] {
                let why = check(behind, &tractor).expect_err("over at once");
                assert!(why.contains("over at once") && why.contains(&start_m.to_string()), "{why}");
            }
            assert_eq!(check(start_m + 0.01, &tractor), Ok(()));
            assert_eq!(check(start_m + 1.5 * 86_000.0, &tractor), Ok(()), "in less than a day");
            assert!(check(1e9, &tractor).is_err_and(|why| why.contains("within a day")));
            // Nothing is known of one that somebody else will drive.
            assert_eq!(check(1e9, &from(start_m, 0.0)), Ok(()));
            for other in [End::Seconds(1.0), End::Scans(1)] {
                assert_eq!(check_end(other, &tractor), Ok(()));
            }
        }
    }

    #[test]
    fn links_of_a_run_lie_in_its_folder() {
        let folder = Path::new("/tmp/run-1");
        for (port, link) in [
            ("can", "/tmp/run-1/can"),
            ("./can", "/tmp/run-1/can"),
            ("{run}/can", "/tmp/run-1/can"),
            ("/x/can", "/x/can"),
        ] {
            let path = PathBuf::from(link);
            assert_eq!(bus_in_folder(&format!("slcan:{port}"), folder), Ok(BusAddress::Slcan(path.clone())));
            assert_eq!(bus_in_folder(&format!("lines:{port}"), folder), Ok(BusAddress::Lines(path.clone())));
            let gnss = nmea_in_folder(&format!("pty:{port}@4800"), folder);
            assert_eq!(gnss, Ok(NmeaAddress::Pty(path, Some(4800))));
        }
    }

    #[test]
    fn a_child_in_another_folder_finds_every_path_that_it_is_told() {
        let here = std::env::current_dir().unwrap_or_default();
        for path in ["can", "links/can", "./can", "/run/can"] {
            let told = for_child(&At::Path(path.into()));
            assert!(Path::new(&told).is_absolute(), "{told}");
            assert_eq!(Path::new(&told), std::path::absolute(here.join(path)).unwrap_or_default());
        }
        assert_eq!(for_child(&At::Name("vcan0".to_owned())), "vcan0");
        assert_eq!(for_child(&At::Address(([127, 0, 0, 1], 4001).into())), "127.0.0.1:4001");
    }
}
