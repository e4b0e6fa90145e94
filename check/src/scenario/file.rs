//! A scenario file as it is written: every key optional, so that a file may leave to its base what it does not change.

use std::collections::BTreeMap;

use serde::Deserialize;
use serde::de::IgnoredAny;

use super::expect::Expect;
use crate::fault::FaultTable;

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
    pub(super) fault: Option<Vec<FaultTable>>,
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
            fault: self.fault.or(base.fault),
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
    #[serde(default = "any_port")]
    pub(super) tcp: String,
    #[serde(default)]
    pub(super) profile: ProfileName,
    pub(super) start: Option<StartName>,
    pub(super) scanner: Option<usize>,
}

fn any_port() -> String {
    "127.0.0.1:0".to_owned()
}

/// Times and jitter of a device.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum ProfileName {
    /// Warm and ready; exact periods, immediate answers.
    #[default]
    Bench,
    /// Boot, busy and save times, latencies and jitter as recorded.
    Field,
}

/// States a scanner can be found in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum StartName {
    Streaming,
    PowerUp,
    Standby,
    Stopped,
    LoggedIn,
    Error,
    ColaA,
    ColaB,
    /// Without power.
    Off,
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
