//! What a scanner is asked to be, checked before anything grows or listens.

use std::path::PathBuf;
use std::sync::Arc;

use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList, PyTuple};
use rowscan_bench::{Directed, ScannerSpec, Undirected};
use rowscan_bus::BusAddress;
use rowscan_bus::nmea::NmeaAddress;
use rowscan_emulator::StartWhen;
use rowscan_emulator::clock::TimeScale;
use rowscan_emulator::stage::Stage;
use rowscan_faults::FaultSpec;
use rowscan_protocol::model::AnyModel;
use rowscan_scenes::Scene;
use rowscan_scenes::files::LoadError;
use rowscan_settings::Table;

use crate::document;
use crate::failure::{Failure, Refusal};
use crate::orchard::{SceneOf, scene};
use crate::seed::Seed;

/// What was asked for.
pub(super) struct Order {
    pub(super) place: Place,
    /// Of the rig's first scanners; the rig's own model where none is named. Empty: the tractor alone.
    pub(super) models: Vec<Option<AnyModel>>,
    pub(super) scale: TimeScale,
    pub(super) start: Option<StartWhen>,
    /// Where CoLa scanners listen.
    pub(super) tcp: Vec<String>,
    /// Where an LMS2xx is a serial port.
    pub(super) pty: Option<PathBuf>,
    pub(super) can: Vec<BusAddress>,
    pub(super) nmea: Vec<NmeaAddress>,
    /// Of scanners with Compact output.
    pub(super) directed: Directed,
    pub(super) faults: Vec<FaultSpec>,
}

impl Order {
    /// Refuses what cannot be together.
    pub(super) fn check(&self) -> Result<(), Failure> {
        let serial = self.models.iter().flatten().filter(|model| model.lms2xx().is_some()).count();
        let (all, tcp) = (self.models.len(), self.tcp.len());
        let refused = match (all, serial) {
            (0, _) if self.can.is_empty() && self.nmea.is_empty() => {
                "no scanner is asked for, and no GNSS and CAN: give a model, can=\"…\" or nmea=\"…\""
                    .to_owned()
            }
            (_, 2..) => {
                "only one LMS2xx can be emulated at a time: give the others a Scanner of their own".to_owned()
            }
            (2.., _) if tcp > 0 && tcp != all => {
                format!(
                    "expected one address in `tcp` for each of the {all} scanners, in their order, found {tcp}"
                )
            }
            _ => return Ok(()),
        };
        Err(Refusal::Usage(refused).into())
    }

    /// Puts destinations and REST interfaces into the scanners that have them.
    pub(super) fn direct(&self, scanners: &mut [ScannerSpec]) -> Result<(), Failure> {
        self.directed.add_to(scanners).map_err(|Undirected { unused }| {
            let why = format!(
                "`udp`, `rest` and `allow_destination` are for scanners with Compact output, such as picoscan150; found {unused} addresses for no such scanner"
            );
            Refusal::Usage(why).into()
        })
    }
}

/// Where datagrams go: the texts of `udp` and `allow_destination`, and REST.
pub(super) fn directed(
    rest: Vec<String>,
    udp: &[String],
    allow_destination: &[String],
) -> Result<Directed, Refusal> {
    let wrong = |key: &str, expected: &str, found: &str| {
        Refusal::Usage(format!("`{key}`: expected {expected}, found `{found}`"))
    };
    let place = |text: &String| {
        text.parse().map_err(|_| wrong("udp", "an IPv4 address with a port, such as 127.0.0.1:0", text))
    };
    let address = |text: &String| {
        let expected = "an IPv4 address, such as 192.0.2.7";
        text.parse().map_err(|_| wrong("allow_destination", expected, text))
    };
    Ok(Directed {
        rest,
        udp: udp.iter().map(place).collect::<Result<_, _>>()?,
        allowed: allow_destination.iter().map(address).collect::<Result<_, _>>()?,
    })
}

/// Where it stands.
pub(super) enum Place {
    /// In an orchard that was grown.
    Grown(Arc<Stage>),
    /// In one that is yet to grow.
    Scene(Box<Scene>),
}

impl Place {
    pub(super) fn of(
        py: Python<'_>,
        orchard: SceneOf,
        seed: Option<Seed>,
        optics: Option<&str>,
    ) -> PyResult<Self> {
        match orchard {
            SceneOf::Named(name) => {
                Ok(Self::Scene(Box::new(scene(py, &name.to_string_lossy(), seed, optics)?)))
            }
            SceneOf::Grown(_) if seed.is_some() || optics.is_some() => Err(Refusal::AlreadyGrown.into()),
            SceneOf::Grown(orchard) => Ok(Self::Grown(Arc::clone(&orchard.get().stage))),
        }
    }

    pub(super) fn scene(&self) -> &Scene {
        match self {
            Self::Grown(stage) => &stage.scene,
            Self::Scene(scene) => scene,
        }
    }
}

/// A pace: a number, or a word.
#[derive(FromPyObject)]
pub(super) enum Pace {
    Times(f64),
    Word(String),
}

impl Pace {
    pub(super) fn scale(self) -> Result<TimeScale, Failure> {
        let word = match self {
            Self::Times(times) => times.to_string(),
            Self::Word(word) => word,
        };
        Ok(word.parse()?)
    }
}

/// Faults: a file of them, or dicts with the same keys.
pub(super) fn faults(given: Option<&Bound<'_, PyAny>>) -> PyResult<Vec<FaultSpec>> {
    let Some(given) = given else { return Ok(Vec::new()) };
    if given.is_instance_of::<PyList>() || given.is_instance_of::<PyTuple>() {
        return given.try_iter()?.map(|fault| fault_of(&fault?)).collect();
    }
    let path: PathBuf = given.extract()?;
    let text = rowscan_files::read_text(&path);
    let text = text.map_err(|cause| Failure::from(LoadError::Read { path: path.clone(), cause }))?;
    let place = path.display().to_string();
    let read = rowscan_faults::read(&text);
    Ok(read.map_err(|error| Failure::from(LoadError::Content { place, error }))?)
}

fn fault_of(fault: &Bound<'_, PyAny>) -> PyResult<FaultSpec> {
    let table: Table = serde_json::from_value(document::value(fault)?).map_err(|error| {
        Refusal::Usage(format!("a fault is a dict with the keys of docs/faults.md: {error}"))
    })?;
    let spec = FaultSpec::from_table(&table).map_err(without_line);
    Ok(spec?)
}

/// The same of a name and keywords; `for_` stands for `for`, which Python keeps to itself.
pub(super) fn fault_named(
    py: Python<'_>,
    name: &str,
    keywords: Option<&Bound<'_, PyDict>>,
) -> PyResult<FaultSpec> {
    let table = PyDict::new(py);
    table.set_item("name", name)?;
    for (key, value) in keywords.into_iter().flatten() {
        let key: String = key.extract()?;
        table.set_item(key.strip_suffix('_').unwrap_or(&key), value)?;
    }
    fault_of(table.as_any())
}

/// What is wrong with a fault that stands on no line.
fn without_line(error: rowscan_settings::TomlError) -> Failure {
    rowscan_settings::TomlError { line: 0, ..error }.into()
}
