//! The shady index beside the same question asked by rays: does any other leaf stand in one of 104 half-lines from a leaf's middle?

use std::hint::black_box;

use rowscan_scenes::Leaf;
use rowscan_scenes::growth::shade::{RaySet, RayWeight, shaded_percent};

use crate::measure::{Case, Report};
use crate::peer::{PARRY, Peer};
use crate::row::Planting;

/// Of so many leaves the peer asks one.
const SHARE: usize = 25;

/// Leaves of the trees, all of one size: in a larger one a leaf has more beside it.
const TREES: [usize; 3] = [5_000, 50_000, 200_000];

/// Half-lines of a leaf: bearing every 45°, elevation every 15°, the poles eight times.
const RAYS: usize = 104;

/// Trees of as much room, on one thread and on all.
pub fn run(report: &mut Report, _arguments: &[String]) {
    for leaves in TREES {
        compare(report, leaves);
    }
}

fn compare(report: &mut Report, leaves: usize) {
    let planting = Planting { rows: 1, trees: 1, leaves, blade_m: 0.05, branches: 1 };
    let name = format!("tree of {} k leaves, 104 half-lines", leaves / 1000);
    let tree = planting.orchard().distinct_trees().first().cloned().unwrap_or_default();
    let leaves: Vec<&Leaf> = tree.leaves.iter().collect();
    let peer = Peer::new(&rowscan_scenes::Orchard::from_organs(tree.leaves.clone(), vec![], f64::INFINITY));
    let directions: Vec<[f64; 3]> = (-6..=6)
        .flat_map(|elevation| (0..8).map(move |bearing| (elevation, bearing)))
        .map(|(elevation, bearing)| {
            let ((sin_e, cos_e), (sin_b, cos_b)) = (
                f64::from(elevation * 15).to_radians().sin_cos(),
                f64::from(bearing * 45).to_radians().sin_cos(),
            );
            [cos_e * cos_b, cos_e * sin_b, sin_e]
        })
        .collect();
    let rays = |leaves: usize| (leaves * RAYS) as f64 * 1e-6;
    let work = [rays(leaves.len()), rays(leaves.len().div_ceil(SHARE))];
    for threads in [1, std::thread::available_parallelism().map_or(1, usize::from)] {
        let Ok(pool) = rayon::ThreadPoolBuilder::new().num_threads(threads).build() else { continue };
        let case = Case { name: name.clone(), unit: "Mrays/s", peer: PARRY, threads, work };
        let ours = || {
            pool.install(|| black_box(shaded_percent(&leaves, RaySet::Literal104, RayWeight::Count)));
        };
        let ask = || {
            for (number, leaf) in leaves.iter().enumerate().step_by(SHARE) {
                for direction in &directions {
                    black_box(peer.any_leaf(leaf.centroid(), *direction, 1e-6, number as u32));
                }
            }
        };
        report.compare(&case, 3, ours, ask);
    }
}
