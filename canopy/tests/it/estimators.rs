//! Every estimator against closed forms: a turbid slab, a slab of leaves, a wall with an edge, a checkered wall.

use crate::common::slab::*;
use crate::common::*;
use rowscan_canopy::estimator::{TABLE, by_name};
use rowscan_canopy::{Estimate, Measure, Parameters, Pipeline, Quantity};
use rowscan_protocol::rig::{Mount, Rig};
use rowscan_protocol::scan::{NO_ECHO, Scan};

/// All estimators on these scans.
fn measured<'a>(rig: &Rig, parameters: Parameters, scans: impl IntoIterator<Item = &'a Scan>) -> Estimate {
    let all: Vec<_> = TABLE.iter().collect();
    let pipeline = Pipeline::with_parameters(Some(rig), 0, None, parameters).unwrap();
    let mut pipeline = pipeline.with_estimators(&all);
    scans.into_iter().for_each(|scan| pipeline.push(scan));
    pipeline.finish()
}

fn of<'a>(measures: &'a [Measure], estimator: &str, quantity: Quantity) -> &'a Measure {
    let whole = |m: &&Measure| m.estimator == estimator && m.quantity == quantity && m.band_m().is_none();
    measures.iter().find(whole).unwrap()
}

fn value(measures: &[Measure], estimator: &str, quantity: Quantity) -> f64 {
    of(measures, estimator, quantity).value.unwrap()
}

#[test]
fn names_and_quantities_are_what_is_reported() {
    let found = measured(&rig(), parameters(), &turbid(1.0, 1.0, 100, 1));
    for info in TABLE {
        assert!(std::ptr::eq(by_name(info.name).unwrap(), info));
        for quantity in info.quantities {
            let reported =
                |m: &Measure| m.estimator == info.name && m.quantity == *quantity && m.value.is_some();
            assert!(found.measures.iter().any(reported), "{} {quantity:?}", info.name);
        }
    }
    assert!(by_name("voxl").is_none());
    for measure in &found.measures {
        assert!(by_name(measure.estimator).unwrap().quantities.contains(&measure.quantity), "{measure:?}");
    }
}

#[test]
fn a_tree_s_own_leaf_areas_stand_before_the_measures_of_the_estimators() {
    let found = measured(&rig(), parameters(), &turbid(1.0, 1.0, 100, 1));
    assert!(!found.trees.is_empty());
    for tree in &found.trees {
        let all = tree.side_by_side();
        let names: Vec<&str> = all.iter().take(2).map(|measure| measure.estimator).collect();
        assert_eq!(names, ["contact", "regression"]);
        assert_eq!(all[0].value, tree.leaf.areas.contact_m2().ok());
        assert_eq!(all[1].value, tree.leaf.areas.regression_m2().ok());
        assert_eq!(all[2..], tree.measures);
    }
}

#[test]
fn a_turbid_slab_has_its_leaf_area_by_voxels_and_by_polar_cells() {
    for (thick_m, density) in [(1.0, 1.0), (1.0, 4.0), (2.0, 2.0)] {
        let found = measured(&rig(), parameters(), &turbid(thick_m, density, 300, 3));
        let truth = density * thick_m * HIGH_M * found.scanned_m.unwrap();
        let leaf = |name| value(&found.measures, name, Quantity::LeafArea) / truth;
        let (voxel, polar) = (leaf("voxel"), leaf("polar"));
        assert!((voxel - 1.0).abs() < 0.02, "{thick_m} m of {density}: voxel {voxel}");
        // Polar cells cut the slab's faces, and hold nothing where no beam came.
        assert!((polar - 1.0).abs() < 0.06, "{thick_m} m of {density}: polar {polar}");
        // Projected on the beams, leaves turned any way have half their area.
        let projected_m2 = value(&found.measures, "tai", Quantity::TreeAreaIndex)
            * rig().row_spacing_m.unwrap()
            * found.scanned_m.unwrap();
        assert!(relative(2.0 * projected_m2, truth) < 0.06, "{thick_m} m of {density}: tai {projected_m2}");
        assert!(
            relative(
                value(&found.measures, "voxel", Quantity::Lai),
                voxel * density * thick_m * HIGH_M / 4.0
            ) < 1e-9
        );
        let by_band: f64 = found
            .measures
            .iter()
            .filter(|m| m.estimator == "voxel" && m.band_m().is_some())
            .map(|m| m.value.unwrap())
            .sum();
        assert!(relative(by_band, value(&found.measures, "voxel", Quantity::LeafArea)) < 1e-9);
        let hits = value(&found.measures, "voxel", Quantity::HitsPerPatch);
        assert!((1.0..1.7).contains(&hits), "leaves without size are hardly ever met twice: {hits}");
    }
}

/// The same leaves a metre, however the scanner is turned: its beams go a longer way through them, at another angle.
#[test]
fn a_turbid_slab_has_its_leaf_area_through_a_scanner_that_is_turned() {
    let (thick_m, density) = (1.0, 2.0);
    for (yaw_deg, pitch_deg, roll_deg) in [
        (0.0, 0.0, 0.0),
        (15.0, 0.0, 0.0),
        (-30.0, 0.0, 0.0),
        (45.0, 0.0, 0.0),
        (0.0, 20.0, 0.0),
        (0.0, 0.0, 10.0),
        (30.0, -15.0, 5.0),
    ] {
        let mount = Mount { yaw_deg, pitch_deg, roll_deg, ..rig().scanners[0].clone() };
        let (rig, scans) = turbid_from(mount, thick_m, density, 300, 9);
        let found = measured(&rig, parameters(), &scans);
        let truth = density * thick_m * HIGH_M * found.scanned_m.unwrap();
        let case = format!("yaw {yaw_deg}, pitch {pitch_deg}, roll {roll_deg}");
        let off = |name| value(&found.measures, name, Quantity::LeafArea) / truth - 1.0;
        assert!(off("voxel").abs() < 0.03, "{case}: voxel {}", off("voxel"));
        assert!(off("polar").abs() < 0.07, "{case}: polar {}", off("polar"));
        let projected_m2 = value(&found.measures, "tai", Quantity::TreeAreaIndex)
            * rig.row_spacing_m.unwrap()
            * found.scanned_m.unwrap();
        assert!(relative(2.0 * projected_m2, truth) < 0.07, "{case}: tai {projected_m2}");
    }
}

#[test]
fn a_turbid_slab_has_the_gaps_of_beer_and_lambert() {
    let (thick_m, density) = (1.0, 1.0);
    let found = measured(&rig(), parameters(), &turbid(thick_m, density, 600, 5));
    let bands = found.measures.iter().filter(|m| m.quantity == Quantity::GapFraction);
    for band in bands.filter(|m| m.z_from_m.unwrap() >= 1.0 && m.z_to_m.unwrap() <= 2.5) {
        // Beams through the middle of the slab: exp(−G a t / cos θ), averaged over the band's beams.
        let [low, high] = band.band_m().unwrap();
        let thetas: Vec<f64> = (0..lms111().len())
            .map(|beam| theta(&rig().scanners[0], lms111(), beam))
            .filter(|(theta, ahead)| *ahead && (low..high).contains(&(HEIGHT_M + DISTANCE_M * theta.tan())))
            .map(|(theta, _)| theta)
            .collect();
        let expected = thetas.iter().map(|t| (-0.5 * density * thick_m / t.cos()).exp()).sum::<f64>()
            / thetas.len() as f64;
        let gap = band.value.unwrap();
        assert!((gap - expected).abs() < 0.02, "{low}..{high}: {gap} {expected}");
        assert!(band.low.unwrap() < expected && expected < band.high.unwrap(), "{band:?}");
    }
    let leaf = value(&found.measures, "gap", Quantity::LeafArea);
    let truth = density * thick_m * HIGH_M * found.scanned_m.unwrap();
    // Beams near the slab's edges pass only part of it.
    assert!((leaf / truth - 1.0).abs() < 0.1, "{}", leaf / truth);
}

#[test]
fn leaf_area_density_of_an_isotropic_slab_is_within_two_percent() {
    // Leaves of 6 cm turned any way, six slabs of 6 m: far more than 2500 leaves hit, each by several beams.
    let (density, radius_m, thick_m) = (1.5, 0.03, 1.0);
    let (mut ratios, mut covered, mut patches) = (Vec::new(), 0, 0.0);
    let mut bands_covered = Vec::new();
    for seed in 0..6 {
        let found = measured(&rig(), parameters(), &leafy(thick_m, density, radius_m, 300, 200 + seed));
        let truth = density * thick_m * HIGH_M * found.scanned_m.unwrap();
        let leaf = of(&found.measures, "voxel", Quantity::LeafArea);
        ratios.push(leaf.value.unwrap() / truth);
        covered += usize::from(leaf.low.unwrap() < truth && truth < leaf.high.unwrap());
        let relative_width = (leaf.high.unwrap() - leaf.low.unwrap()) / truth;
        assert!(relative_width < 0.12, "an interval that says nothing: {relative_width}");
        // Bands wholly within the slab hold what is theirs of it, and are known less well than all.
        let of_leaves =
            found.measures.iter().filter(|m| m.estimator == "voxel" && m.quantity == Quantity::LeafArea);
        let inner = |m: &&Measure| m.band_m().is_some_and(|[low, high]| low >= 0.5 && high <= HIGH_M - 0.5);
        for band in of_leaves.filter(inner) {
            let [low_m, high_m] = band.band_m().unwrap();
            let truth = truth * (high_m - low_m) / HIGH_M;
            let (low, high) = (band.low.unwrap(), band.high.unwrap());
            bands_covered.push(low < truth && truth < high);
            let width = (high - low) / truth;
            assert!(relative_width < width && width < 4.0 * relative_width, "{band:?} {relative_width}");
        }
        patches +=
            found.contact.unwrap().hits as f64 / value(&found.measures, "voxel", Quantity::HitsPerPatch);
    }
    assert!(patches > 2500.0, "{patches}");
    let mean = ratios.iter().sum::<f64>() / ratios.len() as f64;
    assert!((mean - 1.0).abs() < 0.02, "{ratios:?}");
    let held = bands_covered.iter().filter(|held| **held).count();
    assert!(
        bands_covered.len() >= 18 && held as f64 > 0.85 * bands_covered.len() as f64,
        "{bands_covered:?}"
    );
    assert!(covered >= 5, "{covered} of 6 intervals hold the truth: {ratios:?}");
}

/// A wall x = 1.5 m (half a metre before the row) from 0.5 to 2.5 m high.
fn edged_wall(_: f64, theta: f64) -> f64 {
    let z_m = HEIGHT_M + 1.5 * theta.tan();
    if (0.5..2.5).contains(&z_m) { 1.5 / theta.cos() } else { NO_ECHO }
}

#[test]
fn gaps_are_counted_at_the_row_plane_and_not_at_the_crown() {
    // The wall ends at 2.5 m, half a metre before the row; beams over its edge cross the row plane higher, and those below it never reach the plane.
    let found = measured(&rig(), parameters(), &drive(&rig(), lms511(), 25, 200, edged_wall));
    let edge_m = HEIGHT_M + (2.5 - HEIGHT_M) * DISTANCE_M / 1.5;
    assert!(edge_m > 2.5 + 0.2);
    let gap = |from_m: f64| {
        let of_band =
            |m: &&rowscan_canopy::Measure| m.quantity == Quantity::GapFraction && m.z_from_m == Some(from_m);
        found.measures.iter().find(of_band).and_then(|m| m.value).unwrap()
    };
    let low = ((2.5 - HEIGHT_M) / DISTANCE_M).atan();
    let high = ((3.0 - HEIGHT_M) / DISTANCE_M).atan();
    let edge = ((edge_m - HEIGHT_M) / DISTANCE_M).atan();
    let expected = (high - edge) / (high - low);
    assert!((gap(2.5) - expected).abs() < 0.05, "{} {expected}", gap(2.5));
    assert_eq!((gap(2.0), gap(3.0)), (0.0, 1.0));
}

#[test]
fn a_wall_has_its_height_width_volume_and_wall_area() {
    let found = measured(&rig(), parameters(), &drive(&rig(), lms511(), 25, 200, edged_wall));
    let m = |name, quantity| value(&found.measures, name, quantity);
    assert!((m("height", Quantity::Height) - 2.5).abs() < 0.03);
    // One beam in a hundred ends below this.
    assert!((m("height", Quantity::Base) - 0.5).abs() < 0.06);
    assert!((m("width", Quantity::Width) - 1.0).abs() < 0.021);
    assert!((m("width", Quantity::MedianWidth) - 1.0).abs() < 0.021);
    // 1 m wide, 2 m high, both sides; spacing 4 m. Cells of 0.1 m may hold a sliver more at the edges.
    let length_m = found.scanned_m.unwrap();
    assert!(
        relative(m("volume", Quantity::Volume), 2.0 * length_m) < 0.051,
        "{}",
        m("volume", Quantity::Volume)
    );
    assert!(relative(m("lwa", Quantity::LeafWallArea), 2.0 * 2.0 * 1e4 / 4.0) < 0.051);
    assert!(relative(m("trv", Quantity::TreeRowVolume), 2.5 * 1.0 * 1e4 / 4.0) < 0.02);
    assert_eq!(m("porosity", Quantity::Porosity), 0.0);
    // Behind the wall nothing was seen, and beams were aimed there; nothing but corners is out of every beam's way.
    assert!(m("occlusion", Quantity::Occluded) > 0.3, "{}", m("occlusion", Quantity::Occluded));
    assert!(m("occlusion", Quantity::NeverVisited) < 0.05);
    // A tree's numbers are the wall's as well: 1.5 m of it.
    let tree = &found.trees[2];
    assert!(relative(value(&tree.measures, "volume", Quantity::Volume), 2.0 * 1.5) < 0.051);
    assert!(relative(value(&tree.measures, "lwa", Quantity::LeafWallArea), 1e4) < 0.051);
}

#[test]
fn a_checkered_wall_has_the_porosity_of_its_holes() {
    // In the row plane, squares of 0.25 m, every other one open, from 0.5 to 2.5 m high.
    let checkered = |y_m: f64, theta: f64| {
        let z_m = HEIGHT_M + DISTANCE_M * theta.tan();
        let odd = ((z_m / 0.25).floor() + (y_m / 0.25).floor()).rem_euclid(2.0) == 1.0;
        if (0.5..2.5).contains(&z_m) && odd { DISTANCE_M / theta.cos() } else { NO_ECHO }
    };
    let found = measured(&rig(), parameters(), &drive(&rig(), lms511(), 25, 300, checkered));
    let porosity = of(&found.measures, "porosity", Quantity::Porosity);
    assert!((porosity.value.unwrap() - 0.5).abs() < 0.02, "{porosity:?}");
    assert!(porosity.low.unwrap() < 0.5 && porosity.high.unwrap() > 0.5);
}

#[test]
fn an_estimate_in_mid_stream_leaves_the_measures_as_they_would_be() {
    let scans = turbid(1.0, 2.0, 200, 7);
    let all: Vec<_> = TABLE.iter().collect();
    let mut pipeline =
        Pipeline::with_parameters(Some(&rig()), 0, None, parameters()).unwrap().with_estimators(&all);
    for (i, scan) in scans.iter().enumerate() {
        pipeline.push(scan);
        if i == 90 {
            assert!(!pipeline.estimate().measures.is_empty());
        }
    }
    assert_eq!(pipeline.finish(), measured(&rig(), parameters(), &scans));
}
