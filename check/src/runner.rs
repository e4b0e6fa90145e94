//! One run of a scenario: the rig's time goes from its start to the end, children start, are watched and end.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Duration;

use regex_lite::Regex;
use rowscan_bus::isobus::role::IdleSetpoints;
use rowscan_bus::link::socketcand;
use rowscan_emulator::{Compute, Gap, Hold, Sleep, StageRow};
use rowscan_faults::At;
use rowscan_files::OutputFile;
use rowscan_ports::clock::{Stopwatch, rest, within};
use rowscan_ports::task;
use rowscan_protocol::time::SimTime;
use rowscan_sprayer::overlap::overlaps;
use tokio::task::JoinSet;

use crate::child::{self, Child, Start};
use crate::child_clock;
use crate::descendants::Descendants;
use crate::fault::{Pause, ScenarioFault};
use crate::fault_desk::FaultDesk;
use crate::frames::{BusRecord, Frames};
use crate::jitter::{Jitter, JitterWatch};
use crate::journal::{END, Event, Journal, over_at_once};
use crate::onlooker::Onlooker;
use crate::output::Match;
use crate::pause::{self, Timing};
use crate::rig::{self, Failure, ScenarioRig};
use crate::run_end::RunEnd;
use crate::scenario::{DeviceSpec, Mode, OnExit, Ready, RunSpec, Scenario, Time};
use crate::sprayer::{SprayerRun, idle_setpoints, untold};
use crate::standing::Standing;
use crate::takers;
use crate::truth;
use crate::unmet;
use crate::unread;
use crate::witness::{Stream, Witness};

/// Between two looks at the children and at time, host time.
const LOOK_EVERY: Duration = Duration::from_millis(20);
/// Between two looks at whether a child is ready, host time.
const READY_EVERY: Duration = Duration::from_millis(10);

/// How long, host time, all scanners may have takers in lockstep while a child is not ready.
const TAKEN: Duration = Duration::from_secs(3);

/// A pattern's number in a child's output that says it is ready: beyond those of expectations.
const READY: usize = usize::MAX;

/// What a run has beside its scenario.
#[derive(Clone, Copy)]
pub(crate) struct Beside<'a> {
    /// What `{rowscan}` stands for.
    pub(crate) program: Option<&'a Path>,
    /// Where the library is that puts children on simulated time, if somebody says.
    pub(crate) child_clock: Option<&'a Path>,
    /// Who looks at it.
    pub(crate) onlooker: Option<&'a dyn Onlooker>,
    /// Its folder stays: it is recorded there.
    pub(crate) is_kept: bool,
}

/// What one run left.
#[derive(Debug, Default)]
pub(crate) struct RunRecord {
    pub(crate) seed: u64,
    pub(crate) folder: PathBuf,
    pub(crate) events: Vec<Event>,
    pub(crate) streams: BTreeMap<String, Stream>,
    pub(crate) children: BTreeMap<String, ChildRecord>,
    /// Why it cannot be judged.
    pub(crate) error: Option<String>,
    /// When it ended, simulated.
    pub(crate) ended: SimTime,
    /// The child whose leaving ended it before its end was reached: the last one.
    pub(crate) left: Option<String>,
    pub(crate) journal: Option<Journal>,
    pub(crate) wall_s: f64,
    pub(crate) scans_missed: u64,
    /// Events of faults that came too fast to be noted.
    pub(crate) fault_events_lost: u64,
    /// How often each fault acted, by id.
    pub(crate) fault_acts: BTreeMap<String, u64>,
    /// What each bus has carried.
    pub(crate) frames: BTreeMap<String, BusRecord>,
    /// The GNSS receiver's sentences, if an expectation is of them.
    pub(crate) sentences: Vec<(SimTime, String)>,
    /// The longest that the controller computed in a step, where that is measured.
    pub(crate) longest_compute: Option<Duration>,
    /// How late this machine woke what waits, on a paced clock.
    pub(crate) jitter: Option<Jitter>,
    /// When nobody took scans in lockstep, and time went on at the host's pace.
    pub(crate) gaps: Vec<Gap>,
    /// When a child slept by the host's time in lockstep, and held time.
    pub(crate) sleeps: Vec<Sleep>,
    /// How many bytes compared files had when the drive was released, by their names.
    pub(crate) bytes_before: BTreeMap<String, u64>,
    /// The trees of the row that each device sees, by its id.
    pub(crate) truths: BTreeMap<String, truth::Trees>,
    /// What the sprayer did, or why that is unknown; none where there is none.
    pub(crate) sprayer: Option<Result<SprayerRun, String>>,
    /// When connections between task controllers and clients were given up.
    pub(crate) given_up: Vec<SimTime>,
    /// Setpoints that commanded the sprayer nothing.
    pub(crate) idle_setpoints: Vec<IdleSetpoints>,
    /// Bytes that the clients of devices had not read at its end, by the device's id: of those that were a second of scans and more behind.
    pub(crate) unread: BTreeMap<String, u64>,
    /// What the user should know of the scene.
    pub(crate) warnings: Vec<String>,
}

impl RunRecord {
    /// How it ended before its end, in words, if it did.
    pub(crate) fn early(&self, scenario: &Scenario) -> Option<String> {
        let child = self.left.as_deref()?;
        let code = self.children.get(child).and_then(|child| child.exit_code);
        let code = code.map_or("an unknown code".to_owned(), |code| format!("code {code}"));
        let (place, end) = (self.place(), scenario.end);
        Some(format!("the run ended at {place}, before its end, {end}: `{child}` had left with {code}"))
    }

    /// Why a fault changed nothing, if that is known.
    pub(crate) fn unmet(&self, fault: &ScenarioFault) -> Option<String> {
        let Self { streams, events, journal, .. } = self;
        unmet::why(fault, &unmet::Left { streams, events, journal: journal.as_ref()?, end: self.end() })
    }

    /// When it ended, and why.
    pub(crate) fn end(&self) -> RunEnd<'_> {
        RunEnd { at: self.ended, left: self.left.as_deref() }
    }

    /// When and where it ended.
    pub(crate) fn place(&self) -> String {
        let row_m = self.journal.as_ref().map(|journal| format!(", row {:.2} m", journal.row_m(self.ended)));
        format!("{:.3} s{}", self.ended.as_secs_f64(), row_m.unwrap_or_default())
    }

    /// Refuses to compare a file that tells nothing of the drive: it is empty, or as it was before.
    pub(crate) fn check_written(&self, file: &str, content: &[u8]) -> Result<(), String> {
        if content.is_empty() {
            return Err(format!("{file} is empty: there is nothing to compare"));
        }
        match self.bytes_before.get(file) {
            Some(before) if *before == content.len() as u64 => Err(format!(
                "nothing was written to {file} since the drive could start: there is nothing to compare"
            )),
            _ => Ok(()),
        }
    }
}

/// What one child left.
#[derive(Debug, Default)]
pub(crate) struct ChildRecord {
    pub(crate) exit_code: Option<i32>,
    /// The number of its process.
    pub(crate) process: Option<u32>,
    pub(crate) tail: String,
    /// When the patterns of expectations matched, by the expectation's number.
    pub(crate) matches: BTreeMap<usize, Vec<Match>>,
}

/// Runs `scenario` once with `seed`, in `folder`, with these of its faults.
pub(crate) async fn run(
    scenario: &Scenario,
    seed: Option<u64>,
    folder: &Path,
    (faults, beside): (&[ScenarioFault], Beside<'_>),
) -> RunRecord {
    let stopwatch = Stopwatch::start();
    let mut record =
        RunRecord { seed: seed.unwrap_or_default(), folder: folder.to_owned(), ..RunRecord::default() };
    if let Err(failure) = drive(scenario, seed, folder, (faults, beside, &mut record)).await {
        record.error = Some(failure.to_string());
    }
    record.wall_s = stopwatch.elapsed().as_secs_f64();
    record
}

async fn drive(
    scenario: &Scenario,
    seed: Option<u64>,
    folder: &Path,
    (faults, beside, record): (&[ScenarioFault], Beside<'_>, &mut RunRecord),
) -> Result<(), Failure> {
    let stage = rig::grow(scenario, seed, |warning| record.warnings.push(warning.to_string()))?;
    record.seed = stage.scene.seed;
    let mut rig =
        ScenarioRig::start(scenario, stage, folder, (faults, beside.onlooker, beside.is_kept)).await?;
    let journal = rig.journal.clone();
    record.journal = Some(journal.clone());
    // Dropped after the children.
    let descendants = Descendants::new();
    let mut children = Vec::new();
    let program =
        beside.program.map(|program| ("rowscan".to_owned(), program.to_string_lossy().into_owned()));
    rig.places.extend(program);
    let pauses = pauses(scenario, &rig, faults)?;
    let on_clock = match rig.child_clock.is_some() {
        true => Some(child_clock::library(beside.child_clock, beside.program)?),
        false => None,
    };
    let ScenarioRig { bench, places, desk, frames, witness, compute, .. } = &mut rig;
    let hold = bench.hold().cloned().ok_or("the drive is not held")?;
    let around =
        Around { places, on_clock: on_clock.as_deref(), hold: &hold, desk, frames, witness, compute };
    let jitter = (scenario.clock.mode == Mode::Paced).then(JitterWatch::start);
    let drove = Stopwatch::start();
    let ended: Result<Option<String>, Failure> = tokio::select! {
        biased;
        ended = bench.ended() => ended.map(|()| None).map_err(Failure::from),
        ended = accompany(scenario, (folder, record.seed, &mut record.bytes_before), &around, (&journal, pauses), (&descendants, &mut children)) => ended.map(Some),
    };
    record.unread = unread::at_end(scenario, bench, drove.elapsed()).await;
    desk.note();
    record.gaps = rig.gaps.all();
    record.sleeps = rig.sleeps.all();
    // The last child left where it took its last scan: how long its end took the host is nothing of the drive.
    let left = record.gaps.pop_if(|gap| matches!(ended, Ok(Some(_))) && gap.to.is_none());
    record.ended = left.map_or(journal.now(), |gap| gap.from);
    journal.back_to(record.ended);
    let why = match &ended {
        Ok(None) => String::new(),
        Ok(Some(child)) => format!("`{child}` had left, the last child; the scenario's end was not reached"),
        Err(failure) => failure.to_string(),
    };
    journal.note_at(END, why, record.ended);
    record.streams = rig.witness.close(matches!(ended, Ok(None)));
    record.jitter = jitter.and_then(|jitter| jitter.measured());
    record.longest_compute = rig.compute.longest();
    (record.frames, record.sentences) = (rig.frames.close(), rig.sentences.close());
    record.sprayer = sprayed(scenario, &rig, record);
    let booms = scenario.sprayer.iter().map(|spec| &spec.boom);
    let boom = booms.flat_map(|boom| overlaps(boom).into_iter().chain(untold(boom)));
    let runs = record.sprayer.iter().flatten();
    let told = runs.flat_map(|run| run.unheeded().into_iter().chain(run.in_part()));
    let known: Vec<String> = boom.chain(told).chain(idle_setpoints(&rig.sections)).collect();
    record.warnings.extend(known.into_iter().chain(rig.refused.told()));
    record.idle_setpoints = rig.sections.idle();
    record.given_up = rig.sections.given_up().into_iter().chain(rig.clients.lost()).collect();
    let tasks = scenario.buses.iter().filter_map(|bus| bus.task.as_ref());
    record.warnings.extend(tasks.flat_map(|task| task.told(&rig.clients.news(), &rig.clients.steps())));
    let left = ended.as_ref().ok().and_then(Option::as_deref);
    let unfinished = rig.desk.unfinished(RunEnd { at: record.ended, left });
    // Healed faults are forgotten.
    record.fault_acts = rig.desk.acts();
    record.warnings.extend(over_before_drive(faults, &journal));
    rig.desk.heal();
    record.fault_events_lost = rig.desk.events_lost();
    record.warnings.extend(record.streams.iter().filter_map(|(id, stream)| stream.told_of_late(id)));
    record.scans_missed = rig.scans_missed();
    if record.scans_missed > 0 {
        record.warnings.push(format!(
            "this machine was too slow for {} scans: no telegram was made of them, and none of them counts as lost; take a smaller `scale`, or lockstep",
            record.scans_missed
        ));
    }
    let ScenarioRig { stage, bench, file, child_clock, .. } = rig;
    // The children's streams end, as those of a machine that is switched off; then they may end by themselves.
    bench.close().await;
    // Its taps are gone with the bench.
    let recorded = file.map_or(Ok(()), |file| file.finish(journal.began()));
    child::end_all(&mut children, child_clock).await;
    for child in &children {
        record.children.insert(child.id.clone(), record_of(scenario, child));
    }
    let left = descendants.end();
    if !left.is_empty() {
        record
            .warnings
            .push(format!("killed what the children left running outside their group: {}", left.join(", ")));
    }
    record.events = journal.events();
    let idle = |fault: &&ScenarioFault| {
        let at_once = fault.has_until() && fault.id().is_some_and(|id| over_at_once(&record.events, id));
        at_once || record.unmet(fault).is_some()
    };
    let ids: Vec<String> =
        faults.iter().filter(idle).filter_map(|fault| fault.id()).map(str::to_owned).collect();
    record.fault_acts.extend(ids.into_iter().map(|id| (id, 0)));
    let seen = |device: &DeviceSpec| (device.id.clone(), truth::Trees::of(&stage, device.scanner));
    record.truths = scenario.devices.iter().map(seen).collect();
    write_frames(folder, &record.frames)?;
    let ended = ended.map(|left| record.left = left);
    let cut_off = match &ended {
        Ok(()) => record.early(scenario),
        Err(failure) => Some(failure.to_string()),
    };
    if let (Some(Ok(sprayer)), true) = (&mut record.sprayer, beside.is_kept) {
        sprayer.cut_off = cut_off;
        sprayer.keep(folder, scenario.folder(), &stage.scene)?;
    }
    recorded?;
    ended?;
    if let Some(unfinished) = unfinished {
        return Err(unfinished.into());
    }
    if children.len() < scenario.runs.len() {
        return Err(format!("{}, or shorten `ready`", record.end().before("every child had started")).into());
    }
    Ok(())
}

/// What the scenario's sprayer did, by what its bus has carried.
fn sprayed(scenario: &Scenario, rig: &ScenarioRig, record: &RunRecord) -> Option<Result<SprayerRun, String>> {
    let spec = scenario.sprayer.as_ref()?;
    let unknown = || format!("nothing is known of {}", spec.bus);
    let (grown, driven) = ((&rig.stage.scene, &*rig.stage.orchard), (rig.bench.tractor(), record.ended));
    let troubles = rig.sprayer.as_ref().map(|part| part.troubles()).unwrap_or_default();
    let of = |bus| SprayerRun::of(spec, grown, (driven, troubles), (bus, &rig.sections));
    Some(record.frames.get(&spec.bus).ok_or_else(unknown).and_then(of))
}

/// Writes what each bus has carried to `BUS.candump`, as can-utils and cantools read it, with simulated time.
fn write_frames(folder: &Path, frames: &BTreeMap<String, BusRecord>) -> Result<(), Failure> {
    for (bus, frames) in frames {
        let lines: String = frames.all.iter().map(|carried| carried.candump_line(bus)).collect();
        OutputFile::create(&folder.join(format!("{bus}.candump")))?.write_whole(lines.as_bytes())?;
    }
    Ok(())
}

fn record_of(scenario: &Scenario, child: &Child) -> ChildRecord {
    let matches = (0..scenario.expects.len()).map(|number| (number, child.output.matches(number)));
    ChildRecord {
        exit_code: child.exit_code(),
        process: child.number,
        tail: child.output.tail(),
        matches: matches.collect(),
    }
}

/// Faults that were to come later, and were over before the tractor set off: on a paced clock, time goes on while children start.
fn over_before_drive(faults: &[ScenarioFault], journal: &Journal) -> Vec<String> {
    let Some(began) = journal.began() else { return Vec::new() };
    let over = |fault: &ScenarioFault| {
        let (ScenarioFault::Rig(spec), Some(id)) = (fault, fault.id()) else { return None };
        let is_later = !matches!(spec.at, At::Start | At::Time(Duration::ZERO));
        let ended = journal.first(&format!("{id}.end")).filter(|ended| is_later && *ended < began)?;
        Some(format!(
            "the fault `{id}` was over at {:.3} s, before the drive began at {:.3} s: on a paced clock time goes on while children start; let it begin at a place (`row_m`), or take lockstep",
            ended.as_secs_f64(),
            began.as_secs_f64()
        ))
    };
    faults.iter().filter_map(over).collect()
}

/// The pauses among the faults, each with the number of its child and what it is timed by.
fn pauses(
    scenario: &Scenario,
    rig: &ScenarioRig,
    faults: &[ScenarioFault],
) -> Result<Vec<(usize, Pause, Timing)>, Failure> {
    let pauses = faults.iter().filter_map(|fault| match fault {
        ScenarioFault::Pause(pause) => Some(pause),
        _ => None,
    });
    let with_child = pauses.map(|pause| {
        let places = scenario.runs.iter().position(|run| pause.on.as_ref().is_none_or(|on| *on == run.id));
        let child = places.filter(|_| pause.on.is_some() || scenario.runs.len() == 1).ok_or_else(|| {
            let known: Vec<&str> = scenario.runs.iter().map(|run| run.id.as_str()).collect();
            format!("fault `{}`: `on` names one of the runs: {}", pause.id, known.join(", "))
        })?;
        let timing = Timing {
            journal: rig.journal.clone(),
            witness: rig.witness.clone(),
            row: StageRow::new(rig.bench.tractor().clone(), &rig.stage.orchard),
            desk: rig.desk.clone(),
        };
        Ok((child, pause.clone(), timing))
    });
    with_child.collect()
}

/// What children are started in.
struct Around<'a> {
    /// Where things are, by placeholder.
    places: &'a BTreeMap<String, String>,
    /// The library that puts children on simulated time, if one goes by it.
    on_clock: Option<&'a Path>,
    hold: &'a Hold,
    desk: &'a FaultDesk,
    frames: &'a Frames,
    witness: &'a Witness,
    compute: &'a Compute,
}

/// Starts the children one after the other and watches them; ends with the last one to leave when all have, or with why the run cannot go on.
async fn accompany(
    scenario: &Scenario,
    (folder, seed, bytes_before): (&Path, u64, &mut BTreeMap<String, u64>),
    around: &Around<'_>,
    (journal, pauses): (&Journal, Vec<(usize, Pause, Timing)>),
    (descendants, children): (&Descendants, &mut Vec<Child>),
) -> Result<String, Failure> {
    let startup = Stopwatch::start();
    for spec in &scenario.runs {
        let mut start = start(scenario, spec, folder, seed, around.places)?;
        start.env.extend([descendants.mark()]);
        if let Some(library) = around.on_clock.filter(|_| spec.time == Time::Simulated) {
            child_clock::put_on_clock(library, around.places, &start.command, &mut start.env)?;
        }
        let child = Child::start(start, journal)?;
        if spec.compute.is_some() {
            child.process().into_iter().for_each(|process| around.compute.watch(process));
        }
        children.push(child);
        let Some(child) = children.last() else { continue };
        ready(scenario, spec, child, folder, around, startup).await?;
        journal.note(format!("{}.ready", spec.id), "");
    }
    let mut pausing = JoinSet::new();
    for (child, pause, timing) in pauses {
        if let Some(child) = children.get(child) {
            pausing.spawn(task(pause::pause(pause, child.stopper(), timing)));
        }
    }
    *bytes_before = compared_files(scenario, folder);
    if scenario.clock.mode != Mode::Lockstep && !scenario.buses.is_empty() {
        // On this clock the drive does not wait for a client that has just opened its bus and gets no frames yet.
        rest(socketcand::QUIET).await;
    }
    around.hold.release();
    let (mut last, mut since) = (journal.now(), Stopwatch::start());
    let drives_on = scenario.runs.iter().any(|run| run.on_exit == OnExit::DriveOn);
    let mut standing = Standing::new(scenario);
    loop {
        let all_left = async {
            for child in children.iter() {
                child.exited().await;
            }
            if children.is_empty() || drives_on {
                std::future::pending::<()>().await;
            }
        };
        let _ = within(LOOK_EVERY, all_left).await;
        around.desk.note();
        if !drives_on && !children.is_empty() && children.iter().all(|child| child.exit_code().is_some()) {
            return Ok(last_to_leave(journal));
        }
        let limit = scenario.clock.startup;
        if journal.began().is_none() && startup.elapsed() > limit {
            return Err(takers::none_within(limit, &around.witness.untaken(), around.places).into());
        }
        if journal.now() != last {
            (last, since) = (journal.now(), Stopwatch::start());
        }
        if journal.began().is_some() {
            standing.look(journal.row_m(last), last)?;
        }
        // A step that is not acknowledged ends the run by itself; this is time that no one asks for.
        let limit = 2 * scenario.clock.deadline;
        if scenario.clock.mode == Mode::Lockstep && journal.began().is_some() && since.elapsed() > limit {
            return Err(format!("time has stood still for {limit:?}: no one takes scans any more").into());
        }
    }
}

/// How many bytes files have that expectations compare; those that are not there have none.
fn compared_files(scenario: &Scenario, folder: &Path) -> BTreeMap<String, u64> {
    let names = scenario.expects.iter().filter_map(|expect| expect.file.as_ref());
    let size = |name: &String| Some((name.clone(), std::fs::metadata(folder.join(name)).ok()?.len()));
    names.filter_map(size).collect()
}

/// The child that has left last.
fn last_to_leave(journal: &Journal) -> String {
    let events = journal.events();
    let exits = events.iter().rev().filter_map(|event| event.event.strip_suffix(".exited"));
    exits.map(str::to_owned).next().unwrap_or_default()
}

/// What a child is started with.
fn start<'a>(
    scenario: &Scenario,
    spec: &'a RunSpec,
    folder: &'a Path,
    seed: u64,
    places: &BTreeMap<String, String>,
) -> Result<Start<'a>, Failure> {
    let here = std::path::absolute(scenario.folder())?;
    let fill = |text: &str| fill(text, places, &here, folder);
    let mut command = spec.command.iter().map(|word| fill(word)).collect::<Result<Vec<_>, _>>()?;
    if let Some(program) = command.first_mut()
        && program.contains('/')
        && Path::new(program.as_str()).is_relative()
    {
        // A program beside the scenario.
        *program = here.join(&program).to_string_lossy().into_owned();
    }
    let mut env = BTreeMap::from([
        ("ROWSCAN_SEED".to_owned(), seed.to_string()),
        ("PYTHONUNBUFFERED".to_owned(), "1".to_owned()),
    ]);
    let first = scenario.devices.first().and_then(|device| places.get(&format!("{}.tcp", device.id)));
    env.extend(first.map(|address| ("ROWSCAN_ADDRESS".to_owned(), address.clone())));
    for (place, value) in places {
        let name: String = place.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
        env.insert(format!("ROWSCAN_{}", name.to_ascii_uppercase()), value.clone());
    }
    for (name, value) in &spec.env {
        env.insert(name.clone(), fill(value)?);
    }
    let of_this = |on: &Option<String>| on.as_ref().map_or(scenario.runs.len() == 1, |on| *on == spec.id);
    let wanted = scenario.expects.iter().enumerate().filter(|(_, expect)| of_this(&expect.on));
    let mut patterns: Vec<(usize, Regex)> =
        wanted.filter_map(|(number, expect)| Some((number, expect.matches.as_ref()?.0.clone()))).collect();
    if let Ready::Line(pattern) = &spec.ready {
        patterns.push((READY, pattern.clone()));
    }
    Ok(Start { id: &spec.id, written: &spec.command, command, env, folder, patterns })
}

/// A text with its placeholders filled in.
fn fill(
    text: &str,
    places: &BTreeMap<String, String>,
    here: &Path,
    folder: &Path,
) -> Result<String, Failure> {
    let mut filled = text.replace("{scenario}", &here.to_string_lossy());
    filled = filled.replace("{run}", &folder.to_string_lossy());
    for (place, value) in places {
        filled = filled.replace(&format!("{{{place}}}"), value);
    }
    // What looks like a placeholder and is none would reach the child as it is.
    let is_name = |name: &&str| {
        !name.is_empty()
            && name.contains('.')
            && name.chars().all(|c| c.is_ascii_alphanumeric() || "._-".contains(c))
    };
    let left =
        filled.split('{').skip(1).filter_map(|rest| rest.split_once('}')).map(|(name, _)| name).find(is_name);
    match left {
        Some(name) => {
            let known: Vec<&str> = places.keys().map(String::as_str).collect();
            Err(format!("nothing is called `{{{name}}}`; known are {}, scenario, run", known.join(", "))
                .into())
        }
        None => Ok(filled),
    }
}

/// Waits until a child is ready.
async fn ready(
    scenario: &Scenario,
    spec: &RunSpec,
    child: &Child,
    folder: &Path,
    Around { places, frames, witness, .. }: &Around<'_>,
    startup: Stopwatch,
) -> Result<(), Failure> {
    let (alive, mut taken) = (Stopwatch::start(), None::<Stopwatch>);
    let hears = scenario.clock.mode == Mode::Lockstep
        && matches!(spec.ready, Ready::Line(_) | Ready::File(_) | Ready::Frame(_));
    let limit = scenario.clock.startup;
    loop {
        if let Some(code) = child.exit_code() {
            let tail = child.output.tail();
            let last = tail.lines().last().unwrap_or("nothing");
            return Err(format!(
                "`{}` exited with code {code} before it was ready; it last said: {last}",
                spec.id
            )
            .into());
        }
        let is_ready = match &spec.ready {
            Ready::Alive(time) => alive.elapsed() >= *time,
            Ready::Line(_) => !child.output.matches(READY).is_empty(),
            Ready::Port(address) => {
                let address = fill(address, places, scenario.folder(), folder)?;
                tokio::net::TcpStream::connect(address).await.is_ok()
            }
            Ready::File(file) => folder.join(file).exists(),
            Ready::Frame(pattern) => frames.heard(*pattern),
        };
        if is_ready {
            return Ok(());
        }
        // Time does not go before every child is ready: who waits for a scan waits for ever.
        let waits = hears && witness.is_taken();
        let since = taken.take().filter(|_| waits).unwrap_or_else(Stopwatch::start);
        taken = Some(since);
        if since.elapsed() > TAKEN {
            return Err(format!(
                "`{}` takes scans and is not ready: in lockstep no scan comes before every child is ready, so `ready` may not wait for an answer to one; let it wait for what comes before the first scan",
                spec.id
            )
            .into());
        }
        if startup.elapsed() > limit {
            return Err(format!("`{}` was not ready within {limit:?} (`startup_wall_s`)", spec.id).into());
        }
        rest(READY_EVERY).await;
    }
}
