//! Signals: a value that changes in a run, and where it is heard. On a bus by a DBC file's names or by a parameter group's bytes, in the GNSS
//! sentences by field, in a child's output by a regular expression with a number.

mod course;
mod judge;
mod picture;
mod series;

#[cfg(feature = "dbc")]
use rowscan_bus::database::Database;
use rowscan_bus::field::{Address, Field};

pub(crate) use judge::{bus_load, judge};
pub(crate) use picture::picture;
pub(crate) use series::Sample;

/// A signal as `[[expect]]` names it.
#[derive(Clone, Debug, PartialEq)]
pub struct SignalKeys {
    /// `can0:Nozzles.Section3`, `can0`, `gnss:GGA.6` or a child's name.
    pub name: String,
    /// Its parameter group, on a bus.
    pub pgn: Option<u32>,
    /// Its bytes in that: the first, from 0, and how many.
    pub bytes: Option<(u8, u8)>,
    /// What it must do.
    pub must: Must,
}

impl SignalKeys {
    /// Its name, and which messages of a bus.
    fn words(&self) -> String {
        self.pgn.map_or_else(|| self.name.clone(), |pgn| format!("{} (PGN {pgn})", self.name))
    }

    /// What it is and must do, for the title of its expectation.
    pub(crate) fn title(&self) -> String {
        let mut title = format!(" {}", self.name);
        title += &self.pgn.map_or(String::new(), |pgn| format!(" pgn {pgn}"));
        title += &self.bytes.map_or(String::new(), |(first, count)| format!(" bytes {first}+{count}"));
        let Must { change, be_silent, never, for_s, every_s } = self.must;
        for (word, is_said) in [(" never", never), (" changes", change), (" silent", be_silent)] {
            title += if is_said { word } else { "" };
        }
        title += &every_s.map_or(String::new(), |seconds| format!(" every {seconds} s"));
        title += &for_s.map_or(String::new(), |seconds| format!(" for {seconds} s"));
        title
    }
}

/// What a signal must do, beside what its value must be.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Must {
    /// Become another value.
    pub change: bool,
    /// Not be heard.
    pub be_silent: bool,
    /// Never do so.
    pub never: bool,
    /// Hold so long, seconds.
    pub for_s: Option<f64>,
    /// Come so often, seconds.
    pub every_s: Option<f64>,
}

/// Where a signal is heard.
#[derive(Clone, Debug, PartialEq)]
pub enum Source {
    /// A field of a bus's messages.
    Field {
        /// The bus.
        bus: String,
        /// Its place in a message.
        field: Box<Field>,
    },
    /// Whether messages come at all.
    Messages {
        /// The bus.
        bus: String,
        /// Which; all that others than the bench send, where absent.
        address: Option<Address>,
    },
    /// A field of the sentences of the GNSS receiver: its type, such as `GGA`, and the field's number, 0 the type itself.
    Sentence {
        /// The type.
        kind: String,
        /// The field.
        field: usize,
    },
    /// The number that a line of a child's output tells, by the expectation's own pattern.
    Log {
        /// The child.
        child: String,
    },
}

/// What signals can be heard on.
pub(crate) struct Ways<'a> {
    /// Buses with their DBC files; our own messages go with each.
    pub(crate) buses: Vec<(&'a str, Option<Names>)>,
    pub(crate) nmea: Vec<&'a str>,
    pub(crate) runs: Vec<&'a str>,
}

/// The largest parameter group: 18 bits.
const MOST_PGN: u32 = 0x3_FFFF;

impl Source {
    /// True if what is heard there is a message without a value of its own.
    pub(crate) fn has_no_value(&self) -> bool {
        matches!(self, Self::Messages { .. })
    }

    /// What `keys` mean here.
    pub(crate) fn resolve(keys: &SignalKeys, has_pattern: bool, ways: &Ways<'_>) -> Result<Self, String> {
        let (place, what) = match keys.name.split_once(':') {
            Some((place, what)) => (place, Some(what)),
            None => (keys.name.as_str(), None),
        };
        let misplaced = |needs: &str| {
            format!("`pgn` and `bytes` go with a bus alone, such as `signal = \"can0\"`; {needs}")
        };
        let without_group = |needs: &str| match (keys.pgn, keys.bytes) {
            (None, None) => Ok(()),
            _ => Err(misplaced(needs)),
        };
        let no_pattern = || match has_pattern && !ways.runs.contains(&place) {
            true => Err(format!(
                "`matches` searches a child's output, and `{place}` is none; leave it out, or name a run"
            )),
            false => Ok(()),
        };
        if let Some((_, names)) = ways.buses.iter().find(|(bus, _)| *bus == place) {
            no_pattern()?;
            if let Some(pgn) = keys.pgn.filter(|pgn| *pgn > MOST_PGN) {
                return Err(format!(
                    "`pgn`: expected a parameter group up to 0x{MOST_PGN:X}, found 0x{pgn:X}: of an identifier it is bits 8 to 25"
                ));
            }
            let bus = place.to_owned();
            return match (what, keys.pgn, keys.bytes) {
                (Some(name), None, None) => {
                    field(names.as_ref(), name).map(|field| Self::Field { bus, field: Box::new(field) })
                }
                (Some(_), ..) => Err(misplaced("the DBC file knows where a named signal is")),
                (None, Some(pgn), Some((first, count))) => {
                    let fits = (1..=8).contains(&count) && u16::from(first) + u16::from(count) <= 1785;
                    let field = Box::new(Field::bytes_of(pgn, first, count));
                    fits.then_some(Self::Field { bus, field }).ok_or_else(|| {
                        format!("`bytes`: expected the first byte, from 0, and 1 to 8 bytes, found [{first}, {count}]")
                    })
                }
                (None, Some(pgn), None) => Ok(Self::Messages { bus, address: Some(Address::Group(pgn)) }),
                (None, None, None) => Ok(Self::Messages { bus, address: None }),
                (None, None, Some(_)) => Err("`bytes` are those of a parameter group: add `pgn`".to_owned()),
            };
        }
        if ways.nmea.contains(&place) {
            no_pattern()?;
            without_group("a sentence is named as in \"gnss:GGA.6\"")?;
            let wrong = || {
                format!(
                    "`signal`: expected a sentence and a field's number, such as \"{place}:GGA.6\", found \"{}\"",
                    keys.name
                )
            };
            let (kind, field) = what.and_then(|what| what.split_once('.')).ok_or_else(wrong)?;
            let field = field.parse().map_err(|_| wrong())?;
            return Ok(Self::Sentence { kind: kind.to_owned(), field });
        }
        if ways.runs.contains(&place) {
            without_group("a child's output is searched by `matches`")?;
            return match (what, has_pattern) {
                (None, true) => Ok(Self::Log { child: place.to_owned() }),
                _ => Err(format!(
                    "`signal = \"{place}\"` is a child's output: add `matches`, a pattern with the number in parentheses"
                )),
            };
        }
        let known = ways
            .buses
            .iter()
            .map(|(bus, _)| *bus)
            .chain(ways.nmea.iter().copied())
            .chain(ways.runs.iter().copied());
        let known: Vec<&str> = known.collect();
        Err(format!(
            "`signal`: there is no bus, NMEA place or run `{place}`{}",
            rowscan_settings::suggestion(place, &known)
        ))
    }

    /// The value called `name`.
    pub(crate) fn named(&self, name: &str) -> Result<f64, String> {
        let Self::Field { field, .. } = self else {
            return Err(format!(
                "`equals`: expected a number, found \"{name}\": only a DBC file's values have names"
            ));
        };
        let known: Vec<&str> = field.names().collect();
        field.named(name).ok_or_else(|| match known.as_slice() {
            [] => format!(
                "`equals`: expected a number, found \"{name}\": the DBC file names no value of this signal"
            ),
            known => format!(
                "`equals`: no value is called \"{name}\"{}",
                rowscan_settings::suggestion(name, known)
            ),
        })
    }

    /// Its values that have names, with those.
    pub(crate) fn named_values(&self) -> Vec<(f64, String)> {
        match self {
            Self::Field { field, .. } => field.named_values().to_vec(),
            _ => Vec::new(),
        }
    }

    /// True where its value holds until the next one is heard; a line of a log tells a moment.
    pub(crate) fn is_a_state(&self) -> bool {
        !matches!(self, Self::Log { .. })
    }

    /// The unit of its values, if that is known.
    pub(crate) fn unit(&self) -> &str {
        match self {
            Self::Field { field, .. } => &field.unit,
            _ => "",
        }
    }
}

/// The signals that a DBC file names.
#[cfg(feature = "dbc")]
pub(crate) struct Names(Database);

/// Nobody reads DBC files here.
#[cfg(not(feature = "dbc"))]
pub(crate) enum Names {}

#[cfg(feature = "dbc")]
impl Names {
    /// Reads the text of a DBC file.
    pub(crate) fn read(text: &str) -> Result<Self, String> {
        Database::read(text).map(Self).map_err(|error| error.to_string())
    }

    fn field(&self, name: &str) -> Result<Field, String> {
        self.0.field(name).map_err(|error| error.to_string())
    }
}

#[cfg(not(feature = "dbc"))]
impl Names {
    /// Reads no file.
    pub(crate) fn read(_: &str) -> Result<Self, String> {
        Err("this program was built without the feature `dbc`, which reads such files; build it with `--features full`, or give `pgn` and `bytes`".to_owned())
    }

    fn field(&self, _: &str) -> Result<Field, String> {
        match *self {}
    }
}

/// A signal by its name in the bus's own file, or else in the table of messages that a tractor sends here.
fn field(names: Option<&Names>, name: &str) -> Result<Field, String> {
    let ours = || name.split_once('.').and_then(|(message, signal)| Field::of_ours(message, signal));
    let here = names.map(|names| names.field(name));
    match (here, ours()) {
        (Some(Ok(field)), _) | (_, Some(field)) => Ok(field),
        (Some(Err(error)), None) => Err(format!("`signal`: {error}")),
        (None, None) => Err(format!(
            "`signal`: expected a message and a signal of docs/rowscan.dbc, such as GroundBasedSpeed.GroundSpeed, found `{name}`; a message of your own needs the bus's `dbc = \"FILE\"`"
        )),
    }
}

#[cfg(all(test, feature = "dbc"))]
mod tests;
