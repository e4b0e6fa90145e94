//! Scans, positions and CAN frames for programs that do not know our streams, as JSON: in Foxglove's schemas where there is one.
//!
//! JSON and not protobuf: the schema stands readable in the file, any JSON parser reads the messages, and no code need be generated. It costs
//! about four times the size, which is why it can be left out; the raw bytes hold everything.

use rowscan_protocol::can::CanFrame;
use rowscan_protocol::scan::{Scan, elevation_deg};
use serde_json::{Value, json};

pub use crate::fix::Fix;
pub use crate::schema::{Language, Schema};

/// A scan: a range a beam.
pub const LASER_SCAN: Schema = json("scan", "foxglove.LaserScan", include_str!("foxglove/LaserScan.json"));
/// A scan: what came back, as points.
pub const POINT_CLOUD: Schema =
    json("points", "foxglove.PointCloud", include_str!("foxglove/PointCloud.json"));
/// A position.
pub const LOCATION_FIX: Schema =
    json("fix", "foxglove.LocationFix", include_str!("foxglove/LocationFix.json"));
/// Where one frame of reference is in another.
pub const FRAME_TRANSFORM: Schema =
    json("tf", "foxglove.FrameTransform", include_str!("foxglove/FrameTransform.json"));
/// Foxglove has no schema of a CAN frame.
pub const CAN_FRAME: Schema = json("frame", "rowscan.CanFrame", include_str!("foxglove/CanFrame.json"));

const fn json(topic: &'static str, name: &'static str, text: &'static str) -> Schema {
    Schema { topic, name, text, language: Language::Json }
}

/// What stands for a beam without an echo: JSON has no infinity, and viewers leave zeros out.
const MISS: f64 = 0.0;

/// 32-bit float, as the schema numbers types.
const FLOAT32: u8 = 7;

/// The scan's frame: x along device angle 0°, y along 90°, in metres; counter-clockwise from above.
pub fn laser_scan(at_ns: u64, frame: &str, scan: &Scan) -> Vec<u8> {
    let beams = scan.beams;
    let angle = |beam: usize| beams.angle_deg(beam).to_radians();
    let first = scan.echoes.first();
    let ranges: Vec<f64> = first.map_or_else(Vec::new, |echo| {
        echo.range_m.iter().map(|range| if range.is_finite() { *range } else { MISS }).collect()
    });
    let intensities = first.map_or(&[][..], |echo| &echo.remission);
    text(&json!({
        "timestamp": timestamp(at_ns),
        "frame_id": frame,
        "pose": tilted(scan.layer_centideg),
        "start_angle": angle(0),
        "end_angle": angle(beams.len().saturating_sub(1)),
        "ranges": ranges,
        "intensities": intensities,
    }))
}

/// Every echo that came back: x, y, z and remission, packed as 32-bit floats.
pub fn point_cloud(at_ns: u64, frame: &str, scan: &Scan) -> Vec<u8> {
    let mut data = Vec::new();
    let (up, ahead) = elevation_deg(scan.layer_centideg).to_radians().sin_cos();
    for echo in &scan.echoes {
        for (beam, range_m) in echo.range_m.iter().enumerate().filter(|(_, range_m)| range_m.is_finite()) {
            let (sin, cos) = scan.beams.angle_deg(beam).to_radians().sin_cos();
            let remission = echo.remission.get(beam).copied().unwrap_or_default();
            let plane_m = range_m * ahead;
            let values =
                [(plane_m * cos) as f32, (plane_m * sin) as f32, (range_m * up) as f32, f32::from(remission)];
            values.iter().for_each(|value| data.extend_from_slice(&value.to_le_bytes()));
        }
    }
    let field = |name: &str, offset: u32| json!({ "name": name, "offset": offset, "type": FLOAT32 });
    text(&json!({
        "timestamp": timestamp(at_ns),
        "frame_id": frame,
        "pose": origin(),
        "point_stride": 16,
        "fields": [field("x", 0), field("y", 4), field("z", 8), field("intensity", 12)],
        "data": base64(&data),
    }))
}

/// A position. How exact it is GGA does not say.
pub fn location_fix(at_ns: u64, frame: &str, fix: &Fix) -> Vec<u8> {
    text(&json!({
        "timestamp": timestamp(at_ns),
        "frame_id": frame,
        "latitude": fix.latitude_deg,
        "longitude": fix.longitude_deg,
        "altitude": fix.altitude_m,
        "position_covariance": ([0.0; 9]),
        "position_covariance_type": 0,
    }))
}

/// Where the origin of `child` is in `parent`, metres, and how it is turned there: x, y, z and w of a unit quaternion.
pub fn frame_transform(
    at_ns: u64,
    (parent, child): (&str, &str),
    [x, y, z]: [f64; 3],
    [i, j, k, w]: [f64; 4],
) -> Vec<u8> {
    text(&json!({
        "timestamp": timestamp(at_ns),
        "parent_frame_id": parent,
        "child_frame_id": child,
        "translation": { "x": x, "y": y, "z": z },
        "rotation": { "x": i, "y": j, "z": k, "w": w },
    }))
}

/// A CAN frame.
pub fn can_frame(at_ns: u64, frame: &CanFrame) -> Vec<u8> {
    text(&json!({
        "timestamp": timestamp(at_ns),
        "id": frame.id.bits(),
        "extended": frame.id.is_extended(),
        "remote": frame.remote,
        "data": frame.data(),
    }))
}

/// A time as the schemas have it.
pub fn timestamp(at_ns: u64) -> Value {
    json!({ "sec": at_ns / 1_000_000_000, "nsec": at_ns % 1_000_000_000 })
}

/// The plane of a layer: turned up about the axis to the right, so that it is exact straight ahead. The points lie on a cone.
fn tilted(layer_centideg: i16) -> Value {
    let (sin, cos) = (elevation_deg(layer_centideg) / 2.0).to_radians().sin_cos();
    json!({
        "position": { "x": 0.0, "y": 0.0, "z": 0.0 },
        "orientation": { "x": sin, "y": 0.0, "z": 0.0, "w": cos },
    })
}

fn origin() -> Value {
    json!({
        "position": { "x": 0.0, "y": 0.0, "z": 0.0 },
        "orientation": { "x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0 },
    })
}

fn text(value: &Value) -> Vec<u8> {
    value.to_string().into_bytes()
}

/// RFC 4648, with padding: how JSON holds the schema's bytes.
fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for three in bytes.chunks(3) {
        let at = |i: usize| u32::from(three.get(i).copied().unwrap_or_default());
        let bits = at(0) << 16 | at(1) << 8 | at(2);
        for place in 0..4 {
            let letter = LETTERS.get((bits >> (18 - 6 * place) & 63) as usize).copied().unwrap_or(b'=');
            text.push(if place <= three.len() { char::from(letter) } else { '=' });
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use rowscan_protocol::angle::BeamGrid;
    use rowscan_protocol::scan::{Echo, NO_ECHO};

    #[test]
    fn base64_is_that_of_the_rfc() {
        for (bytes, expected) in [
            ("", ""),
            ("f", "Zg=="),
            ("fo", "Zm8="),
            ("foo", "Zm9v"),
            ("foob", "Zm9vYg=="),
            ("foobar", "Zm9vYmFy"),
        ] {
            assert_eq!(base64(bytes.as_bytes()), expected);
        }
    }

    #[test]
    fn a_scan_keeps_every_beam_and_a_cloud_every_return() {
        let echo = Echo { range_m: vec![1.0, NO_ECHO, 2.5], remission: vec![7, 0, 9] };
        let beams = BeamGrid { start: 0, step: 10_000, count: 3 };
        let scan = Scan { beams, echoes: vec![echo], ..Scan::default() };
        let found: Value = serde_json::from_slice(&laser_scan(1_500_000_000, "left", &scan)).expect("json");
        assert_eq!(found["ranges"], json!([1.0, 0.0, 2.5]));
        assert_eq!(found["intensities"], json!([7, 0, 9]));
        assert_eq!(found["timestamp"], json!({ "sec": 1, "nsec": 500_000_000 }));
        assert_eq!(found["end_angle"], json!(2.0_f64.to_radians()));
        let cloud: Value = serde_json::from_slice(&point_cloud(0, "left", &scan)).expect("json");
        // Two returns of 16 bytes.
        assert_eq!(cloud["data"].as_str().map(str::len), Some(32_usize.div_ceil(3) * 4));
    }
}
