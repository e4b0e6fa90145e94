//! An MRS1000 in an orchard: the points of every layer are where the leaves are that its beams met.

use crate::common;

use std::collections::BTreeMap;

use common::points::Leaves;
use common::small_scene;
use rowscan_canopy::Placing;
use rowscan_emulator::offline::Offline;
use rowscan_emulator::stage::Stage;
use rowscan_protocol::client::ColaConfig;
use rowscan_protocol::model;
use rowscan_protocol::rig::{Orientation, Roof, RowSide};
use rowscan_protocol::scan::Scan;

/// How far a point may be beside its leaf, metres: the facets of a cone, whole millimetres, and beams that advance by chords.
const BESIDE_M: f64 = 0.004;

/// Points by layer: all of them, and those on the leaf that the beam met. Codes are read as the sheet has them, or mirrored.
fn points_on_leaves(
    orientation: Orientation,
    roof: Option<Roof>,
    mirrored: bool,
) -> BTreeMap<i16, (u32, u32)> {
    let mut scene = small_scene();
    let mut mount = scene.rig.scanners[0].clone();
    (mount.orientation, mount.roof, mount.row) = (orientation, roof, RowSide::Right);
    scene.rig.scanners = vec![mount];
    let stage = Stage::grow(scene, &|_, _| {}).expect("it grows");
    let model = model::by_name("mrs1000").expect("known");
    let (device, view) = stage.scanner(0, model).expect("it fits");
    let mut offline = Offline::new(device, view);
    offline.set_up(ColaConfig::default()).expect("it takes it");
    let mut placing = Placing::new(Some(stage.rig.clone()), 0, Some(0));
    let leaves = Leaves { orchard: &stage.orchard, beside_m: BESIDE_M, periods: 1 };
    let (mut found, mut scan) = (BTreeMap::<i16, (u32, u32)>::new(), Scan::default());
    for _ in 0..40 {
        if !offline.scan_into(&mut scan).expect("sound") {
            continue;
        }
        let layer = scan.layer_centideg;
        scan.layer_centideg = if mirrored { -layer } else { layer };
        let (all, on) = leaves.points(&mut placing, &scan, offline.returns());
        let sum = found.entry(layer).or_default();
        *sum = (sum.0 + all, sum.1 + on);
    }
    found
}

#[test]
fn points_of_every_layer_are_on_the_leaves_that_its_beams_met() {
    for (orientation, roof) in [
        (Orientation::Side, None),
        (Orientation::Side, Some(Roof::Forward)),
        (Orientation::Up, Some(Roof::Backward)),
    ] {
        let found = points_on_leaves(orientation, roof, false);
        assert_eq!(found.keys().copied().collect::<Vec<_>>(), [-500, -250, 0, 250]);
        for (layer, (all, on)) in found {
            assert!(all > 300, "{orientation:?} {roof:?}, layer {layer}: {all} leaves");
            // A leaf seen edge-on is met far beside the place where a beam 0.3 mm a metre beside this one would meet it.
            let spare = if layer == 0 { 0 } else { all / 50 };
            assert!(
                on + spare >= all,
                "{orientation:?} {roof:?}, layer {layer}: {on} of {all} on their leaves"
            );
        }
    }
}

/// The wrong twin: codes that count upwards.
#[test]
fn layers_that_are_mirrored_lie_beside_the_leaves() {
    for (layer, (all, on)) in points_on_leaves(Orientation::Side, None, true) {
        let share = f64::from(on) / f64::from(all);
        assert!(if layer == 0 { share == 1.0 } else { share < 0.5 }, "layer {layer}: {on} of {all}");
    }
}
