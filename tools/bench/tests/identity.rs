//! The caster and parry3d's hierarchy meet the same organs.

#![allow(missing_docs)]

use rowscan_benches::peer::{FARTHEST_M, Peer};
use rowscan_benches::row::Planting;
use rowscan_protocol::scan::Pose;
use rowscan_scenes::{BeamFan, Beams, Caster, Class, Layers, Scratch};

/// Agreement of ranges, metres.
const CLOSE_M: f64 = 1e-4;

#[test]
fn every_return_is_the_peers_but_for_edges() {
    let planting = Planting { rows: 2, trees: 2, leaves: 600, blade_m: 0.08, branches: 150 };
    let orchard = planting.orchard();
    let (caster, peer) = (Caster::new(&orchard), Peer::new(&orchard));
    let still = BeamFan::from_degrees(-90.0, 0.25, 721);
    let (mut scratch, mut layers) = (Scratch::default(), Layers::default());
    let (mut asked, mut odd, mut worst) = (0, 0, 0.0f64);
    for fan in [still.clone(), still.advancing(0.015 / 721.0)] {
        let beams = Beams::from(fan);
        for line in 0..120 {
            let origin = Pose { x_m: -1.9, y_m: f64::from(line) * 0.0237, z_m: 1.6 };
            caster.cast_layers(origin, &beams, 3, &mut scratch, &mut layers);
            for (beam, ((mut start, direction), ours)) in beams.rays(origin).zip(layers.nearest()).enumerate()
            {
                start[1] = start[1].rem_euclid(orchard.length_m());
                let ground = if direction[2] < 0.0 { (start[2] / -direction[2]) as f32 } else { FARTHEST_M };
                let theirs = peer.nearest(start, direction, ground);
                asked += 1;
                let same = match (ours.class, theirs) {
                    (Class::Ground | Class::None, None) => true,
                    (Class::Leaf | Class::Wood, Some(hit)) => {
                        let apart = (ours.range_m - f64::from(hit.range_m)).abs();
                        let same =
                            hit.label == (ours.tree, ours.organ) && hit.wood == (ours.class == Class::Wood);
                        if same {
                            worst = worst.max(apart);
                        }
                        same || apart < CLOSE_M
                    }
                    _ => false,
                };
                let (first, wood) = peer.layers(start, direction, ground);
                let expected = first.iter().take_while(|range| **range < wood);
                let found = layers.leaves(beam);
                let layers_same = expected.clone().count() == found.len()
                    && expected.zip(found).all(|(a, b)| (f64::from(*a) - b.range_m).abs() < CLOSE_M);
                odd += usize::from(!same || !layers_same);
            }
        }
    }
    // The peer works in single precision: at a beam that grazes an edge it may decide otherwise.
    assert!(asked > 170_000 && odd * 2_000 < asked, "{odd} of {asked} differ");
    assert!(worst < CLOSE_M, "{worst} m");
}
