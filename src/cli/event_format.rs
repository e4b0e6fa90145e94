//! `--format` of commands that serve: what they tell are events, and events are no rows.

use clap::ValueEnum;
use clap::builder::{PossibleValuesParser, TypedValueParser};

use super::Format;

/// Takes every format but CSV.
pub(super) fn parser() -> impl TypedValueParser<Value = Format> {
    let of_events = Format::value_variants().iter().filter(|format| **format != Format::Csv);
    let names = of_events.filter_map(ValueEnum::to_possible_value);
    PossibleValuesParser::new(names).try_map(|name| Format::from_str(&name, false))
}
