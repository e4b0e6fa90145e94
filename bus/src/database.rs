//! DBC files, read: which bits of which frames a signal is. The text is read by the crate can-dbc; what its fields mean stands here.

use std::collections::BTreeMap;

use can_dbc::{
    AttributeValue, AttributeValuedForObjectType, ByteOrder, DBC, MessageId, MultiplexIndicator,
    SignalExtendedValueType, ValueType,
};
use rowscan_settings::suggestion;

use crate::field::{Address, Bits, Field, Kind, largest_raw};
use crate::frame::{CanId, J1939Id};

/// The messages of a DBC file.
#[derive(Clone, Debug)]
pub struct Database {
    dbc: DBC,
    /// Messages with an identifier that no frame has: the reader cuts it off.
    misnumbered: BTreeMap<String, u32>,
}

/// Why a DBC file, or a signal of it, cannot be used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum DatabaseError {
    /// The text is no DBC file.
    #[error("line {line}: expected a DBC file, found `{found}`")]
    Text {
        /// The line that was not understood, from 1.
        line: usize,
        /// Its beginning.
        found: String,
    },
    /// A name without a message.
    #[error("expected MESSAGE.SIGNAL, found `{0}`")]
    NoMessage(String),
    /// No such message or signal.
    #[error("there is no {what} `{found}`{}", suggestion(found, &known.iter().map(String::as_str).collect::<Vec<_>>()))]
    Unknown {
        /// `message` or `signal`.
        what: &'static str,
        /// What was asked for.
        found: String,
        /// What there is.
        known: Vec<String>,
    },
    /// An identifier that no frame has.
    #[error(
        "message `{message}`: expected an identifier of 11 bits, or one of 29 bits with bit 31 set, as DBC files write them; found {found}, which \
         would be {} for the frame 0x{found:08X}",
        found | 0x8000_0000
    )]
    Identifier {
        /// Whose.
        message: String,
        /// What the file has.
        found: u32,
    },
    /// A signal that its message has no room for.
    #[error(
        "signal `{signal}`: expected bits within the {bytes} bytes of its message, found {size} bits from bit {start} on: correct its place, or \
         the length in its message's `BO_` line"
    )]
    Beyond {
        /// `MESSAGE.SIGNAL`.
        signal: String,
        /// The message's length.
        bytes: u64,
        /// The signal's first bit, as DBC files count them.
        start: u64,
        /// Its length.
        size: u64,
    },
    /// Bits that cannot be.
    #[error("signal `{0}`: expected 1 to 64 bits, 32 or 64 of a floating point number")]
    Width(String),
}

impl Database {
    /// Reads the text of a DBC file.
    ///
    /// # Errors
    /// Text that is none; the line says where it stops being one.
    pub fn read(given: &str) -> Result<Self, DatabaseError> {
        let (owned, added) = completed(given);
        let text = owned.as_str();
        // What was added is none of the file's.
        let own = |rest: &'_ str| rest.len().min(given.len() + 1);
        let wrong = |rest: &str| {
            let rest = text.get(text.len() - own(rest)..).unwrap_or(rest);
            let read = text.len().saturating_sub(rest.len());
            let line = text.get(..read).unwrap_or(text).lines().count().saturating_sub(added).max(1);
            let found = rest.trim_start().lines().next().unwrap_or_default();
            DatabaseError::Text { line, found: found.chars().take(60).collect() }
        };
        match DBC::try_from(text) {
            Ok(read) if read.messages().is_empty() => Err(wrong(text)),
            Ok(dbc) => Ok(Self { dbc, misnumbered: misnumbered(text) }),
            Err(can_dbc::Error::Incomplete(_, rest)) => Err(wrong(rest)),
            Err(_) => Err(wrong(text)),
        }
    }

    /// The signal called `MESSAGE.SIGNAL`.
    ///
    /// # Errors
    /// There is none, or its bits cannot be.
    pub fn field(&self, name: &str) -> Result<Field, DatabaseError> {
        let (message, signal) =
            name.split_once('.').ok_or_else(|| DatabaseError::NoMessage(name.to_owned()))?;
        let unknown = |what, found: &str, known: Vec<String>| DatabaseError::Unknown {
            what,
            found: found.to_owned(),
            known,
        };
        let messages = self.dbc.messages();
        let found = messages.iter().find(|known| known.message_name() == message).ok_or_else(|| {
            unknown("message", message, messages.iter().map(|known| known.message_name().clone()).collect())
        })?;
        let signals = found.signals();
        let signal = signals.iter().find(|known| known.name() == signal).ok_or_else(|| {
            unknown("signal", signal, signals.iter().map(|known| known.name().clone()).collect())
        })?;
        let bits = bits(signal);
        let kind = match (
            self.dbc.extended_value_type_for_signal(*found.message_id(), signal.name()),
            signal.value_type(),
        ) {
            (Some(SignalExtendedValueType::IEEEfloat32Bit | SignalExtendedValueType::IEEEdouble64bit), _) => {
                Kind::Float
            }
            (_, ValueType::Signed) => Kind::Signed,
            (_, ValueType::Unsigned) => Kind::Unsigned,
        };
        let is_float = kind == Kind::Float;
        if !(1..=64).contains(&bits.size) || (is_float && !matches!(bits.size, 32 | 64)) {
            return Err(DatabaseError::Width(name.to_owned()));
        }
        if bits.last_byte() >= *found.message_size() {
            let (signal, bytes) = (name.to_owned(), *found.message_size());
            return Err(DatabaseError::Beyond { signal, bytes, start: bits.start, size: bits.size });
        }
        if let Some(found) = self.misnumbered.get(message).copied() {
            return Err(DatabaseError::Identifier { message: message.to_owned(), found });
        }
        let switch =
            || self.dbc.message_multiplexor_switch(*found.message_id()).ok().flatten().map(self::bits);
        let only_if = match signal.multiplexer_indicator() {
            MultiplexIndicator::MultiplexedSignal(value)
            | MultiplexIndicator::MultiplexorAndMultiplexedSignal(value) => {
                switch().map(|switch| (switch, *value))
            }
            MultiplexIndicator::Multiplexor | MultiplexIndicator::Plain => None,
        };
        let named = self.dbc.value_descriptions_for_signal(*found.message_id(), signal.name());
        let names = named
            .unwrap_or_default()
            .iter()
            .map(|value| (*value.a() * signal.factor() + signal.offset(), value.b().clone()));
        let address = self.address(*found.message_id());
        let knows_missing = matches!(address, Address::Group(_)) && !is_float;
        Ok(Field {
            address,
            bits,
            scale: *signal.factor(),
            offset: *signal.offset(),
            kind,
            only_if,
            knows_missing,
            largest_raw: largest_raw(bits.size).filter(|raw| {
                // A file that lets a number reach farther uses all of its codes.
                let largest = *raw as f64 * signal.factor() + signal.offset();
                let is_largest = (signal.max() - largest).abs() < signal.factor().abs() / 2.0;
                knows_missing && kind == Kind::Unsigned && is_largest
            }),
            names: names.collect(),
            unit: signal.unit().clone(),
        })
    }

    /// How a message is told from others: by its parameter group where the file says that it is one of J1939.
    fn address(&self, id: MessageId) -> Address {
        let id_of = match id {
            MessageId::Standard(id) => return Address::Id(CanId::Standard(id)),
            MessageId::Extended(bits) => CanId::Extended(bits & 0x1FFF_FFFF),
        };
        let is_j1939 = self.dbc.attribute_values().iter().any(|value| {
            let AttributeValuedForObjectType::MessageDefinitionAttributeValue(of, Some(format)) =
                value.attribute_value()
            else {
                return false;
            };
            *of == id && value.attribute_name() == "VFrameFormat" && is_three(format)
        });
        match J1939Id::of(id_of).filter(|_| is_j1939) {
            Some(id) => Address::Group(id.pgn),
            None => Address::Id(id_of),
        }
    }
}

/// The messages of the text whose identifier no frame has: 29 bits without the bit that marks them.
fn misnumbered(text: &str) -> BTreeMap<String, u32> {
    let message = |line: &str| {
        let mut words = line.trim_start().strip_prefix("BO_ ")?.split_whitespace();
        let id = words.next()?.parse::<u32>().ok().filter(|id| id & 0x8000_0000 == 0 && *id > 0x7FF)?;
        Some((words.next()?.trim_end_matches(':').to_owned(), id))
    };
    text.lines().filter_map(message).collect()
}

/// The number of `J1939PG` among the frame formats.
fn is_three(value: &AttributeValue) -> bool {
    match value {
        AttributeValue::AttributeValueU64(value) => *value == 3,
        AttributeValue::AttributeValueI64(value) => *value == 3,
        AttributeValue::AttributeValueF64(value) => *value == 3.0,
        AttributeValue::AttributeValueCharString(value) => value == "J1939PG",
    }
}

fn bits(signal: &can_dbc::Signal) -> Bits {
    let big_endian = *signal.byte_order() == ByteOrder::BigEndian;
    Bits { start: *signal.start_bit(), size: *signal.signal_size(), big_endian }
}

/// The text with its last line ended, behind as many lines as there are sections in the second place: those that the reader wants, and other readers do without.
fn completed(text: &str) -> (String, usize) {
    let is_missing = |section: &str| !text.lines().any(|line| line.trim_start().starts_with(section));
    let sections = [("VERSION", "VERSION \"\"\n"), ("NS_", "NS_ :\n")];
    let added = sections.into_iter().filter(|(section, _)| is_missing(section)).map(|(_, empty)| empty);
    let added: Vec<&str> = added.collect();
    (format!("{}{text}\n", added.concat()), added.len())
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "VERSION \"\"\n\nNS_ :\n\nBS_:\n\nBU_: A\n\n\
        BO_ 291 Plain: 8 A\n SG_ Low : 4|12@1+ (0.5,-1) [0|0] \"m\" A\n SG_ High : 7|16@0- (1,0) [0|0] \"\" A\n\
        \nBO_ 2566852736 Nozzles: 8 A\n SG_ Section1 : 0|2@1+ (1,0) [0|3] \"\" A\n SG_ Step : 8|8@1+ (1,0) [0|255] \"\" A\n\
        \nBO_ 292 Many: 8 A\n SG_ Which M : 0|8@1+ (1,0) [0|255] \"\" A\n SG_ First m1 : 8|8@1+ (1,0) [0|255] \"\" A\n SG_ Second m2 : 8|8@1+ (1,0) [0|255] \"\" A\n\
        \nBA_DEF_ BO_ \"VFrameFormat\" ENUM \"StandardCAN\",\"ExtendedCAN\",\"reserved\",\"J1939PG\";\n\
        BA_ \"VFrameFormat\" BO_ 2566852736 3;\n\nVAL_ 2566852736 Section1 0 \"closed\" 1 \"open\" ;\n";

    #[test]
    fn bits_are_worth_what_the_file_says() {
        let database = Database::read(TEXT).expect("a DBC file");
        let low = database.field("Plain.Low").expect("there");
        // 0xABC in bits 4 to 15, low bit first.
        assert_eq!(low.value(&[0xC0, 0xAB]), Some(f64::from(0xABC) * 0.5 - 1.0));
        assert_eq!(low.value(&[0xC0]), None, "too short");
        let high = database.field("Plain.High").expect("there");
        assert_eq!(high.value(&[0xFF, 0xFE]), Some(-2.0), "high byte first, two's complement");
        assert_eq!(low.address, Address::Id(CanId::Standard(291)));
        assert!(!low.address.fits(CanId::Extended(291)));
    }

    #[test]
    fn a_parameter_group_is_known_from_any_sender_and_can_be_not_available() {
        let database = Database::read(TEXT).expect("a DBC file");
        let section = database.field("Nozzles.Section1").expect("there");
        assert!(
            section.address.fits(CanId::Extended(0x18FF_1021))
                && section.address.fits(CanId::Extended(0x0CFF_1080))
        );
        assert!(!section.address.fits(CanId::Extended(0x18FF_1180)));
        assert_eq!((section.value(&[0b0000_0001]), section.value(&[0b11])), (Some(1.0), None));
        assert_eq!((section.named("open"), section.named("ajar")), (Some(1.0), None));
        assert_eq!(section.names().collect::<Vec<_>>(), ["closed", "open"]);
    }

    #[test]
    fn a_multiplexed_signal_is_there_while_its_switch_says_so() {
        let database = Database::read(TEXT).expect("a DBC file");
        let second = database.field("Many.Second").expect("there");
        assert_eq!((second.value(&[2, 7]), second.value(&[1, 7])), (Some(7.0), None));
    }

    #[test]
    fn frames_and_bits_that_cannot_be_are_refused_where_they_are_asked_for() {
        let unmarked = TEXT.replace("2566852736 Nozzles", "419369088 Nozzles");
        let database = Database::read(&unmarked).expect("a DBC file");
        let why =
            |database: &Database, name: &str| database.field(name).map(drop).expect_err(name).to_string();
        let message = why(&database, "Nozzles.Section1");
        assert!(
            message.contains("`Nozzles`") && message.contains("2566852736 for the frame 0x18FF1080"),
            "{message}"
        );
        assert!(database.field("Plain.Low").is_ok(), "the others are as they were");
        for (place, beyond) in [("4|12@1+", "60|12@1+"), ("4|12@1+", "64|1@1+"), ("7|16@0-", "63|16@0-")] {
            let database = Database::read(&TEXT.replace(place, beyond)).expect("a DBC file");
            let name = if place.ends_with("1+") { "Plain.Low" } else { "Plain.High" };
            let message = why(&database, name);
            assert!(message.contains(name) && message.contains("8 bytes"), "{message}");
        }
        // To the last bit.
        let last = Database::read(&TEXT.replace("4|12@1+", "52|12@1+")).expect("a DBC file");
        assert!(last.field("Plain.Low").is_ok());
    }

    /// J1939 keeps the codes above 250, and those of wider numbers like them, for errors: they are no values in our table, whoever reads it.
    #[test]
    fn codes_above_the_largest_value_are_none() {
        let database = Database::read(&crate::dbc()).expect("ours");
        let mut looked_at = 0;
        for message in crate::pgn::MESSAGES.iter().filter(|message| message.len <= 8) {
            for signal in message.signals.iter().filter(|signal| !signal.signed && signal.bits == 8) {
                let name = format!("{}.{}", message.name, signal.name);
                let fields = [Field::of_ours(message.name, signal.name), database.field(&name).ok()];
                for field in fields.map(|field| field.expect(&name)) {
                    let known: Vec<u8> =
                        (249..=255).filter(|code| field.value(&[*code; 8]).is_some()).collect();
                    assert_eq!(known, [249, 250], "{name}");
                    looked_at += 1;
                }
            }
        }
        assert!(looked_at > 20, "{looked_at}");
    }

    #[test]
    fn our_own_table_is_read_as_it_was_written() {
        let database = Database::read(&crate::dbc()).expect("ours");
        for message in crate::pgn::MESSAGES.iter().filter(|message| message.len <= 8) {
            let raw: Vec<Option<f64>> = message
                .signals
                .iter()
                .map(|signal| {
                    Some(((signal.raw_min() + signal.raw_max()) / 3) as f64 * signal.scale + signal.offset)
                })
                .collect();
            let bytes = message.encode(&raw);
            for (signal, expected) in message.signals.iter().zip(message.decode(bytes.bytes())) {
                let name = format!("{}.{}", message.name, signal.name);
                let ours = Field::of_ours(message.name, signal.name);
                assert_eq!(Some(database.field(&name).expect(&name)), ours, "as the table has it");
                let found = database.field(&name).expect(&name).value(bytes.bytes());
                // An all-ones choice is a value of ours.
                if signal.names.is_empty() {
                    let near = |(a, b): (f64, f64)| (a - b).abs() <= 1e-9 * a.abs().max(1.0);
                    assert!(found.zip(expected).is_some_and(near), "{name}: {found:?} {expected:?}");
                }
            }
        }
    }

    #[test]
    fn what_is_not_there_is_named_with_what_is() {
        let database = Database::read(TEXT).expect("a DBC file");
        let why = |name: &str| database.field(name).map(|_| ()).expect_err("there is none").to_string();
        assert_eq!(why("Nozzles.Sektion1"), "there is no signal `Sektion1`; did you mean `Section1`?");
        assert!(why("Nozles.Section1").contains("`Nozzles`"), "{}", why("Nozles.Section1"));
        assert_eq!(why("Section1"), "expected MESSAGE.SIGNAL, found `Section1`");
        let wrong = TEXT.replace("SG_ High : 7|16@0-", "SG_ High : seven@0-");
        let error = Database::read(&wrong).map(|_| ()).expect_err("no DBC file");
        assert!(matches!(&error, DatabaseError::Text { line, .. } if (9..=13).contains(line)), "{error}");
        assert!(Database::read(TEXT.trim_end()).is_ok(), "without an end of the last line");
        assert!(Database::read("").is_err());
        let hello = Database::read("hello").map(drop).expect_err("no DBC file");
        assert_eq!(hello.to_string(), "line 1: expected a DBC file, found `hello`");
    }

    #[test]
    fn sections_that_other_readers_do_without_may_be_missing() {
        for missing in [
            &["VERSION \"\"\n"][..],
            &["NS_ :\n"],
            &["BS_:\n"],
            &["BU_: A\n"],
            &["VERSION \"\"\n", "NS_ :\n", "BS_:\n", "BU_: A\n"],
        ] {
            let text = missing.iter().fold(TEXT.to_owned(), |text, section| text.replace(section, ""));
            let database = Database::read(&text).unwrap_or_else(|why| panic!("without {missing:?}: {why}"));
            assert!(
                database.field("Plain.Low").is_ok() && database.field("Many.Second").is_ok(),
                "{missing:?}"
            );
            // What is wrong is still wrong, on its line.
            let wrong = text.replace("SG_ Low : 4|12@1+", "SG_ Low : four@1+");
            let line = wrong.lines().position(|line| line.contains("four")).expect("there") + 1;
            let told = Database::read(&wrong).map(drop).expect_err("no DBC file");
            assert!(
                matches!(&told, DatabaseError::Text { line: at, .. } if at.abs_diff(line) <= 2),
                "{told}, in line {line}"
            );
        }
    }
}
