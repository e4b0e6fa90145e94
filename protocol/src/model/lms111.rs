//! SICK LMS111.

use super::{Model, ScanMode};

pub(super) static LMS111: Model = Model {
    name: "lms111",
    title: "LMS111",
    start_angle: -450_000,
    stop_angle: 2_250_000,
    modes: &[
        ScanMode { frequency_centihz: 2500, step: 2500 },
        ScanMode { frequency_centihz: 2500, step: 5000 },
        ScanMode { frequency_centihz: 5000, step: 5000 },
    ],
    default_mode: ScanMode { frequency_centihz: 5000, step: 5000 },
    min_range_m: 0.5,
    max_range_m: 20.0,
    echoes: 2,
    emulates: &[],
    not_emulated: &[],
    evidence: &[],
};
