//! The canopy by height: bands add up, stand where the leaves are, and are withheld where the row is.

use crate::common::slab::*;
use crate::common::*;
use rowscan_canopy::{
    BandEstimate, Calibration, Estimate, Footprint, LeafShape, Parameters, Pipeline, shipped,
};
use rowscan_protocol::model::AnyModel;
use rowscan_protocol::rig::{BeamWidth, EchoChoice, Mount, Rig};
use rowscan_protocol::scan::{NO_ECHO, Scan};

const LINES: u32 = 600;

/// A row of crowns 1.5 m apart, from 0.5 to 2.5 m high, denser in their middles, that get thinner along the row.
fn crowns(y_m: f64, theta: f64) -> f64 {
    let chance = ((y_m * 977.0 + theta * 7919.0).sin() * 43_758.547).fract().abs();
    let (thick_m, near_m) = (0.8, Mount::default().distance_m - 0.4);
    let density = (0.9 - 0.03 * y_m) * (std::f64::consts::PI * y_m / 1.5).sin().abs();
    let range_m = (near_m + thick_m * -(1.0 - chance).ln() / (2.0 * density)) / theta.cos();
    let z_m = Mount::default().height_m + range_m * theta.sin();
    let inside = theta.cos() > 0.0 && range_m * theta.cos() < near_m + thick_m && (0.5..2.5).contains(&z_m);
    if inside { range_m } else { NO_ECHO }
}

/// The scans of a row of crowns, long enough for its blocks.
fn row() -> (Rig, Vec<Scan>) {
    let rig = Rig { speed_m_s: 1.5, ..orchard_rig() };
    let scans = drive(&rig, lms111(), 50, LINES, crowns);
    (rig, scans)
}

fn told<'a>(
    rig: &Rig,
    parameters: Parameters,
    calibration: Option<Calibration>,
    band_m: f64,
    scans: impl IntoIterator<Item = &'a Scan>,
) -> Estimate {
    let pipeline = Pipeline::with_parameters(Some(rig), 0, calibration, parameters).unwrap();
    let mut pipeline = pipeline.with_profile(band_m).unwrap();
    scans.into_iter().for_each(|scan| pipeline.push(scan));
    pipeline.finish()
}

fn spindle() -> Calibration {
    toml::from_str(shipped::text("spindle-lms111").unwrap()).unwrap()
}

/// Beams as wide as those of an LMS111.
fn eye() -> Parameters {
    let model = AnyModel::by_name("lms111").unwrap();
    let footprint =
        Footprint { echo: Some(EchoChoice::First), ..Footprint::of(model.optics(), LeafShape::default()) };
    Parameters { footprint: Some(footprint), ..Parameters::default() }
}

fn sum(bands: &[BandEstimate]) -> f64 {
    bands.iter().filter_map(|band| band.leaf_area_m2).sum()
}

#[test]
fn bands_add_up_to_their_trees_and_to_the_row() {
    let (rig, crowns) = row();
    let slab = turbid(1.0, 2.0, 300, 5);
    let wide = Rig { optics: Some(BeamWidth::Device), ..rig.clone() };
    let scattered = drive(&wide, lms111(), 50, LINES, self::crowns);
    let slab_rig = slab::rig();
    for (what, rig, parameters, calibration, scans) in [
        ("crowns, rays", &rig, Parameters::default(), None, &crowns),
        ("crowns, rays, calibrated", &rig, Parameters::default(), Some(spindle()), &crowns),
        ("crowns, eye", &wide, eye(), None, &scattered),
        ("slab, rays", &slab_rig, slab::parameters(), None, &slab),
        ("slab, eye", &slab_rig, Parameters { half_width_m: Some(1.5), ..eye() }, None, &slab),
    ] {
        for band_m in [0.1, 0.25, 0.33, 0.5] {
            let found = told(rig, parameters, calibration.clone(), band_m, scans);
            let profile = found.profile.as_ref().unwrap();
            let row_m2 = found.leaf.areas.best_m2().unwrap();
            assert!(row_m2 > 1.0, "{what}: {row_m2}");
            assert!(relative(sum(&profile.row), row_m2) < 1e-9, "{what}, {band_m} m: {}", sum(&profile.row));
            assert_eq!(profile.trees.len(), found.trees.len(), "{what}");
            for (bands, tree) in profile.trees.iter().zip(&found.trees) {
                let tree_m2 = tree.leaf.areas.best_m2().unwrap();
                assert_eq!((bands.tree, bands.bands.len()), (tree.tree, profile.row.len()), "{what}");
                assert!((sum(&bands.bands) - tree_m2).abs() < 1e-9 * row_m2, "{what}: tree {}", tree.tree);
            }
            for (number, band) in profile.row.iter().enumerate() {
                assert!((band.from_m - number as f64 * band_m).abs() < 1e-9, "{what}: {band:?}");
                let shares = [band.gap_fraction, band.porosity, band.visited];
                assert!(shares.iter().flatten().all(|share| (0.0..=1.0).contains(share)), "{what}: {band:?}");
            }
        }
    }
}

#[test]
fn nothing_else_changes_by_a_profile_and_without_one_there_is_none() {
    let (rig, scans) = row();
    let plain = estimate_with(&rig, Parameters::default(), &scans);
    assert_eq!(plain.profile, None);
    let profiled = told(&rig, Parameters::default(), None, 0.25, &scans);
    assert_eq!(Estimate { profile: None, ..profiled }, plain);
}

/// How far bands are off a truth from the ground up, at most, over the mean band that has leaf.
fn worst(bands: &[BandEstimate], truth_m2: impl Fn(&BandEstimate) -> f64) -> f64 {
    let of_leaf: Vec<f64> = bands.iter().map(&truth_m2).filter(|truth| *truth > 0.0).collect();
    let mean_m2 = of_leaf.iter().sum::<f64>() / of_leaf.len() as f64;
    let off = bands.iter().map(|band| (band.leaf_area_m2.unwrap_or(0.0) - truth_m2(band)).abs() / mean_m2);
    off.fold(0.0, f64::max)
}

#[test]
fn the_bands_of_a_slab_have_its_leaf_area_and_a_shifted_twin_does_not() {
    let (thick_m, density) = (1.0, 2.0);
    let found = told(&slab::rig(), slab::parameters(), None, 0.25, &turbid(thick_m, density, 600, 7));
    let length_m = found.scanned_m.unwrap();
    // From 0.5 to 3 m.
    let truth_m2 = |band: &BandEstimate| {
        let high_m = (band.to_m.min(0.5 + HIGH_M) - band.from_m.max(0.5)).max(0.0);
        density * thick_m * high_m * length_m
    };
    let bands = &found.profile.as_ref().unwrap().row;
    let off = worst(bands, truth_m2);
    assert!(off < 0.06, "{off}: {bands:?}");
    for band in bands.iter().filter(|band| truth_m2(band) > 0.0) {
        let found = band.density_m2_per_m3.unwrap();
        assert!(relative(found, density) < 0.06, "{band:?}");
        assert!(relative(band.volume_m3, thick_m * 0.25 * length_m) < 0.02, "{band:?}");
        assert_eq!(band.visited, Some(1.0), "{band:?}");
    }
    // The twin: each band says what the one above it should.
    let shifted: Vec<BandEstimate> = bands
        .iter()
        .zip(bands.iter().skip(1))
        .map(|(band, next)| BandEstimate { leaf_area_m2: next.leaf_area_m2, ..*band })
        .collect();
    assert!(worst(&shifted, truth_m2) > 0.9, "a profile that is one band too low must be found out");
}

/// The share of passages through a band of the turbid slab that go on: beams come to it as far as leaves let them, and go on by the way they have in it.
fn passing(band: &BandEstimate, thick_m: f64, density: f64) -> f64 {
    let (grid, mount) = (lms111(), slab::rig().scanners[0].clone());
    let (mut came, mut went) = (0.0, 0.0);
    for beam in 0..grid.len() {
        let (angle, true) = theta(&mount, grid, beam) else { continue };
        let Some((near_m, far_m)) = chord(thick_m, angle) else { continue };
        let at = |z_m: f64| (z_m - HEIGHT_M) / angle.sin();
        let (a, b) = if angle.sin().abs() < 1e-9 {
            if (band.from_m..band.to_m).contains(&HEIGHT_M) { (near_m, far_m) } else { continue }
        } else {
            (at(band.from_m), at(band.to_m))
        };
        let (from_m, to_m) = (a.min(b).max(near_m), a.max(b).min(far_m));
        if from_m < to_m {
            let passes = |way_m: f64| (-0.5 * density * way_m).exp();
            came += passes(from_m - near_m);
            went += passes(to_m - near_m);
        }
    }
    went / came
}

#[test]
fn fewer_beams_go_on_where_the_leaves_are_denser() {
    let mut before = vec![1.0; 10];
    for density in [0.5, 1.0, 2.0, 4.0] {
        let found = told(&slab::rig(), slab::parameters(), None, 0.25, &turbid(1.0, density, 400, 3));
        // Of the bands from 0.5 to 3 m.
        let row = found.profile.unwrap().row;
        for (band, before) in row.iter().skip(2).zip(&mut before) {
            let (gap, expected) = (band.gap_fraction.unwrap(), passing(band, 1.0, density));
            assert!((gap - expected).abs() < 0.03, "{density}: {gap}, expected {expected}: {band:?}");
            assert!(gap < *before, "{density}: {gap} after {before}: {band:?}");
            *before = gap;
        }
    }
}

#[test]
fn what_is_withheld_of_the_row_is_withheld_of_its_bands() {
    let (rig, scans) = row();
    let unknown = Rig { optics: None, ..rig };
    let found = told(&unknown, Parameters::default(), None, 0.25, &scans);
    assert!(found.leaf.areas.best_m2().is_err());
    let profile = found.profile.unwrap();
    assert!(!profile.row.is_empty() && !profile.trees.is_empty());
    let all = profile.row.iter().chain(profile.trees.iter().flat_map(|tree| &tree.bands));
    for band in all {
        assert_eq!((band.leaf_area_m2, band.density_m2_per_m3), (None, None), "{band:?}");
        assert_eq!((band.leaf_area_interval_m2, band.leaf_area_sampling_error_m2), (None, None), "{band:?}");
    }
    assert!(profile.row.iter().any(|band| band.gap_fraction.is_some()), "gaps are none of leaf area");
    // Below the ground's clearance of a whole band nothing is known, and that is not 0.
    let rig = Rig { ground_clearance_m: 0.25, ..orchard_rig() };
    let found = told(&rig, Parameters::default(), None, 0.1, &drive(&rig, lms111(), 50, LINES, crowns));
    let row = found.profile.unwrap().row;
    let known: Vec<bool> = row.iter().take(4).map(|band| band.leaf_area_m2.is_some()).collect();
    assert_eq!(known, [false, false, true, true]);
}

#[test]
fn a_short_row_has_no_intervals_and_says_so() {
    let (rig, scans) = row();
    let few = |found: &Estimate| found.warnings.iter().any(|warning| warning.code() == "too_few_blocks");
    let long = told(&rig, Parameters::default(), None, 0.25, &scans);
    let with_leaf = |band: &&BandEstimate| band.leaf_area_m2 > Some(0.0);
    let short = told(&rig, Parameters::default(), None, 0.25, &scans[..120]);
    assert!(few(&short) && !few(&long), "{:?}", short.warnings);
    for (found, known) in [(long, true), (short, false)] {
        let row = found.profile.unwrap().row;
        let bands: Vec<&BandEstimate> = row.iter().filter(with_leaf).collect();
        assert!(bands.len() > 6, "{bands:?}");
        for band in bands {
            assert_eq!(band.leaf_area_sampling_error_m2.is_some(), known, "{band:?}");
        }
    }
}

#[test]
fn a_band_that_is_too_low_or_too_high_is_refused() {
    for band_m in [0.0, 0.05, 0.6, f64::NAN] {
        let pipeline = Pipeline::new(Some(&orchard_rig()), 0, None).unwrap();
        assert!(pipeline.with_profile(band_m).is_err(), "{band_m}");
    }
}
