//! What the models of a family share. A model's file holds the differences.

use core::time::Duration;

use super::{
    CLIENT, DigitalLines, Evaluations, MAINTENANCE, Model, RemissionWidth, StartUp, Times, mode, optics,
    scatters,
};

const fn ms(milliseconds: u64) -> Duration {
    Duration::from_millis(milliseconds)
}

/// LMS100, LMS111, LMS151: 270°, two echoes.
pub(super) const LMS1XX: Model = Model {
    name: "",
    title: "",
    type_code: "",
    order_number: "",
    ident_version: "V1.80",
    firmware: "V1.80.2  ",
    start_angle: -450_000,
    stop_angle: 2_250_000,
    modes: &[mode(25, 2500), mode(25, 5000), mode(50, 5000)],
    default_mode: mode(50, 5000),
    min_range_m: 0.05,
    max_range_m: 20.0,
    no_echo: 0,
    optics: optics::LMS1XX,
    echoes: 2,
    takes_empty_echo_mask: false,
    encoders: 1,
    remission: RemissionWidth::Bits8,
    scandata_version: 1,
    zeros_before_first_scan: false,
    scan_counter_restart: Some(4),
    transmit_delay_us: 3_100,
    period_ppm: 6_575,
    scatter: scatters::LMS1XX,
    start_up: StartUp { scans: 7, status: 1, outputs: 0x01 },
    outputs: 0x04,
    lines: DigitalLines {
        version: 1,
        inputs: [2, 2, 2, 2],
        inputs_timed: false,
        outputs: &[0, 0, 1, 2, 2, 2, 2, 2, 2, 2, 2],
        outputs_told_at_once: false,
    },
    fields: 30,
    evaluations: Evaluations { always: 0, most: 4 },
    logins: &[MAINTENANCE, CLIENT],
    replies_without_blank: &["FREchoFilter", "SetActiveApplications"],
    lacks: &["DO3And4Fnc"],
    times: Times {
        boot: ms(15_000),
        initialisation: ms(10_000),
        spin_up: ms(5_000),
        first_scan: ms(80),
        busy_after_new_mode: ms(30_000),
        reply: ms(1),
        login_reply: ms(3),
        start_reply: ms(14),
        save_reply: ms(1_000),
    },
    emulates: &[
        "25 Hz/0.25°, 25 Hz/0.5°, 50 Hz/0.5°; LMPoutputRange cuts the full grid",
        "one or two echoes, echo filter, encoder block from LICencset, LICsrc and LICencres",
        "scan counter restarts at 4 with LMCstartmeas; the next 7 scans carry device status 1",
    ],
    not_emulated: &[
        "50 Hz/0.25° interlaced: mLMPsetscancfg answers 2; how telegrams of the two turns differ is in no public source",
    ],
    evidence: &[
        "recorded LMS111, V1.80.2: firmware text, version, counters, times, status and output bytes, digital lines, period 20132 µs with a standard deviation of 25 (83 periods; the last 38 of them 20112 and 20)",
        "LMPoutputRange: as delivered, by several public sources (FFF92230 to 225510); the recorded read (FFF92233, 22550D) came before its client's write of the same, so it is as a client left it",
        "STlms stays 7 over LMCstartmeas on a measuring scanner: inferred from two public clients that ask once",
        "nearest recorded range is 62 mm; the nearest range is set below it, not verified",
        "SCdevicestate stays 0 for 30 s after a new scan mode: comment in a public client; boot, spin-up and save times: not verified",
    ],
};

/// LMS500, LMS511 PRO and Lite: 190°, five echoes.
pub(super) const LMS5XX: Model = Model {
    ident_version: "V1.80",
    firmware: "V1.80    ",
    start_angle: -50_000,
    stop_angle: 1_850_000,
    modes: &[
        mode(25, 1667),
        mode(25, 2500),
        mode(35, 2500),
        mode(50, 3333),
        mode(50, 5000),
        mode(75, 5000),
        mode(100, 6667),
        mode(100, 10_000),
    ],
    default_mode: mode(25, 1667),
    min_range_m: 0.2,
    // What 16 bits of millimetres hold.
    max_range_m: 65.535,
    optics: optics::LMS5XX,
    echoes: 5,
    takes_empty_echo_mask: true,
    scandata_version: 0,
    scan_counter_restart: None,
    transmit_delay_us: 40_700,
    period_ppm: 70,
    scatter: scatters::LMS5XX,
    start_up: StartUp { scans: 1, status: 1, outputs: 0x00 },
    outputs: 0x38,
    lines: DigitalLines {
        version: 0,
        inputs: [0, 0, 0, 0],
        inputs_timed: true,
        outputs: &[0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 2, 2, 2, 2],
        outputs_told_at_once: true,
    },
    lacks: &[],
    times: Times { first_scan: ms(220), start_reply: ms(1), ..LMS1XX.times },
    emulates: &[
        "eight scan modes from 25 Hz/0.1667° to 100 Hz/1°; LMPoutputRange cuts the full grid",
        "one to five echoes, echo filter, encoder block from DO3And4Fnc, LICencset, LICsrc and LICencres",
        "telegram version 0; the first scan after LMCstartmeas carries device status 1",
    ],
    not_emulated: &[
        "interlaced scan modes (0.083° and 0.042°): mLMPsetscancfg answers 2; SICK's own driver has none on an LMS5xx either, and its manual lists no such values",
        "scale factor 2 for ranges over 65.5 m: such ranges read as no echo; the telegram that switches to it is in no public source (LMDscandatascalefactor is another family's)",
    ],
    evidence: &[
        "recorded LMS511, V1.80: firmware text, output range, version, times, status and output bytes, digital lines, period 40003 µs with a standard deviation of 128 (89 periods)",
        "pairs of frequency and resolution: the values are the manual's, the pairs are not verified",
        "LMPoutputRange: the recorded read came before any write and is the manual's range; whether as delivered or as a client left it cannot be told",
        "echo mask 0 is taken, with one echo: a public LMS511 program that sends it; not recorded",
        "STlms stays 7 over LMCstartmeas on a measuring scanner: inferred from public clients of the LMS1xx",
        "nearest range, boot, spin-up and save times: not verified",
    ],
    ..LMS1XX
};

/// TiM5xx, TiM781, TiM781S: 270°, 15 Hz, one echo, 16-bit remission.
pub(super) const TIM: Model = Model {
    ident_version: "V3.13",
    firmware: "V3.13",
    modes: &[mode(15, 3333)],
    default_mode: mode(15, 3333),
    max_range_m: 25.0,
    no_echo: 2,
    optics: optics::TIM,
    echoes: 1,
    takes_empty_echo_mask: false,
    encoders: 0,
    remission: RemissionWidth::Bits16,
    zeros_before_first_scan: true,
    scan_counter_restart: None,
    transmit_delay_us: 7_000,
    period_ppm: -13,
    scatter: scatters::TIM,
    start_up: StartUp { scans: 0, status: 0, outputs: 0x00 },
    outputs: 0x00,
    lines: DigitalLines {
        version: 0,
        inputs: [0, 0, 0, 0],
        inputs_timed: false,
        outputs: &[0, 0, 0, 0],
        outputs_told_at_once: false,
    },
    fields: 48,
    evaluations: Evaluations { always: 3, most: 3 },
    lacks: &["DO3And4Fnc", "LICsrc", "LICencset", "LICencres", "FREchoFilter", "MSsuppmode"],
    times: Times { first_scan: ms(280), start_reply: ms(1), ..LMS1XX.times },
    emulates: &[
        "15 Hz/0.3333°; LMPoutputRange cuts the full grid",
        "a beam without an echo reads 2 with remission 0, as recorded; 16-bit remission out of the box",
        "the scan counter keeps counting over LMCstartmeas",
    ],
    not_emulated: &[
        "echo filter and encoders: sFA 3 for FREchoFilter, MSsuppmode, LIC… and DO3And4Fnc, sFA 4 for encoders in LMDscandatacfg; whether real ones have them was not found out",
        "raw codes for no valid return other than 2",
    ],
    evidence: &[
        "recorded TiM781S, V3.13: firmware text, version, times, status bytes, inputs, code 2 for no echo, period 66666 µs with a standard deviation of 15 (59 periods)",
        "LMPoutputRange: the recorded read came before any write and is the full range; whether as delivered or as a client left it cannot be told",
        "16-bit remission: as a client left it; the recorded read followed its client's write, and the width out of the box is not known",
        "LFErec of a TiM7xx carries three fields: all recorded events do, each field with the time of its own last change; a read was not recorded. Fields that are not set read 0 (assumed)",
        "STlms stays 7 over LMCstartmeas on a measuring scanner: inferred from public clients of the LMS1xx",
        "a poll before the first scan is answered with a scan of 24 zeros: a public program's test accepts it as normal from a TiM551 and a TiM571; of the others assumed",
        "outputs, boot, spin-up and save times: not verified",
    ],
    ..LMS1XX
};
