//! GeoJSON, RFC 7946: longitude and latitude of WGS 84, rings counter-clockwise and closed.

use serde_json::{Map, Value, json};

use super::{ATTRIBUTES, LeafMap, MapMetre};
use crate::export::ExportError;

pub(super) fn write(map: &LeafMap) -> Result<Vec<u8>, ExportError> {
    let features: Vec<Value> = map.metres.iter().map(feature).collect();
    Ok(serde_json::to_vec_pretty(&json!({ "type": "FeatureCollection", "features": features }))?)
}

fn feature(metre: &MapMetre) -> Value {
    let [first, ..] = metre.corners;
    let ring: Vec<[f64; 2]> = metre.corners.into_iter().chain([first]).collect();
    let numbers = ATTRIBUTES.iter().zip(metre.values).map(|(name, value)| ((*name).to_owned(), json!(value)));
    let properties: Map<String, Value> =
        [("source".to_owned(), json!(metre.source))].into_iter().chain(numbers).collect();
    json!({ "type": "Feature", "geometry": { "type": "Polygon", "coordinates": [ring] }, "properties": properties })
}
