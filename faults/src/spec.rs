//! One fault as it is written, and the file of them.

use std::time::Duration;

use rowscan_settings::fault_table::bus::BusFault;
use rowscan_settings::fault_table::{PartFault, Settings, read_number, read_text, read_whole};
use rowscan_settings::{Located, Table, TomlError, Value, from_toml, suggestion};
use serde::Deserialize;

use crate::event::Direction;
use crate::fault::{Action, Cut, Fault, Layer};
use crate::kinds::FAULTS;
use crate::when::{At, Lasts};

/// Keys that every fault has.
pub const COMMON: &[&str] = &["name", "id", "on", "direction", "at", "for", "until", "every", "p", "count"];

/// From one beginning to the next, at least.
const SHORTEST_PERIOD: Duration = Duration::from_millis(1);

/// One fault of a plan, checked.
#[derive(Clone, Debug)]
pub struct FaultSpec {
    /// How events and `after` name it; as the fault, where absent.
    pub id: Option<String>,
    /// Its line of the table.
    pub fault: &'static Fault,
    /// The one stream it acts on; every stream, where absent.
    pub on: Option<String>,
    /// Which way it acts.
    pub directions: Vec<Direction>,
    /// When it begins.
    pub at: At,
    /// How long it lasts.
    pub lasts: Option<Lasts>,
    /// When it is over, whatever else.
    pub until: Option<At>,
    /// From one beginning to the next.
    pub every: Option<Lasts>,
    /// The probability of each event.
    pub p: Option<f64>,
    /// Most acts.
    pub count: Option<u64>,
    /// Its own parameters, as they were written.
    pub parameters: Table,
}

impl FaultSpec {
    /// The same with its times so much later.
    pub(crate) fn later_by(self, by: Duration) -> Self {
        let later = |at: At| match at {
            At::Time(at) => At::Time(at.saturating_add(by)),
            other => other,
        };
        Self { at: later(self.at), until: self.until.map(later), ..self }
    }
}

/// A file of faults.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    #[serde(default)]
    version: Option<u32>,
    #[serde(default)]
    fault: Vec<Table>,
}

/// Reads a file of `[[fault]]` tables.
///
/// # Errors
/// The first error with its line and, for an unknown key or name, the nearest valid one.
pub fn read(text: &str) -> Result<Vec<FaultSpec>, TomlError> {
    let file: File = from_toml(text)?;
    match file.version {
        None | Some(1) => file.fault.iter().map(FaultSpec::from_table).collect(),
        Some(other) => {
            Err(TomlError { line: 0, message: format!("expected version 1 of fault files, found {other}") })
        }
    }
}

impl FaultSpec {
    /// Reads one table, of a file, of a scenario, or of JSON.
    ///
    /// # Errors
    /// As [`read`].
    pub fn from_table(table: &Table) -> Result<Self, TomlError> {
        let refuse = |line: usize, message: String| TomlError { line, message };
        let Some(name) = table.entries.get("name") else {
            return Err(refuse(table.line, "the key `name` is missing; add it".to_owned()));
        };
        let fault = find(name)?;
        let own: Vec<&str> = fault.parameters.iter().map(|parameter| parameter.key).collect();
        let valid = [COMMON, &own].concat();
        if let Some((key, value)) = table.entries.iter().find(|(key, _)| !valid.contains(&key.as_str())) {
            let message = format!("unknown key `{key}` of `{}`{}", fault.name, suggestion(key, &valid));
            return Err(refuse(value.line, message));
        }
        let given = |key: &str| table.entries.get(key);
        let word =
            |key: &str| given(key).map(|found| read_text(found, "a string").map(str::to_owned)).transpose();
        let count = given("count").map(|found| read_whole(found, 1, i64::MAX)).transpose()?;
        let mut spec = Self {
            id: word("id")?,
            fault,
            on: word("on")?,
            directions: given("direction").map_or(Ok(fault.directions.to_vec()), directions)?,
            at: given("at").map(At::read).transpose()?.unwrap_or_default(),
            lasts: given("for").map(lasting).transpose()?,
            until: given("until").map(At::read).transpose()?,
            every: given("every").map(Lasts::read).transpose()?,
            p: given("p").map(probability).transpose()?,
            count: count.map(i64::unsigned_abs),
            parameters: table.clone(),
        };
        if let (Some(_), Some(until)) = (&spec.lasts, given("until")) {
            return Err(refuse(
                until.line,
                "`for` and `until` are two ways to say one thing; leave one out".to_owned(),
            ));
        }
        if let (Layer::Accept | Layer::Part(_), Some(found)) = (fault.layer, given("direction")) {
            return Err(refuse(found.line, format!("`{}` has no direction; leave it out", fault.name)));
        }
        let action = spec.action()?;
        if matches!(action, Action::Part(_)) && action.cut().is_some() {
            spec.directions = Direction::BOTH.to_vec();
        }
        let instant = matches!(action, Action::Cut(Cut::Reset | Cut::Finish | Cut::HalfClose));
        if let Some(found) = given("for").or(given("until")).filter(|_| instant) {
            let message = format!("`{}` happens at once and lasts; leave `for` and `until` out", fault.name);
            return Err(refuse(found.line, message));
        }
        let restarts = matches!(action, Action::Part(PartFault::Bus(BusFault::Off { restart: Some(_) })));
        if let Some(found) = given("for").or(given("until")).filter(|_| restarts) {
            let message = "`restart_ms` says when the controllers come back; leave `for` and `until` out, or `restart_ms`";
            return Err(refuse(found.line, message.to_owned()));
        }
        if let (Some(Lasts::Time(period)), Some(found)) = (spec.every, given("every"))
            && period < SHORTEST_PERIOD
        {
            return Err(refuse(found.line, "expected `every` of 0.001 s or more".to_owned()));
        }
        Ok(spec)
    }

    /// What it does; every stream has its own.
    pub(crate) fn action(&self) -> Result<Action, TomlError> {
        self.fault.make.make(&Settings::new(&self.parameters, self.fault.parameters))
    }

    /// True if scans or commands of its stream begin or end it.
    pub(crate) fn needs_stream(&self) -> bool {
        let scans = |lasts: Option<Lasts>| matches!(lasts, Some(Lasts::Scans(_)));
        self.at.needs_stream()
            || self.until.as_ref().is_some_and(At::needs_stream)
            || scans(self.lasts)
            || scans(self.every)
    }

    /// True if it needs to know where the tractor is.
    pub fn needs_row(&self) -> bool {
        self.at.needs_row() || self.until.as_ref().is_some_and(At::needs_row)
    }

    /// True if it ends with its first act: nothing says how long it lasts.
    pub(crate) fn is_single(&self) -> bool {
        self.lasts.is_none() && self.until.is_none() && self.p.is_none()
    }
}

/// The table's line of this name.
fn find(found: &Located) -> Result<&'static Fault, TomlError> {
    let name = read_text(found, "the name of a fault")?;
    let names: Vec<&str> = FAULTS.iter().map(|fault| fault.name).collect();
    FAULTS.iter().find(|fault| fault.name == name).ok_or_else(|| TomlError {
        line: found.line,
        message: match crate::kinds::NOT_HERE
            .iter()
            .find(|(known, _)| known.split(" / ").any(|known| known == name))
        {
            Some((_, why)) => format!("the fault `{name}` is not there: {why}"),
            None => format!("unknown fault `{name}`{}", suggestion(name, &names)),
        },
    })
}

/// Longer than nothing: else nothing would happen.
fn lasting(found: &Located) -> Result<Lasts, TomlError> {
    match Lasts::read(found)? {
        Lasts::Time(Duration::ZERO) => Err(TomlError {
            line: found.line,
            message: "expected `for` of more than 0 s: nothing would happen".to_owned(),
        }),
        lasts => Ok(lasts),
    }
}

/// More than 0: else nothing would happen.
fn probability(found: &Located) -> Result<f64, TomlError> {
    match read_number(found, 0.0, 1.0)? {
        p if p > 0.0 => Ok(p),
        p => Err(TomlError {
            line: found.line,
            message: format!("expected a probability of more than 0, found {p}: nothing would happen"),
        }),
    }
}

fn directions(found: &Located) -> Result<Vec<Direction>, TomlError> {
    let words = ["to_client", "to_device", "both"];
    match &found.value {
        Value::Text(text) if text == "to_client" => Ok(vec![Direction::ToClient]),
        Value::Text(text) if text == "to_device" => Ok(vec![Direction::ToDevice]),
        Value::Text(text) if text == "both" => Ok(Direction::BOTH.to_vec()),
        Value::Text(text) => Err(TomlError {
            line: found.line,
            message: format!("unknown value `{text}`{}", suggestion(text, &words)),
        }),
        other => Err(TomlError {
            line: found.line,
            message: format!("expected one of {}, found {}", words.join(", "), other.kind()),
        }),
    }
}
