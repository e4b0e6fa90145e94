//! The states of all streams, for `GET /state`.

use std::sync::Arc;

use rowscan_control::StateOf;
use rowscan_emulator::CountReader;
use serde_json::{Map, json};

use super::events::Counted;

/// Tells what each scanner has done, by the streams' names.
pub(super) fn state_of(streams: impl IntoIterator<Item = (String, CountReader)>) -> StateOf {
    let streams: Vec<(String, CountReader)> = streams.into_iter().collect();
    Arc::new(move || {
        let told = |(name, counts): &(String, CountReader)| {
            (name.clone(), json!(counts.counts().map(Counted::from)))
        };
        streams.iter().map(told).collect::<Map<_, _>>().into()
    })
}
