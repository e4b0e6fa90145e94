//! SICK LMS111: outdoor, 270°, 20 m.

use super::{CLIENT, Lines, MAINTENANCE, Model, RemissionWidth, StartUp, mode};

pub(super) static LMS111: Model = Model {
    name: "lms111",
    title: "LMS111",
    ident_version: "V1.80",
    firmware: "V1.80.2  ",
    start_angle: -450_000,
    stop_angle: 2_250_000,
    output_range_as_read: (-449_997, 2_249_997),
    modes: &[mode(25, 2500), mode(25, 5000), mode(50, 5000)],
    default_mode: mode(50, 5000),
    min_range_m: 0.05,
    max_range_m: 20.0,
    echoes: 2,
    remission: RemissionWidth::Bits8,
    scandata_version: 1,
    scan_counter_restart: Some(4),
    transmit_delay_us: 3_100,
    start_up: StartUp { scans: 7, status: 1, outputs: 0x01 },
    outputs: 0x04,
    lines: Lines {
        version: 1,
        inputs: [2, 2, 2, 2],
        inputs_timed: false,
        outputs: &[0, 0, 1, 2, 2, 2, 2, 2, 2, 2, 2],
    },
    fields: 30,
    logins: &[MAINTENANCE, CLIENT],
    replies_without_blank: &["FREchoFilter"],
    emulates: &[
        "both CoLa dialects, switched by EIHstCola",
        "25 Hz/0.25°, 25 Hz/0.5°, 50 Hz/0.5°; LMPoutputRange cuts the full grid",
        "LMDscandata with one or two echoes, 8- or 16-bit remission, device name, time, output rate",
        "scan counter restarts at 4 with LMCstartmeas; the next 7 scans carry device status 1",
        "user levels, write protection, sFA codes; settings kept by mEEwriteall, lost by mSCreboot",
    ],
    not_emulated: &[
        "50 Hz/0.25° interlaced: mLMPsetscancfg answers 2",
        "encoders, position block, comment in LMDscandatacfg: sFA 4",
        "field evaluation: fieldNNN reads as unused, LFErec can be subscribed to and never comes",
        "LIDinputstate and LIDoutputstate never change, so no events come",
        "filters, encoder, time server and network variables: sFA 3",
    ],
    evidence: &[
        "recorded LMS111, V1.80.2: firmware text, output range, version, counters, times, status and output bytes, digital lines",
        "nearest recorded range is 77 mm; the nearest range is set below it, not verified",
        "FREchoFilter reply without trailing blank: recorded on an MRS1104, not verified on an LMS111",
        "DeviceIdent text: shape as recorded on other models",
    ],
};
