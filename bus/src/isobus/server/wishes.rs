//! What a task controller wants of its clients, as messages to one of them.

use crate::isobus::ddi::{self, Work};
use crate::isobus::pool::{ElementKind, Pool, property, trigger};
use crate::isobus::process_data::{ProcessData, command};

/// Between two values that come by time, ms.
const INTERVAL_MS: i32 = 1000;

/// What is wanted of every client.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Wishes {
    /// Litres per hectare; none where no rate is set.
    pub rate_l_ha: Option<f64>,
    /// Sections that shall be open, by their places from 0; those beyond are shut.
    pub sections: Vec<bool>,
}

impl Wishes {
    /// The condensed word `word` of a boom with so many sections.
    fn word(&self, word: u16, sections: usize) -> i32 {
        let first = usize::from(word * ddi::SECTIONS);
        let open = |place: usize| self.sections.get(place).copied().unwrap_or(false);
        ddi::condensed((first..sections.max(first)).map(|place| Work::of(open(place))))
    }

    /// The setpoints of a pool's elements that can be set. The sections of a pool are taken in the order of their elements' numbers; where several elements
    /// take condensed setpoints, all are told the same (assumed).
    pub(super) fn setpoints(&self, pool: &Pool) -> Vec<ProcessData> {
        let sections = pool.elements(ElementKind::Section).len();
        let settable = pool.process_data().into_iter().filter(|known| known.2 & property::SETTABLE != 0);
        let mut messages = Vec::new();
        for (element, ddi, ..) in settable {
            let value = match (ddi, ddi::word(ddi, ddi::SETPOINT_SECTIONS)) {
                (_, Some(word)) => Some(self.word(word, sections)),
                (ddi::SECTION_CONTROL, _) => Some(1),
                (ddi::SETPOINT_RATE, _) => self.rate_l_ha.map(ddi::rate),
                _ => None,
            };
            let set = |value| ProcessData { command: command::VALUE, element, ddi, value };
            messages.extend(value.map(set));
        }
        // Section control is switched on before sections are set.
        messages.sort_by_key(|message| message.ddi != ddi::SECTION_CONTROL);
        messages
    }
}

/// What a client shall tell by itself: its sections on every change, the rate by time.
pub(super) fn triggers(pool: &Pool) -> Vec<ProcessData> {
    let known = pool.process_data().into_iter();
    let asked = known.filter_map(|(element, ddi, _, triggers)| {
        let is_state = ddi::word(ddi, ddi::ACTUAL_SECTIONS).is_some() || ddi == ddi::ACTUAL_WORK;
        let (command, value) = match ddi {
            _ if is_state && triggers & trigger::ON_CHANGE != 0 => (command::ON_CHANGE, 1),
            ddi::ACTUAL_RATE if triggers & trigger::TIME != 0 => (command::TIME_INTERVAL, INTERVAL_MS),
            _ => return None,
        };
        Some(ProcessData { command, element, ddi, value })
    });
    asked.collect()
}

/// Asks for what a pool's sections do.
pub(super) fn questions(pool: &Pool) -> Vec<ProcessData> {
    let known = pool.process_data().into_iter();
    let states = known.filter(|known| ddi::word(known.1, ddi::ACTUAL_SECTIONS).is_some());
    states
        .map(|(element, ddi, ..)| ProcessData { command: command::REQUEST, element, ddi, value: -1 })
        .collect()
}
