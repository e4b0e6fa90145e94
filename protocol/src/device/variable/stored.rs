//! The values that clients have set.

use alloc::vec::Vec;

use super::shape::Value;
use super::table::{Source, VARIABLES, Variable};

/// One value a stored row of the table.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(in crate::device) struct Stored(Vec<(&'static str, Vec<Value>)>);

impl Stored {
    /// As delivered.
    pub(in crate::device) fn new() -> Self {
        let stored = |variable: &'static Variable| {
            let Source::Stored(delivered) = variable.source else { return None };
            let values = variable.parts.iter().zip(delivered).map(|(part, number)| part.kind.value(*number));
            Some((variable.name, values.collect()))
        };
        Self(VARIABLES.iter().filter_map(stored).collect())
    }

    /// The value of a stored variable; empty of any other.
    pub(in crate::device) fn of(&self, variable: &Variable) -> &[Value] {
        self.named(variable.name)
    }

    /// The same by name.
    pub(in crate::device) fn named(&self, name: &str) -> &[Value] {
        let found = self.0.iter().find(|(known, _)| *known == name);
        found.map_or(&[], |(_, value)| value.as_slice())
    }

    /// A part of it that is a number; 0 where there is none.
    pub(in crate::device) fn number(&self, name: &str, part: usize) -> i64 {
        self.named(name).get(part).map_or(0, Value::number)
    }

    pub(in crate::device) fn set(&mut self, variable: &Variable, value: Vec<Value>) {
        self.set_named(variable.name, value);
    }

    pub(in crate::device) fn set_named(&mut self, name: &str, value: Vec<Value>) {
        if let Some((_, stored)) = self.0.iter_mut().find(|(known, _)| *known == name) {
            *stored = value;
        }
    }
}
