//! A scenario file as it is written: every key optional, so that a file may leave to its base what it does not change.

use std::collections::BTreeMap;

use rowscan_protocol::device::{Profile, Start};
use rowscan_protocol::lms2xx;
use rowscan_strict_toml::{Table, suggestion};
use serde::Deserialize;
use serde::de::IgnoredAny;

use super::expect::Expect;
use crate::fault::ScenarioFault;

/// The tables of a scenario file.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ScenarioFile {
    #[serde(rename = "use")]
    pub(super) base: Option<String>,
    pub(super) version: Option<u32>,
    pub(super) scene: Option<String>,
    pub(super) seed: Option<u64>,
    pub(super) clock: Option<ClockTable>,
    pub(super) end: Option<EndTable>,
    pub(super) device: Option<Vec<DeviceTable>>,
    pub(super) bus: Option<Vec<PortTable>>,
    pub(super) nmea: Option<Vec<PortTable>>,
    pub(super) run: Option<Vec<RunTable>>,
    /// As written.
    pub(super) fault: Option<Vec<Table>>,
    /// As read, once the file is.
    #[serde(skip)]
    pub(super) faults: Option<Vec<ScenarioFault>>,
    pub(super) expect: Option<Vec<Expect>>,
    pub(super) repeat: Option<RepeatTable>,
    pub(super) sprayer: Option<IgnoredAny>,
}

impl ScenarioFile {
    /// This file's keys before those of `base`. A key given here replaces the base's whole value.
    pub(super) fn over(self, base: Self) -> Self {
        Self {
            base: None,
            version: self.version.or(base.version),
            scene: self.scene.or(base.scene),
            seed: self.seed.or(base.seed),
            clock: self.clock.or(base.clock),
            end: self.end.or(base.end),
            device: self.device.or(base.device),
            bus: self.bus.or(base.bus),
            nmea: self.nmea.or(base.nmea),
            run: self.run.or(base.run),
            fault: None,
            faults: self.faults.or(base.faults),
            expect: self.expect.or(base.expect),
            repeat: self.repeat.or(base.repeat),
            sprayer: self.sprayer.or(base.sprayer),
        }
    }
}

/// What drives simulated time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Mode {
    /// The host's clock.
    #[default]
    Paced,
    /// The participants, who acknowledge each step.
    Lockstep,
}

/// `clock = { … }`
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct ClockTable {
    pub(super) mode: Mode,
    pub(super) scale: Option<f64>,
    pub(super) step_ms: Option<f64>,
    pub(super) ack: BTreeMap<String, AckValue>,
    pub(super) deadline_wall_s: Option<f64>,
    pub(super) startup_wall_s: Option<f64>,
}

/// What acknowledges a step, of one child.
#[derive(Clone, Debug, Deserialize)]
#[serde(untagged)]
pub(super) enum AckValue {
    /// A level by name.
    Level(String),
    /// An output of the child: parsed, not supported yet.
    Output(IgnoredAny),
}

/// `end = { … }`: exactly one key.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct EndTable {
    pub(super) row_m: Option<f64>,
    pub(super) s: Option<f64>,
    pub(super) scans: Option<u64>,
}

/// `[[device]]`
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct DeviceTable {
    pub(super) id: String,
    pub(super) model: String,
    pub(super) tcp: Option<String>,
    pub(super) pty: Option<String>,
    pub(super) rate: Option<u32>,
    #[serde(default)]
    pub(super) profile: ProfileName,
    pub(super) start: Option<StartName>,
    pub(super) scanner: Option<usize>,
}

/// A profile, as `emulate --profile` names it.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(try_from = "String")]
pub(super) struct ProfileName(pub(super) Profile);

impl TryFrom<String> for ProfileName {
    type Error = String;

    fn try_from(name: String) -> Result<Self, String> {
        let known: Vec<&str> = Profile::NAMED.iter().map(|(name, ..)| *name).collect();
        let unknown = || format!("unknown profile `{name}`{}", suggestion(&name, &known));
        Profile::by_name(&name).map(Self).ok_or_else(unknown)
    }
}

/// A state, as `emulate --start` names it, or `off`.
#[derive(Clone, Debug, Deserialize)]
#[serde(try_from = "String")]
pub(super) struct StartName(pub(super) String);

/// Without power.
pub(super) const OFF: &str = "off";

impl TryFrom<String> for StartName {
    type Error = String;

    fn try_from(name: String) -> Result<Self, String> {
        let cola = Start::NAMED.iter().map(|(name, ..)| *name);
        let lms2xx = lms2xx::device::Start::NAMED.iter().map(|(name, ..)| *name);
        let known: Vec<&str> = cola.chain(lms2xx).chain([OFF]).collect();
        match known.contains(&name.as_str()) {
            true => Ok(Self(name)),
            false => Err(format!("unknown state `{name}`{}", suggestion(&name, &known))),
        }
    }
}

/// `[[bus]]`, `[[nmea]]`
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct PortTable {
    pub(super) id: String,
    pub(super) port: String,
}

/// `[[run]]`
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RunTable {
    pub(super) id: String,
    pub(super) command: Vec<String>,
    pub(super) ready: Option<ReadyTable>,
    #[serde(default)]
    pub(super) env: BTreeMap<String, String>,
}

/// `ready = { … }`: exactly one key.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ReadyTable {
    pub(super) alive_s: Option<f64>,
    pub(super) line: Option<String>,
    pub(super) port: Option<PortName>,
    pub(super) file: Option<String>,
    pub(super) frame: Option<String>,
}

/// A TCP port of this machine, or an address.
#[derive(Clone, Debug, Deserialize)]
#[serde(untagged)]
pub(super) enum PortName {
    Number(u16),
    Address(String),
}

/// `repeat = { … }`
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RepeatTable {
    pub(super) seeds: u32,
}
