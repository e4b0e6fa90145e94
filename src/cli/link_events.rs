//! What happens to a scanner's link, told while it happens.

use rowscan_canopy::Warning;
use rowscan_driver::{LinkEvent, LinkEvents, Scanner};
use rowscan_ports::task;
use rowscan_protocol::host::DeviceInfo;
use rowscan_protocol::model::AnyModel;
use tokio::task::JoinSet;

use super::output::say;

/// Tells what happens to a link until it is dropped, and then what is left to tell.
#[derive(Debug)]
pub(super) struct LinkTeller {
    events: LinkEvents,
    /// Stands before what is told, where there are several links.
    name: Option<String>,
    /// The model that the scanner is taken for, if any.
    taken_for: Option<AnyModel>,
    _task: JoinSet<()>,
}

impl LinkTeller {
    /// Of a scanner that is called so, and taken for this model.
    pub(super) fn start(scanner: &Scanner, name: Option<String>, taken_for: Option<AnyModel>) -> Self {
        let (events, mut tasks) = (scanner.link_events(), JoinSet::new());
        let (told, by) = (events.clone(), name.clone());
        tasks.spawn(task(async move {
            loop {
                tell(by.as_deref(), taken_for, &told.next().await);
            }
        }));
        Self { events, name, taken_for, _task: tasks }
    }
}

impl Drop for LinkTeller {
    fn drop(&mut self) {
        while let Some(event) = self.events.take() {
            tell(self.name.as_deref(), self.taken_for, &event);
        }
    }
}

/// A name with its version, which some scanners tell in the name as well.
fn with_version(ident: &str, firmware: &str) -> String {
    match ident.ends_with(firmware) {
        true => ident.to_owned(),
        false => format!("{ident} {firmware}"),
    }
}

fn tell(name: Option<&str>, taken_for: Option<AnyModel>, event: &LinkEvent) {
    let say = |what: std::fmt::Arguments<'_>| match name {
        Some(name) => say(format_args!("{name}: {what}")),
        None => say(what),
    };
    match event {
        LinkEvent::Ready(DeviceInfo { ident, firmware, language }) => {
            say(format_args!("connected: {}, {language}", with_version(ident.trim(), firmware.trim())));
            let found = AnyModel::of_device(ident, firmware);
            if let Some(other) = taken_for.and_then(|taken_for| Warning::other_model(&found, taken_for)) {
                say(format_args!("{other}"));
            }
        }
        LinkEvent::Setting(note) => say(format_args!("the scanner: {note}")),
        LinkEvent::Malformed { fault } => {
            say(format_args!("a scan telegram gives no scan: {fault}; more of this kind are counted"));
        }
        LinkEvent::Lost { cause, pause } => say(format_args!("{cause}; trying again in {pause:?}")),
        // Events that this version does not know.
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_version_is_told_once() {
        assert_eq!(with_version("LMS10x_FieldEval V1.80.2", "V1.80.2"), "LMS10x_FieldEval V1.80.2");
        assert_eq!(with_version("LMS111", "V1.80.2"), "LMS111 V1.80.2");
    }
}
