//! What a value of an element of a task controller's client is expected to be.

use rowscan_bus::isobus::ddi::{self, Work};
use serde_json::Value;

/// What stands for "what the task controller has set".
const AS_SETPOINT: &str = "as_setpoint";
/// The highest number of an element.
const LAST_ELEMENT: u32 = 4095;

/// A value that is expected.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ProcessValue {
    pub(crate) element: u16,
    pub(crate) ddi: u16,
    /// What it must be; what was set last where none.
    pub(crate) number: Option<i32>,
}

impl ProcessValue {
    /// Of these keys.
    pub(crate) fn new(
        (element, ddi): (Option<u32>, Option<u32>),
        value: Option<&Value>,
    ) -> Result<Self, String> {
        let (Some(element), Some(ddi), Some(value)) = (element, ddi, value) else {
            return Err("`ddi` expects nothing yet; add `element`, `ddi` and `value`".to_owned());
        };
        let number = match value {
            Value::String(word) if word == AS_SETPOINT => None,
            other => Some(other.as_i64().and_then(of_32_bits).ok_or_else(|| {
                format!("`value`: expected a whole number of 32 bits or \"{AS_SETPOINT}\", found {other}")
            })?),
        };
        let small = |key: &str, found: u32, last: u32| {
            u16::try_from(found)
                .ok()
                .filter(|_| found <= last)
                .ok_or_else(|| format!("`{key}`: expected 0 to {last}, found {found}"))
        };
        let value = Self {
            element: small("element", element, LAST_ELEMENT)?,
            ddi: small("ddi", ddi, u16::MAX.into())?,
            number,
        };
        if number.is_none() && value.setpoint().is_none() {
            return Err(format!(
                "`value`: DDI {} has no setpoint that is known here; expected a whole number",
                value.ddi
            ));
        }
        Ok(value)
    }

    /// In a few words.
    pub(crate) fn title(self) -> String {
        let value = self.number.map_or(AS_SETPOINT.to_owned(), |number| number.to_string());
        format!(" {} of element {}: {value}", self.ddi, self.element)
    }

    /// The DDI by which it is set.
    pub(crate) fn setpoint(self) -> Option<u16> {
        match (self.ddi, ddi::word(self.ddi, ddi::ACTUAL_SECTIONS)) {
            (_, Some(word)) => Some(ddi::SETPOINT_SECTIONS + word),
            (ddi::ACTUAL_WORK, _) => Some(ddi::SETPOINT_WORK),
            (ddi::ACTUAL_RATE, _) => Some(ddi::SETPOINT_RATE),
            // Those that are set themselves.
            (
                ddi::SETPOINT_WORK | ddi::SETPOINT_RATE | ddi::SECTION_CONTROL | ddi::PRESCRIPTION_CONTROL,
                _,
            ) => Some(self.ddi),
            _ => ddi::word(self.ddi, ddi::SETPOINT_SECTIONS).map(|_| self.ddi),
        }
    }

    /// True if the state is as it must be.
    pub(crate) fn is_so(self, told: Option<i32>, set: Option<i32>) -> bool {
        match (self.number, told, set) {
            (Some(number), told, _) => told == Some(number),
            (None, Some(told), Some(set)) if ddi::word(self.ddi, ddi::ACTUAL_SECTIONS).is_some() => {
                let pairs = ddi::sections(told).into_iter().zip(ddi::sections(set));
                // A section that there is not is as shut as it was set.
                pairs.into_iter().all(|(told, set)| {
                    set.is_on().is_none() || told == set || (told, set) == (Work::Absent, Work::Off)
                })
            }
            (None, told, set) => told.is_some() && told == set,
        }
    }
}

/// A number of 32 bits, with a sign or without.
fn of_32_bits(number: i64) -> Option<i32> {
    i32::try_from(number).ok().or_else(|| u32::try_from(number).ok().map(|bits| bits as i32))
}

/// What was set before, with what is set now: a section that is left as it is keeps its state.
pub(crate) fn merged(before: Option<i32>, now: i32, ddi: u16) -> i32 {
    match before.filter(|_| ddi::word(ddi, ddi::SETPOINT_SECTIONS).is_some()) {
        Some(before) => ddi::condensed(
            ddi::sections(before)
                .into_iter()
                .zip(ddi::sections(now))
                .map(|(before, now): (Work, Work)| if now.is_on().is_none() { before } else { now }),
        ),
        None => now,
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::expect_used, reason = "a test fails by panicking")]

    use super::*;

    fn value(ddi: u32, value: Value) -> Result<ProcessValue, String> {
        ProcessValue::new((Some(2), Some(ddi)), Some(&value))
    }

    #[test]
    fn sections_are_as_set_where_they_were_set() {
        let sections = value(161, "as_setpoint".into()).expect("it has a setpoint");
        let word = |bits: u32| Some(bits as i32);
        assert!(sections.is_so(word(0xFFFF_FF11), word(0xFFFF_FF11)));
        // Sections 2 and 4 were left as they were.
        assert!(sections.is_so(word(0xFFFF_FF15), word(0xFFFF_FFDD)));
        assert!(!sections.is_so(word(0xFFFF_FF14), word(0xFFFF_FF11)));
        assert!(!sections.is_so(None, word(0xFFFF_FF11)) && !sections.is_so(word(5), None));
        // A section that there is not is as shut as it was set, and never open.
        assert!(sections.is_so(word(0xFFFF_FF11), word(0x0000_0011)));
        assert!(!sections.is_so(word(0xFFFF_FF11), word(0x0000_0111)));
        for (set, setpoint) in [(1, 1), (2, 1), (141, 289), (160, 160), (161, 290), (162, 291), (290, 290)] {
            assert_eq!(value(set, 1.into()).expect("a number").setpoint(), Some(setpoint), "{set}");
        }
        assert_eq!(
            value(161, 0xFFFF_FF55_u32.into()).expect("without a sign"),
            value(161, (-171).into()).expect("with one")
        );
        // What was set before still holds of them.
        assert_eq!(merged(word(0xFFFF_FF11), 0xFFFF_FFDC_u32 as i32, 290), 0xFFFF_FF10_u32 as i32);
        let width = value(67, 4000.into()).expect("a number");
        assert!(width.is_so(Some(4000), None) && !width.is_so(Some(3999), None) && !width.is_so(None, None));
    }

    #[test]
    fn what_cannot_be_expected_is_refused() {
        for (found, says) in [
            (value(67, "as_setpoint".into()), "DDI 67 has no setpoint"),
            (value(70_000, 1.into()), "`ddi`: expected 0 to 65535, found 70000"),
            (value(161, "open".into()), "expected a whole number of 32 bits or \"as_setpoint\""),
            (value(161, 1.5.into()), "found 1.5"),
            (ProcessValue::new((None, Some(161)), Some(&1.into())), "add `element`"),
            (ProcessValue::new((Some(5000), Some(161)), Some(&1.into())), "`element`: expected 0 to 4095"),
        ] {
            let why = found.expect_err(says);
            assert!(why.contains(says), "{why}");
        }
    }
}
