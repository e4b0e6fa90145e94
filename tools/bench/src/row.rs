//! Rows of trees to measure on: leaves at random in crowns, and branches.

use std::f64::consts::TAU;

use rowscan_scenes::seed::{Purpose, Stream};
use rowscan_scenes::{Cylinder, Leaf, Orchard, Tree};

/// Distance between trees, metres.
pub const SPACING_M: f64 = 1.5;

/// Distance between rows, metres.
pub const ROWS_M: f64 = 4.0;

/// Half of the blade of grown trees: (distance along the midrib / length, half width / length).
const HALF_BLADE: [(f64, f64); 3] = [(0.12, 0.2025), (0.40, 0.28125), (0.75, 0.21375)];

/// What a row is made of.
#[derive(Clone, Copy, Debug)]
pub struct Planting {
    /// Rows.
    pub rows: usize,
    /// Trees in a row.
    pub trees: usize,
    /// Leaves of a tree.
    pub leaves: usize,
    /// Length of a blade, metres; its width is 9/16 of that.
    pub blade_m: f64,
    /// Branches of a tree.
    pub branches: usize,
}

impl Planting {
    /// The orchard, the same for the same planting.
    pub fn orchard(self) -> Orchard {
        let trees = (0..self.rows * self.trees).map(|number| {
            let (row, place) = (number / self.trees, number % self.trees);
            let foot = [row as f64 * ROWS_M, (place as f64 + 0.5) * SPACING_M];
            self.tree(foot, &mut Purpose::Growth.stream(1, row as u32, place as u32))
        });
        Orchard::from_trees(trees.collect(), self.trees as f64 * SPACING_M, None, None)
    }

    /// One tree that stands at the origin; `number` tells it from others.
    pub fn tree_at_origin(self, number: u32) -> Tree {
        self.tree([0.0; 2], &mut Purpose::Growth.stream(1, 0, number))
    }

    /// Rays can go round a crown of 1.6 by 1.6 by 3 m, from 0.5 m up.
    fn tree(self, [x, y]: [f64; 2], stream: &mut Stream) -> Tree {
        let within = |stream: &mut Stream| loop {
            let [a, b, c] = std::array::from_fn(|_| 2.0 * stream.unit() - 1.0);
            if a * a + b * b + c * c <= 1.0 {
                return [x + 0.8 * a, y + 0.8 * b, 2.0 + 1.5 * c];
            }
        };
        let leaves = (0..self.leaves).filter_map(|_| leaf(within(stream), self.blade_m, stream)).collect();
        let mut wood: Vec<Cylinder> = Cylinder::new([x, y, 0.0], [x, y, 3.0], 0.03).into_iter().collect();
        wood.extend((1..self.branches).filter_map(|_| {
            let (base, along) = (within(stream), direction(stream));
            let (length, radius) = (0.05 + 0.25 * stream.unit(), 0.001 + 0.003 * stream.unit());
            Cylinder::new(base, std::array::from_fn(|i| base[i] + length * along[i]), radius).ok()
        }));
        Tree { leaves, wood, ..Tree::default() }
    }
}

fn leaf(foot: [f64; 3], length: f64, stream: &mut Stream) -> Option<Leaf> {
    let (midrib, other) = (direction(stream), direction(stream));
    let across = cross(midrib, other);
    let norm = across.iter().map(|c| c * c).sum::<f64>().sqrt();
    let at = |u: f64, v: f64| -> [f64; 3] {
        std::array::from_fn(|i| foot[i] + length * (u * midrib[i] + v * across[i] / norm))
    };
    let side = |sign: f64| HALF_BLADE.iter().map(move |(u, v)| at(*u, sign * v));
    let mut outline = vec![at(0.0, 0.0)];
    outline.extend(side(1.0));
    outline.push(at(1.0, 0.0));
    outline.extend(side(-1.0).rev());
    Leaf::new(outline).ok()
}

fn direction(stream: &mut Stream) -> [f64; 3] {
    let (z, turn) = (2.0 * stream.unit() - 1.0, TAU * stream.unit());
    let flat = (1.0 - z * z).sqrt();
    [flat * turn.cos(), flat * turn.sin(), z]
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}
