//! `[[fault]]` tables: those of docs/faults.md, and what only a scenario has: `sweep`, and `host_pause`.

use std::collections::BTreeSet;
use std::time::Duration;

use rowscan_faults::{At, FAULTS, FaultSpec, Lasts, NOT_HERE, free_id};
use rowscan_settings::{Located, Table, TomlError, Value, suggestion};

/// Name of the fault that stops a child.
pub(crate) const HOST_PAUSE: &str = "host_pause";
/// Faults that hold bytes back for longer than a step of a clock in lockstep.
const HOLDING: &[&str] = &["delay", "jitter", "stall", "bandwidth"];

/// A fault of a scenario.
#[derive(Clone, Debug)]
pub enum ScenarioFault {
    /// A line of the fault table, as `--faults` files have it.
    Rig(Box<FaultSpec>),
    /// The same again and again, a parameter counting up.
    Sweep(Sweep),
    /// A child is stopped.
    Pause(Pause),
    /// A line of the table that is not built.
    NotHere(String),
}

/// A fault on one scan after another, with a parameter that counts up from scan to scan.
#[derive(Clone, Debug, PartialEq)]
pub struct Sweep {
    /// What events call it.
    pub id: String,
    /// The parameter.
    pub key: String,
    /// Its first value.
    pub from: i64,
    /// Its last one; until the telegram has no such byte, where absent.
    pub to: Option<i64>,
    /// The scan of the first value.
    pub scan: i64,
    table: Table,
}

/// A child that is stopped (SIGSTOP) and goes on.
#[derive(Clone, Debug, PartialEq)]
pub struct Pause {
    /// What events call it.
    pub id: String,
    /// The child; the only one where absent.
    pub on: Option<String>,
    /// When, on the rig's clock.
    pub at: At,
    /// How long, host time.
    pub lasts: Duration,
}

impl ScenarioFault {
    /// Reads one table.
    ///
    /// # Errors
    /// The line and what is wrong there, with the remedy.
    pub(crate) fn read(table: &Table) -> Result<Self, TomlError> {
        let name = match table.entries.get("name").map(|name| &name.value) {
            Some(Value::Text(name)) => name.as_str(),
            _ => "",
        };
        let is_built = FAULTS.iter().any(|fault| fault.name == name);
        let is_known = NOT_HERE.iter().any(|(names, _)| names.split(" / ").any(|known| known == name));
        match name {
            HOST_PAUSE => Pause::read(table).map(Self::Pause),
            _ if is_known && !is_built => {
                let why = FaultSpec::from_table(table).err().map(|error| error.message);
                Ok(Self::NotHere(why.unwrap_or_else(|| format!("the fault `{name}` is not there yet"))))
            }
            _ if table.entries.contains_key("sweep") => Sweep::read(table).map(Self::Sweep),
            _ => FaultSpec::from_table(table).map(|spec| Self::Rig(Box::new(spec))),
        }
    }

    /// What events call it; none of one that is not built.
    pub fn id(&self) -> Option<&str> {
        match self {
            Self::Rig(spec) => spec.id.as_deref(),
            Self::Sweep(sweep) => Some(&sweep.id),
            Self::Pause(pause) => Some(&pause.id),
            Self::NotHere(_) => None,
        }
    }

    /// When it begins.
    pub(crate) fn at(&self) -> Option<At> {
        match self {
            Self::Rig(spec) => Some(spec.at.clone()),
            Self::Sweep(sweep) => Some(At::Scan(sweep.scan.unsigned_abs())),
            Self::Pause(pause) => Some(pause.at.clone()),
            Self::NotHere(_) => None,
        }
    }

    /// True if an event ends it.
    pub(crate) fn has_until(&self) -> bool {
        matches!(self, Self::Rig(spec) if spec.until.is_some())
    }

    /// True if it may never begin though its time comes.
    pub(crate) fn is_by_chance(&self) -> bool {
        matches!(self, Self::Rig(spec) if spec.p.is_some_and(|p| p < 1.0))
    }

    /// Gives an id to those that have none: its name, numbered where that is taken.
    pub(crate) fn name_all(faults: &mut [Self]) {
        let mut taken: BTreeSet<String> = faults.iter().filter_map(Self::id).map(str::to_owned).collect();
        for fault in faults {
            if let Self::Rig(spec) = fault
                && spec.id.is_none()
            {
                let id = free_id(spec.fault.name, |id| taken.contains(id));
                taken.insert(id.clone());
                spec.id = Some(id);
            }
        }
    }

    /// Its name, if it holds bytes back for longer than a step in lockstep.
    pub(crate) fn holds_back(&self) -> Option<&'static str> {
        match self {
            Self::Rig(spec) => HOLDING.iter().copied().find(|name| *name == spec.fault.name),
            _ => None,
        }
    }
}

impl Sweep {
    fn read(table: &Table) -> Result<Self, TomlError> {
        let mut table = table.clone();
        let refuse = |line: usize, message: &str| TomlError { line, message: message.to_owned() };
        let Some(sweep) = table.entries.remove("sweep") else {
            return Err(refuse(table.line, "the key `sweep` is missing; add it"));
        };
        let line = sweep.line;
        let entries = sweep.into_table()?.entries;
        let mut entries = entries.into_iter();
        let (Some((key, range)), None) = (entries.next(), entries.next()) else {
            return Err(refuse(
                line,
                "`sweep`: expected one parameter of the fault, such as `offset = \"all\"`",
            ));
        };
        let (from, to) = match (&range.value, key.as_str()) {
            (Value::Text(all), "offset") if all == "all" => (1, None),
            (Value::List(ends), _) => match ends.iter().map(|end| &end.value).collect::<Vec<_>>()[..] {
                [Value::Whole(from), Value::Whole(to)] if from <= to => (*from, Some(*to)),
                _ => return Err(refuse(range.line, "expected [first, last]")),
            },
            _ => return Err(refuse(range.line, "expected [first, last]; of `offset` also \"all\"")),
        };
        table.entries.insert(key.clone(), Located { line: range.line, value: Value::Whole(from) });
        // The first one is checked as any fault is.
        let first = FaultSpec::from_table(&table)?;
        let At::Scan(scan) = first.at else {
            let line = table.entries.get("at").map_or(line, |at| at.line);
            return Err(refuse(line, "a fault with `sweep` begins at a scan: expected `at = { scan = N }`"));
        };
        let id = first.id.unwrap_or_else(|| first.fault.name.to_owned());
        Ok(Self { id, key, from, to, scan: i64::try_from(scan).unwrap_or(i64::MAX), table })
    }

    /// The fault of the value number `number`, from 0; none behind the last one.
    pub(crate) fn step(&self, number: i64) -> Option<FaultSpec> {
        let value = self.from.checked_add(number)?;
        if self.to.is_some_and(|last| value > last) {
            return None;
        }
        let mut table = self.table.clone();
        let line = table.line;
        let mut set = |key: &str, value: Value| table.entries.insert(key.to_owned(), Located { line, value });
        let scan = Located { line, value: Value::Whole(self.scan.checked_add(number)?) };
        set(&self.key, Value::Whole(value));
        set("at", Value::Table([("scan".to_owned(), scan)].into()));
        set("id", Value::Text(self.step_id(number)));
        FaultSpec::from_table(&table).ok()
    }

    /// What the fault of value number `number` is called.
    pub(crate) fn step_id(&self, number: i64) -> String {
        format!("{}[{}]", self.id, self.from.saturating_add(number))
    }
}

impl Pause {
    fn read(table: &Table) -> Result<Self, TomlError> {
        const KEYS: &[&str] = &["name", "id", "on", "at", "for"];
        if let Some((key, found)) = table.entries.iter().find(|(key, _)| !KEYS.contains(&key.as_str())) {
            let message = format!("unknown key `{key}` of `{HOST_PAUSE}`{}", suggestion(key, KEYS));
            return Err(TomlError { line: found.line, message });
        }
        // When it is, is said as of any fault that lasts.
        let mut common = table.clone();
        let name = common.entries.get_mut("name");
        name.into_iter().for_each(|name| name.value = Value::Text("stall".to_owned()));
        let spec = FaultSpec::from_table(&common)?;
        if let (At::Command(_), Some(at)) = (&spec.at, table.entries.get("at")) {
            let message = "a child is stopped at a time, a scan or a place; use `s`, `scan`, `row_m`, `tree` or `after`";
            return Err(TomlError { line: at.line, message: message.to_owned() });
        }
        match spec.lasts {
            Some(Lasts::Time(lasts)) => Ok(Self {
                id: spec.id.unwrap_or_else(|| HOST_PAUSE.to_owned()),
                on: spec.on,
                at: spec.at,
                lasts,
            }),
            _ => Err(TomlError {
                line: table.line,
                message: format!(
                    "`{HOST_PAUSE}` lasts for seconds of the host's time: add `for = {{ s = … }}`"
                ),
            }),
        }
    }
}
