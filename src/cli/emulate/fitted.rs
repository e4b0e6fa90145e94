//! The scanners of the rig that are emulated.

use rowscan_emulator::{LineWatch, SeenScanner};
use rowscan_faults::{Language, Medium, StreamFaults};
use rowscan_protocol::model::AnyModel;

use super::super::faulting::Faulting;
use super::running::Running;

/// A scanner of the rig with its model.
pub(super) struct Fitted {
    /// Number in the rig, from 0.
    pub(super) index: usize,
    pub(super) model: AnyModel,
}

impl Fitted {
    /// What its stream is called, where it is one of several.
    pub(super) fn stream(&self, of: usize) -> Option<String> {
        (of > 1).then(|| format!("scanner{}", self.index))
    }

    /// Its part of the faults, if there are any.
    pub(super) fn faults(&self, faulting: Option<&Faulting>, on_a_line: bool) -> Option<StreamFaults> {
        let (medium, language) = match self.model {
            AnyModel::Cola(_) if !on_a_line => (Medium::Tcp, Language::Cola),
            AnyModel::Cola(_) => (Medium::Wire, Language::Cola),
            AnyModel::Lms2xx(_) => (Medium::Wire, Language::Lms2xx),
        };
        Some(faulting?.control().stream(&self.name(), medium, language))
    }

    /// The same on the page.
    pub(super) fn seen(&self, running: &Running, lines: LineWatch) -> SeenScanner {
        let counting = running.counts();
        SeenScanner { name: self.name(), number: self.index, model: self.model, lines, counting }
    }

    /// What faults and state call it.
    pub(super) fn name(&self) -> String {
        format!("scanner{}", self.index)
    }
}

/// The flags that tell an estimate which scanners these are; models that differ are the rig's own.
pub(super) fn which(scanners: &[Fitted]) -> String {
    let mut flags = String::new();
    if let Some(first) = scanners.first()
        && scanners.iter().all(|fitted| fitted.model.name() == first.model.name())
    {
        flags += &format!(" --model {}", first.model.name());
    }
    if scanners.iter().enumerate().any(|(place, fitted)| fitted.index != place) {
        scanners.iter().for_each(|fitted| flags += &format!(" --scanner {}", fitted.index));
    }
    flags
}
