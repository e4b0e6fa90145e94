//! `what = "ddi"`: a value of an element of a task controller's client, as it was told on a bus.

use std::collections::BTreeSet;
use std::time::Duration;

use rowscan_bus::J1939Id;
use rowscan_bus::isobus::ddi::{self, Work};
use rowscan_bus::isobus::process_data::{ProcessData, command};
use rowscan_bus::pgn::isobus::PROCESS_DATA;
use rowscan_protocol::time::SimTime;
use serde_json::Value;

use crate::judged::{Judged, from_event};
use crate::runner::RunRecord;
use crate::scenario::Expect;

/// What stands for "what the task controller has set".
const AS_SETPOINT: &str = "as_setpoint";
/// The highest number of an element.
const LAST_ELEMENT: u32 = 4095;

/// A value that is expected.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ProcessValue {
    element: u16,
    ddi: u16,
    /// What it must be; what was set last where none.
    number: Option<i32>,
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
            other => Some(other.as_i64().and_then(|number| i32::try_from(number).ok()).ok_or_else(|| {
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
    fn setpoint(self) -> Option<u16> {
        match (self.ddi, ddi::word(self.ddi, ddi::ACTUAL_SECTIONS)) {
            (_, Some(word)) => Some(ddi::SETPOINT_SECTIONS + word),
            (ddi::ACTUAL_WORK, _) => Some(ddi::SETPOINT_WORK),
            (ddi::ACTUAL_RATE, _) => Some(ddi::SETPOINT_RATE),
            _ => None,
        }
    }

    /// True if the state is as it must be.
    fn is_so(self, told: Option<i32>, set: Option<i32>) -> bool {
        match (self.number, told, set) {
            (Some(number), told, _) => told == Some(number),
            (None, Some(told), Some(set)) if ddi::word(self.ddi, ddi::ACTUAL_SECTIONS).is_some() => {
                let pairs = ddi::sections(told).into_iter().zip(ddi::sections(set));
                pairs.into_iter().all(|(told, set)| set.is_on().is_none() || told == set)
            }
            (None, told, set) => told.is_some() && told == set,
        }
    }
}

/// What was set before, with what is set now: a section that is left as it is keeps its state.
fn merged(before: Option<i32>, now: i32, ddi: u16) -> i32 {
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

/// A value that went over a bus.
struct Said {
    at: SimTime,
    /// Told by a client; else set by a task controller.
    is_told: bool,
    data: ProcessData,
}

/// All that was told of a value, and set of its setpoint, in the order of time.
fn said(wanted: ProcessValue, run: &RunRecord) -> Vec<Said> {
    let mut all = Vec::new();
    for bus in run.frames.values() {
        let data = bus.all.iter().filter_map(|carried| {
            let id = J1939Id::of(carried.frame.id).filter(|id| id.pgn == PROCESS_DATA.pgn)?;
            Some((carried.at, id.source, ProcessData::read(carried.frame.data())?))
        });
        // Task controllers are known by their status.
        let status = data.clone().filter(|(.., data)| data.command == command::SERVER_STATUS);
        let servers: BTreeSet<u8> = status.map(|(_, source, _)| source).collect();
        let values = data.filter(|(.., data)| {
            [command::VALUE, command::SET_AND_ACKNOWLEDGE].contains(&data.command)
                && data.element == wanted.element
        });
        all.extend(values.filter_map(|(at, source, data)| {
            let is_told = !servers.contains(&source);
            let ddi = if is_told { Some(wanted.ddi) } else { wanted.setpoint() };
            (ddi == Some(data.ddi)).then_some(Said { at, is_told, data })
        }));
    }
    all.sort_by_key(|said| said.at);
    all
}

/// Judges it.
pub(crate) fn judge(expect: &Expect, run: &RunRecord) -> Result<Judged, String> {
    let wanted = expect.process.ok_or("`ddi` expects nothing yet; add `element`, `ddi` and `value`")?;
    let from = from_event(expect.after.as_ref(), run)?;
    let due = from + Duration::from_secs_f64(expect.within_s.unwrap_or_default());
    let setpoint = wanted.setpoint();
    let said = said(wanted, run);
    let unknown = |what: String| format!("`ddi`: unknown: no {what} in the whole run");
    if !said.iter().any(|said| said.is_told) {
        return Err(unknown(format!("client told DDI {} of element {}", wanted.ddi, wanted.element)));
    }
    if wanted.number.is_none() && said.iter().all(|said| said.is_told) {
        return Err(unknown(format!("task controller set DDI {}", setpoint.unwrap_or_default())));
    }
    let (mut told, mut set, mut first) = (None, None, None);
    let mut rest = said.into_iter().peekable();
    while let Some(Said { at, is_told, data }) = rest.next_if(|said| said.at <= due) {
        if is_told {
            told = Some(data.value);
        } else {
            set = Some(merged(set, data.value, data.ddi));
        }
        // What is said up to the event, or at one instant after it, holds together.
        let is_last = rest.peek().is_none_or(|next| next.at > at.max(from));
        if is_last && wanted.is_so(told, set) {
            first = Some(at.max(from));
            break;
        }
    }
    let words = |value: Option<i32>| value.map_or("nothing".to_owned(), |value| format!("{value:#X}"));
    let s = |at: SimTime| at.as_secs_f64() - from.as_secs_f64();
    Ok(match first {
        Some(at) => {
            Judged::holds(true, format!("ddi{} after {:.3} s", wanted.title(), s(at))).at(at).due(due, at)
        }
        None if due > run.ended => {
            return Err(format!(
                "the run ended at {:.3} s, before `within_s` was over; move `end`",
                run.ended.as_secs_f64()
            ));
        }
        None => Judged::holds(
            false,
            format!(
                "expected ddi{} within {:.3} s, found {} told and {} set",
                wanted.title(),
                s(due),
                words(told),
                words(set)
            ),
        )
        .at(due),
    })
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
