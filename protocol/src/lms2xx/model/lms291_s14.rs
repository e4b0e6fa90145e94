//! SICK LMS291-S14, the Fast one: 90° with 0.5° in every mirror turn.

use super::family::OUTDOOR;
use super::{Model, Variant};

const FAST: Variant = Variant { angle_deg: 90, step_centideg: 50 };

pub(super) static LMS291_S14: Model = Model {
    name: "lms291-s14",
    title: "LMS291-S14",
    type_text: "LMS291;S14;X01.27 ",
    variants: &[FAST],
    default_variant: FAST,
    turn_step_centideg: 50,
    takes_variants: false,
    reflectivity: true,
    bytes_a_turn: 559,
    emulates: &[
        "90° with 0.5° in one mirror turn; the variant is fixed: 3B answers 0",
        "what the other LMS2xx have, and range with reflectivity (mode 50)",
    ],
    ..OUTDOOR
};
