//! SICK MRS1000, as an MRS1104 with firmware 1.0.0: 275° in four layers, three echoes.

use core::time::Duration;

use super::family::LMS1XX;
use super::{DigitalLines, Evaluations, Model, StartUp, Times, mode, optics, scatters};

pub(super) const MRS1000: Model = Model {
    name: "mrs1000",
    title: "MRS1000",
    ident_name: "MRS1xxxx",
    ident_version: "1.0.0.0R",
    type_code: "MRS1104C-111011",
    order_number: "1081208",
    firmware: "V 1.0.0",
    start_angle: -475_000,
    stop_angle: 2_275_000,
    // Turns of all layers: each layer has every fourth one.
    modes: &[mode(50, 2500)],
    default_mode: mode(50, 2500),
    min_range_m: 0.1,
    max_range_m: 64.0,
    optics: optics::MRS1000,
    layers: &[250, -500, 0, -250],
    echoes: 3,
    encoders: 0,
    device_number: 0,
    scan_counter_restart: None,
    transmit_delay_us: 64_800,
    period_ppm: -4_935,
    scatter: scatters::MRS1000,
    start_up: StartUp { scans: 0, status: 0, outputs: 0x00 },
    operating_hours: 0x2A0D,
    power_on_count: 0x141,
    outputs: 0x00,
    lines: DigitalLines { outputs: &[0, 0, 0, 0], ..LMS1XX.lines },
    fields: 0,
    evaluations: Evaluations { always: 0, most: 0 },
    lacks: &[
        "DO3And4Fnc",
        "LICsrc",
        "LICencset",
        "LICencres",
        "LFPmeanfilter",
        "LFPmedianfilter",
        "LFPparticle",
        "MSsuppmode",
        "LFErec",
        "LMPautostartmeas",
    ],
    times: Times {
        // The recorded client asked for the state each second: 0 at 14.036 s after the start, 1 at 15.038 s. The middle is taken; how it is shared is assumed,
        // as an LMS1xx's, whose mirror turns by then.
        spin_up: Duration::from_millis(14_457),
        first_scan: Duration::from_millis(80),
        start_reply: Duration::from_millis(3),
        ..LMS1XX.times
    },
    emulates: &[
        "50 Hz/0.25° in four layers: a telegram a turn, in the order 250, −500, 0, −250 of its layer codes, so 12.5 scans a second and layer; elevation is −code/100°",
        "one to three echoes, echo filter (one channel with 0 and 2), 8-bit remission",
        "ScanLayerFilter: layers that are off are not sent; the mirror turns on, and counters of telegrams do not count them",
        "the scan counter keeps counting over LMCstartmeas; SCdevicestate 0 for 14.5 s after it (`field` profile)",
    ],
    not_emulated: &[
        "25 Hz/0.125° and 12.5 Hz/0.0625°: mLMPsetscancfg answers 2, as firmware too old for them does",
        "InertialMeasurementUnit: sFA F, as recorded of the MRS1104; `decode` reads the event of one that has it",
        "angle table ANGL1 (bit 1 of the remission in LMDscandatacfg, from firmware 2.2 on): sFA 4",
        "mean, median and particle filters, fog filter, encoder, evaluation fields: sFA 3; whether real ones have them was not found out",
        "the estimate is of the level layer, code 0; the other three are counted and left out (`other_layer`). The page and Foxglove show the lines of that layer alone",
    ],
    evidence: &[
        "recorded MRS1104, 1.0.0.0R: order and codes of layers, angles, shots, measurement frequency (that of one layer), device number 0, times, identity texts, replies without blank, LMPoutputRange beyond the field refused with 4, period 19901 µs with a standard deviation of 386 (39 periods; every second is longer, which the `field` profile repeats without knowing which layer it is)",
        "elevation −code/100°, upwards positive: a public client's signs and SICK's names of its layers (−2.5°, 0°, +2.5°, +5°); not verified on a scene",
        "one layer a turn of a mirror of 50 Hz: assumed from the times of telegrams; each layer's beams then take 15 ms",
        "ScanLayerFilter: order 1 to 4 taken as −2.5°, 0°, +2.5°, +5°, as the layers' colours are numbered; which firmware has it, and what a mask without a layer does (here sFA 4), is not known",
        "optics: no public measurement of the spot was at hand; an LMS1xx's numbers stand for it (assumed). No calibration ships: leaf areas are the raw contact frequency and say so (`uncalibrated`), impacted area gives none",
        "nearest and farthest range, type code, order number, outputs, boot, spin-up and save times: not verified",
    ],
    ..LMS1XX
};
