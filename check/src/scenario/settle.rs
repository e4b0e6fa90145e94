//! From what is written to what is meant: values checked, defaults filled in.

use std::collections::BTreeSet;
use std::path::Path;
use std::time::Duration;

use rowscan_emulator::lockstep::Ack;
use rowscan_protocol::device::{Profile, Start};
use rowscan_protocol::frame::Dialect;
use rowscan_protocol::model;

use super::file::{
    AckValue, ClockTable, DeviceTable, EndTable, Mode, PortName, PortTable, ProfileName, ReadyTable,
    RunTable, ScenarioFile, StartName,
};
use super::{Clock, DeviceSpec, End, PortSpec, Ready, RunSpec, Scenario};
use crate::fault;

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
    let faults = file.fault.unwrap_or_default();
    let starts_off = |device: &DeviceTable| device.start == Some(StartName::Off);
    let off = file.device.iter().flatten().any(starts_off);
    let ports = file.bus.iter().flatten();
    let mut refusal =
        needs_sprayer(file.sprayer.is_some(), ports).or_else(|| fault::refusal(&faults)).or_else(|| {
            off.then(|| "`start = \"off\"` needs the fault `power`, which lands separately".to_owned())
        });
    let runs = file.run.unwrap_or_default();
    let clock = clock(&file.clock.unwrap_or_default(), &runs, &mut refusal)?;
    let mut settled_runs = Vec::new();
    for run in runs {
        settled_runs.push(settled(run, &mut refusal)?);
    }
    let devices = file.device.unwrap_or_default();
    let devices = devices.into_iter().enumerate().map(|(place, table)| device(place, table));
    let scenario = Scenario {
        path: path.to_owned(),
        scene: file.scene.ok_or_else(|| missing("scene"))?,
        seed: file.seed,
        seeds: file.repeat.map_or(1, |repeat| repeat.seeds),
        clock,
        end: end(file.end.ok_or_else(|| missing("end"))?)?,
        devices: devices.collect::<Result<_, _>>()?,
        buses: ports_of(file.bus),
        nmea: ports_of(file.nmea),
        runs: settled_runs,
        faults,
        expects: file.expect.unwrap_or_default(),
        refusal,
    };
    check(&scenario)?;
    Ok(scenario)
}

fn needs_sprayer<'a>(table: bool, mut ports: impl Iterator<Item = &'a PortTable>) -> Option<String> {
    let port = ports.find(|port| port.port.starts_with("udp-aog:"));
    match (table, port) {
        (true, _) => Some("`sprayer` needs the sprayer, which is not there yet".to_owned()),
        (false, Some(port)) => Some(format!("`{}` needs the sprayer, which is not there yet", port.port)),
        (false, None) => None,
    }
}

fn ports_of(tables: Option<Vec<PortTable>>) -> Vec<PortSpec> {
    tables.unwrap_or_default().into_iter().map(|PortTable { id, port }| PortSpec { id, port }).collect()
}

/// Refuses what contradicts itself.
fn check(scenario: &Scenario) -> Result<(), String> {
    if scenario.expects.is_empty() {
        return Err("it expects nothing; add an [[expect]]".to_owned());
    }
    if scenario.seeds == 0 {
        return Err("`repeat`: expected 1 seed or more, found 0".to_owned());
    }
    if scenario.devices.is_empty() {
        return Err("it has no scanner; add a [[device]]".to_owned());
    }
    let mut ids = BTreeSet::new();
    let of_devices = scenario.devices.iter().map(|device| &device.id);
    let of_ports = scenario.buses.iter().chain(&scenario.nmea).map(|port| &port.id);
    for id in of_devices.chain(of_ports).chain(scenario.runs.iter().map(|run| &run.id)) {
        let is_name = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '-');
        if id.is_empty() || !id.chars().all(is_name) {
            return Err(format!("`id`: expected letters, digits, `_` and `-`, found `{id}`"));
        }
        if !ids.insert(id) {
            return Err(format!("two things are called `{id}`; rename one"));
        }
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
    if table.step_ms.is_some() {
        refusal
            .get_or_insert("`step_ms` lands separately: a step ends with the scanners' instants".to_owned());
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

fn end(table: EndTable) -> Result<End, String> {
    match (table.row_m, table.s, table.scans) {
        (Some(row_m), None, None) if row_m.is_finite() => Ok(End::RowM(row_m)),
        (None, Some(s), None) if (0.0..=86_400.0).contains(&s) => Ok(End::Seconds(s)),
        (None, None, Some(scans)) if scans > 0 => Ok(End::Scans(scans)),
        _ => Err("`end`: expected one of `row_m`, `s` (up to 86400) and `scans` (from 1)".to_owned()),
    }
}

fn device(place: usize, table: DeviceTable) -> Result<DeviceSpec, String> {
    let model = model::by_name(&table.model).ok_or_else(|| {
        format!(
            "`model`: expected a scanner with a network interface (`rowscan models`), found `{}`",
            table.model
        )
    })?;
    let profile = match table.profile {
        ProfileName::Bench => Profile::Bench,
        ProfileName::Field => Profile::Field,
    };
    let start = match (table.start, table.profile) {
        (None, ProfileName::Bench) | (Some(StartName::Streaming), _) => Start::Streaming,
        (None, ProfileName::Field) | (Some(StartName::PowerUp | StartName::Off), _) => Start::PowerUp,
        (Some(StartName::Standby), _) => Start::Standby,
        (Some(StartName::Stopped), _) => Start::Stopped,
        (Some(StartName::LoggedIn), _) => Start::LoggedIn,
        (Some(StartName::Error), _) => Start::Error,
        (Some(StartName::ColaA), _) => Start::Stored(Dialect::A),
        (Some(StartName::ColaB), _) => Start::Stored(Dialect::B),
    };
    let scanner = table.scanner.unwrap_or(place);
    Ok(DeviceSpec { id: table.id, model, tcp: table.tcp, profile, start, scanner })
}

fn settled(run: RunTable, refusal: &mut Option<String>) -> Result<RunSpec, String> {
    if run.command.is_empty() {
        return Err(format!("the `command` of run `{}` is empty; name a program", run.id));
    }
    let wrong = || format!("`ready` of run `{}`: expected one of `alive_s`, `line`, `port`, `file`", run.id);
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
        Some(ReadyTable { alive_s: None, line: None, port: None, file: None, frame: Some(_) }) => {
            refusal.get_or_insert("`ready = { frame = … }` lands separately".to_owned());
            Ready::Alive(Duration::ZERO)
        }
        Some(_) => return Err(wrong()),
    };
    Ok(RunSpec { id: run.id, command: run.command, ready, env: run.env })
}
