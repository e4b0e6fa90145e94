//! The machine behind a client: what its sections do when they are told something, as its own sensors see it.

use std::fmt::Debug;
use std::time::Duration;

use rowscan_protocol::time::SimTime;

use crate::isobus::implement::Implement;

/// A section is told to open or close.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SectionOrder {
    /// When.
    pub at: SimTime,
    /// The section's number.
    pub number: u16,
    /// Whether it shall be open.
    pub is_open: bool,
}

/// What a machine does.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Seen {
    /// Whether each section sprays, in the order of their numbers.
    pub open: Vec<bool>,
    /// What all of them give, litres a minute.
    pub flow_l_min: f64,
    /// What is left in the tank, ml; none where that is not known.
    pub tank_ml: Option<i32>,
}

/// A machine behind a client.
pub trait Machine: Debug + Send + Sync {
    /// A section is told to open or close.
    fn tell(&mut self, order: &SectionOrder);

    /// What it does at `at`; looks come in the order of time.
    fn look(&mut self, at: SimTime) -> Seen;

    /// When it is to be looked at again.
    fn next(&self) -> Option<SimTime>;
}

/// One section's valve.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Valve {
    told: bool,
    open: bool,
    /// When it does what it was told.
    due: Option<SimTime>,
}

/// A machine on which nothing goes wrong: its valves have the implement's dead times, and nominal flow.
#[derive(Clone, Debug)]
pub(super) struct DeadTimes {
    implement: Implement,
    valves: Vec<Valve>,
    /// What was sprayed up to an instant, litres.
    sprayed: (SimTime, f64),
}

impl DeadTimes {
    pub(super) fn new(implement: Implement) -> Self {
        let valves = vec![Valve { told: false, open: false, due: None }; implement.sections.len()];
        Self { implement, valves, sprayed: (SimTime::ZERO, 0.0) }
    }

    /// Counts what has been sprayed up to `at`.
    fn count(&mut self, at: SimTime) {
        let (from, litres) = self.sprayed;
        let s = at.as_secs_f64() - from.as_secs_f64();
        self.sprayed = (at.max(from), litres + self.flow_l_min() / 60.0 * s.max(0.0));
    }

    fn flow_l_min(&self) -> f64 {
        let open = self.implement.sections.iter().zip(&self.valves).filter(|(_, valve)| valve.open);
        open.map(|(section, _)| section.flow_l_min).sum()
    }
}

impl Machine for DeadTimes {
    fn tell(&mut self, order: &SectionOrder) {
        self.look(order.at);
        let Self { implement, valves, .. } = self;
        let own = valves.iter_mut().zip(&implement.sections);
        for (valve, _) in own.filter(|(_, section)| section.number == order.number) {
            let ms = if order.is_open { implement.on_ms } else { implement.off_ms };
            let delay = Duration::from_millis(u64::try_from(ms).unwrap_or(0));
            // A pulse that is over before its valve has moved leaves it where it is.
            valve.due = (valve.open != order.is_open).then_some(order.at + delay);
            valve.told = order.is_open;
        }
    }

    fn look(&mut self, at: SimTime) -> Seen {
        while let Some(due) = self.next().filter(|due| *due <= at) {
            self.count(due);
            for valve in self.valves.iter_mut().filter(|valve| valve.due == Some(due)) {
                (valve.open, valve.due) = (valve.told, None);
            }
        }
        self.count(at);
        let left_ml = |tank_ml: i32| (f64::from(tank_ml) - 1000.0 * self.sprayed.1).max(0.0).round() as i32;
        Seen {
            open: self.valves.iter().map(|valve| valve.open).collect(),
            flow_l_min: self.flow_l_min(),
            tank_ml: self.implement.tank_ml.map(left_ml),
        }
    }

    fn next(&self) -> Option<SimTime> {
        self.valves.iter().filter_map(|valve| valve.due).min()
    }
}
