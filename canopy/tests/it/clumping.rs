//! How close together leaves stand, from the scans themselves: what it is made of, what goes by it, and what does not.

use crate::common::*;
use rowscan_canopy::calibration::{ClumpingBy, Optics};
use rowscan_canopy::{
    Calibration, Clumping, ClumpingLaw, CutMethod, Estimate, Footprint, LeafShape, Parameters, Pipeline,
    shipped,
};
use rowscan_protocol::model::AnyModel;
use rowscan_protocol::rig::{BeamWidth, EchoChoice, Rig};
use rowscan_protocol::scan::{NO_ECHO, Scan};

fn rig() -> Rig {
    Rig { optics: Some(BeamWidth::Device), ..orchard_rig() }
}

/// Nine metres of row: of blocks of `block` beams and lines, one in three ends at the row plane.
fn row(block: usize) -> Vec<Scan> {
    let mut line = 0;
    drive(&rig(), lms111(), 50, 450, |y_m, theta| {
        line += 1;
        let (beam, of_way) = ((theta.to_degrees() / 0.5).floor(), (y_m / 0.02).floor());
        let cell = |value: f64| (value / block as f64).floor();
        let dice = (cell(beam) * 12.9898 + cell(of_way) * 78.233).sin() * 43_758.547;
        let ends = dice.fract().abs() < 0.33 && theta.abs() < 0.8;
        // Leaves lie at other depths than their neighbours.
        let x_m = 1.9 + 0.2 * scatter(cell(beam), cell(of_way));
        if ends { x_m / theta.cos() } else { NO_ECHO }
    })
}

fn eye(law: Option<&'static ClumpingLaw>, echo: EchoChoice) -> Parameters {
    let model = AnyModel::by_name("lms111").unwrap();
    let of_model = Footprint::of(model.optics(), LeafShape::default());
    assert!(of_model.law.is_some(), "the table has a law for the LMS111");
    let footprint = Footprint { echo: Some(echo), law: of_model.law.and(law), ..of_model };
    Parameters { footprint: Some(footprint), ..Parameters::default() }
}

fn law() -> Option<&'static ClumpingLaw> {
    ClumpingLaw::of(AnyModel::by_name("lms111").unwrap().optics())
}

fn estimated(parameters: Parameters, calibration: Option<Calibration>, scans: &[Scan]) -> Estimate {
    let pipeline = Pipeline::with_parameters(Some(&rig()), 0, calibration, parameters).unwrap();
    let mut pipeline = pipeline.with_trees_found(&CutMethod::ALL);
    scans.iter().for_each(|scan| pipeline.push(scan));
    pipeline.finish()
}

fn clumping(estimate: &Estimate) -> Clumping {
    estimate.contact.unwrap().clumping.expect("beams with a width hit something")
}

/// By a calibration that was fitted on leaf areas by the scans, a proportion of 1.
fn by_scans(parameters: Parameters, scans: &[Scan]) -> Estimate {
    estimated(parameters, Some(of_device(ClumpingBy::Scans)), scans)
}

fn leaf(estimate: &Estimate) -> f64 {
    estimate.leaf.areas.best_m2().unwrap()
}

fn close(a: f64, b: f64) -> bool {
    (a / b - 1.0).abs() < 1e-9
}

#[test]
fn small_surfaces_are_passed_by_blocks_of_beams_and_large_ones_are_not() {
    let [strewn, clumped] = [1, 12].map(|block| estimated(eye(law(), EchoChoice::First), None, &row(block)));
    let (of_strewn, of_clumped) = (clumping(&strewn), clumping(&clumped));
    assert!(of_strewn.closed < 0.2, "{of_strewn:?}");
    assert!((0.5..1.0).contains(&of_clumped.closed), "{of_clumped:?}");
    assert!(of_clumped.factor > of_strewn.factor);
}

#[test]
fn the_row_its_trees_and_its_metres_go_by_one_factor() {
    let scans = row(6);
    let told = by_scans(eye(law(), EchoChoice::First), &scans);
    let constant = by_scans(eye(None, EchoChoice::First), &scans);
    let factor = clumping(&told).factor.unwrap();
    assert!((factor - 1.0).abs() > 0.05, "a factor that shows: {factor}");
    assert!(close(leaf(&told), factor * leaf(&constant)));
    for (of_told, of_constant) in told.trees.iter().zip(&constant.trees) {
        let [a, b] = [of_told, of_constant].map(|tree| tree.leaf.areas.contact_m2().unwrap());
        assert!(close(a, factor * b) || b == 0.0);
    }
    for (of_told, of_constant) in told.slices.iter().zip(&constant.slices) {
        let [a, b] = [of_told, of_constant].map(|metre| metre.leaf.areas.contact_m2().unwrap());
        assert!(close(a, factor * b) || b == 0.0);
    }
    // What is raw stays as it was counted, whatever is made of it.
    for estimate in [&told, &constant] {
        assert!(close(estimate.leaf.areas.contact_raw_m2().unwrap(), leaf(&constant)));
    }
    assert_eq!(told.trees_found, constant.trees_found);
    assert_eq!(clumping(&constant).factor, None);
}

#[test]
fn what_is_known_of_it_is_the_laws_where_such_rows_were_fitted_and_else_the_constants() {
    let law = law().unwrap();
    for (block, fitted) in [(8, true), (1, false)] {
        let told = by_scans(eye(Some(law), EchoChoice::First), &row(block));
        let Clumping { closed, constant_sd, applied, .. } = clumping(&told);
        assert!(applied);
        assert_eq!(law.holds(closed), fitted, "{block}: {closed}");
        let expected = if fitted { law.relative_sd } else { constant_sd };
        assert_eq!(told.leaf.spot_relative_sd, Some(expected), "{block}");
    }
    let constant = estimated(eye(None, EchoChoice::First), None, &row(8));
    assert_eq!(constant.leaf.spot_relative_sd, Some(clumping(&constant).constant_sd));
}

#[test]
fn windows_that_do_not_overlap_add_up_to_the_row() {
    let mut pipeline = Pipeline::with_parameters(
        Some(&rig()),
        0,
        Some(of_device(ClumpingBy::Scans)),
        eye(law(), EchoChoice::First),
    )
    .unwrap();
    let mut slices: Vec<([f64; 2], f64)> = Vec::new();
    for scan in row(6) {
        pipeline.push(&scan);
        let Ok(window) = pipeline.window() else { continue };
        let Ok(leaf) = window.leaf else { continue };
        for slice in leaf.slices() {
            match slices.iter_mut().find(|(y_m, _)| *y_m == slice.y_m) {
                Some((_, raw_m2)) => *raw_m2 = slice.raw_m2(),
                None => slices.push((slice.y_m, slice.raw_m2())),
            }
        }
    }
    let last = pipeline.window().unwrap().leaf.unwrap().factor();
    let row_m2 = leaf(&pipeline.finish());
    let sum: f64 = slices.iter().map(|(_, raw_m2)| last * raw_m2).sum();
    assert!((sum / row_m2 - 1.0).abs() < 0.06, "{sum} {row_m2}: all slices but the last");
}

/// A calibration for an LMS111's own beams, fitted on raw leaf areas of this kind.
fn of_device(clumping: ClumpingBy) -> Calibration {
    let mut calibration: Calibration =
        toml::from_str(shipped::text("spindle-lms111-device").unwrap()).unwrap();
    assert_eq!(calibration.class.optics, Optics::Footprint);
    calibration.contact.clumping = clumping;
    // How much wood its rows had is no matter here.
    calibration.class.canopy.wood_share = None;
    // A proportion: the factor itself shows.
    (calibration.contact.k, calibration.contact.p) = (1.0, 1.0);
    calibration
}

#[test]
fn a_calibration_is_applied_to_the_raw_leaf_areas_that_it_was_fitted_on() {
    let scans = row(6);
    let by = |calibration| leaf(&estimated(eye(law(), EchoChoice::First), calibration, &scans));
    let constant = leaf(&estimated(eye(None, EchoChoice::First), None, &scans));
    let factor = clumping(&estimated(eye(law(), EchoChoice::First), None, &scans)).factor.unwrap();
    assert!(close(by(None), constant) && close(by(Some(of_device(ClumpingBy::Constant))), constant));
    assert!(close(by(Some(of_device(ClumpingBy::Scans))), factor * constant));
    assert!((factor - 1.0).abs() > 0.05, "or nothing is shown");
    // Files without the key are of the constant, and stay as they were.
    let text = shipped::text("spindle-lms111-device").unwrap();
    assert!(!text.contains("clumping"), "{text}");
    let written = toml::to_string(&of_device(ClumpingBy::Scans)).unwrap();
    assert!(written.contains("clumping = \"scans\""), "{written}");
}

#[test]
fn nothing_is_measured_of_rays_and_no_law_holds_for_last_echoes() {
    let scans = row(6);
    let rays = estimated(Parameters::default(), None, &scans);
    assert_eq!(rays.contact.unwrap().clumping, None);
    let last = estimated(eye(law(), EchoChoice::Last), None, &scans);
    assert!(last.contact.unwrap().clumping.is_none_or(|clumping| clumping.factor.is_none()));
}
