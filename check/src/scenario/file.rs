//! A scenario file as it is written: every key optional, so that a file may leave to its base what it does not change.

use std::borrow::Cow;
use std::collections::BTreeMap;

use rowscan_protocol::device::{Profile, Start};
use rowscan_protocol::lms2xx;
use rowscan_settings::{Table, suggestion};
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::Deserialize;
use serde::de::IgnoredAny;

use super::expect::Expect;
use crate::fault::ScenarioFault;
use crate::sprayer::SprayerTable;
use crate::task_controller::TaskControllerTable;

/// The tables of a scenario file.
#[derive(Debug, Default, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct ScenarioFile {
    /// Another scenario, by its path from this file: keys that are left out here are that one's.
    #[serde(rename = "use")]
    #[schemars(example = &"base.toml")]
    pub(super) base: Option<String>,
    /// Format of the file.
    #[schemars(range(min = 1, max = 1), example = 1)]
    pub(super) version: Option<u32>,
    /// The scene: a built-in one's name, or a file beside this one.
    #[schemars(example = &"spindle")]
    pub(super) scene: Option<String>,
    /// Seed of everything random, instead of the scene's own.
    #[schemars(example = 7)]
    pub(super) seed: Option<u64>,
    /// What drives simulated time.
    pub(super) clock: Option<ClockTable>,
    /// When the run is over: exactly one key.
    pub(super) end: Option<EndTable>,
    /// The scanners.
    pub(super) device: Option<Vec<DeviceTable>>,
    /// CAN buses; the tractor's ECU is on the first.
    pub(super) bus: Option<Vec<BusTable>>,
    /// Places that GNSS sentences are sent to.
    pub(super) nmea: Option<Vec<PortTable>>,
    /// The children: the controllers that are judged.
    pub(super) run: Option<Vec<RunTable>>,
    /// What goes wrong: a fault of docs/faults.md with its parameters, or `host_pause`, which stops a child.
    #[serde(default)]
    #[schemars(schema_with = "crate::fault_schema::faults")]
    pub(super) fault: Option<Vec<Table>>,
    /// As read, once the file is.
    #[serde(skip)]
    pub(super) faults: Option<Vec<ScenarioFault>>,
    /// What is expected.
    #[schemars(with = "Option<Vec<super::expect::Table>>")]
    pub(super) expect: Option<Vec<Expect>>,
    /// The same run again with other seeds.
    pub(super) repeat: Option<RepeatTable>,
    /// The sprayer that the controller commands.
    pub(super) sprayer: Option<SprayerTable>,
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
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Mode {
    /// The host's clock.
    #[default]
    Paced,
    /// The participants, who acknowledge each step.
    Lockstep,
}

/// `clock = { … }`
#[derive(Clone, Debug, Default, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(super) struct ClockTable {
    /// The host's clock, or a clock that waits for the participants.
    pub(super) mode: Mode,
    /// Paced: simulated seconds a second of the host; 1 where left out.
    #[schemars(range(min = 1e-6, max = 1e6), example = 1.0, extend("x-unit" = "s/s"))]
    pub(super) scale: Option<f64>,
    /// Lockstep: what acknowledges a step, by the child's id: `sent`, `read`, `idle` or `reply`.
    #[schemars(with = "BTreeMap<String, String>", example = ack_example())]
    pub(super) ack: BTreeMap<String, AckValue>,
    /// Lockstep: the host's time that a step may take; 5 where left out.
    #[schemars(range(min = 0.001, max = 86400.0), example = 5.0)]
    pub(super) deadline_wall_s: Option<f64>,
    /// The host's time until every child is ready and every scanner has a client; 30 where left out.
    #[schemars(range(min = 0.001, max = 86400.0), example = 20.0)]
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
#[derive(Clone, Copy, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct EndTable {
    /// So far along the row.
    #[schemars(extend("exclusiveMinimum" = 0.0), example = 6.0)]
    pub(super) row_m: Option<f64>,
    /// So long after the drive has started, simulated.
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 86400.0, "x-unit" = "s"), example = 10.0)]
    pub(super) s: Option<f64>,
    /// After so many scans of the drive.
    #[schemars(range(min = 1), example = 500)]
    pub(super) scans: Option<u64>,
}

/// `[[device]]`
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct DeviceTable {
    /// Its name in the scenario.
    #[schemars(example = &"left")]
    pub(super) id: String,
    /// Scanner model, by the name that `rowscan models` lists.
    #[schemars(example = &"lms111")]
    pub(super) model: String,
    /// Where a CoLa scanner listens; port 0 takes a free one.
    #[schemars(example = &"127.0.0.1:0")]
    pub(super) tcp: Option<String>,
    /// Where the REST interface of a scanner with Compact output listens; port 0 takes a free one, and so does leaving it out. `{ID.rest}` is its address.
    #[schemars(example = &"127.0.0.1:0")]
    pub(super) rest: Option<String>,
    /// Where the datagrams of such a scanner go: scans to this address, IMU and encoder to ports 7503 and 7504 there; port 0 takes a free one. `{ID.udp}` is
    /// the address that a client binds. Where it is left out, a client directs them.
    #[schemars(example = &"127.0.0.1:0")]
    pub(super) udp: Option<String>,
    /// Addresses besides loopback that clients may direct its datagrams to; to others nothing is sent.
    #[schemars(example = ["192.0.2.7"])]
    pub(super) allow_destination: Option<Vec<String>>,
    /// Where an LMS2xx is: a link to its pseudo-terminal, from the run's folder.
    #[schemars(example = &"scanner")]
    pub(super) pty: Option<String>,
    /// Rate that an LMS2xx was left at.
    #[schemars(example = 38400, extend("x-unit" = "baud"))]
    pub(super) rate: Option<u32>,
    /// How long things take: `bench` at once, `field` as on real devices.
    #[serde(default)]
    #[schemars(extend("default" = "bench"))]
    pub(super) profile: ProfileName,
    /// The state it is found in.
    #[schemars(example = &"power-up")]
    pub(super) start: Option<StartName>,
    /// Its number in the scene's rig, from 0; the same as its place in this list where left out.
    #[schemars(example = 1)]
    pub(super) scanner: Option<usize>,
}

fn ack_example() -> BTreeMap<String, String> {
    BTreeMap::from([("sut".to_owned(), "idle".to_owned())])
}

fn env_example() -> BTreeMap<String, String> {
    BTreeMap::from([("LOG".to_owned(), "debug".to_owned())])
}

/// A profile, as `emulate --profile` names it.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(try_from = "String")]
pub(super) struct ProfileName(pub(super) Profile);

impl JsonSchema for ProfileName {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> Cow<'static, str> {
        "ProfileName".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        let known: Vec<&str> = Profile::NAMED.iter().map(|(name, ..)| *name).collect();
        json_schema!({ "type": "string", "enum": known })
    }
}

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

/// The names of all states.
fn states() -> Vec<&'static str> {
    let cola = Start::NAMED.iter().map(|(name, ..)| *name);
    let lms2xx = lms2xx::device::Start::NAMED.iter().map(|(name, ..)| *name);
    let mut known: Vec<&str> = Vec::new();
    for name in cola.chain(lms2xx).chain([OFF]) {
        if !known.contains(&name) {
            known.push(name);
        }
    }
    known
}

impl JsonSchema for StartName {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> Cow<'static, str> {
        "StartName".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({ "type": "string", "enum": states() })
    }
}

impl TryFrom<String> for StartName {
    type Error = String;

    fn try_from(name: String) -> Result<Self, String> {
        let known = states();
        match known.contains(&name.as_str()) {
            true => Ok(Self(name)),
            false => Err(format!("unknown state `{name}`{}", suggestion(&name, &known))),
        }
    }
}

/// `[[bus]]`
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct BusTable {
    /// Its name in the scenario; faults act on it.
    #[schemars(example = &"can0")]
    pub(super) id: String,
    /// Its port, as `emulate --can` takes it.
    #[schemars(example = &"slcan:{run}/can")]
    pub(super) port: Option<String>,
    /// Its ports, where it has several: each hears what the others say.
    #[schemars(example = ["socketcand:127.0.0.1:0", "candump:{run}/bus.log"])]
    pub(super) ports: Option<Vec<String>>,
    /// The DBC file that names its signals, from this file.
    #[schemars(example = &"nozzles.dbc")]
    pub(super) dbc: Option<String>,
    /// The rig's own ISOBUS task controller on it, for a controller that is itself the client; docs/sprayer.md.
    pub(super) task_controller: Option<TaskControllerTable>,
}

impl BusTable {
    /// All of its ports.
    pub(super) fn all(&self) -> impl Iterator<Item = &String> {
        self.port.iter().chain(self.ports.iter().flatten())
    }
}

/// `[[nmea]]`
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct PortTable {
    /// Its name in the scenario.
    #[schemars(example = &"can0")]
    pub(super) id: String,
    /// The place, as `emulate --nmea` takes it.
    #[schemars(example = &"tcp:127.0.0.1:0")]
    pub(super) port: String,
}

/// `[[run]]`
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct RunTable {
    /// Its name in the scenario.
    #[schemars(example = &"sut")]
    pub(super) id: String,
    /// Program and arguments, with placeholders such as `{left.tcp}`.
    #[schemars(example = ["python3", "{scenario}/controller.py", "{left.tcp}"])]
    pub(super) command: Vec<String>,
    /// Which time its clocks, sleeps and time-outs go by: the host's, or in lockstep the simulated one (docs/lockstep.md).
    #[serde(default)]
    pub(super) time: Time,
    /// Whether the run ends with the last child that ends, or drives on to its own end: what the machine does without its controller is judged then, too.
    #[serde(default)]
    pub(super) on_exit: OnExit,
    /// When it is ready: exactly one key; at once where left out.
    pub(super) ready: Option<ReadyTable>,
    /// In lockstep, how long it computes: what it says on a bus takes effect so much later. `{ s = 0.02 }`, or `"measured"`: the processor time of its threads
    /// in the step.
    #[schemars(example = compute_example())]
    pub(super) compute: Option<ComputeTable>,
    /// What measured processor time is multiplied by: how much slower the controller's own computer is; 1 where left out.
    #[schemars(range(min = 0.001, max = 1000.0), example = 4.0)]
    pub(super) cpu_factor: Option<f64>,
    /// Its environment beside the bench's own, with placeholders.
    #[serde(default)]
    #[schemars(example = env_example())]
    pub(super) env: BTreeMap<String, String>,
}

/// `compute`: a time, or that it is measured.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(untagged)]
pub(super) enum ComputeTable {
    /// Always so long.
    Fixed(ComputeTime),
    /// `measured`.
    Named(String),
}

/// `compute = { s = … }`
#[derive(Clone, Copy, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct ComputeTime {
    /// Simulated seconds.
    #[schemars(range(min = 0.0, max = 60.0), example = 0.02)]
    pub(super) s: f64,
}

fn compute_example() -> serde_json::Value {
    serde_json::json!({ "s": 0.02 })
}

/// Which time a child goes by.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Time {
    /// The host's.
    #[default]
    Host,
    /// Simulated time: it waits for the child's timers, and they for it.
    Simulated,
}

/// What becomes of the run when a child ends.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum OnExit {
    /// It ends with the last child that ends.
    #[default]
    End,
    /// It goes on to its own end.
    DriveOn,
}

/// `ready = { … }`: exactly one key.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct ReadyTable {
    /// It has been alive for so long, in the host's time.
    #[schemars(range(min = 0.0, max = 3600.0), example = 0.5)]
    pub(super) alive_s: Option<f64>,
    /// A line of its output matches this regular expression.
    #[schemars(example = &"ready")]
    pub(super) line: Option<String>,
    /// Something listens on this TCP port of this machine, or at this address.
    #[schemars(example = 8080)]
    pub(super) port: Option<PortName>,
    /// This file is there, from the run's folder.
    #[schemars(example = &"ready.txt")]
    pub(super) file: Option<String>,
    /// A bus has heard this frame: an identifier, or `pgn:0xCB00 cmd:0xE`.
    #[schemars(example = &"0x18FF1080")]
    pub(super) frame: Option<String>,
}

/// A TCP port of this machine, or an address.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(untagged)]
pub(super) enum PortName {
    Number(u16),
    Address(String),
}

/// `repeat = { … }`
#[derive(Clone, Copy, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct RepeatTable {
    /// How many seeds, from `seed` on.
    #[schemars(range(min = 1), example = 3)]
    pub(super) seeds: u32,
}
