//! What shape an orchard has: the figures by which growers and sprayer guides describe canopies.

use glam::DVec2;
use serde::Serialize;

use crate::orchard::grown::Orchard;
use crate::organ::{Cylinder, Leaf, Tree};

/// Thickness of the slices whose hulls make the crown volume, metres.
pub(crate) const SLICE_M: f64 = 0.25;

/// Side of the cells that light is looked for in, metres.
pub(crate) const CELL_M: f64 = 0.01;

/// The shape of a row.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct CanopyForm {
    /// Highest point, mean over the trees, metres.
    pub height_m: f64,
    /// Lowest leaf, mean over the trees, metres.
    pub clear_m: f64,
    /// Extent of the leaves across the row, 2nd to 98th percentile of their centroids by area, mean over the trees, metres.
    pub width_m: f64,
    /// Volume of the crowns, m³ a tree: convex hulls of the leaves, by slices of 0.25 m, each tree by itself.
    pub crown_volume_m3: f64,
    /// Leaf area over crown volume, m²/m³.
    pub leaf_area_density_m2_m3: f64,
    /// Mean inclination of the leaves from the horizontal, weighted by area, degrees.
    pub inclination_deg: f64,
    /// G(0°): leaf area seen along a level beam square to the row, over leaf area.
    pub projection: f64,
    /// Share of level lines square to the row, from the lowest leaf of the row to its mean height, that pass through without meeting
    /// leaf or wood.
    pub gap_fraction: f64,
}

impl CanopyForm {
    /// The shape of one row; None where it bears no leaf.
    pub fn of_row(orchard: &Orchard, row: usize) -> Option<Self> {
        let trees: Vec<Tree> = orchard.trees_from_foot(row).map(|tree| tree.into_owned()).collect();
        let clothed: Vec<&Tree> = trees.iter().filter(|tree| !tree.leaves.is_empty()).collect();
        let mean = |of: &dyn Fn(&Tree) -> f64| {
            clothed.iter().map(|tree| of(tree)).sum::<f64>() / clothed.len().max(1) as f64
        };
        let leaves = || clothed.iter().flat_map(|tree| &tree.leaves);
        let area_m2: f64 = leaves().map(Leaf::area_m2).sum();
        let volume_m3: f64 = clothed.iter().map(|tree| crown_volume_m3(tree)).sum();
        if clothed.is_empty() || volume_m3 <= 0.0 {
            return None;
        }
        let weighted =
            |of: &dyn Fn(&Leaf) -> f64| leaves().map(|leaf| leaf.area_m2() * of(leaf)).sum::<f64>() / area_m2;
        let height_m = mean(&top_m);
        let lowest_m = clothed.iter().map(|tree| lowest_leaf_m(tree)).fold(f64::INFINITY, f64::min);
        Some(Self {
            height_m,
            clear_m: mean(&lowest_leaf_m),
            width_m: mean(&width_m),
            crown_volume_m3: volume_m3 / clothed.len() as f64,
            leaf_area_density_m2_m3: area_m2 / volume_m3,
            inclination_deg: weighted(&|leaf| libm::acos(leaf.normal()[2].abs().min(1.0)).to_degrees()),
            projection: weighted(&|leaf| leaf.normal()[0].abs()),
            gap_fraction: gap_fraction(&trees, orchard.length_m(), (lowest_m, height_m)),
        })
    }
}

fn top_m(tree: &Tree) -> f64 {
    let leaves = tree.leaves.iter().flat_map(|leaf| leaf.outline().iter().map(|vertex| vertex[2]));
    leaves.chain(tree.wood.iter().map(Cylinder::top_m)).fold(0.0, f64::max)
}

fn lowest_leaf_m(tree: &Tree) -> f64 {
    let heights = tree.leaves.iter().flat_map(|leaf| leaf.outline().iter().map(|vertex| vertex[2]));
    heights.fold(f64::INFINITY, f64::min)
}

fn width_m(tree: &Tree) -> f64 {
    let mut across: Vec<(f64, f64)> =
        tree.leaves.iter().map(|leaf| (leaf.centroid()[0], leaf.area_m2())).collect();
    across.sort_by(|a, b| a.0.total_cmp(&b.0));
    let whole: f64 = across.iter().map(|(_, area)| area).sum();
    let at = |share: f64| {
        let mut sum = 0.0;
        let found = across.iter().find(|(_, area)| {
            sum += area;
            sum >= share * whole
        });
        found.or(across.last()).map_or(0.0, |(x, _)| *x)
    };
    at(0.98) - at(0.02)
}

/// Volume of a tree's crown: areas of the convex hulls of all leaf vertices of a slice, times its thickness.
pub(crate) fn crown_volume_m3(tree: &Tree) -> f64 {
    let mut slices: std::collections::BTreeMap<i64, Vec<DVec2>> = std::collections::BTreeMap::new();
    for [x, y, z] in tree.leaves.iter().flat_map(|leaf| leaf.outline().iter().copied()) {
        slices.entry((z / SLICE_M).floor() as i64).or_default().push(DVec2::new(x, y));
    }
    slices.into_values().map(|points| hull_area_m2(points) * SLICE_M).sum()
}

/// Area of the convex hull of points, by Andrew's monotone chain.
fn hull_area_m2(mut points: Vec<DVec2>) -> f64 {
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    let half = |points: &mut dyn Iterator<Item = DVec2>| {
        let mut chain: Vec<DVec2> = Vec::new();
        for point in points {
            while let [.., a, b] = chain.as_slice() {
                if (*b - *a).perp_dot(point - *a) > 0.0 {
                    break;
                }
                chain.pop();
            }
            chain.push(point);
        }
        chain
    };
    let lower = half(&mut points.iter().copied());
    let upper = half(&mut points.iter().rev().copied());
    let ring: Vec<DVec2> = lower.into_iter().chain(upper).collect();
    let next = ring.iter().cycle().skip(1);
    0.5 * ring.iter().zip(next).map(|(a, b)| a.perp_dot(*b)).sum::<f64>().abs()
}

/// Share of the cells of a wall along the row, between two heights, that nothing of the trees covers; the row repeats.
fn gap_fraction(trees: &[Tree], length_m: f64, (from_m, to_m): (f64, f64)) -> f64 {
    let length_m = if length_m.is_finite() { length_m } else { return f64::NAN };
    let cells = |extent_m: f64| (extent_m / CELL_M).round().clamp(1.0, 1e5) as usize;
    let (wide, high) = (cells(length_m), cells(to_m - from_m));
    let mut covered = vec![false; wide * high];
    let mut cover = |polygon: &[DVec2]| {
        let low = polygon.iter().copied().fold(DVec2::INFINITY, DVec2::min);
        let top = polygon.iter().copied().fold(DVec2::NEG_INFINITY, DVec2::max);
        let first = |value: f64| (value / CELL_M - 0.5).ceil() as i64;
        for row in first(low.y - from_m).max(0)..=(first(top.y - from_m) - 1).min(high as i64 - 1) {
            for column in first(low.x)..first(top.x) {
                let middle = DVec2::new((column as f64 + 0.5) * CELL_M, from_m + (row as f64 + 0.5) * CELL_M);
                if is_inside(polygon, middle) {
                    let at = row as usize * wide + column.rem_euclid(wide as i64) as usize;
                    covered.get_mut(at).into_iter().for_each(|cell| *cell = true);
                }
            }
        }
    };
    for tree in trees {
        for leaf in &tree.leaves {
            let flat: Vec<DVec2> = leaf.outline().iter().map(|[_, y, z]| DVec2::new(*y, *z)).collect();
            cover(&flat);
        }
        for piece in &tree.wood {
            cover(&silhouette(piece));
        }
    }
    covered.iter().filter(|cell| !**cell).count() as f64 / covered.len() as f64
}

/// A cylinder seen across the row: a strip of its thickness.
fn silhouette(piece: &Cylinder) -> [DVec2; 4] {
    let flat = |[_, y, z]: [f64; 3]| DVec2::new(y, z);
    let (base, tip) = (flat(piece.base()), flat(piece.tip()));
    let side = (tip - base).try_normalize().unwrap_or(DVec2::Y).perp() * piece.radius_m();
    [base + side, tip + side, tip - side, base - side]
}

/// Even-odd rule.
fn is_inside(polygon: &[DVec2], point: DVec2) -> bool {
    let next = polygon.iter().cycle().skip(1);
    polygon
        .iter()
        .zip(next)
        .filter(|(a, b)| {
            (a.y > point.y) != (b.y > point.y) && point.x < a.x + (b.x - a.x) * (point.y - a.y) / (b.y - a.y)
        })
        .count()
        % 2
        == 1
}
