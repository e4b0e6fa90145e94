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
    /// True for polygons, whose cosine comes from their normal; false where the floor knows it.
    flat: bool,
    /// Whether a polygon's normal has a Y below zero; how much follows from its length.
    back: bool,
    /// X and Z of the normal.
    normal: [f32; 2],
}

impl Tag {
    /// What no beam meets.
    pub(super) const NOTHING: Self = Self::round(Label::of_nobody(Class::None));
    /// The level plane under all.
    pub(super) const GROUND: Self = Self::round(Label::of_nobody(Class::Ground));

    pub(super) const fn round(label: Label) -> Self {
        Self { label, flat: false, back: false, normal: [0.0; 2] }
    }

    pub(super) fn polygon(label: Label, normal: [f64; 3]) -> Self {
        Self { label, flat: true, back: normal[1] < 0.0, normal: [normal[0] as f32, normal[2] as f32] }
    }

    /// The return of a beam; `cos_of_floor` is |beam · normal| where the floor ends it.
    #[inline(always)]
    pub(super) fn met(&self, range_m: f64, [x, y, z]: [f64; 3], cos_of_floor: f64) -> Return {
        let Label { tree, organ, class } = self.label;
        let [normal_x, normal_z] = self.normal;
        let mut cos = normal_x * x as f32 + normal_z * z as f32;
        if y != 0.0 {
            let normal_y = (1.0 - normal_x * normal_x - normal_z * normal_z).max(0.0).sqrt();
            cos += if self.back { -normal_y } else { normal_y } * y as f32;
        }
        let cos_incidence = if self.flat { cos.abs() } else { cos_of_floor as f32 };
        Return { range_m, class, tree, organ, cos_incidence }
    }
}

impl Label {
    pub(super) const fn of_nobody(class: Class) -> Self {
        Self { tree: Return::NO_LABEL, organ: Return::NO_LABEL, class }
    }
}
