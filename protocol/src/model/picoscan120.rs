//! SICK picoScan120, firmware 2.2.1.0R: the picoScan150 with one echo, one scan mode, no IMU and no encoder. No bytes of one are public.

use super::compact::CompactOutput;
use super::picoscan150::{COMPACT_OUTPUT, PICOSCAN1XX};
use super::{Model, ScanMode};

/// The mode as delivered, of SICK's OpenAPI file; others of it are not known.
static MODES: [ScanMode; 1] = [ScanMode { frequency_centihz: 2000, step: 1000 }];

static COMPACT: CompactOutput = CompactOutput {
    profiles: 0,
    imu_period_us: None,
    encoder: false,
    lacks: &[
        "PerformanceProfileNumber",
        "FREchoFilter",
        "LFPangleRangeFilter",
        "LFPintervalFilter",
        "LFPradialDistanceRangeFilter",
        "ImuDataEnable",
        "ImuDataEthSettings",
        "EncoderDataEnable",
        "EncoderDataEthSettings",
        "EncSetting",
        "SensitivityMode",
        "EnableLongRangeMode",
    ],
    ..COMPACT_OUTPUT
};

pub(super) static PICOSCAN120: Model = Model {
    name: "picoscan120",
    title: "picoScan120",
    ident_name: "picoScan120",
    order_number: "unknown",
    modes: &MODES,
    default_mode: MODES[0],
    echoes: 1,
    compact: Some(&COMPACT),
    emulates: &[
        "one mode, 20 Hz/0.1°; Compact scan telegrams over UDP in 10 segments of 30° a turn, one echo; CoLa A and B and REST with the variables of docs/picoscan.md that it has; LMDscandata with ScanDataFormat 3",
    ],
    not_emulated: &[
        "other modes: which it has is not known; operatingMode: the name is not answered",
        "what a picoScan150 does not emulate either",
    ],
    evidence: &[
        "20 Hz, 0.1°, one echo, no profiles, no echo filter, no angle filter, no IMU, no encoder: SICK's OpenAPI file of the picoScan120, 2.2.1; interval filter, distance filter, sensitivity and long range as the angle filter (assumed)",
        "no bytes of a picoScan120 are public: telegrams, segments, times and all else are a picoScan150's (assumed); its DeviceType, too; the order number is not known",
        "a refused FREchoFilter: the code of a real device is not known; sFA 3 as for any name that a model lacks",
    ],
    ..PICOSCAN1XX
};
