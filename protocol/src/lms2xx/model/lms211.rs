//! SICK LMS211: outdoor, 100°.

use super::family::{OUTDOOR, variant};
use super::{Model, Variant};

/// Whether `3B` refuses 180° is not stated; the listing's table of variants has 100° only.
const VARIANTS: &[Variant] = &[variant(100, 100), variant(100, 50), variant(100, 25)];

pub(super) static LMS211: Model = Model {
    name: "lms211",
    title: "LMS211",
    type_text: "LMS211;302063;X01.27 ",
    variants: VARIANTS,
    default_variant: variant(100, 50),
    ..OUTDOOR
};
