//! The leaf kernel: polygon ∩ scan plane = segments; a segment covers a run of beams.

use glam::DVec3;

use super::nearest::Nearest;
use super::row_index::{Extent, RowIndex};
use super::sight::{Plane, Point, Segment, Sight};
use crate::organ::Leaf;

/// Leaves whose plane is nearer than this to the scan plane (sine of the angle) are edge-on and return nothing.
const PARALLEL: f64 = 1e-12;

/// Whose organ an entry is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Label {
    pub(super) tree: u32,
    pub(super) organ: u32,
}

/// All leaves of an orchard, images over the border of the period included, in the order of the row index.
#[derive(Clone, Debug, Default)]
pub(super) struct LeafField {
    index: RowIndex,
    labels: Vec<Label>,
    normals: Vec<[f64; 3]>,
    /// Where each entry's vertices start; one more than entries.
    starts: Vec<usize>,
    vertices: Vec<[f64; 3]>,
}

impl LeafField {
    pub(super) fn new<'a>(leaves: impl Iterator<Item = (Label, &'a Leaf)>, period_m: f64) -> Self {
        let images: Vec<(Label, &Leaf, f64, Extent)> = leaves
            .flat_map(|(label, leaf)| {
                let extent = Extent::around(leaf.outline().iter().map(|[_, y, _]| *y));
                extent.images(period_m).map(move |shift| {
                    (label, leaf, shift, Extent { from_m: extent.from_m + shift, to_m: extent.to_m + shift })
                })
            })
            .collect();
        let (index, order) = RowIndex::new(&images.iter().map(|(.., extent)| *extent).collect::<Vec<_>>());
        let mut field = Self { index, starts: vec![0], ..Self::default() };
        for (label, leaf, shift, _) in order.iter().filter_map(|number| images.get(*number)) {
            field.labels.push(*label);
            field.normals.push(leaf.normal());
            field.vertices.extend(leaf.outline().iter().map(|[x, y, z]| [*x, y + shift, *z]));
            field.starts.push(field.vertices.len());
        }
        field
    }

    /// Number of entries; owners below it are leaves.
    pub(super) fn len(&self) -> usize {
        self.labels.len()
    }

    pub(super) fn label(&self, entry: usize) -> Option<Label> {
        self.labels.get(entry).copied()
    }

    /// |direction · normal| of an entry.
    pub(super) fn cos_incidence(&self, entry: usize, direction: DVec3) -> f64 {
        self.normals.get(entry).map_or(0.0, |normal| DVec3::from_array(*normal).dot(direction).abs())
    }

    /// Enters every leaf that the plane y = `y_m` cuts, seen from (`x_m`, `z_m`).
    pub(super) fn cast<S: Sight>(
        &self,
        [x_m, y_m, z_m]: [f64; 3],
        sight: &S,
        crossings: &mut Vec<Point>,
        nearest: &mut Nearest,
    ) {
        for entry in self.index.at(y_m) {
            let (Some(normal), Some(bounds)) = (self.normals.get(entry), self.starts.get(entry..entry + 2))
            else {
                continue;
            };
            let &[from, to] = bounds else { continue };
            let outline = self.vertices.get(from..to).unwrap_or(&[]);
            let [nx, ny, nz] = *normal;
            if nx.abs().max(nz.abs()) < PARALLEL {
                continue;
            }
            cut(outline, y_m, crossings);
            if crossings.len() > 2 {
                // Non-convex: the crossings alternate in and out along the line in which the leaf's plane meets ours.
                let along = |p: &Point| nx * p.1 - nz * p.0;
                crossings.sort_by(|a, b| along(a).total_cmp(&along(b)));
            }
            let Some([qx, qy, qz]) = outline.first() else { continue };
            let distance = nx * (qx - x_m) + ny * (qy - y_m) + nz * (qz - z_m);
            let plane = Plane { normal: (nx, nz), distance };
            for pair in crossings.chunks_exact(2) {
                let [a, b] = pair else { continue };
                let (a, b) = ((a.0 - x_m, a.1 - z_m), (b.0 - x_m, b.1 - z_m));
                if let Some(segment) = sight.segment(a, b, plane) {
                    cover(segment, entry as u32, sight, nearest);
                }
            }
        }
    }
}

/// Where the outline crosses the plane y = `y_m`: an even number of points (X, Z). A vertex on the plane counts as below it.
fn cut(outline: &[[f64; 3]], y_m: f64, crossings: &mut Vec<Point>) {
    crossings.clear();
    let Some(mut from) = outline.last() else { return };
    for to in outline {
        if (from[1] > y_m) != (to[1] > y_m) {
            // Always from the lower end, so that two leaves that share an edge share the crossing to the last bit.
            let (low, high) = if from[1] > y_m { (to, from) } else { (from, to) };
            let share = (y_m - low[1]) / (high[1] - low[1]);
            crossings.push((low[0] + share * (high[0] - low[0]), low[2] + share * (high[2] - low[2])));
        }
        from = to;
    }
}

/// Enters a segment in every beam that meets it: two signs a beam, the first end included, the second not, so that of two segments
/// that share an end exactly one is met.
fn cover<S: Sight>(segment: Segment, owner: u32, sight: &S, nearest: &mut Nearest) {
    sight.runs(segment.low, segment.width, |beams| {
        let (p, q) = sight.parameters(beams.clone());
        for (beam, (p, q)) in beams.zip(p.iter().zip(q)) {
            if (segment.from.at(*p, *q) >= 0.0) & (segment.to.at(*p, *q) > 0.0) {
                nearest.offer(beam, segment.key.at(*p, *q), owner);
            }
        }
    });
}
