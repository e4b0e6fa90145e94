//! What an owner is, as far as a return tells.

use super::returns::{Class, Return};

/// What an entry is, and whose organ.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Label {
    pub(super) tree: u32,
    pub(super) organ: u32,
    pub(super) class: Class,
}

/// What a return needs to know of an owner.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tag {
    pub(super) label: Label,
    /// True for polygons, whose cosine comes from their normal in (X, Z); false where the floor knows it.
    flat: bool,
    normal: [f32; 2],
}

impl Tag {
    /// What no beam meets.
    pub(super) const NOTHING: Self = Self::round(Label::of_nobody(Class::None));
    /// The level plane under all.
    pub(super) const GROUND: Self = Self::round(Label::of_nobody(Class::Ground));

    pub(super) const fn round(label: Label) -> Self {
        Self { label, flat: false, normal: [0.0; 2] }
    }

    pub(super) fn polygon(label: Label, normal: [f64; 3]) -> Self {
        Self { label, flat: true, normal: [normal[0] as f32, normal[2] as f32] }
    }

    /// The return of a beam; `cos_of_floor` is |beam · normal| where the floor ends it.
    #[inline(always)]
    pub(super) fn met(&self, range_m: f64, (x, z): (f64, f64), cos_of_floor: f64) -> Return {
        let Label { tree, organ, class } = self.label;
        let cos = (self.normal[0] * x as f32 + self.normal[1] * z as f32).abs();
        let cos_incidence = if self.flat { cos } else { cos_of_floor as f32 };
        Return { range_m, class, tree, organ, cos_incidence }
    }
}

impl Label {
    pub(super) const fn of_nobody(class: Class) -> Self {
        Self { tree: Return::NO_LABEL, organ: Return::NO_LABEL, class }
    }
}
