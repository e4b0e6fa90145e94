//! SICK picoScan150, firmware 2.2.1.0R: 276°, three echoes, Compact over UDP; CoLa and REST for its settings.

use core::time::Duration;

use super::compact::CompactOutput;
use super::family::LMS1XX;
use super::{Evaluations, Model, Password, ScanMode, StartUp, Times, optics};
use crate::optics::Fact;

const fn profile(frequency_hz: u32, step: u16) -> ScanMode {
    ScanMode { frequency_centihz: frequency_hz * 100, step }
}

/// The profiles by number; 0.33° is taken for a third of a degree, as an LMS's or TiM's is.
static PROFILES: [ScanMode; 11] = [
    profile(15, 5000),
    profile(15, 3333),
    profile(20, 1000),
    profile(20, 2500),
    profile(25, 2500),
    profile(30, 1000),
    profile(40, 2500),
    profile(50, 2500),
    profile(15, 500),
    profile(40, 1250),
    profile(15, 10_000),
];

pub(super) const COMPACT_OUTPUT: CompactOutput = CompactOutput {
    profiles: 11,
    segment: 300_000,
    wide_segment: 600_000,
    wide_from_centihz: 3000,
    transmit_us: 400,
    transmit_within_us: [-420, 1_700],
    jitter_us: Fact::recorded(20.0),
    imu_period_us: Some(10_082),
    encoder: true,
    layers: &[],
    elevation_off_deg: Fact::assumed(0.0),
    lacks: &[],
};

static COMPACT: CompactOutput = COMPACT_OUTPUT;

pub(super) static PICOSCAN150: Model = PICOSCAN1XX;

/// What others of the family differ from.
pub(super) const PICOSCAN1XX: Model = Model {
    name: "picoscan150",
    title: "picoScan150",
    ident_name: "picoScan",
    ident_version: "2.2.1.0R",
    type_code: "picoScan1xx",
    order_number: "1134610",
    firmware: "2.2.1.0R",
    // LMS coordinates, in which CoLa has its angles: 90° more than the angles of Compact and REST.
    start_angle: -480_000,
    stop_angle: 2_280_000,
    modes: &PROFILES,
    default_mode: PROFILES[1],
    min_range_m: 0.05,
    // What 16 bits of millimetres hold.
    max_range_m: 65.535,
    optics: optics::PICOSCAN,
    echoes: 3,
    scan_counter_restart: None,
    transmit_delay_us: 56_000,
    period_ppm: 0,
    start_up: StartUp { scans: 0, status: 0, outputs: 0x00 },
    outputs: 0x00,
    fields: 0,
    evaluations: Evaluations { always: 0, most: 0 },
    logins: &[Password { level: 4, hash: 0x81BE_23AA }],
    replies_without_blank: &[],
    lacks: &[
        "EIHstCola",
        "LMPoutputRange",
        "LFPmeanfilter",
        "LFPmedianfilter",
        "LFPparticle",
        "MSsuppmode",
        "DO3And4Fnc",
        "LICsrc",
        "LICencset",
        "LICencres",
        "SetActiveApplications",
        "LFErec",
        "LMPautostartmeas",
        "TSCTCinterface",
        "TSCTCmaxoffset",
        "TSCTCdelay",
        "mLMPsetscancfg",
    ],
    encoders: 0,
    times: Times { first_scan: Duration::from_millis(280), ..LMS1XX.times },
    compact: Some(&COMPACT),
    emulates: &[
        "eleven profiles from 15 Hz/0.05° to 50 Hz/0.25°; Compact scan telegrams over UDP in segments of 30° (10 a turn) up to 25 Hz and of 60° (5 a turn) from 30 Hz on, each sent at the instant at which its last beam is measured",
        "up to three echoes, the echo filter (one echo a beam with 0 and 2), RSSI of 8 bits times 257, the reflector bit where the receiver is at its end",
        "angle filter (beams outside are sent as zero, hidden segments are not sent) and interval filter; IMU and encoder telegrams from the tractor's attitude and wheel",
        "CoLa A and B with the variables of docs/picoscan.md; LMDscandata with ScanDataFormat 3",
    ],
    not_emulated: &[
        "MSGPACK (ScanDataFormat 1), native ROS 2 (4) and data over TCP (protocol 2): the values are taken, and nothing is sent; the log says so",
        "licences: all are there; a real device's answer without one is not known",
        "CoLa 2 on port 2122, WebSocket events, HTTPS, contamination, evaluation fields, cubic area filter",
        "ranges beyond 65.5 m (a scale other than 1.0): such beams read as no echo",
        "EnableLegacyUserLevel: levels 2 and 3 stay off, SetAccessMode answers 0",
    ],
    evidence: &[
        "telegram layout, segments of 30°, times at profile 1, RSSI and unused echoes: three recorded telegrams of a picoScan150",
        "profiles, segments of 60°, filters: SICK's developer guide; the last segment is the rest of the 276° (assumed)",
        "period: nominal; two recorded ones were 5538 and 5559 µs a segment, within their jitter of 20 µs",
        "transmission: −0.42 to +1.7 ms from the first beam in three recorded telegrams, so before the last beam; drawn evenly between (assumed)",
        "telegram counter: 1 at power-up, and it goes on over stop and start (assumed)",
        "optics: no public measurement of the spot was at hand; an LMS1xx's numbers stand for it (assumed), and the calibrations `spindle-picoscan150`, `mature-picoscan150` and their `-device` are of rows seen so",
        "boot, initialisation and reply times: an LMS1xx's, not verified; IMU period: a recorded multiScan136's",
        "reflector: the guide's 254 in LMDscandata; that the bit follows the receiver's end is assumed",
    ],
    ..LMS1XX
};
