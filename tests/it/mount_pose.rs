//! How scanners sit: what the emulator casts is what the signs say, online as offline, and a wrong belief shows in the estimate.

use crate::common::small_scene;
use crate::online_offline::{bits, online};

use rowscan_emulator::offline::Offline;
use rowscan_emulator::stage::Stage;
use rowscan_protocol::client::ColaConfig;
use rowscan_protocol::frame::Dialect;
use rowscan_protocol::model;
use rowscan_protocol::rig::{Mount, Orientation, RowSide};
use rowscan_protocol::scan::Scan;
use rowscan_scenes::caster::brute::Oracle;
use rowscan_scenes::{Scene, TrueMount};
use rowscan_study::trial::Trial;

fn sat(mount: Mount) -> Scene {
    let mut scene = small_scene();
    scene.orchard.rows = Some(2);
    scene.rig.scanners = vec![mount];
    scene
}

/// A scan at standstill, 1.7 m along the row.
fn standing(scene: Scene) -> (Stage, Scan) {
    let mut scene = scene;
    (scene.rig.speed_m_s, scene.rig.start_m) = (0.0, 1.7);
    let stage = Stage::grow(scene, &|_, _| {}).expect("it grows");
    let (device, view) = stage.scanner(0, model::by_name("lms111").expect("known")).expect("it fits");
    let mut offline = Offline::new(device, view);
    offline.set_up(ColaConfig::default()).expect("taken");
    let mut scan = Scan::default();
    assert!(offline.scan_into(&mut scan).expect("a scan"));
    (stage, scan)
}

#[test]
fn every_beam_goes_where_the_signs_say_on_either_side() {
    let askew = Mount { yaw_deg: 6.0, pitch_deg: -9.0, roll_deg: 4.0, offset_y_m: 0.35, ..Mount::default() };
    let up = Mount { orientation: Orientation::Up, distance_m: 2.0, ..askew.clone() };
    let left = Mount { row: RowSide::Left, ..up.clone() };
    for (mount, side) in [(askew, 1.0), (up, 1.0), (left, -1.0)] {
        let (stage, scan) = standing(sat(mount.clone()));
        let (oracle, axes) = (Oracle::new(&stage.orchard), mount.attitude().axes());
        let mut met = 0;
        for beam in (0..scan.beams.len()).step_by(7) {
            let (sin, cos) = mount.theta_deg(scan.beams.angle_deg(beam)).to_radians().sin_cos();
            let [x, y, z] = axes.beam(cos, sin);
            let seen = scan.echoes[0].range_m[beam];
            // The first row is at X = 0; the scanner that looks left drives on its other side.
            let from = [-side * mount.distance_m, 1.7 + mount.offset_y_m, mount.height_m];
            let expected = oracle.ray(from, [side * x, y, z]).range_m;
            let missed = seen.is_infinite() && !(0.5..=20.0).contains(&expected);
            assert!(missed || (seen - expected).abs() < 0.0011, "beam {beam}: {seen}, expected {expected}");
            met += usize::from(seen.is_finite());
        }
        assert!(met > 20, "{met}");
    }
}

#[tokio::test]
async fn a_scanner_askew_is_read_the_same_online_and_offline() {
    let model = model::by_name("lms111").expect("known");
    let mount = Mount { yaw_deg: 5.0, pitch_deg: 4.0, offset_y_m: 0.2, ..Mount::default() };
    let mut scene = small_scene();
    scene.orchard.trees = Some(1);
    scene.rig.scanners = vec![mount];
    let offline = Trial::run(scene.clone(), model, None).expect("it runs").estimate;
    assert_eq!(bits(&online(scene, model, Dialect::B).await), bits(&offline));
}

#[test]
fn a_height_that_is_believed_wrongly_is_the_trees_error() {
    let model = model::by_name("lms111").expect("known");
    let height = |true_mounts: Vec<TrueMount>| {
        let mut scene = small_scene();
        scene.true_mounts = true_mounts;
        Trial::run(scene, model, None).expect("it runs").estimate.trees[1].height_m.expect("a tree")
    };
    let right = height(Vec::new());
    let really = TrueMount { height_m: Some(1.55), ..TrueMount::default() };
    // The mirror is 5 cm lower than the rig says: all looks as much higher, and the ground is still below the rig's clearance.
    let wrong = height(vec![really]);
    assert!((wrong - right - 0.05).abs() < 0.03, "{wrong} {right}");
}
