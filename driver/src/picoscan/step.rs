//! What is asked of a scanner, in the order in which SICK's own SDK asks.

use std::collections::VecDeque;
use std::net::SocketAddrV4;

use crate::picoscan_address::PicoscanAddress;
use rowscan_protocol::client::ColaConfig;
use rowscan_protocol::leftover::Leftover;
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
    /// The setting that it reads or puts right.
    pub(super) leftover: Option<&'static Leftover>,
    /// What is told where it reads a switch that is on.
    pub(super) told: Option<&'static str>,
}

/// What a setting that begins with a switch is written to be off, if it was on: the same with `bEnable` off. Real devices wrap structs by their name;
/// the schema shows them bare.
pub(super) fn off(setting: &'static Leftover, data: &Value) -> Option<Step> {
    let was_on = is_on(setting.name, data)?;
    let mut value = data.get(setting.name).unwrap_or(data).clone();
    let enable = value.get_mut("bEnable")?;
    *enable = if enable.is_boolean() { json!(false) } else { json!(0) };
    was_on.then(|| Step { leftover: Some(setting), ..Step::write(setting.name, value, false) })
}

/// Whether a setting that begins with a switch is on.
pub(super) fn is_on(name: &str, data: &Value) -> Option<bool> {
    let enable = data.get(name).unwrap_or(data).get("bEnable")?;
    enable.as_bool().or_else(|| enable.as_u64().map(|on| on != 0))
}

impl Step {
    fn read(name: &'static str, is_needed: bool) -> Self {
        Self { name, data: None, is_needed, may_lack: false, leftover: None, told: None }
    }

    /// Reads a setting that another client may have left, and that not every model has.
    fn look(setting: &'static Leftover) -> Self {
        Self { may_lack: true, leftover: Some(setting), ..Self::read(setting.name, false) }
    }

    /// Reads which layers are sent: that is the user's choice.
    fn look_at_layers() -> Self {
        let told = "some of its layers are off (LFPlayerFilter): their lines are not sent, and the user's choice is kept";
        Self { may_lack: true, told: Some(told), ..Self::read("LFPlayerFilter", false) }
    }

    fn write(name: &'static str, value: Value, is_needed: bool) -> Self {
        Self { data: Some(json!({ name: value })), ..Self::read(name, is_needed) }
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
    let leftovers = Leftover::of_compact().map(Step::look);
    let settings = [
        Some(Step::write("ScanDataEthSettings", destination.clone(), true)),
        Some(Step::write("ScanDataFormat", json!(2), true)),
        profile.ok().flatten().map(|number| Step::write("PerformanceProfileNumber", json!(number), false)),
        echo.map(|code| Step::write(ECHO, code, false)),
        // A measurement that runs already begins anew with it: before the stream does.
        Some(Step { data: Some(json!({})), ..Step::read("mStartMeasure", false) }),
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
    let steps = about
        .into_iter()
        .chain(leftovers)
        .chain([Step::look_at_layers()])
        .chain(settings.into_iter().flatten());
    (steps.chain(readings).chain([last]).collect(), profile.is_ok())
}

/// The setting of which echoes are sent.
pub(super) const ECHO: &str = "FREchoFilter";

impl Step {
    /// Reads which echoes are sent, where this is the step that sets them: a scanner that refuses keeps its own.
    pub(super) fn read_back(&self) -> Option<Self> {
        let sets_the_echo = self.name == ECHO && self.data.is_some();
        sets_the_echo.then(|| Self { may_lack: true, ..Self::read(ECHO, false) })
    }
}

/// Streams that a client switches on beside the scans.
const STREAMS: [&str; 2] = ["ImuDataEnable", "EncoderDataEnable"];

impl Step {
    /// The stream beside the scans that this switches on, if that is what it does.
    pub(super) fn switches_on(&self) -> Option<&'static str> {
        STREAMS.into_iter().find(|name| *name == self.name)
    }
}

/// The end of the scans, and of the streams beside them that were switched on.
pub(super) fn stop(switched_on: &[&'static str]) -> VecDeque<Step> {
    let all = std::iter::once("ScanDataEnable").chain(switched_on.iter().copied());
    all.map(|name| Step::write(name, json!(false), false)).collect()
}
