//! From what is written to what is meant: values checked, defaults filled in.

use std::collections::BTreeSet;
use std::net::{Ipv4Addr, SocketAddrV4};
use std::path::Path;
use std::time::Duration;

use rowscan_emulator::lockstep::Ack;
use rowscan_protocol::device::Start;
use rowscan_protocol::lms2xx::{self, Rate};
use rowscan_protocol::model::{AnyModel, Model};

use super::events::Events;
use super::file::{
    AckValue, BusTable, ClockTable, ComputeTable, ComputeTime, DeviceTable, EndTable, Mode, OFF, PortName,
    PortTable, ReadyTable, RunTable, ScenarioFile, Time,
};
use super::{BusSpec, Clock, ComputeSpec, DeviceKind, DeviceSpec, End, PortSpec, Ready, RunSpec, Scenario};
use crate::fault::ScenarioFault;
use crate::signal::{Names, Source, Ways};
use crate::sprayer::{self, SprayerTable};
use crate::task_controller::TaskSpec;

/// The largest DBC file.
const LARGEST_DBC: u64 = 64 * 1024 * 1024;

/// The version of the format.
const VERSION: u32 = 1;

/// A scenario of these tables.
pub(super) fn settle(path: &Path, file: ScenarioFile) -> Result<Scenario, String> {
    let missing = |key: &str| format!("the key `{key}` is missing; add it");
    match file.version {
        Some(VERSION) => {}
        Some(other) => return Err(format!("`version`: expected {VERSION}, found {other}")),
        None => return Err(missing("version")),
    }
    let mut faults = file.faults.unwrap_or_default();
    ScenarioFault::name_all(&mut faults);
    let mut refusal = not_here(&faults);
    let runs = file.run.unwrap_or_default();
    let clock = clock(&file.clock.unwrap_or_default(), &runs, &mut refusal)?;
    let mut settled_runs = Vec::new();
    for run in runs {
        settled_runs.push(settled(run)?);
    }
    check_time(&settled_runs, &clock)?;
    let devices = file.device.unwrap_or_default();
    let is_off = |device: &&DeviceTable| device.start.as_ref().is_some_and(|start| start.0 == OFF);
    let off: Vec<String> = devices.iter().filter(is_off).map(|device| device.id.clone()).collect();
    check_power(&off, &faults)?;
    let devices = devices.into_iter().enumerate().map(|(place, table)| device(place, table, clock.mode));
    let devices = devices.collect::<Result<_, _>>()?;
    let mut scenario = Scenario {
        path: path.to_owned(),
        scene: file.scene.ok_or_else(|| missing("scene"))?,
        seed: file.seed,
        seeds: file.repeat.map_or(1, |repeat| repeat.seeds),
        clock,
        end: end(file.end.ok_or_else(|| missing("end"))?)?,
        devices,
        buses: buses(file.bus)?,
        nmea: ports_of(file.nmea),
        runs: settled_runs,
        faults,
        sprayer: None,
        expects: file.expect.unwrap_or_default(),
        refusal,
    };
    check(&scenario)?;
    signals(&mut scenario, file.sprayer)?;
    Ok(scenario)
}

/// The first fault that is not built, and why.
fn not_here(faults: &[ScenarioFault]) -> Option<String> {
    faults.iter().find_map(|fault| match fault {
        ScenarioFault::NotHere(why) => Some(why.clone()),
        _ => None,
    })
}

fn buses(tables: Option<Vec<BusTable>>) -> Result<Vec<BusSpec>, String> {
    let bus = |table: BusTable| match (table.port.is_some(), table.all().count()) {
        (true, 2..) => {
            Err(format!("bus `{}`: `port` and `ports` both say where it is; leave one out", table.id))
        }
        (_, 0) => Err(format!("bus `{}`: it has no port; add `ports = [\"…\"]`", table.id)),
        _ => {
            let ports = table.all().cloned().collect();
            let task = table.task_controller.map(TaskSpec::new).transpose();
            let task = task.map_err(|why| format!("bus `{}`: {why}", table.id))?;
            Ok(BusSpec { ports, id: table.id, dbc: table.dbc, task })
        }
    };
    let buses: Vec<BusSpec> = tables.unwrap_or_default().into_iter().map(bus).collect::<Result<_, _>>()?;
    let own: Vec<&str> = buses.iter().filter(|bus| bus.task.is_some()).map(|bus| bus.id.as_str()).collect();
    match own.as_slice() {
        [first, second, ..] => {
            Err(format!("buses `{first}` and `{second}` both have a `task_controller`; leave one out"))
        }
        _ => Ok(buses),
    }
}

fn ports_of(tables: Option<Vec<PortTable>>) -> Vec<PortSpec> {
    tables.unwrap_or_default().into_iter().map(|PortTable { id, port }| PortSpec { id, port }).collect()
}

/// Finds where each signal is heard, and the sprayer's commands.
fn signals(scenario: &mut Scenario, sprayer: Option<SprayerTable>) -> Result<(), String> {
    if sprayer.is_none() && scenario.expects.iter().all(|expect| expect.signal.is_none()) {
        return Ok(());
    }
    let folder = scenario.folder().to_owned();
    let read = |bus: &BusSpec| -> Result<Option<Names>, String> {
        let Some(file) = &bus.dbc else { return Ok(None) };
        let path = folder.join(file);
        let told =
            |why: &dyn std::fmt::Display| format!("`dbc` of bus `{}`, {}: {why}", bus.id, path.display());
        let bytes = rowscan_files::read(&path, LARGEST_DBC).map_err(|cause| told(&cause))?;
        // Units and comments of older files are Latin-1.
        let text = String::from_utf8(bytes)
            .unwrap_or_else(|error| error.as_bytes().iter().map(|byte| char::from(*byte)).collect());
        Names::read(&text).map(Some).map_err(|error| told(&error))
    };
    let databases = scenario.buses.iter().map(read).collect::<Result<Vec<_>, _>>()?;
    let ways = Ways {
        buses: scenario.buses.iter().map(|bus| bus.id.as_str()).zip(databases).collect(),
        nmea: scenario.nmea.iter().map(|place| place.id.as_str()).collect(),
        runs: scenario.runs.iter().map(|run| run.id.as_str()).collect(),
    };
    scenario.sprayer = sprayer.map(|table| sprayer::settled(table, &folder, &ways)).transpose()?;
    let client = scenario.sprayer.as_ref().filter(|sprayer| sprayer.client.is_some());
    let has_both = |bus: &&BusSpec| bus.task.is_some() && client.is_some_and(|client| client.bus == bus.id);
    if let Some(bus) = scenario.buses.iter().find(has_both) {
        return Err(format!(
            "bus `{}`: its `task_controller` and the client that `sprayer.isobus` makes are both the rig's own: nothing of yours would be tested; leave one out",
            bus.id
        ));
    }
    for (number, expect) in scenario.expects.iter_mut().enumerate() {
        let Some(keys) = &expect.signal else { continue };
        let told = |message| format!("expectation {}, `{}`: {message}", number + 1, expect.what.name);
        let source = Source::resolve(keys, expect.matches.is_some(), &ways).map_err(told)?;
        if let Some(name) = &expect.equals_text {
            expect.bounds.equals = Some(source.named(name).map_err(told)?);
        }
        if source.has_no_value() && !expect.bounds.is_empty() {
            let why = "a whole message has no value to be bound: add `pgn` and `bytes`, or name a signal of a DBC file";
            return Err(told(why.to_owned()));
        }
        if let Source::Log { child } = &source {
            expect.on = Some(child.clone());
        }
        expect.source = Some(source);
    }
    Ok(())
}

/// Refuses what contradicts itself.
fn check(scenario: &Scenario) -> Result<(), String> {
    if scenario.expects.is_empty() {
        return Err("it expects nothing; add an [[expect]]".to_owned());
    }
    if scenario.seeds == 0 {
        return Err("`repeat`: expected 1 seed or more, found 0".to_owned());
    }
    let computing: Vec<&str> =
        scenario.runs.iter().filter(|run| run.compute.is_some()).map(|run| run.id.as_str()).collect();
    match computing.as_slice() {
        [_, _, ..] => {
            return Err(format!(
                "`compute`: expected it of one run, found it of {}: nobody could say whose frames on a bus are late",
                computing.join(" and ")
            ));
        }
        [_] if scenario.clock.mode == Mode::Paced => {
            return Err(
                "`compute` is of a clock in lockstep: on a paced one a controller takes the time it takes"
                    .to_owned(),
            );
        }
        _ => {}
    }
    if scenario.devices.is_empty() {
        return Err("it has no scanner; add a [[device]]".to_owned());
    }
    let mut ids = BTreeSet::new();
    let of_devices = scenario.devices.iter().map(|device| &device.id);
    let buses = scenario.buses.iter().map(|bus| &bus.id);
    let of_ports = buses.chain(scenario.nmea.iter().map(|port| &port.id));
    for id in of_devices.chain(of_ports).chain(scenario.runs.iter().map(|run| &run.id)) {
        let is_name = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '-');
        if id.is_empty() || !id.chars().all(is_name) {
            return Err(format!("`id`: expected letters, digits, `_` and `-`, found `{id}`"));
        }
        if !ids.insert(id) {
            return Err(format!("two things are called `{id}`; rename one"));
        }
    }
    check_events(scenario)
}

/// Refuses names that mean two things, and expectations of what cannot happen.
fn check_events(scenario: &Scenario) -> Result<(), String> {
    let events = Events::of(scenario)?;
    // Of a fault that is not built it is not known what it is called.
    if not_here(&scenario.faults).is_some() {
        return Ok(());
    }
    for (number, expect) in scenario.expects.iter().enumerate() {
        let told = |message| format!("expectation {}, `{}`: {message}", number + 1, expect.what.name);
        events.check(expect, &scenario.faults).map_err(told)?;
    }
    Ok(())
}

fn clock(table: &ClockTable, runs: &[RunTable], refusal: &mut Option<String>) -> Result<Clock, String> {
    let seconds = |key: &str, value: Option<f64>, default: f64| match value.unwrap_or(default) {
        value if (0.001..=86_400.0).contains(&value) => Ok(Duration::from_secs_f64(value)),
        value => Err(format!("`{key}`: expected 0.001 to 86400 seconds, found {value}")),
    };
    let scale = match (table.mode, table.scale) {
        (Mode::Lockstep, Some(_)) => {
            return Err("in lockstep the participants set the pace: leave `scale` out".to_owned());
        }
        (Mode::Lockstep, None) => None,
        (Mode::Paced, scale) => Some(scale.unwrap_or(1.0)),
    };
    if let Some(scale) = scale.filter(|scale| !(1e-6..=1e6).contains(scale)) {
        return Err(format!("`scale`: expected 0.000001 to 1000000, found {scale}"));
    }
    if table.mode == Mode::Paced && !table.ack.is_empty() {
        return Err("`ack` is of a clock in lockstep: add `mode = \"lockstep\"`".to_owned());
    }
    let mut acks = Vec::new();
    for (id, value) in &table.ack {
        if !runs.iter().any(|run| run.id == *id) {
            return Err(format!("`ack`: there is no [[run]] with id `{id}`"));
        }
        let ack = match value {
            AckValue::Level(level) if level == "reply" => Ack::Reply("127.0.0.1:0".to_owned()),
            AckValue::Level(level) => level.parse().map_err(|error| format!("`ack`: {error}"))?,
            AckValue::Output(_) => {
                refusal.get_or_insert("an `ack` by an output lands separately".to_owned());
                continue;
            }
        };
        if !acks.contains(&ack) {
            acks.push(ack);
        }
    }
    if acks.iter().filter(|ack| !matches!(ack, Ack::Reply(_))).count() > 1 {
        return Err("`ack`: expected one of sent, read, idle for all children, found several".to_owned());
    }
    if acks.is_empty() {
        acks.push(Ack::Idle);
    }
    let deadline = seconds("deadline_wall_s", table.deadline_wall_s, 5.0)?;
    let startup = seconds("startup_wall_s", table.startup_wall_s, 30.0)?;
    Ok(Clock { mode: table.mode, scale, acks, deadline, startup })
}

/// Refuses simulated time for children where nobody can see when they have dealt with their timers.
fn check_time(runs: &[RunSpec], clock: &Clock) -> Result<(), String> {
    let Some(run) = runs.iter().find(|run| run.time == Time::Simulated) else { return Ok(()) };
    match (clock.mode, &clock.acks[..]) {
        (Mode::Lockstep, [Ack::Idle]) => Ok(()),
        (Mode::Lockstep, _) => Err(format!(
            "`time` of run `{}`: simulated time needs to see that children are idle: expected `ack` idle alone; leave `ack` out",
            run.id
        )),
        (Mode::Paced, _) => Err(format!(
            "`time` of run `{}`: only a clock in lockstep waits for a child's timers: add `clock = {{ mode = \"lockstep\" }}`",
            run.id
        )),
    }
}

fn end(table: EndTable) -> Result<End, String> {
    let wrong = |expected: &str, found: f64| Err(format!("`end`: expected {expected}, found {found}"));
    match (table.row_m, table.s, table.scans) {
        (Some(row_m), None, None) if row_m > 0.0 && row_m.is_finite() => Ok(End::RowM(row_m)),
        (Some(row_m), None, None) => wrong("`row_m` above 0", row_m),
        (None, Some(s), None) if s > 0.0 && s <= 86_400.0 => Ok(End::Seconds(s)),
        (None, Some(s), None) => wrong("`s` above 0, up to 86400", s),
        (None, None, Some(0)) => wrong("`scans` from 1 on", 0.0),
        (None, None, Some(scans)) => Ok(End::Scans(scans)),
        _ => Err("`end`: expected one of `row_m`, `s` and `scans`".to_owned()),
    }
}

fn device(place: usize, table: DeviceTable, mode: Mode) -> Result<DeviceSpec, String> {
    let unknown = || format!("`model`: expected a scanner (`rowscan models`), found `{}`", table.model);
    let model = AnyModel::by_name(&table.model).ok_or_else(unknown)?;
    let (id, profile) = (table.id.clone(), table.profile.0);
    let state = |known: bool, name: &str| match known {
        true => Ok(()),
        false => Err(format!("`start` of `{id}`: a {} has no state `{name}`", model.name())),
    };
    let name = table.start.as_ref().map(|start| start.0.clone());
    let kind = match model {
        AnyModel::Cola(model) => {
            if table.pty.is_some() || table.rate.is_some() {
                return Err(format!("`{id}` is a network scanner: leave `pty` and `rate` out"));
            }
            let start = match name.as_deref() {
                None => profile.default_start(),
                // The fault `power` holds it off; then it powers up.
                Some(OFF) => Start::PowerUp,
                Some(name) => {
                    state(Start::by_name(name).is_some(), name)?;
                    Start::by_name(name).unwrap_or_default()
                }
            };
            let (udp, allowed) = destinations(&id, model, &table)?;
            if name.as_deref() == Some("streaming") && model.compact.is_some() && udp.is_none() {
                return Err(format!(
                    "`start` of `{id}`: it streams at once, and nothing says where to: add `udp = \"127.0.0.1:0\"`"
                ));
            }
            let free = || "127.0.0.1:0".to_owned();
            let tcp = table.tcp.unwrap_or_else(free);
            let rest = model.compact.map(|_| table.rest.unwrap_or_else(free));
            DeviceKind::Cola { model, tcp, rest, udp, allowed, start }
        }
        AnyModel::Lms2xx(model) => {
            use lms2xx::device::Start;
            let is_on_a_network = table.tcp.is_some() || table.rest.is_some();
            if is_on_a_network || table.udp.is_some() || table.allow_destination.is_some() {
                return Err(format!(
                    "`{id}` has a serial line: `pty` names its link, leave `tcp`, `rest`, `udp` and `allow_destination` out"
                ));
            }
            if mode == Mode::Lockstep {
                let why = "nobody can see what its client has read";
                return Err(format!(
                    "`{id}` has a serial line, and in lockstep {why}: use `mode = \"paced\"`"
                ));
            }
            let start = match name.as_deref() {
                None => Start::default_of(profile),
                Some(OFF) => Start::PowerUp,
                Some(name) => {
                    state(Start::by_name(name).is_some(), name)?;
                    Start::by_name(name).unwrap_or_default()
                }
            };
            let baud = table.rate.unwrap_or(9600);
            let rates = || format!("`rate` of `{id}`: expected 9600, 19200, 38400 or 500000, found {baud}");
            let rate = Rate::of(baud).ok_or_else(rates)?;
            DeviceKind::Lms2xx { model, link: table.pty.unwrap_or_else(|| id.clone()), start, rate }
        }
    };
    Ok(DeviceSpec { scanner: table.scanner.unwrap_or(place), id, kind, profile })
}

/// Where the datagrams of a network scanner may go.
fn destinations(
    id: &str,
    model: &Model,
    table: &DeviceTable,
) -> Result<(Option<SocketAddrV4>, Vec<Ipv4Addr>), String> {
    let given = [
        ("rest", table.rest.is_some()),
        ("udp", table.udp.is_some()),
        ("allow_destination", table.allow_destination.is_some()),
    ];
    if let Some((key, _)) = given.iter().find(|(_, is_given)| *is_given && model.compact.is_none()) {
        return Err(format!(
            "`{key}` of `{id}`: a {} has no REST interface and sends no datagrams; leave it out",
            model.name
        ));
    }
    let place = |text: &String| {
        let wrong = || {
            format!(
                "`udp` of `{id}`: expected an IPv4 address with a port, such as 127.0.0.1:0, found `{text}`"
            )
        };
        text.parse::<SocketAddrV4>().map_err(|_| wrong())
    };
    let address = |text: &String| {
        let wrong = || {
            format!(
                "`allow_destination` of `{id}`: expected IPv4 addresses, such as 192.0.2.7, found `{text}`"
            )
        };
        text.parse::<Ipv4Addr>().map_err(|_| wrong())
    };
    let udp = table.udp.as_ref().map(place).transpose()?;
    Ok((udp, table.allow_destination.iter().flatten().map(address).collect::<Result<_, _>>()?))
}

fn compute(
    id: &str,
    table: Option<ComputeTable>,
    factor: Option<f64>,
) -> Result<Option<ComputeSpec>, String> {
    let wrong = |key: &str, expected: &str, found: &dyn std::fmt::Display| {
        Err(format!("`{key}` of run `{id}`: expected {expected}, found {found}"))
    };
    match (table, factor) {
        (Some(ComputeTable::Fixed(ComputeTime { s })), None) if (0.0..=60.0).contains(&s) => {
            Ok(Some(ComputeSpec::Fixed(Duration::from_secs_f64(s))))
        }
        (Some(ComputeTable::Fixed(ComputeTime { s })), None) => wrong("compute", "0 to 60 seconds", &s),
        (Some(ComputeTable::Named(name)), _) if name != "measured" => {
            wrong("compute", "{ s = SECONDS } or \"measured\"", &format!("\"{name}\""))
        }
        (Some(ComputeTable::Named(_)), Some(factor)) if !(0.001..=1000.0).contains(&factor) => {
            wrong("cpu_factor", "0.001 to 1000", &factor)
        }
        (Some(ComputeTable::Named(_)), factor) => Ok(Some(ComputeSpec::Measured(factor.unwrap_or(1.0)))),
        (None, None) => Ok(None),
        (_, Some(factor)) => wrong("cpu_factor", "it beside `compute = \"measured\"`", &factor),
    }
}

/// Refuses a device that is off for good.
fn check_power(off: &[String], faults: &[ScenarioFault]) -> Result<(), String> {
    let powers = |id: &String| {
        faults.iter().any(|fault| match fault {
            ScenarioFault::Rig(spec) => {
                spec.fault.name == "power" && spec.on.as_ref().is_none_or(|on| on == id)
            }
            ScenarioFault::NotHere(_) => true,
            _ => false,
        })
    };
    match off.iter().find(|id| !powers(id)) {
        Some(id) => Err(format!(
            "`{id}` is off at the start and nothing ends that: add a [[fault]] `power` on it, with `at` and `for`"
        )),
        None => Ok(()),
    }
}

fn settled(run: RunTable) -> Result<RunSpec, String> {
    if run.command.is_empty() {
        return Err(format!("the `command` of run `{}` is empty; name a program", run.id));
    }
    let wrong =
        || format!("`ready` of run `{}`: expected one of `alive_s`, `line`, `port`, `file`, `frame`", run.id);
    let ready = match run.ready {
        None => Ready::Alive(Duration::ZERO),
        Some(ReadyTable { alive_s: Some(s), line: None, port: None, file: None, frame: None })
            if (0.0..=3600.0).contains(&s) =>
        {
            Ready::Alive(Duration::from_secs_f64(s))
        }
        Some(ReadyTable { alive_s: None, line: Some(line), port: None, file: None, frame: None }) => {
            Ready::Line(regex_lite::Regex::new(&line).map_err(|error| format!("{}: {error}", wrong()))?)
        }
        Some(ReadyTable { alive_s: None, line: None, port: Some(port), file: None, frame: None }) => {
            Ready::Port(match port {
                PortName::Number(port) => format!("127.0.0.1:{port}"),
                PortName::Address(address) => address,
            })
        }
        Some(ReadyTable { alive_s: None, line: None, port: None, file: Some(file), frame: None }) => {
            Ready::File(file)
        }
        Some(ReadyTable { alive_s: None, line: None, port: None, file: None, frame: Some(frame) }) => {
            Ready::Frame(frame.parse().map_err(|error| format!("`ready` of run `{}`: {error}", run.id))?)
        }
        Some(_) => return Err(wrong()),
    };
    let compute = compute(&run.id, run.compute, run.cpu_factor)?;
    let RunTable { id, command, time, on_exit, env, .. } = run;
    Ok(RunSpec { id, command, time, on_exit, ready, compute, env })
}
