//! `[[expect]]` tables.

use rowscan_scenes::files::nearest;
use schemars::{Schema, SchemaGenerator, json_schema};
use serde::Deserialize;
use serde_json::Value;

use rowscan_sprayer::Edge;
use rowscan_sprayer::safety::Rule;

use super::bounds::Bounds;
use super::process_value::ProcessValue;
use super::valve_state::ValveState;
use crate::journal::END;
use crate::signal::{Must, SignalKeys, Source};
use crate::what::{self, Count, Kind, RATE, Sprayed, WHATS, What};

/// What `equals` says where the device itself tells how much is right.
const DEVICE: &str = "device";

/// An expectation as it is written.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(super) struct Table {
    /// What is expected; docs/bench.md says which keys go with it.
    #[schemars(schema_with = "what_names", example = &"scans_lost")]
    what: String,
    /// The device it is of; where there is only one, it may be left out.
    #[schemars(example = &"left")]
    on: Option<String>,
    /// The child, fault or file it is of.
    #[schemars(example = &"sut")]
    of: Option<String>,
    /// A file of the run's folder.
    #[schemars(example = &"canopy.log")]
    file: Option<String>,
    /// The event it counts from: a fault's id, or `ID.end`.
    #[schemars(example = &"cable.end")]
    after: Option<String>,
    /// So many simulated seconds after that, at most.
    #[schemars(example = 2.0)]
    within_s: Option<f64>,
    /// Two numbers that it lies between, both included; or two events that are counted between.
    #[schemars(example = (0, 3), extend("x-kind" = "two numbers, or two events"))]
    between: Option<(Value, Value)>,
    /// Exactly this: a number; for files, the path of another.
    #[schemars(example = 0, extend("x-kind" = "a number or a text"))]
    equals: Option<Value>,
    /// The same as in a run without faults: `faults`.
    #[schemars(example = &"faults")]
    equals_run_without: Option<String>,
    /// More than this.
    #[schemars(example = 100.0)]
    above: Option<f64>,
    /// Less than this.
    #[schemars(example = 3.0)]
    below: Option<f64>,
    /// Nearer to 0 than this.
    #[schemars(example = 0.1)]
    abs_below: Option<f64>,
    /// Its 95th percentile is less than this.
    #[schemars(example = 0.05)]
    p95_below: Option<f64>,
    /// How far from `equals` or the run without faults it may be.
    #[schemars(example = 0.001)]
    tolerance: Option<f64>,
    /// A regular expression that a line of the output matches.
    #[schemars(example = &"scanner lost")]
    matches: Option<String>,
    /// The signal: a bus and a name of its DBC file, `can0:Nozzles.Section3`; a bus, with `pgn` and `bytes`; a sentence's field, `gnss:GGA.6`; or a
    /// child, with `matches`.
    #[schemars(example = &"can0:Nozzles.Section3")]
    signal: Option<String>,
    /// The J1939 parameter group of a signal.
    #[schemars(range(max = 0x3_FFFF), example = 65296)]
    pgn: Option<u32>,
    /// Its bytes in that: the first, from 0, and how many, the low one first.
    #[schemars(example = (2, 1))]
    bytes: Option<(u8, u8)>,
    /// The signal becomes another value.
    #[schemars(example = true)]
    changes: Option<bool>,
    /// The signal is not heard.
    #[schemars(example = true)]
    silent: Option<bool>,
    /// What is expected of the signal never is.
    #[schemars(example = true)]
    never: Option<bool>,
    /// The signal comes so often, simulated seconds; `tolerance` is how much sooner or later it may be, a tenth where left out.
    #[schemars(example = 0.1)]
    every_s: Option<f64>,
    /// It holds so long, simulated seconds.
    #[schemars(example = 0.5)]
    for_s: Option<f64>,
    /// Runs that must agree; 2 where left out.
    #[schemars(example = 2)]
    runs: Option<u32>,
    /// The state that all valves have.
    #[schemars(example = &"closed")]
    all: Option<String>,
    /// The edge that is judged.
    #[schemars(example = &"open")]
    edge: Option<String>,
    /// The element of a task controller's client, by its number in process data.
    #[schemars(example = 2)]
    element: Option<u32>,
    /// The value's number in the data dictionary of ISOBUS.
    #[schemars(example = 161)]
    ddi: Option<u32>,
    /// What the value must be, or `as_setpoint`: what was set last.
    #[schemars(example = &"as_setpoint", extend("x-kind" = "a number or a text"))]
    value: Option<Value>,
}

/// The names of everything that can be expected, with what each tells.
fn what_names(_: &mut SchemaGenerator) -> Schema {
    let names = WHATS.iter().map(|what| json_schema!({ "const": what.name, "description": what.tells }));
    json_schema!({ "type": "string", "oneOf": names.collect::<Vec<_>>() })
}

/// An expectation whose keys fit what it expects.
#[derive(Clone, Debug, Deserialize)]
#[serde(try_from = "Table")]
pub struct Expect {
    /// What is expected.
    pub what: &'static What,
    /// The device or child it is of; where there is only one, it may be left out.
    pub on: Option<String>,
    /// The file of `bytes_of` and `same_bytes`.
    pub file: Option<String>,
    /// The event it counts from.
    pub after: Option<String>,
    /// Simulated seconds after that.
    pub within_s: Option<f64>,
    /// The events it counts between.
    pub between_events: Option<(String, String)>,
    /// What a number must be.
    pub bounds: Bounds,
    /// The text it must equal: another file, or `device`.
    pub equals_text: Option<String>,
    /// The same of a run without faults.
    pub equals_run_without: Option<String>,
    /// The signal.
    pub signal: Option<SignalKeys>,
    /// Where that is heard, once the scenario's buses and children are known.
    pub source: Option<Source>,
    /// The pattern of a log line.
    pub matches: Option<Pattern>,
    /// Runs that must agree.
    pub runs: u32,
    /// The edge of a section.
    pub edge: Option<Edge>,
    /// The 95th percentile is less than this.
    pub p95_below: Option<f64>,
    /// The state that all valves have.
    pub all: Option<ValveState>,
    /// The value of a task controller's client.
    pub process: Option<ProcessValue>,
}

/// A regular expression with its text.
#[derive(Clone, Debug)]
pub struct Pattern(pub regex_lite::Regex);

impl Table {
    /// The keys that are given, `what` apart.
    fn given(&self) -> Vec<&'static str> {
        let given = [
            ("on", self.on.is_some()),
            ("of", self.of.is_some()),
            ("file", self.file.is_some()),
            ("after", self.after.is_some()),
            ("within_s", self.within_s.is_some()),
            ("between", self.between.is_some()),
            ("equals", self.equals.is_some()),
            ("equals_run_without", self.equals_run_without.is_some()),
            ("above", self.above.is_some()),
            ("below", self.below.is_some()),
            ("abs_below", self.abs_below.is_some()),
            ("p95_below", self.p95_below.is_some()),
            ("tolerance", self.tolerance.is_some()),
            ("matches", self.matches.is_some()),
            ("signal", self.signal.is_some()),
            ("pgn", self.pgn.is_some()),
            ("bytes", self.bytes.is_some()),
            ("changes", self.changes.is_some()),
            ("silent", self.silent.is_some()),
            ("never", self.never.is_some()),
            ("every_s", self.every_s.is_some()),
            ("for_s", self.for_s.is_some()),
            ("runs", self.runs.is_some()),
            ("all", self.all.is_some()),
            ("edge", self.edge.is_some()),
            ("element", self.element.is_some()),
            ("ddi", self.ddi.is_some()),
            ("value", self.value.is_some()),
        ];
        given.into_iter().filter(|(_, is_given)| *is_given).map(|(key, _)| key).collect()
    }
}

impl TryFrom<Table> for Expect {
    type Error = String;

    fn try_from(table: Table) -> Result<Self, String> {
        if table.what.is_empty() {
            return Err("the key `what` is missing; add it".to_owned());
        }
        let names: Vec<&str> = WHATS.iter().map(|what| what.name).collect();
        let what = what::by_name(&table.what).ok_or_else(|| match nearest(&table.what, &names) {
            near if near.is_empty() => {
                format!("unknown `what`: `{}`; known are {}", table.what, names.join(", "))
            }
            near => format!("unknown `what`: `{}`{near}", table.what),
        })?;
        if let Some(wrong) = table.given().into_iter().find(|key| !what.keys.contains(key)) {
            let valid = what.keys.join(", ");
            return Err(format!("`{wrong}` does not go with `{}`; valid here: {valid}", what.name));
        }
        let expect = Self::of(what, table)?;
        expect.complete()?;
        expect.check_signal()?;
        expect.check_window()?;
        expect.check_numbers()?;
        expect.check_bounds()?;
        Ok(expect)
    }
}

/// The edge that is named.
fn edge_named(name: &str) -> Result<Edge, String> {
    match name {
        "open" | "leading" => Ok(Edge::Open),
        "close" | "trailing" => Ok(Edge::Close),
        other => Err(format!("`edge`: expected \"open\" or \"close\", found \"{other}\"")),
    }
}

/// Refuses a text after `equals` that tells nothing of what is expected.
fn check_text(kind: Kind, text: &str) -> Result<(), String> {
    let expected = match kind {
        Kind::BytesOf if !text.is_empty() => return Ok(()),
        Kind::BytesOf => "the path of a file",
        Kind::Count(Count::ScansLost) if text == DEVICE => return Ok(()),
        Kind::Count(Count::ScansLost) => "a number or \"device\"",
        // The name of a value; the scenario knows the DBC file.
        Kind::Signal if !text.is_empty() => return Ok(()),
        Kind::Signal => "a number or a value's name",
        _ => "a number",
    };
    Err(format!("`equals`: expected {expected}, found \"{text}\""))
}

impl Expect {
    fn of(what: &'static What, table: Table) -> Result<Self, String> {
        let (equals, equals_text) = match &table.equals {
            None => (None, None),
            Some(Value::String(text)) => (None, Some(text.clone())),
            Some(value) => match value.as_f64() {
                Some(number) => (Some(number), None),
                None => {
                    // A table's value that is no number of JSON: TOML has these.
                    let found = if value.is_null() { "nan or inf".to_owned() } else { value.to_string() };
                    return Err(format!("`equals`: expected a number or a text, found {found}"));
                }
            },
        };
        if let Some(text) = &equals_text {
            check_text(what.kind, text)?;
        }
        if what.kind == Kind::BytesOf && equals.is_some() {
            return Err("`equals`: expected the path of a file, found a number".to_owned());
        }
        if table.equals.is_some() && table.equals_run_without.is_some() {
            return Err("`equals` and `equals_run_without` are two expected values; leave one out".to_owned());
        }
        if let Some(other) = table.equals_run_without.as_ref().filter(|without| *without != "faults") {
            return Err(format!("`equals_run_without`: expected \"faults\", found \"{other}\""));
        }
        let (between, between_events) = match table.between {
            None => (None, None),
            Some((Value::String(_), Value::String(_))) if !what.takes_events() => {
                let counts = WHATS.iter().filter(|what| what.takes_events()).map(|what| what.name);
                return Err(format!(
                    "`between` of `{}`: expected two numbers, found two events; it is measured over the whole run. Between events {} are counted",
                    what.name,
                    counts.collect::<Vec<_>>().join(", ")
                ));
            }
            Some((Value::String(from), Value::String(to))) => (None, Some((from, to))),
            Some((from, to)) => match (from.as_f64(), to.as_f64()) {
                (Some(least), Some(most)) => (Some((least, most)), None),
                _ => return Err("`between`: expected two numbers or two events".to_owned()),
            },
        };
        let pattern = |text: String| {
            if text.is_empty() {
                return Err(
                    "`matches`: expected a pattern, found an empty text, which every line matches".to_owned()
                );
            }
            let pattern = regex_lite::Regex::new(&text)
                .map_err(|error| format!("`matches`: `{text}` is no pattern: {error}"))?;
            // An empty line, and one that nobody writes.
            if pattern.is_match("") && pattern.is_match("\u{1}") {
                return Err(format!(
                    "`matches`: expected a pattern that some lines do not match, found `{text}`, which every line matches"
                ));
            }
            Ok(pattern)
        };
        let names_file = what.kind == Kind::SameBytes;
        let signal = table.signal.map(|name| SignalKeys {
            name,
            pgn: table.pgn,
            bytes: table.bytes,
            must: Must {
                change: table.changes.unwrap_or(false),
                be_silent: table.silent.unwrap_or(false),
                never: table.never.unwrap_or(false),
                for_s: table.for_s,
                every_s: table.every_s,
            },
        });
        Ok(Self {
            what,
            file: if names_file { table.of.clone() } else { table.file },
            on: table.on.or(table.of.filter(|_| !names_file)),
            after: table.after,
            within_s: table.within_s,
            between_events,
            bounds: Bounds {
                equals,
                above: table.above,
                below: table.below,
                abs_below: table.abs_below,
                between,
                tolerance: table.tolerance.unwrap_or(0.0),
            },
            equals_text,
            equals_run_without: table.equals_run_without,
            signal,
            source: None,
            matches: table.matches.map(pattern).transpose()?.map(Pattern),
            runs: table.runs.unwrap_or(2),
            edge: table.edge.as_deref().map(edge_named).transpose()?,
            p95_below: table.p95_below,
            all: table.all.as_deref().map(ValveState::named).transpose()?,
            process: (what.kind == Kind::ProcessValue)
                .then(|| ProcessValue::new((table.element, table.ddi), table.value.as_ref()))
                .transpose()?,
        })
    }

    /// Refuses one that expects nothing.
    fn complete(&self) -> Result<(), String> {
        let name = self.what.name;
        let lacks = |keys: &str| Err(format!("`{name}` expects nothing yet; add {keys}"));
        let compared = self.equals_text.is_some() || self.equals_run_without.is_some();
        match self.what.kind {
            Kind::NextScan if self.within_s.is_none() => lacks("`within_s`"),
            Kind::Count(_) | Kind::Unheard | Kind::Measure(_) | Kind::FaultActs
                if self.bounds.is_empty() && !compared =>
            {
                lacks("`equals`, `above`, `below` or `between`")
            }
            Kind::BusLoad if self.bounds.is_empty() => lacks("`above`, `below` or `between`"),
            Kind::Signal if self.signal.is_none() => lacks("`signal`"),
            Kind::FaultActs if self.on.is_none() => lacks("`of`, the fault"),
            Kind::Log if self.matches.is_none() => lacks("`matches`"),
            Kind::BytesOf if self.file.is_none() => lacks("`file`"),
            Kind::BytesOf if !compared => lacks("`equals`, the other file"),
            Kind::SameBytes if self.file.is_none() => lacks("`of`, the file"),
            Kind::Sprayer(Sprayed::LatencyError) if self.p95_below.is_none() => lacks("`p95_below`"),
            Kind::Sprayer(Sprayed::Valves) if self.all.is_none() => lacks("`all`"),
            Kind::Sprayer(Sprayed::TimeToSafe) if self.after.is_none() => lacks("`after`"),
            Kind::Sprayer(Sprayed::LatencyError | Sprayed::Valves) => Ok(()),
            Kind::Sprayer(_) if self.bounds.is_empty() => lacks("`above`, `below` or `between`"),
            Kind::Sprayer(Sprayed::Edges) => match self.on.as_deref() {
                None | Some("missed" | "spurious") => Ok(()),
                Some(other) => Err(format!("`of`: expected \"missed\" or \"spurious\", found \"{other}\"")),
            },
            Kind::Sprayer(Sprayed::RateError) => match self.on.as_deref() {
                Some(other) if !RATE.contains(&other) => {
                    Err(format!("`of`: expected one of {}, found \"{other}\"", RATE.join(", ")))
                }
                _ => Ok(()),
            },
            Kind::Sprayer(Sprayed::Forbidden) => match self.on.as_deref() {
                Some(other) if Rule::named(other).is_none() => {
                    let known = Rule::ALL.map(Rule::name);
                    Err(format!("`of`: expected one of {}, found \"{other}\"", known.join(", ")))
                }
                _ => Ok(()),
            },
            Kind::SameBytes if self.runs < 2 => Err("`runs`: expected 2 or more".to_owned()),
            _ => Ok(()),
        }
    }

    /// Refuses a signal that must do several things at once, or nothing.
    fn check_signal(&self) -> Result<(), String> {
        let Some(SignalKeys { must, .. }) = &self.signal else { return Ok(()) };
        let is_bound = !self.bounds.is_empty() || self.equals_text.is_some();
        let without = self.equals_run_without.is_some();
        let given = [
            ("changes", must.change),
            ("silent", must.be_silent),
            ("every_s", must.every_s.is_some()),
            ("equals_run_without", without),
            ("a value's bounds", is_bound),
        ];
        let given: Vec<&str> =
            given.into_iter().filter(|(_, is_given)| *is_given).map(|(key, _)| key).collect();
        if let [first, second, ..] = given.as_slice() {
            return Err(format!("{first} and {second} are two expectations of `signal`; write two"));
        }
        let wrong = |key: &str, with: &str| Err(format!("`{key}` goes with {with} of `signal`"));
        match () {
            () if must.never && !(must.change || is_bound) => wrong("never", "a value's bounds or `changes`"),
            () if must.never && (self.within_s.is_some() || must.for_s.is_some()) => Err("`never` is of the whole time; leave `within_s` and `for_s` out".to_owned()),
            () if must.for_s.is_some() && !(is_bound || must.be_silent || must.every_s.is_some()) => wrong("for_s", "a value's bounds, `silent` or `every_s`"),
            () if given.is_empty() && self.within_s.is_none() => Err("`signal` expects nothing yet; add `equals`, `above`, `below`, `changes`, `silent`, `every_s` or `within_s`".to_owned()),
            () => Ok(()),
        }
    }

    /// Refuses a window that holds nothing.
    fn check_window(&self) -> Result<(), String> {
        if let Some((from, to)) = &self.between_events {
            if let Some(after) = &self.after {
                return Err(format!(
                    "`after` ({after}) and `between` ({from}, {to}) are two windows; leave one out"
                ));
            }
            if from == to {
                return Err(format!(
                    "`between`: expected two events, found `{from}` twice: nothing is between"
                ));
            }
        }
        let from = self.between_events.iter().map(|(from, _)| ("between", from));
        // What a child says as it ends comes after the end; nothing is delivered then.
        let after = self.after.iter().filter(|_| self.what.kind != Kind::Log).map(|after| ("after", after));
        match from.chain(after).find(|(_, event)| *event == END) {
            Some((key, _)) => {
                Err(format!("`{key}`: expected an event before the end, found `{END}`: nothing comes after"))
            }
            None => Ok(()),
        }
    }

    /// Refuses bounds that contradict each other, or of which one says it all.
    fn check_bounds(&self) -> Result<(), String> {
        let Bounds { equals, above, below, abs_below, between, .. } = self.bounds;
        let bounds = [
            ("above", above.is_some()),
            ("below", below.is_some()),
            ("abs_below", abs_below.is_some()),
            ("between", between.is_some()),
        ];
        let equals = equals.is_some() || self.equals_text.is_some() && self.what.kind == Kind::Signal;
        match (bounds.iter().find(|(_, is_given)| *is_given), above, below) {
            (Some((key, _)), ..) if equals => {
                Err(format!("`equals` and `{key}`: expected one of them, found both; leave one out"))
            }
            (_, Some(above), Some(below)) if above >= below => Err(format!(
                "`above` and `below`: expected numbers with others between them, found {above} and {below}"
            )),
            _ => Ok(()),
        }
    }

    /// Refuses numbers that nothing, or everything, meets.
    fn check_numbers(&self) -> Result<(), String> {
        let Bounds { equals, above, below, abs_below, between, tolerance } = self.bounds;
        let (least, most) = between.unzip();
        let numbers = [
            ("within_s", self.within_s, 0.0),
            ("tolerance", Some(tolerance), 0.0),
            ("for_s", self.signal.as_ref().and_then(|signal| signal.must.for_s), f64::MIN_POSITIVE),
            ("every_s", self.signal.as_ref().and_then(|signal| signal.must.every_s), f64::MIN_POSITIVE),
            ("abs_below", abs_below, f64::MIN_POSITIVE),
            ("p95_below", self.p95_below, f64::MIN_POSITIVE),
            ("equals", equals, f64::MIN),
            ("above", above, f64::MIN),
            ("below", below, f64::MIN),
            ("between", least, f64::MIN),
            ("between", most, least.unwrap_or(f64::MIN)),
        ];
        self.bounds.decide(self.what)?;
        let wrong = numbers
            .into_iter()
            .find(|(_, value, lowest)| value.is_some_and(|value| !(*lowest..=f64::MAX).contains(&value)));
        let Some((key, Some(found), lowest)) = wrong else { return Ok(()) };
        let expected = match key {
            "abs_below" | "p95_below" | "for_s" | "every_s" => "a number above 0".to_owned(),
            _ if lowest == f64::MIN => "a finite number".to_owned(),
            _ => format!("a number from {lowest} on"),
        };
        Err(format!("`{key}`: expected {expected}, found {found}"))
    }

    /// What it expects of whom, in a few words: the same words in every run.
    pub fn title(&self) -> String {
        let mut title = self.what.name.to_owned();
        title += &self.signal.as_ref().map_or(String::new(), SignalKeys::title);
        title += &self.edge.map_or(String::new(), |edge| format!(" {}", edge.name()));
        title += &self.all.map_or(String::new(), |state| format!(" all {}", state.name()));
        title += &self.process.map_or(String::new(), ProcessValue::title);
        for (word, text) in [("of", &self.file), ("on", &self.on), ("after", &self.after)] {
            if let Some(text) = text {
                title += &format!(" {word} {text}");
            }
        }
        if let Some((from, to)) = &self.between_events {
            title += &format!(" between {from} and {to}");
        }
        if let Some(seconds) = self.within_s {
            title += &format!(" within {seconds} s");
        }
        if let Some(Pattern(pattern)) = &self.matches {
            title += &format!(" matches {}", pattern.as_str());
        }
        let compared = self.equals_text.iter().cloned();
        let without = self.equals_run_without.iter().map(|without| format!("as in a run without {without}"));
        let p95 = self.p95_below.iter().map(|most| format!("p95 below {most}"));
        let words = Some(self.bounds.words()).filter(|words| !words.is_empty());
        let words: Vec<String> = compared.chain(without).chain(words).chain(p95).collect();
        if words.is_empty() { title } else { title + ": " + &words.join(", ") }
    }
}
