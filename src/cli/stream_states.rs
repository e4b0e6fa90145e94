//! The states of all streams, for `GET /state`.

use std::sync::Arc;

use rowscan_control::StateOf;
use rowscan_emulator::Counting;
use serde_json::{Map, Value, json};

use super::events::Counted;

/// Tells what each scanner has done, by the streams' names.
pub(super) fn state_of(streams: impl IntoIterator<Item = (String, Counting)>) -> StateOf {
    let streams: Vec<(String, Counting)> = streams.into_iter().collect();
    Arc::new(move || {
        streams.iter().map(|(name, counting)| (name.clone(), told(counting))).collect::<Map<_, _>>().into()
    })
}

fn told(counting: &Counting) -> Value {
    match counting {
        Counting::Cola(counter) => json!(counter.counts().as_ref().map(Counted::cola)),
        Counting::Lms2xx(counts) => json!(Counted::lms2xx(counts())),
    }
}
