//! What the beams of a side could see at best: the part of each cell's areas that a scanner driven past on that side can reach.
//!
//! The mirror moves along the row and its beams lie across it, so a point of a surface is seen from one place of the track alone. Every patch of surface
//! is asked by a beam of its own whether anything stands before it. No scanner does better: it has fewer beams, and a spot.

use rayon::prelude::*;
use rowscan_protocol::scan::Pose;
use serde::Serialize;
use std::borrow::Cow;
use std::collections::BTreeMap;

use crate::bins::Bins;
use crate::caster::{BeamFan, Caster, Return, Scratch};
use crate::cells::{Cell, CellAreas, CellGrid};
use crate::orchard::Orchard;
use crate::organ::{Surface, Tree};
use crate::patches::{self, Patch};

/// Where a scanner passes a row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Track {
    /// Distance of the mirror from the row's axis, metres; negative towards smaller X.
    pub aside_m: f64,
    /// Height of the mirror, metres.
    pub height_m: f64,
}

/// A cell, and what of it can be seen.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SeenCell {
    /// The cell with its exact areas.
    #[serde(flatten)]
    pub cell: Cell,
    /// One-sided leaf area that beams reach, on either face, m².
    pub leaf_visible_m2: f64,
    /// The rest.
    pub leaf_hidden_m2: f64,
    /// Surface of wood that beams reach, m²: half of it at the most.
    pub wood_visible_m2: f64,
    /// The rest.
    pub wood_hidden_m2: f64,
    /// Surface of fruit that beams reach, m².
    pub fruit_visible_m2: f64,
    /// The rest.
    pub fruit_hidden_m2: f64,
}

/// What was asked of the patches of a cell, m² of leaf, wood and fruit.
#[derive(Clone, Copy, Debug, Default)]
struct Asked {
    all: [f64; 3],
    visible: [f64; 3],
}

impl Orchard {
    /// The cells of one row with what can be seen of them from a track beside it; none where [`Orchard::cells_of_row`] has none.
    pub fn seen_cells(
        &self,
        caster: &Caster,
        row: usize,
        grid: CellGrid,
        track: Track,
    ) -> Option<Vec<SeenCell>> {
        let cells = self.cells_of_row(row, grid)?;
        let (along, heights) = grid.bins(self.period_m())?;
        let first = row * self.trees_per_row();
        let axis_m = self.row_spacing_m().map_or(0.0, |spacing_m| row as f64 * spacing_m);
        let foot_m = self.foot_of_trees_m(row);
        let look = Look { caster, mirror_m: [axis_m + track.aside_m, foot_m + track.height_m], foot_m };
        let trees: Vec<Cow<'_, Tree>> = self.trees_of_row(row).collect();
        let asked: Vec<BTreeMap<(i64, i64), Asked>> = trees
            .par_iter()
            .enumerate()
            .map(|(number, tree)| look.tree(tree, first + number, &along, &heights))
            .collect();
        let seen = cells.numbered().map(|((y, z, tree), cell)| {
            let asked = asked.get(tree as usize).and_then(|of_tree| of_tree.get(&(y, z)));
            SeenCell::of(cell, asked.copied().unwrap_or_default())
        });
        Some(seen.collect())
    }
}

impl SeenCell {
    fn of(cell: Cell, asked: Asked) -> Self {
        let CellAreas { leaf_area_m2, wood_area_m2, fruit_area_m2 } = cell.areas;
        // Too little for a patch of its own counts as hidden: a sliver at a face.
        let share = |kind: usize| {
            if asked.all[kind] > 0.0 { (asked.visible[kind] / asked.all[kind]).clamp(0.0, 1.0) } else { 0.0 }
        };
        let split = |area: f64, kind: usize| {
            let visible = area * share(kind);
            (visible, area - visible)
        };
        let ((leaf_visible_m2, leaf_hidden_m2), (wood_visible_m2, wood_hidden_m2)) =
            (split(leaf_area_m2, LEAF), split(wood_area_m2, WOOD));
        let (fruit_visible_m2, fruit_hidden_m2) = split(fruit_area_m2, FRUIT);
        Self {
            cell,
            leaf_visible_m2,
            leaf_hidden_m2,
            wood_visible_m2,
            wood_hidden_m2,
            fruit_visible_m2,
            fruit_hidden_m2,
        }
    }
}

const LEAF: usize = 0;
const WOOD: usize = 1;
const FRUIT: usize = 2;

/// A caster, and where the mirror passes: X and Z.
struct Look<'a> {
    caster: &'a Caster,
    mirror_m: [f64; 2],
    /// Z of the row's foot, from which cells count their heights.
    foot_m: f64,
}

impl Look<'_> {
    /// Asks all patches of a tree.
    fn tree(&self, tree: &Tree, number: usize, along: &Bins, heights: &Bins) -> BTreeMap<(i64, i64), Asked> {
        let mut cells: BTreeMap<(i64, i64), Asked> = BTreeMap::new();
        let mut scratch = Scratch::default();
        let number = u32::try_from(number).unwrap_or(Return::NO_LABEL);
        let mut ask = |patch: &Patch, kind: usize, organ: usize| {
            let [_, y_m, z_m] = patch.foot;
            let cell = cells
                .entry((along.in_period(along.bin_of(y_m)), heights.bin_of(z_m - self.foot_m)))
                .or_default();
            cell.all[kind] += patch.area_m2;
            let organ = u32::try_from(organ).unwrap_or(Return::NO_LABEL);
            if self.reaches(patch, kind == LEAF, (number, organ), &mut scratch) {
                cell.visible[kind] += patch.area_m2;
            }
        };
        for (organ, blade) in tree.leaves.iter().enumerate() {
            patches::of_blade(blade, |patch| ask(&patch, LEAF, organ));
        }
        for (organ, piece) in tree.wood.iter().enumerate() {
            patches::of_branch(piece, |patch| ask(&patch, WOOD, organ));
        }
        for (organ, facet) in tree.facets.iter().enumerate() {
            let kind = match facet.surface {
                Surface::Bark => WOOD,
                Surface::Fruit => FRUIT,
                Surface::Post | Surface::Wire | Surface::Soil | Surface::Grass => continue,
            };
            patches::of_blade(&facet.polygon, |patch| ask(&patch, kind, tree.wood.len() + organ));
        }
        cells
    }

    /// True if the beam to a patch ends on its organ. A branch's far side turns away; of a blade either face will do.
    fn reaches(&self, patch: &Patch, either_face: bool, organ: (u32, u32), scratch: &mut Scratch) -> bool {
        let ([x, y, z], [mirror_x, mirror_z]) = (patch.at, self.mirror_m);
        let (ahead, up) = (x - mirror_x, z - mirror_z);
        if !either_face && ahead * patch.normal[0] + up * patch.normal[2] >= 0.0 {
            return false;
        }
        let fan = BeamFan::from_degrees(libm::atan2(up, ahead).to_degrees(), 1.0, 1);
        let mut met = [Return::MISS];
        self.caster.cast(Pose { x_m: mirror_x, y_m: y, z_m: mirror_z }, &fan, scratch, &mut met);
        met.iter().all(|met| (met.tree, met.organ) == organ && (met.range_m - ahead.hypot(up)).abs() < NEAR_M)
    }
}

/// Between a patch and where its beam ends on its organ, metres: a piece of a branch bulges, a blade is cut once.
const NEAR_M: f64 = 0.01;
