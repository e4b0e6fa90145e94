//! Branches, posts and wires as the caster keeps them: cylinders, eight side by side.

use super::row_index::{RowIndex, YExtent};
use super::tag::{Label, Tag};
use crate::lanes::{Row, WIDTH};
use crate::organ::Cylinder;

/// How far a conservative outline is widened, relative; far above rounding.
pub(super) const WIDER: f64 = 1.0 + 1e-9;

/// An axis that rises less than this along Y lies in the scan plane.
pub(super) const LEVEL: f64 = 1e-12;

/// Eight cylinders.
#[derive(Clone, Debug)]
pub(super) struct Poles {
    pub(super) base: [Row; 3],
    pub(super) axis: [Row; 3],
    pub(super) length: Row,
    pub(super) radius: Row,
    pub(super) inverse_radius: Row,
    /// How far a disk square to the axis reaches along Y from its middle.
    pub(super) reach: Row,
    /// Metres along the axis for a metre along Y; infinite where the axis lies in the scan plane.
    pub(super) pitch: Row,
    pub(super) from: Row,
    pub(super) to: Row,
}

impl Poles {
    /// Nothing anywhere.
    const NONE: Self = Self {
        base: [Row::splat(0.0); 3],
        axis: [Row::splat(0.0); 3],
        length: Row::splat(0.0),
        radius: Row::splat(0.0),
        inverse_radius: Row::splat(0.0),
        reach: Row::splat(0.0),
        pitch: Row::splat(f64::INFINITY),
        from: Row::splat(f64::INFINITY),
        to: Row::splat(f64::NEG_INFINITY),
    };

    fn set(&mut self, lane: usize, piece: &Cylinder, shift: f64) {
        let length = piece.length_m();
        let (base, tip) = (piece.base(), piece.tip());
        for axis in 0..3 {
            self.base[axis].0[lane] = base[axis];
            self.axis[axis].0[lane] = (tip[axis] - base[axis]) / length;
        }
        self.base[1].0[lane] += shift;
        let rise = self.axis[1].0[lane];
        self.pitch.0[lane] = if rise.abs() < LEVEL { f64::INFINITY } else { 1.0 / rise };
        let extent = extent(piece);
        self.length.0[lane] = length;
        self.radius.0[lane] = piece.radius_m();
        self.inverse_radius.0[lane] = 1.0 / piece.radius_m();
        self.reach.0[lane] = reach_m(piece);
        self.from.0[lane] = extent.from_m + shift;
        self.to.0[lane] = extent.to_m + shift;
    }
}

fn reach_m(piece: &Cylinder) -> f64 {
    let (base, tip) = (piece.base(), piece.tip());
    let flat = (tip[0] - base[0]).hypot(tip[2] - base[2]);
    piece.radius_m() * flat / piece.length_m() * WIDER + 1e-12
}

fn extent(piece: &Cylinder) -> YExtent {
    let reach = reach_m(piece);
    YExtent::around([piece.base()[1], piece.tip()[1]].into_iter().flat_map(|y| [y - reach, y + reach]))
}

/// All wood of an orchard, images over the border of the period included, in the order of the row index.
#[derive(Clone, Debug, Default)]
pub(super) struct WoodField {
    pub(super) index: RowIndex,
    /// What each entry is.
    tags: Vec<Tag>,
    poles: Vec<Poles>,
}

impl WoodField {
    pub(super) fn new<'a>(wood: impl Iterator<Item = (Label, &'a Cylinder)>, period_m: f64) -> Self {
        let images: Vec<(Label, &Cylinder, f64)> = wood
            .flat_map(|(label, piece)| extent(piece).images(period_m).map(move |shift| (label, piece, shift)))
            .collect();
        let extents: Vec<YExtent> = images
            .iter()
            .map(|(_, piece, shift)| {
                let YExtent { from_m, to_m } = extent(piece);
                YExtent { from_m: from_m + shift, to_m: to_m + shift }
            })
            .collect();
        let (index, order) = RowIndex::new(&extents);
        let (tags, poles) = (Vec::with_capacity(order.len()), Vec::with_capacity(order.len() / WIDTH));
        let mut field = Self { index, tags, poles };
        for eight in order.chunks(WIDTH) {
            let mut poles = Poles::NONE;
            for (lane, number) in eight.iter().enumerate() {
                let image = images.get(*number as usize);
                field.tags.push(image.map_or(Tag::NOTHING, |image| Tag::round(image.0)));
                if let Some((_, piece, shift)) = image {
                    poles.set(lane, piece, *shift);
                }
            }
            field.poles.push(poles);
        }
        field
    }

    /// Eight entries.
    #[inline(always)]
    pub(super) fn eight(&self, eight: usize) -> Option<&Poles> {
        self.poles.get(eight)
    }

    /// What eight entries are.
    #[inline(always)]
    pub(super) fn tags(&self, eight: usize) -> &[Tag] {
        self.tags.get(eight * WIDTH..(eight + 1) * WIDTH).unwrap_or(&[])
    }
}
