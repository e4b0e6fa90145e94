//! Names that stand in tables of the program, read back from files: one that is in no table is refused.

use rowscan_canopy::estimator::name_of;
use rowscan_protocol::model::AnyModel;
use serde::de::Error;
use serde::{Deserialize, Deserializer};

/// A name of a table.
pub(crate) type Name = &'static str;

/// An estimator's.
pub(crate) fn of_estimator<'de, D: Deserializer<'de>>(from: D) -> Result<Name, D::Error> {
    read(from, name_of)
}

/// A scanner model's.
pub(crate) fn of_model<'de, D: Deserializer<'de>>(from: D) -> Result<Name, D::Error> {
    read(from, |name| AnyModel::by_name(name).map(AnyModel::name))
}

/// What hits count, and kinds of beams.
pub(crate) fn of_way<'de, D: Deserializer<'de>>(from: D) -> Result<Name, D::Error> {
    read(from, |name| ["contact", "share", "rays", "eye"].into_iter().find(|known| *known == name))
}

fn read<'de, D: Deserializer<'de>>(from: D, known: impl Fn(&str) -> Option<Name>) -> Result<Name, D::Error> {
    let name = String::deserialize(from)?;
    known(&name).ok_or_else(|| D::Error::custom(format!("unknown name `{name}`")))
}
