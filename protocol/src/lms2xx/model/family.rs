//! What the models share. A model's file holds the differences.

use core::time::Duration;

use super::{Model, Times, Variant};
use crate::lms2xx::configuration::Configuration;
use crate::lms2xx::values::{MeasuringMode, Unit};

const fn variant(angle_deg: u16, step_centideg: u16) -> Variant {
    Variant { angle_deg, step_centideg }
}

/// LMS211, LMS221, LMS291: outdoor, centimetres out of the box.
pub(super) const OUTDOOR: Model = Model {
    name: "",
    title: "",
    type_text: "",
    software: b"V02.30 ",
    variants: &[variant(180, 100), variant(180, 50), variant(100, 100), variant(100, 50), variant(100, 25)],
    default_variant: variant(180, 50),
    turn_step_centideg: 100,
    takes_variants: true,
    reflectivity: false,
    configuration: Configuration::new(MeasuringMode(0), Unit::Cm),
    min_range_m: 0.05,
    max_range_m: 80.0,
    times: Times { boot: Duration::from_secs(15), save: Duration::from_secs(4) },
    emulates: &[
        "180° and 100°; 0.5° and 0.25° scans are two and four mirror turns, each with its own place of the tractor",
        "values on request and as a stream: all, mean, sub-range, mean of a sub-range, partial scans; cm and mm; measuring modes 0 to 6, 0F, 3F",
        "power-on text, installation mode, variant, configuration block, status, errors, reset, four rates",
        "a telegram with a pause inside it is dropped; with `--profile field` bytes closer than 55 µs at 500 000 bits a second are lost too",
    ],
    not_emulated: &[
        "minimum values (20 to 23, 2C), values with fields (29), reflectivity by parts (2B), navigation (2E): mode change answers 1",
        "evaluation fields, contours, restart and dazzle evaluation: kept in the configuration block, without effect; field flags are 0",
        "pollution and calibration values of the status: constant",
        "all commands but 10, 20, 30, 31, 32, 36, 37, 3A, 3B, 3F, 74, 77: 92",
        "storing a permanent rate: its command is not known; start with --rate",
    ],
    evidence: &[
        "frames, checksum, commands, replies: published telegrams and captured start-ups of public clients",
        "a beam without an echo reads 4 below the top of its range: the most frequent code in recordings of an LMS200",
        "36, 37, 3F as requests for what their replies carry; status length, its encoding of the rate; boot and EEPROM times; real-time index counts mirror turns: not verified",
    ],
};
