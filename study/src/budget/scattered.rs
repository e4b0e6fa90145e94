//! The same leaves in the same voxels, at random places in them.

use rowscan_canopy::VoxelGrid;
use rowscan_protocol::random::Stream;
use rowscan_scenes::{Leaf, Orchard, Tree};

/// What the random places are keyed by, beside the seed.
const STREAM: u64 = 0x7374_7265_776e;

/// Every leaf as `pieces` of its shape, inclination and bearing, with its area in all, centres uniform over the voxel that its own lies in.
pub(super) fn scattered(orchard: &Orchard, grid: &VoxelGrid, pieces: u32, seed: u64) -> Orchard {
    let trees = orchard.trees().enumerate().map(|(number, tree)| {
        let mut stream = Stream::keyed(seed, &[STREAM, number as u64, u64::from(pieces)]);
        let mut leaves = Vec::with_capacity(tree.leaves.len() * pieces as usize);
        for leaf in &tree.leaves {
            let piece = leaf.scaled(1.0 / f64::from(pieces).sqrt()).unwrap_or_else(|_| leaf.clone());
            for _ in 0..pieces {
                leaves.push(placed(&piece, leaf.centroid(), grid, &mut stream));
            }
        }
        Tree { leaves, ..Tree::default() }
    });
    Orchard::from_trees(
        trees.collect(),
        orchard.length_m(),
        orchard.tree_spacing_m(),
        orchard.row_spacing_m(),
    )
}

/// A leaf with its centre anywhere in the voxel that `home` lies in.
fn placed(leaf: &Leaf, home: [f64; 3], grid: &VoxelGrid, stream: &mut Stream) -> Leaf {
    let own = leaf.centroid();
    let mut by = [0.0; 3];
    for ((((by, own), home), corner_m), edge_m) in
        by.iter_mut().zip(own).zip(home).zip(grid.corner_m).zip(grid.edge_m)
    {
        let place_m = corner_m + (((home - corner_m) / edge_m).floor() + stream.unit()) * edge_m;
        *by = place_m - own;
    }
    leaf.translated(by)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn leaves_keep_area_angle_and_voxel() {
        let grid = VoxelGrid { corner_m: [-2.0, 0.0, 0.1], edge_m: [0.25, 0.25, 0.25] };
        let leaf = Leaf::new([[0.1, 0.6, 1.0], [0.18, 0.6, 1.02], [0.18, 0.65, 1.02], [0.1, 0.65, 1.0]])
            .expect("a leaf");
        let orchard = Orchard::from_trees(
            vec![Tree { leaves: vec![leaf.clone(); 50], ..Tree::default() }],
            2.0,
            Some(2.0),
            None,
        );
        let voxel = |leaf: &Leaf| [0, 1, 2].map(|k| ((leaf.centroid()[k] - grid.corner_m[k]) / 0.25).floor());
        for pieces in [1, 9] {
            let scattered = scattered(&orchard, &grid, pieces, 7);
            let leaves: Vec<Leaf> = scattered.trees().flat_map(|tree| tree.leaves.clone()).collect();
            let area_m2: f64 = leaves.iter().map(Leaf::area_m2).sum();
            assert!((area_m2 / (50.0 * leaf.area_m2()) - 1.0).abs() < 1e-9);
            assert!(leaves.iter().all(|piece| voxel(piece) == voxel(&leaf)));
            assert!(leaves.iter().all(|piece| (piece.normal()[2] - leaf.normal()[2]).abs() < 1e-12));
            let mean_x = leaves.iter().map(|leaf| leaf.centroid()[0]).sum::<f64>() / leaves.len() as f64;
            assert!((mean_x - 0.125).abs() < 0.04, "spread over the voxel: {mean_x}");
        }
    }
}
