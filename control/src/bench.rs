//! What is controlled.

use std::fmt;
use std::sync::Arc;

use rowscan_faults::FaultControl;
use serde_json::{Map, Value, json};

use crate::log::Log;
use crate::time::Time;
use crate::toxics::Toxics;

/// Tells the state of one part of the bench, at once.
pub type StateOf = Arc<dyn Fn() -> Value + Send + Sync>;

/// A bench that runs. Clones share it.
#[derive(Clone)]
pub struct Bench {
    pub(crate) faults: FaultControl,
    pub(crate) time: Arc<dyn Time>,
    pub(crate) log: Log,
    /// What `GET /state` tells beside clock and faults, by key.
    pub(crate) parts: Arc<Vec<(String, StateOf)>>,
    pub(crate) toxics: Toxics,
}

impl Bench {
    /// A bench of these parts. `parts` tell their state under their names.
    pub fn new(faults: FaultControl, time: Arc<dyn Time>, log: Log, parts: Vec<(String, StateOf)>) -> Self {
        Self { faults, time, log, parts: Arc::new(parts), toxics: Toxics::default() }
    }
}

impl fmt::Debug for Bench {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Bench").field("faults", &self.faults).finish_non_exhaustive()
    }
}

impl Bench {
    /// What `GET /state` tells: clock, faults, and each part under its name.
    pub fn state(&self) -> Map<String, Value> {
        let mut all = Map::new();
        all.insert("clock".to_owned(), json!(self.time.state()));
        all.insert("faults".to_owned(), json!(self.faults.list()));
        for (name, tell) in self.parts.iter() {
            all.insert(name.clone(), tell());
        }
        all
    }

    /// Keeps in the log that somebody asked for something.
    pub(crate) fn note(&self, what: &'static str, order: &Value) {
        let at_s = self.time.state().now_s;
        self.log.keep(&serde_json::json!({ "event": "control", "what": what, "at_s": at_s, "order": order }));
    }
}
