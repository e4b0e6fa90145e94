//! What is scanned, and how far it reaches.

use std::ops::Range;

use crate::orchard::Orchard;

/// The trees whose areas count, and where they stand.
#[derive(Clone, Debug, PartialEq)]
pub struct Target {
    /// Numbers of the trees, as in [`Orchard::trees`].
    pub trees: Range<u32>,
    /// X of the axis of the row nearest to X = −∞, metres.
    pub near_axis_x_m: f64,
    /// X of the axis of the row farthest from it; the same for a single row.
    pub far_axis_x_m: f64,
    /// How far leaves, wood, posts and wires reach; None if there is nothing.
    pub extent: Option<Extent>,
    /// Period along Y, metres; infinite where the scene does not repeat.
    pub period_m: f64,
}

/// The box around leaves, wood, posts and wires, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extent {
    /// Least X, Y, Z.
    pub low: [f64; 3],
    /// Greatest X, Y, Z.
    pub high: [f64; 3],
}

impl Target {
    /// One row of an orchard. None if there is no such row.
    pub fn row(orchard: &Orchard, row: usize) -> Option<Self> {
        (row < orchard.rows()).then(|| Self::rows(orchard, row..row + 1))
    }

    /// All rows of an orchard.
    pub fn whole(orchard: &Orchard) -> Self {
        Self::rows(orchard, 0..orchard.rows())
    }

    fn rows(orchard: &Orchard, rows: Range<usize>) -> Self {
        let trees = rows.start * orchard.trees_per_row()..rows.end * orchard.trees_per_row();
        let number = |tree: usize| u32::try_from(tree).unwrap_or(u32::MAX);
        let axis = |row: usize| orchard.row_spacing_m().map_or(0.0, |spacing_m| row as f64 * spacing_m);
        let mut extent = Extent::NOTHING;
        for tree in orchard.trees().skip(trees.start).take(trees.len()) {
            let facets = tree.facets.iter().map(|facet| &facet.polygon);
            for vertex in tree.leaves.iter().chain(facets).flat_map(|leaf| leaf.outline()) {
                extent.add(*vertex, 0.0);
            }
            for piece in &tree.wood {
                extent.add(piece.base(), piece.radius_m());
                extent.add(piece.tip(), piece.radius_m());
            }
        }
        for (_, support) in rows.clone().flat_map(|row| orchard.supports_of_row(row)) {
            extent.add(support.shape.base(), support.shape.radius_m());
            extent.add(support.shape.tip(), support.shape.radius_m());
        }
        Self {
            trees: number(trees.start)..number(trees.end),
            near_axis_x_m: axis(rows.start),
            far_axis_x_m: axis(rows.end.saturating_sub(1)),
            extent: extent.low.iter().zip(&extent.high).all(|(low, high)| low <= high).then_some(extent),
            period_m: orchard.period_m(),
        }
    }
}

impl Extent {
    const NOTHING: Self = Self { low: [f64::INFINITY; 3], high: [f64::NEG_INFINITY; 3] };

    fn add(&mut self, point: [f64; 3], margin_m: f64) {
        for ((low, high), coordinate) in self.low.iter_mut().zip(&mut self.high).zip(point) {
            *low = low.min(coordinate - margin_m);
            *high = high.max(coordinate + margin_m);
        }
    }
}
