//! ISOBUS: process data, working sets, language (ISO 11783-7 and -10), as AgIsoStack++ sends them.

use crate::message::{Message, Signal};

/// What task controllers and their clients say.
pub const PROCESS_DATA: Message = Message {
    name: "ProcessData",
    pgn: 51_968,
    priority: 3,
    period_ms: None,
    len: 8,
    source: 0xFE,
    about: "a value of an element of a device, to one receiver; object pools go by the transport protocol (ISO 11783-10)",
    signals: &[
        Signal::new("ProcessCommand", 0, 4, 1.0, "")
            .about("3 tells or sets a value; docs/sprayer.md has all"),
        Signal::new("Element", 4, 12, 1.0, "")
            .about("of commands 0 and 1 the low four bits say what is meant"),
        Signal::new("Ddi", 16, 16, 1.0, "").about("number in the data dictionary"),
        Signal::new("ProcessValue", 32, 32, 1.0, "").signed().about("in the unit of its DDI"),
    ],
};

/// "I speak for a working set of so many members."
pub const WORKING_SET_MASTER: Message = Message {
    name: "WorkingSetMaster",
    pgn: 65_037,
    priority: 7,
    period_ms: None,
    len: 8,
    source: 0xFE,
    about: "said by a client before it turns to a task controller (ISO 11783-7)",
    signals: &[Signal::new("Members", 0, 8, 1.0, "")],
};

/// The language and units that an operator has chosen.
pub const LANGUAGE: Message = Message {
    name: "LanguageCommand",
    pgn: 65_039,
    priority: 6,
    period_ms: None,
    len: 8,
    source: 0xF7,
    about: "language, formats and units; answered by a task controller (ISO 11783-7)",
    signals: &[
        Signal::new("LanguageCode", 0, 16, 1.0, "").about("two letters"),
        Signal::new("TimeFormat", 20, 2, 1.0, ""),
        Signal::new("DecimalSymbol", 22, 2, 1.0, ""),
        Signal::new("DateFormat", 24, 8, 1.0, ""),
        Signal::new("Units", 32, 16, 1.0, ""),
        Signal::new("CountryCode", 48, 16, 1.0, "").about("two letters"),
    ],
};
