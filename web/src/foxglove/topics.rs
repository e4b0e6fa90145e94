//! What there is to subscribe to, and the messages of each.

use std::sync::Arc;

use crate::{FixGauge, Metre, TractorGauge};
use foxglove::{ChannelBuilder, Context, FoxgloveError, PartialMetadata, RawChannel, Schema};
use rowscan_recording::foxglove as messages;
use serde_json::{Map, Value, json};

use super::frames::{self, Placed};

/// The tractor in numbers.
const TRACTOR: messages::Schema = messages::Schema {
    topic: "tractor",
    name: "rowscan.Tractor",
    text: include_str!("schemas/Tractor.json"),
    language: messages::Language::Json,
};
/// A metre of the row, as measured.
const CANOPY: messages::Schema = messages::Schema {
    topic: "canopy",
    name: "rowscan.Canopy",
    text: include_str!("schemas/Canopy.json"),
    language: messages::Language::Json,
};

/// One topic.
#[derive(Debug)]
pub(crate) struct Topic(Arc<RawChannel>);

impl Topic {
    fn of(context: &Arc<Context>, path: String, schema: messages::Schema) -> Result<Self, FoxgloveError> {
        let described = Schema::new(schema.name, schema.language.of_schema(), schema.text.as_bytes());
        let channel = ChannelBuilder::new(path)
            .context(context)
            .message_encoding(schema.language.of_messages())
            .schema(described);
        Ok(Self(channel.build_raw()?))
    }

    /// Sends what `message` makes, if anybody wants it.
    pub(crate) fn send(&self, at_ns: u64, message: impl FnOnce() -> Vec<u8>) {
        if self.0.has_sinks() {
            self.0.log_with_meta(&message(), PartialMetadata { log_time: Some(at_ns) });
        }
    }
}

/// The topics of a scanner.
#[derive(Debug)]
pub(crate) struct ScannerTopics {
    pub(crate) name: String,
    pub(crate) scan: Topic,
    pub(crate) points: Topic,
    pub(crate) canopy: Topic,
}

impl ScannerTopics {
    pub(crate) fn of(context: &Arc<Context>, name: &str) -> Result<Self, FoxgloveError> {
        let topic =
            |schema: messages::Schema| Topic::of(context, format!("/{name}/{}", schema.topic), schema);
        Ok(Self {
            name: name.to_owned(),
            scan: topic(messages::LASER_SCAN)?,
            points: topic(messages::POINT_CLOUD)?,
            canopy: topic(CANOPY)?,
        })
    }
}

/// The topics that all scanners share.
#[derive(Debug)]
pub(crate) struct SharedTopics {
    pub(crate) frames: Topic,
    pub(crate) tractor: Topic,
    pub(crate) fix: Topic,
}

impl SharedTopics {
    pub(crate) fn of(context: &Arc<Context>) -> Result<Self, FoxgloveError> {
        let topic = |schema: messages::Schema| Topic::of(context, format!("/{}", schema.topic), schema);
        Ok(Self {
            frames: topic(messages::FRAME_TRANSFORM)?,
            tractor: topic(TRACTOR)?,
            fix: topic(messages::LOCATION_FIX)?,
        })
    }
}

/// Where a frame is in the scene's.
pub(crate) fn frame(at_ns: u64, name: &str, placed: Placed) -> Vec<u8> {
    messages::frame_transform(at_ns, (frames::SCENE, name), placed.translation_m, placed.rotation)
}

/// The tractor's antenna.
pub(crate) fn fix(at_ns: u64, fix: &FixGauge) -> Vec<u8> {
    let FixGauge { latitude_deg, longitude_deg, altitude_m } = *fix;
    messages::location_fix(at_ns, frames::TRACTOR, &messages::Fix { latitude_deg, longitude_deg, altitude_m })
}

/// The tractor in numbers.
pub(crate) fn tractor(at_ns: u64, gauge: &TractorGauge) -> Vec<u8> {
    message(at_ns, json!({ "way_m": gauge.way_m }), json!(gauge.speeds))
}

/// A metre of the row.
pub(crate) fn canopy(at_ns: u64, metre: &Metre) -> Vec<u8> {
    message(at_ns, json!({}), json!(metre))
}

/// What is not known is left out: a plot has a gap there.
fn message(at_ns: u64, first: Value, rest: Value) -> Vec<u8> {
    let mut all = Map::from_iter([("timestamp".to_owned(), messages::timestamp(at_ns))]);
    for part in [first, rest] {
        if let Value::Object(keys) = part {
            all.extend(keys.into_iter().filter(|(_, value)| !value.is_null()));
        }
    }
    Value::from(all).to_string().into_bytes()
}
