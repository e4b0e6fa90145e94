//! What is there in small: exact leaf, wood and fruit areas by cell along the row and height band, of every row.
//!
//! Leaves, fruit and bark of meshes are cut exactly at the faces of cells and bands. A branch is shared out by length along its axis.

use std::collections::BTreeMap;

use glam::DVec3;
use rayon::prelude::*;
use serde::Serialize;

use crate::bins::{Axis, Bins};
use crate::orchard::grown::Orchard;
use crate::organ::{Cylinder, Leaf, Surface, Tree};
use crate::polygon;

/// The sizes of cells.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CellGrid {
    /// Length of a cell along the row, metres; the last one ends with the row.
    pub cell_m: f64,
    /// Thickness of a height band, metres.
    pub band_m: f64,
}

impl Default for CellGrid {
    fn default() -> Self {
        Self { cell_m: 0.1, band_m: 0.5 }
    }
}

impl CellGrid {
    /// Cells along a row of this length, and height bands; None where a size is none.
    pub(crate) fn bins(self, length_m: f64) -> Option<(Bins, Bins)> {
        let along = if length_m.is_finite() {
            Bins::along_row(length_m, self.cell_m)
        } else {
            Bins::even(Axis::Y, self.cell_m)
        };
        along.zip(Bins::even(Axis::Z, self.band_m))
    }
}

/// One-sided leaf area, lateral surface of the wood, surface of the fruit, m².
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct CellAreas {
    /// One-sided leaf area, m².
    pub leaf_area_m2: f64,
    /// Lateral surface of the wood, m².
    pub wood_area_m2: f64,
    /// Surface of the fruit, m².
    pub fruit_area_m2: f64,
}

impl CellAreas {
    fn add(&mut self, other: Self) {
        self.leaf_area_m2 += other.leaf_area_m2;
        self.wood_area_m2 += other.wood_area_m2;
        self.fruit_area_m2 += other.fruit_area_m2;
    }

    /// The same without what rounding leaves at a face that an edge lies on; None if that is all.
    fn settled(self) -> Option<Self> {
        const LEAST_M2: f64 = 1e-12;
        let settled = |area: f64| if area < LEAST_M2 { 0.0 } else { area };
        let settled = Self {
            leaf_area_m2: settled(self.leaf_area_m2),
            wood_area_m2: settled(self.wood_area_m2),
            fruit_area_m2: settled(self.fruit_area_m2),
        };
        (settled != Self::default()).then_some(settled)
    }
}

/// What one tree has in one cell.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Cell {
    /// The row, from 0.
    pub row: usize,
    /// Place of the tree that it belongs to, from 0; crowns reach into their neighbours' cells.
    pub tree: u32,
    /// Lower face along the row, metres.
    pub y_from_m: f64,
    /// Upper face along the row, metres.
    pub y_to_m: f64,
    /// Lower height, metres.
    pub z_from_m: f64,
    /// Upper height, metres.
    pub z_to_m: f64,
    /// What is in it.
    #[serde(flatten)]
    pub areas: CellAreas,
}

/// A height band of a column.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ColumnBand {
    /// Lower height, metres.
    pub z_from_m: f64,
    /// Upper height, metres.
    pub z_to_m: f64,
    /// What all trees have in it.
    #[serde(flatten)]
    pub areas: CellAreas,
}

/// One cell of a row with all its heights.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CellColumn {
    /// Lower face along the row, metres.
    pub y_from_m: f64,
    /// Upper face along the row, metres.
    pub y_to_m: f64,
    /// From the row's lowest organ to its highest; empty bands too.
    pub bands: Vec<ColumnBand>,
}

/// The cells of one row.
#[derive(Clone, Debug, PartialEq)]
pub struct RowCells {
    row: usize,
    along: Bins,
    heights: Bins,
    /// By cell along the row, band and tree.
    areas: BTreeMap<(i64, i64, u32), CellAreas>,
    /// Lowest and highest band of the row.
    reach: Option<(i64, i64)>,
}

impl Orchard {
    /// The cells of one row; none where there is no such row, or a size is not a positive number. Parts beyond the row's end count where
    /// the row repeats them.
    pub fn cells_of_row(&self, row: usize, grid: CellGrid) -> Option<RowCells> {
        let (along, heights) = grid.bins(self.period_m())?;
        (row < self.rows()).then_some(())?;
        let mut cells = RowCells { row, along, heights, areas: BTreeMap::new(), reach: None };
        for (number, tree) in (0..).zip(self.trees_from_foot(row)) {
            cells.add(number, &tree);
        }
        cells.areas.retain(|_, areas| areas.settled().inspect(|settled| *areas = *settled).is_some());
        let bands = || cells.areas.keys().map(|(_, band, _)| *band);
        cells.reach = bands().min().zip(bands().max());
        Some(cells)
    }

    /// The cells of all rows.
    pub fn cells(&self, grid: CellGrid) -> Vec<RowCells> {
        let rows: Vec<_> = (0..self.rows()).into_par_iter().map(|row| self.cells_of_row(row, grid)).collect();
        rows.into_iter().flatten().collect()
    }
}

impl RowCells {
    /// The row, from 0.
    pub fn row(&self) -> usize {
        self.row
    }

    /// The cells with anything in them, along the row, upwards, by tree.
    pub fn cells(&self) -> impl Iterator<Item = Cell> + '_ {
        self.numbered().map(|(_, cell)| cell)
    }

    /// The same, with their numbers along the row and upwards, and their trees'.
    pub(crate) fn numbered(&self) -> impl Iterator<Item = ((i64, i64, u32), Cell)> + '_ {
        self.areas.iter().map(|(&(cell, band, tree), &areas)| {
            let ([y_from_m, y_to_m], [z_from_m, z_to_m]) = (self.y_m(cell), self.z_m(band));
            ((cell, band, tree), Cell { row: self.row, tree, y_from_m, y_to_m, z_from_m, z_to_m, areas })
        })
    }

    /// The cell at `y_m` along the row, where the row repeats it, with what all trees have in it.
    pub fn column(&self, y_m: f64) -> CellColumn {
        let cell = self.along.in_period(self.along.bin_of(y_m));
        let bands = self.reach.map_or(0..0, |(low, high)| low..high + 1);
        let band = |band: i64| {
            let mut areas = CellAreas::default();
            let trees = self.areas.range((cell, band, 0)..=(cell, band, u32::MAX));
            trees.for_each(|(_, of_tree)| areas.add(*of_tree));
            let [z_from_m, z_to_m] = self.z_m(band);
            ColumnBand { z_from_m, z_to_m, areas }
        };
        let [y_from_m, y_to_m] = self.y_m(cell);
        CellColumn { y_from_m, y_to_m, bands: bands.map(band).collect() }
    }

    fn y_m(&self, cell: i64) -> [f64; 2] {
        self.along.faces_m(cell).map(to_nanometres)
    }

    fn z_m(&self, band: i64) -> [f64; 2] {
        self.heights.faces_m(band).map(to_nanometres)
    }

    fn add(&mut self, number: u32, tree: &Tree) {
        let Self { along, heights, areas, .. } = self;
        let mut put = |cell: i64, band: i64, part: CellAreas| {
            areas.entry((along.in_period(cell), band, number)).or_default().add(part);
        };
        let mut knife = Knife { along, heights, scratch: Vec::new(), strip: Vec::new() };
        let leaf = |leaf_area_m2| CellAreas { leaf_area_m2, ..CellAreas::default() };
        let wood = |wood_area_m2| CellAreas { wood_area_m2, ..CellAreas::default() };
        let fruit = |fruit_area_m2| CellAreas { fruit_area_m2, ..CellAreas::default() };
        for blade in &tree.leaves {
            knife.polygon(blade, |cell, band, area| put(cell, band, leaf(area)));
        }
        for facet in &tree.facets {
            match facet.surface {
                Surface::Bark => {
                    knife.polygon(&facet.polygon, |cell, band, area| put(cell, band, wood(area)));
                }
                Surface::Fruit => {
                    knife.polygon(&facet.polygon, |cell, band, area| put(cell, band, fruit(area)));
                }
                Surface::Post | Surface::Wire | Surface::Soil | Surface::Grass => {}
            }
        }
        for piece in &tree.wood {
            knife.branch(piece, |cell, band, area| put(cell, band, wood(area)));
        }
    }
}

/// A face as it is written: 0.3 and not 0.30000000000000004.
fn to_nanometres(face_m: f64) -> f64 {
    (face_m * 1e9).round() / 1e9
}

/// Cuts organs along the row first, then upwards.
struct Knife<'a> {
    along: &'a Bins,
    heights: &'a Bins,
    scratch: Vec<[f64; 3]>,
    strip: Vec<[f64; 3]>,
}

impl Knife<'_> {
    /// Calls `add(cell, band, area)` for every part of a polygon.
    fn polygon(&mut self, polygon: &Leaf, mut add: impl FnMut(i64, i64, f64)) {
        let normal = DVec3::from_array(polygon.normal());
        // Along one normal, so that the parts of an outline that is not quite plane add up too.
        let area = |outline: &[[f64; 3]]| polygon::vector_area(outline).dot(normal);
        let [low, high] = self.along.extent_m(polygon.outline()).map(|y_m| self.along.bin_of(y_m));
        for cell in low..=high {
            let strip = if low == high {
                polygon.outline()
            } else {
                self.along.clip(polygon.outline(), cell, &mut self.scratch, &mut self.strip);
                &self.strip
            };
            if strip.len() < 3 {
                continue;
            }
            let below = |face_m| {
                polygon::clip(strip, Axis::Z as usize, face_m, polygon::Keep::Below, &mut self.scratch);
                area(&self.scratch)
            };
            let extent_m = self.heights.extent_m(strip);
            self.heights.cut(extent_m, area(strip), below, |band, area| add(cell, band, area));
        }
    }

    /// The same of a branch: it is shared out by length along its axis.
    fn branch(&mut self, piece: &Cylinder, mut add: impl FnMut(i64, i64, f64)) {
        let (base, tip) = (DVec3::from_array(piece.base()), DVec3::from_array(piece.tip()));
        let mut shares = vec![0.0, 1.0];
        for (bins, from, to) in [(self.along, base.y, tip.y), (self.heights, base.z, tip.z)] {
            let (low, high) = (bins.bin_of(from.min(to)), bins.bin_of(from.max(to)));
            let share = |face: i64| ((bins.face_m(face) - from) / (to - from)).clamp(0.0, 1.0);
            shares.extend((low + 1..=high).map(share));
        }
        shares.sort_unstable_by(f64::total_cmp);
        for pair in shares.windows(2) {
            let &[from, to] = pair else { continue };
            let middle = base.lerp(tip, from.midpoint(to));
            let (cell, band) = (self.along.bin_of(middle.y), self.heights.bin_of(middle.z));
            add(cell, band, piece.area_m2() * (to - from));
        }
    }
}
