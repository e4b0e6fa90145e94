//! Scenario files: strict TOML; a file may `use` another and change some of its keys.

mod bounds;
mod events;
mod expect;
mod file;
mod process_value;
mod settle;
mod valve_state;

use std::collections::BTreeMap;
use std::fmt;
use std::net::{Ipv4Addr, SocketAddrV4};
use std::path::{Path, PathBuf};
use std::time::Duration;

use rowscan_emulator::lockstep::Ack;
use rowscan_protocol::device::{Profile, Start};
use rowscan_protocol::lms2xx::{self, Rate};
use rowscan_protocol::model::{AnyModel, Model};
use rowscan_settings::{TomlError, from_toml};

pub use bounds::Bounds;
pub use expect::Expect;
use file::ScenarioFile;
pub use file::{Mode, OnExit, Time};
pub use process_value::ProcessValue;
pub(crate) use process_value::merged;
pub use valve_state::ValveState;

use crate::fault::ScenarioFault;
use crate::frames::FramePattern;
use crate::sprayer::SprayerSpec;
use crate::task_controller::TaskSpec;

/// How many files may use one another.
const DEEPEST: usize = 8;

/// A scenario, its values checked.
#[derive(Clone, Debug)]
pub struct Scenario {
    /// Where it stands.
    pub path: PathBuf,
    /// Scene by name or path.
    pub scene: String,
    /// The scene's seed; the scene's own where absent.
    pub seed: Option<u64>,
    /// Seeds to try, from `seed` on.
    pub seeds: u32,
    /// What drives time.
    pub clock: Clock,
    /// When it is over.
    pub end: End,
    /// The scanners.
    pub devices: Vec<DeviceSpec>,
    /// CAN ports by id.
    pub buses: Vec<BusSpec>,
    /// Places for GNSS sentences by id.
    pub nmea: Vec<PortSpec>,
    /// The children.
    pub runs: Vec<RunSpec>,
    /// What goes wrong.
    pub faults: Vec<ScenarioFault>,
    /// The sprayer.
    pub sprayer: Option<SprayerSpec>,
    /// What is expected.
    pub expects: Vec<Expect>,
    /// Why it cannot be run, though it is sound.
    pub refusal: Option<String>,
}

/// What drives time.
#[derive(Clone, Debug, PartialEq)]
pub struct Clock {
    /// Paced or lockstep.
    pub mode: Mode,
    /// Simulated seconds a host second; none: as fast as it goes.
    pub scale: Option<f64>,
    /// What acknowledges a step.
    pub acks: Vec<Ack>,
    /// Host time for a step.
    pub deadline: Duration,
    /// Host time until every child is ready and every scanner has a taker.
    pub startup: Duration,
}

/// When a scenario is over.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum End {
    /// So many metres along the row.
    RowM(f64),
    /// So many simulated seconds after the drive has started.
    Seconds(f64),
    /// So many scans.
    Scans(u64),
}

impl fmt::Display for End {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::RowM(row_m) => write!(f, "row {row_m} m"),
            Self::Seconds(seconds) => write!(f, "{seconds} s of driving"),
            Self::Scans(scans) => write!(f, "{scans} scans"),
        }
    }
}

/// A scanner.
#[derive(Clone, Debug)]
pub struct DeviceSpec {
    /// Its name in the scenario.
    pub id: String,
    /// What it is, and where it is found.
    pub kind: DeviceKind,
    /// Times and jitter.
    pub profile: Profile,
    /// Number in the rig.
    pub scanner: usize,
}

/// What a scanner is, with the state it is found in.
#[derive(Clone, Debug)]
pub enum DeviceKind {
    /// Speaks CoLa at an address.
    Cola {
        /// Its model.
        model: &'static Model,
        /// Where it listens.
        tcp: String,
        /// Where its REST interface is, if it has one.
        rest: Option<String>,
        /// Where its datagrams go, if it sends any and the scenario says so.
        udp: Option<SocketAddrV4>,
        /// Addresses besides loopback that clients may direct them to.
        allowed: Vec<Ipv4Addr>,
        /// How it is found.
        start: Start,
    },
    /// An LMS2xx on a pseudo-terminal.
    Lms2xx {
        /// Its model.
        model: &'static lms2xx::model::Model,
        /// The link to the pseudo-terminal, from the run's folder.
        link: String,
        /// How it is found.
        start: lms2xx::device::Start,
        /// The rate it was left at.
        rate: Rate,
    },
}

impl DeviceKind {
    /// Its model.
    pub fn model(&self) -> AnyModel {
        match self {
            Self::Cola { model, .. } => (*model).into(),
            Self::Lms2xx { model, .. } => (*model).into(),
        }
    }
}

/// A CAN bus.
#[derive(Clone, Debug)]
pub struct BusSpec {
    /// Its name in the scenario; faults act on it.
    pub id: String,
    /// Its ports, as `emulate --can` takes them: each hears what the others say.
    pub ports: Vec<String>,
    /// The DBC file that names its signals, from the scenario.
    pub dbc: Option<String>,
    /// The task that the rig's own task controller carries out on it.
    pub task: Option<TaskSpec>,
}

/// A place for GNSS sentences by name.
#[derive(Clone, Debug)]
pub struct PortSpec {
    /// Its name in the scenario.
    pub id: String,
    /// As `emulate --nmea` takes it.
    pub port: String,
}

/// A child.
#[derive(Clone, Debug)]
pub struct RunSpec {
    /// Its name in the scenario.
    pub id: String,
    /// Program and arguments, with placeholders.
    pub command: Vec<String>,
    /// Which time it goes by.
    pub time: Time,
    /// What becomes of the run when it ends.
    pub on_exit: OnExit,
    /// When it is ready.
    pub ready: Ready,
    /// In lockstep, how long it computes.
    pub compute: Option<ComputeSpec>,
    /// Its environment besides ours, with placeholders.
    pub env: BTreeMap<String, String>,
}

/// How long a child computes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ComputeSpec {
    /// Always so long.
    Fixed(Duration),
    /// The processor time of its threads in the step, so many times.
    Measured(f64),
}

/// When a child is ready.
#[derive(Clone, Debug)]
pub enum Ready {
    /// Alive for so long, host time.
    Alive(Duration),
    /// A line of its output matches.
    Line(regex_lite::Regex),
    /// Something listens there.
    Port(String),
    /// This file of the run's folder is there.
    File(String),
    /// A bus has heard this frame.
    Frame(FramePattern),
}

/// Why a scenario cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum ScenarioError {
    /// The file could not be read.
    #[error("cannot read {}: {cause}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The system's error.
        cause: std::io::Error,
    },
    /// The file is not a scenario.
    #[error("{}:{line}: {message}", path.display())]
    Content {
        /// The file.
        path: PathBuf,
        /// The line, from 1; 0 if it concerns the whole.
        line: usize,
        /// What is wrong, with the remedy.
        message: String,
    },
    /// A value that cannot be.
    #[error("{}: {message}", path.display())]
    Value {
        /// The file.
        path: PathBuf,
        /// What is wrong, with the remedy.
        message: String,
    },
}

impl Scenario {
    /// Reads a scenario with what it uses.
    ///
    /// # Errors
    /// A file that cannot be read, content that is refused, files that use one another in a circle.
    pub fn load(path: &Path) -> Result<Self, ScenarioError> {
        let mut file = read(path)?;
        let mut from = path.to_owned();
        for _ in 0..DEEPEST {
            let Some(base) = file.base.take() else {
                let value = |message| ScenarioError::Value { path: path.to_owned(), message };
                return settle::settle(path, file).map_err(value);
            };
            from = from.parent().unwrap_or(Path::new("")).join(base);
            let base = read(&from)?;
            let further = base.base.clone();
            file = file.over(base);
            file.base = further;
        }
        Err(ScenarioError::Value {
            path: path.to_owned(),
            message: format!("more than {DEEPEST} files use one another, or in a circle; break it up"),
        })
    }

    /// The folder it stands in.
    pub fn folder(&self) -> &Path {
        // A bare name has an empty parent.
        self.path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
    }
}

/// The tables of a scenario file.
pub fn schema(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
    generator.subschema_for::<ScenarioFile>()
}

fn read(path: &Path) -> Result<ScenarioFile, ScenarioError> {
    let text = rowscan_files::read_text(path)
        .map_err(|cause| ScenarioError::Read { path: path.to_owned(), cause })?;
    let content = |error: TomlError| ScenarioError::Content {
        path: path.to_owned(),
        line: error.line,
        message: error.message,
    };
    let mut file: ScenarioFile = from_toml(&text).map_err(content)?;
    let faults = file.fault.take().map(|tables| tables.iter().map(ScenarioFault::read).collect());
    file.faults = faults.transpose().map_err(content)?;
    Ok(file)
}

#[cfg(test)]
mod tests;
