//! What is asked of a scanner, in the order in which SICK's own SDK asks.

use std::net::SocketAddrV4;

use crate::picoscan_address::PicoscanAddress;
use rowscan_protocol::client::ColaConfig;
use rowscan_protocol::model::SEGMENTED;
use rowscan_protocol::rig::EchoChoice;
use serde_json::{Value, json};

/// One request: a variable that is read, or written, or a method.
#[derive(Clone, Debug)]
pub(super) struct Step {
    pub(super) name: &'static str,
    /// The data of a POST; none of a GET.
    pub(super) data: Option<Value>,
    /// No scan can come without it.
    pub(super) is_needed: bool,
    /// Not every model has it: one that does not is no news.
    pub(super) may_lack: bool,
}

/// Filters of a scanner that take beams, echoes or turns away; a beam that is filtered out looks like a miss. What is told where one was on.
///
/// Layers are no beams: which ones come is the user's choice (LFPlayerFilter), and an estimate names the layer that it is of.
pub(super) const FILTERS: [(&str, &str); 3] = [
    (
        "LFPangleRangeFilter",
        "its filter of angles (LFPangleRangeFilter) was on, and beams outside look like misses: it is off now",
    ),
    (
        "LFPradialDistanceRangeFilter",
        "its filter of ranges (LFPradialDistanceRangeFilter) was on, and echoes outside look like misses: it is off now",
    ),
    ("LFPintervalFilter", "its filter of turns (LFPintervalFilter) was on: it is off now"),
];

/// What a filter is written to be off, if it was on: the same with `bEnable` off. Real devices wrap structs by their name; the schema shows them bare.
pub(super) fn off(name: &'static str, data: &Value) -> Option<Step> {
    let mut value = data.get(name).unwrap_or(data).clone();
    let enable = value.get_mut("bEnable")?;
    let was_on = enable.as_bool().or_else(|| enable.as_u64().map(|on| on != 0))?;
    *enable = if enable.is_boolean() { json!(false) } else { json!(0) };
    was_on.then(|| Step::write(name, value, false))
}

impl Step {
    fn read(name: &'static str, is_needed: bool) -> Self {
        Self { name, data: None, is_needed, may_lack: false }
    }

    /// Reads what not every model has.
    fn look(name: &'static str) -> Self {
        Self { may_lack: true, ..Self::read(name, false) }
    }

    fn write(name: &'static str, value: Value, is_needed: bool) -> Self {
        Self { name, data: Some(json!({ name: value })), is_needed, may_lack: false }
    }
}

/// The profile with this scan mode, if one is asked for and it is not the only mode of a model; an error if no scanner of this kind has the mode.
fn profile(config: &ColaConfig) -> Result<Option<u8>, ()> {
    let Some(mode) = config.scan_mode else { return Ok(None) };
    let mut profiles = SEGMENTED.iter().filter_map(|model| model.profile(mode));
    let is_only_mode = SEGMENTED.iter().any(|model| model.modes == [mode]);
    profiles.next().map(Some).or(is_only_mode.then_some(None)).ok_or(())
}

/// The start-up, and whether the scanner has the scan mode that is asked for.
pub(super) fn start_up(to: SocketAddrV4, place: &PicoscanAddress, config: &ColaConfig) -> (Vec<Step>, bool) {
    let profile = profile(config);
    let destination = json!({ "Protocol": 1, "IPAddress": to.ip().octets(), "Port": to.port() });
    let echo = config.echo.map(|echo| match echo {
        EchoChoice::First => json!(0),
        EchoChoice::Last => json!(2),
    });
    let about = [
        Step::read("DeviceIdent", true),
        Step::read("FirmwareVersion", false),
        // Whose telegrams are taken, where others come to the same port.
        Step::read("SerialNumber", false),
    ];
    // What another client has left, or stored.
    let filters = FILTERS.map(|(name, _)| Step::look(name));
    let settings = [
        Some(Step::write("ScanDataEthSettings", destination.clone(), true)),
        Some(Step::write("ScanDataFormat", json!(2), true)),
        profile.ok().flatten().map(|number| Step::write("PerformanceProfileNumber", json!(number), false)),
        echo.map(|code| Step::write("FREchoFilter", code, false)),
        // A measurement that runs already begins anew with it: before the stream does.
        Some(Step { name: "mStartMeasure", data: Some(json!({})), is_needed: false, may_lack: false }),
    ];
    // To the port that scans come to: one stream holds all of it in its order. A model without them refuses, and scans come nevertheless.
    let readings = [
        (place.imu, "ImuDataEthSettings", "ImuDataEnable"),
        (
            place.encoder || config.encoder_ticks_per_m.is_some(),
            "EncoderDataEthSettings",
            "EncoderDataEnable",
        ),
    ];
    let readings = readings.into_iter().filter(|(on, ..)| *on).flat_map(|(_, settings, enable)| {
        [Step::write(settings, destination.clone(), false), Step::write(enable, json!(true), false)]
    });
    let last = Step::write("ScanDataEnable", json!(true), true);
    let steps = about.into_iter().chain(filters).chain(settings.into_iter().flatten());
    (steps.chain(readings).chain([last]).collect(), profile.is_ok())
}

/// The end of the stream.
pub(super) fn stop() -> Step {
    Step::write("ScanDataEnable", json!(false), false)
}
