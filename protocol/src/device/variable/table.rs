//! All variables, a row each.

use core::fmt;

use super::shape::{Kind, Part};

/// The numbers a part takes.
type Range = core::ops::RangeInclusive<i64>;

/// Who may do what with a variable.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    /// Everybody reads it, nobody writes it.
    ReadOnly,
    /// Everybody reads it, an authorised client writes it.
    Written,
}

/// Where a variable's value comes from.
#[derive(Clone, Copy)]
pub(in crate::device) enum Source {
    /// From what clients have set; these numbers as delivered, an address as one number.
    Stored(&'static [i64]),
    /// From something of the device's own.
    Own(Own),
    /// From the CoLa command of this name, whose value has these parts.
    Command,
}

/// What variables tell of the device's own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::device) enum Own {
    /// The number of the scan mode.
    Profile,
    /// The scan mode in force.
    ScanConfig,
    /// The type's name.
    DeviceType,
    /// The model's order number.
    OrderNumber,
    /// Starting up, normal or out of order.
    DeviceStatus,
    /// Tenths of an hour.
    OperatingHours,
    /// How often it was switched on.
    PowerOnCount,
    /// Its IP address.
    Address,
    /// Its calendar.
    DateTime,
}

/// One variable.
pub struct Variable {
    /// Its name in CoLa and REST.
    pub name: &'static str,
    /// What its value is made of.
    pub parts: &'static [Part],
    /// Who may do what.
    pub access: Access,
    /// What it does here.
    pub effect: &'static str,
    /// How name, type, range and value as delivered are known.
    pub evidence: &'static str,
    pub(in crate::device) source: Source,
}

impl fmt::Debug for Variable {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Variable").field("name", &self.name).finish_non_exhaustive()
    }
}

impl Variable {
    /// REST gives an object of named parts.
    pub fn is_struct(&self) -> bool {
        self.parts.first().is_some_and(|part| !part.key.is_empty())
    }

    /// mEEwriteall and WriteEeprom save it.
    pub fn is_saved(&self) -> bool {
        matches!(self.source, Source::Stored(_))
    }
}

const OAPI: &str = "SICK's OpenAPI file of 2.2.1";
const CLIENTS: &str = "SICK's OpenAPI file of 2.2.1; public clients write it in CoLa A";
const GUIDE: &str = "SICK's OpenAPI file of 2.2.1; SICK's developer guide";
const LOGGED: &str = "SICK's OpenAPI file of 2.2.1; logs of real devices in a public issue tracker";

const FLAG: Kind = Kind::Flag;

const fn byte(range: Range) -> Kind {
    Kind::Number { bytes: 1, from: *range.start(), to: *range.end() }
}

const fn word(range: Range) -> Kind {
    Kind::Number { bytes: 2, from: *range.start(), to: *range.end() }
}

const fn long(range: Range) -> Kind {
    Kind::Number { bytes: 4, from: *range.start(), to: *range.end() }
}

const fn part(key: &'static str, kind: Kind) -> Part {
    Part { key, kind }
}

/// The one part of a value that is no struct.
const fn plain(kind: Kind) -> [Part; 1] {
    [part("", kind)]
}

const fn stored(
    name: &'static str,
    parts: &'static [Part],
    delivered: &'static [i64],
    effect: &'static str,
    evidence: &'static str,
) -> Variable {
    let source = Source::Stored(delivered);
    Variable { name, parts, access: Access::Written, effect, evidence, source }
}

const fn own(
    name: &'static str,
    parts: &'static [Part],
    source: Source,
    effect: &'static str,
    evidence: &'static str,
) -> Variable {
    Variable { name, parts, access: Access::Written, effect, evidence, source }
}

/// One that a CoLa command of the same name answers.
const fn command(
    name: &'static str,
    parts: &'static [Part],
    effect: &'static str,
    evidence: &'static str,
) -> Variable {
    Variable { name, parts, access: Access::Written, effect, evidence, source: Source::Command }
}

impl Variable {
    const fn read_only(self) -> Self {
        Self { access: Access::ReadOnly, ..self }
    }
}

/// Where a stream goes.
const DESTINATION: &[Part] =
    &[part("Protocol", byte(1..=2)), part("IPAddress", Kind::Address), part("Port", word(0..=65_535))];
/// 192.168.0.100, as one number.
const DELIVERED_TO: i64 = 0xC0A8_0064;
const SWITCH: &[Part] = &plain(FLAG);
const ANGLE: Kind = long(-1_380_000..=1_380_000);
/// Layers that a filter of layers names.
pub(in crate::device) const LAYERS: usize = 16;
const ELEVATION: Kind = long(-900_000..=900_000);

/// Off or on, and the same of each layer.
const LAYER_FILTER: [Part; 1 + LAYERS] = {
    const KEYS: [&str; LAYERS] = [
        "aLayers.0",
        "aLayers.1",
        "aLayers.2",
        "aLayers.3",
        "aLayers.4",
        "aLayers.5",
        "aLayers.6",
        "aLayers.7",
        "aLayers.8",
        "aLayers.9",
        "aLayers.10",
        "aLayers.11",
        "aLayers.12",
        "aLayers.13",
        "aLayers.14",
        "aLayers.15",
    ];
    let mut parts = [part("bEnable", FLAG); 1 + LAYERS];
    let mut layer = 0;
    while layer < LAYERS {
        parts[1 + layer] = part(KEYS[layer], FLAG);
        layer += 1;
    }
    parts
};
/// All layers are sent.
const LAYERS_DELIVERED: [i64; 1 + LAYERS] = {
    let mut numbers = [1; 1 + LAYERS];
    numbers[0] = 0;
    numbers
};

/// One row a variable.
#[rustfmt::skip]
pub static VARIABLES: &[Variable] = &[
    stored("ScanDataEnable", SWITCH, &[0], "Compact scan telegrams are sent while it measures", CLIENTS),
    stored("ScanDataFormat", &plain(byte(1..=4)), &[2], "2 Compact over UDP, 3 LMDscandata to those who subscribe; 1 and 4: nothing is sent", CLIENTS),
    stored("ScanDataEthSettings", DESTINATION, &[1, DELIVERED_TO, 2115], "where scan telegrams go; protocol 2 (TCP): nothing is sent", CLIENTS),
    stored("ImuDataEnable", SWITCH, &[0], "IMU telegrams are sent while it measures", CLIENTS),
    stored("ImuDataEthSettings", DESTINATION, &[1, DELIVERED_TO, 7503], "where IMU telegrams go", CLIENTS),
    stored("EncoderDataEnable", SWITCH, &[0], "an encoder telegram a turn is sent while it measures", OAPI),
    stored("EncoderDataEthSettings", DESTINATION, &[1, DELIVERED_TO, 7504], "where encoder telegrams go", OAPI),
    own("PerformanceProfileNumber", &plain(byte(1..=11)), Source::Own(Own::Profile), "the scan mode of this number", CLIENTS),
    own("ScanConfig", &[part("udiScanFreq", long(1500..=5000)), part("ScanRange.uiLength", word(1..=1)), part("ScanRange.aRange.0.udiAngleRes", long(500..=10_000)), part("ScanRange.aRange.0.diStartAngle", ANGLE), part("ScanRange.aRange.0.diStopAngle", ANGLE)], Source::Own(Own::ScanConfig), "the scan mode in force, not the schema's 4000 and 2500, which contradict its profile 2", OAPI).read_only(),
    stored("LFPangleRangeFilter", &[part("bEnable", FLAG), part("fThetaStart", Kind::Azimuth), part("fThetaStop", Kind::Azimuth), part("fPhiStart", ELEVATION), part("fPhiStop", ELEVATION), part("uiBeamIncrement", word(1..=20))], &[0, -900_000, 900_000, -900_000, 900_000, 1], "Compact: beams outside, and between each n-th, are sent as zero; a hidden segment is not sent; a start behind its stop leaves no beam (assumed), and the log says so", LOGGED),
    stored("LFPlayerFilter", &LAYER_FILTER, &LAYERS_DELIVERED, "Compact: lines of layers that are off, counted from the highest, are not sent", LOGGED),
    stored("LFPintervalFilter", &[part("bEnable", FLAG), part("uiReductionFactor", long(2..=50))], &[0, 2], "Compact: only every n-th turn is sent", GUIDE),
    stored("LFPradialDistanceRangeFilter", &[part("bEnable", FLAG), part("ulDistMin", long(0..=200_000)), part("ulDistMax", long(0..=200_000))], &[0, 0, 200_000], "Compact: echoes outside are sent as zero", OAPI),
    stored("ScanDataPreformatting", &plain(byte(1..=1)), &[1], "1: lines are sent as they are measured; 2, rectified, is not taken", CLIENTS),
    command("FREchoFilter", &plain(byte(0..=2)), "0 first echo, 1 all, 2 last", LOGGED),
    command("LocationName", &plain(Kind::Text(16)), "kept, and told in LMDscandata", OAPI),
    command("DeviceIdent", &[part("Name", Kind::Text(64)), part("Version", Kind::Text(64))], "the model and its firmware", OAPI).read_only(),
    own("DeviceType", &plain(Kind::Text(64)), Source::Own(Own::DeviceType), "as the schema has it", OAPI).read_only(),
    command("SerialNumber", &plain(Kind::Text(9)), "the one in Compact telegrams", OAPI).read_only(),
    own("OrderNumber", &plain(Kind::Text(9)), Source::Own(Own::OrderNumber), "the model's", OAPI).read_only(),
    command("FirmwareVersion", &plain(Kind::Text(32)), "the model's", OAPI).read_only(),
    command("SCdevicestate", &plain(byte(0..=3)), "0 busy or logged in, 1 ready, 2 error", OAPI).read_only(),
    own("DeviceStatus", &plain(byte(0..=8)), Source::Own(Own::DeviceStatus), "1 while it starts up, 3 normal, 8 out of order", OAPI).read_only(),
    own("OpHours", &plain(long(0..=4_294_967_295)), Source::Own(Own::OperatingHours), "tenths of an hour, as ODoprh", OAPI).read_only(),
    own("PowerOnCnt", &plain(long(0..=4_294_967_295)), Source::Own(Own::PowerOnCount), "as ODpwrc", OAPI).read_only(),
    own("EtherIPAddress", &plain(Kind::Address), Source::Own(Own::Address), "192.168.0.1 as delivered, whatever it is reached by", OAPI).read_only(),
    own("LSPdatetime", &[part("uiYear", word(0..=65_535)), part("usiMonth", byte(0..=255)), part("usiDay", byte(0..=255)), part("usiHour", byte(0..=255)), part("usiMinute", byte(0..=255)), part("usiSec", byte(0..=255)), part("udiUSec", long(0..=4_294_967_295))], Source::Own(Own::DateTime), "the device's calendar, 1970 at power-up until LSPsetdatetime", OAPI).read_only(),
    stored("SensitivityMode", &plain(byte(0..=2)), &[1], "kept, without effect", OAPI),
    stored("EnableLongRangeMode", SWITCH, &[0], "kept, without effect", OAPI),
    stored("EtherAuxEnabled", SWITCH, &[1], "kept, without effect: CoLa is always on", OAPI),
    stored("EtherCoLaScanMode", &plain(byte(0..=3)), &[3], "kept, without effect: it is about the device search", OAPI),
    stored("EncSetting", &plain(byte(0..=4)), &[0], "kept, without effect: the encoder always counts", OAPI),
    stored("TSCRole", &plain(byte(0..=3)), &[0], "kept, without effect: no time server is asked", OAPI),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_unique_and_what_is_delivered_is_legal() {
        for (place, variable) in VARIABLES.iter().enumerate() {
            assert!(VARIABLES.iter().skip(place + 1).all(|other| other.name != variable.name));
            assert!(!variable.effect.is_empty() && !variable.evidence.is_empty());
            if let Source::Stored(delivered) = variable.source {
                assert_eq!(delivered.len(), variable.parts.len(), "{}", variable.name);
                for (part, number) in variable.parts.iter().zip(delivered) {
                    assert!(part.kind.takes(&part.kind.value(*number)), "{}", variable.name);
                }
            }
        }
    }
}
