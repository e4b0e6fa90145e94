//! What can happen in a scenario, by the names that windows of expectations use.

use std::collections::{BTreeMap, BTreeSet};

use rowscan_settings::suggestion;

use super::{Expect, Scenario};
use crate::fault::ScenarioFault;
use crate::journal::{END, row_place};
use crate::what::Kind;

/// Events of a device.
const OF_DEVICES: &[&str] = &["connected", "disconnected", "first_scan", "telegram_bad"];
/// Events of a child.
const OF_RUNS: &[&str] = &["started", "ready", "exited"];
/// Events of a fault beside its begin, which has its id.
const OF_FAULTS: &[&str] = &["act", "skipped", "end", "recovered"];
/// Events of a sweep or a pause: neither acts on a single telegram.
const OF_OTHERS: &[&str] = &["end", "recovered"];

/// Everything that can happen in a scenario.
#[derive(Debug)]
pub(super) struct Events {
    names: BTreeSet<String>,
    /// Names that mean something already, with what.
    taken: BTreeMap<String, String>,
}

impl Events {
    /// Those of `scenario`.
    ///
    /// # Errors
    /// A child or a fault whose events could not be told from others.
    pub(super) fn of(scenario: &Scenario) -> Result<Self, String> {
        let mut events = Self { names: BTreeSet::new(), taken: BTreeMap::new() };
        events.names.insert(END.to_owned());
        events.taken.insert(END.to_owned(), "the end of the run".to_owned());
        for device in &scenario.devices {
            events.owned(&device.id, "device", OF_DEVICES)?;
        }
        for run in &scenario.runs {
            events.owned(&run.id, "run", OF_RUNS)?;
        }
        for fault in &scenario.faults {
            let Some(id) = fault.id() else { continue };
            let own = if matches!(fault, ScenarioFault::Rig(_)) { OF_FAULTS } else { OF_OTHERS };
            events.owned(id, "fault", own)?;
            events.names.insert(id.to_owned());
        }
        Ok(events)
    }

    /// Adds the events of the `kind` called `id`.
    fn owned(&mut self, id: &str, kind: &str, own: &[&str]) -> Result<(), String> {
        let names: Vec<String> = own.iter().map(|event| format!("{id}.{event}")).collect();
        for name in names.iter().map(String::as_str).chain([id]) {
            if let Some(known) = self.taken.insert(name.to_owned(), format!("the {kind} `{id}`")) {
                return Err(format!(
                    "the {kind} `{id}`: `{name}` is already the name of {known} or of what happens to it; choose another `id`"
                ));
            }
        }
        self.names.extend(names);
        Ok(())
    }

    /// Refuses an expectation that names what cannot happen here.
    pub(super) fn check(&self, expect: &Expect, faults: &[ScenarioFault]) -> Result<(), String> {
        let between =
            expect.between_events.iter().flat_map(|(from, to)| [("between", from), ("between", to)]);
        // Counts go from event to event, in their order.
        let may_be_place = !matches!(expect.what.kind, Kind::Count(_));
        for (key, name) in expect.after.iter().map(|after| ("after", after)).chain(between) {
            if key == "after" && may_be_place && row_place(name).is_some() {
                continue;
            }
            if !self.names.contains(name) {
                let known: Vec<&str> = self.names.iter().map(String::as_str).collect();
                return Err(format!("`{key}`: no event is called `{name}` here{}", suggestion(name, &known)));
            }
        }
        let known: Vec<&str> = faults.iter().filter_map(ScenarioFault::id).collect();
        match &expect.on {
            Some(of) if expect.what.kind == Kind::FaultActs && !known.contains(&of.as_str()) => {
                match known.len() {
                    0 => Err(format!("`of`: there is no fault `{of}`; add a [[fault]] with that `id`")),
                    _ => Err(format!("`of`: there is no fault `{of}`{}", suggestion(of, &known))),
                }
            }
            _ => Ok(()),
        }
    }
}
