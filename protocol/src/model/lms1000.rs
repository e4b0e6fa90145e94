//! SICK LMS1000, firmware 2: 276° in one plane at 150 turns a second, three echoes, finer scan modes interlaced.

use super::mrs1000::MRS1000;
use super::{Model, ScanMode, mode, optics, scatters};

/// A telegram each; two or four of them are a scan of the finer modes.
const TURN: ScanMode = mode(150, 7500);

pub(super) static LMS1000: Model = Model {
    name: "lms1000",
    title: "LMS1000",
    ident_name: "LMS1xxxx",
    ident_version: "2.2.1.0R",
    type_code: "LMS1104C-111031",
    order_number: "unknown",
    firmware: "V 2.2.1  ",
    start_angle: -480_000,
    stop_angle: 2_280_000,
    modes: &[TURN, mode(75, 3750), ScanMode { frequency_centihz: 3750, step: 1875 }],
    default_mode: TURN,
    turn: Some(TURN),
    angle_table: true,
    optics: optics::LMS1000,
    layers: &[0],
    device_number: 1,
    transmit_delay_us: 29_625,
    period_ppm: 0,
    scatter: scatters::LMS1000,
    outputs: 0xF0,
    lacks: &[
        "DO3And4Fnc",
        "LICsrc",
        "LICencset",
        "LICencres",
        "FREchoFilter",
        "LFPparticle",
        "MSsuppmode",
        "LFErec",
        "LMPautostartmeas",
    ],
    emulates: &[
        "150 Hz/0.75°; 75 Hz/0.375° of two interlaced turns and 37.5 Hz/0.1875° of four: a telegram a turn, 150 a second in every mode, with the step of one turn (0.75°) and a start that is a step of the mode later from turn to turn; the first turn of a sequence has 369 beams, the others 368",
        "one to three echoes, 8-bit remission",
        "angle table ANGL1 (bit 1 of the remission in LMDscandatacfg), without corrections",
        "a mean filter over an interlaced mode is of turns with the same start (assumed)",
        "the scan counter keeps counting over LMCstartmeas; SCdevicestate 0 for 14.5 s after it (`field` profile)",
    ],
    not_emulated: &[
        "scan modes of firmware before 2.0, 0.25° among them: mLMPsetscancfg answers 1, 2 or 3",
        "echo filter, particle and fog filter, encoder, evaluation fields: sFA 3; InertialMeasurementUnit: sFA F. It has no IMU and no echo filter; of the others it was not found out",
        "corrections of angles: every entry of ANGL1 says 0; what a real one says is in no public source. A recorded table is described by `decode`, and not applied to beams",
    ],
    evidence: &[
        "no bytes of an LMS1000 are public. Field, modes, echoes, names of filters, length of the firmware's text: SICK's public ROS driver, its launch files and its issue tracker; interlaced turns, shifted starts and a beam less in later turns: the telegram listing",
        "scan frequency in interlaced scans: that of turns (150 Hz), as the recorded MRS1104 states that of its telegrams; order of starts upwards, and the sequence counted from power-up: assumed",
        "measurement frequency: shots of one turn all round, 720 × 100 Hz (assumed)",
        "ANGL1: name, scale and offset −32768 by a public client; that it is the last 16-bit channel, has a value a beam and no correction: assumed",
        "DeviceIdent: the recorded MRS1104's with the letter of its family, and firmware 2.2.1 (assumed); type code by one that a user quotes; the order number is not known",
        "telegram version 1, device number 1, outputs F0 and 29.6 ms from a turn's zero index to its transmission: the head of a telegram in an LMS1104C's manual",
        "spin-up and replies: the recorded MRS1104's (assumed); period 6667 µs; its scatter is an LMS1xx's (assumed)",
        "scan mode out of the box, nearest and farthest range, counters, boot and save times: not verified",
        "optics: no public measurement of the spot was at hand; an LMS1xx's numbers stand for it (assumed). No calibration ships: leaf areas are the raw contact frequency and say so (`uncalibrated`), impacted area gives none",
    ],
    ..MRS1000
};
