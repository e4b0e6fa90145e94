//! What is in the air before the row, and a tractor that stands while the way goes on: both were counted as leaves without a word. Snow of 1 mm/h made 102 m² of
//! 58, a nozzle before the scanner 230 m² of 113, a tractor that stood 319 m² of 113.

use crate::common::small_scene;

use rowscan_canopy::{AdvanceSource, Estimate, Warning, Withheld};
use rowscan_emulator::stage::Stage;
use rowscan_protocol::model::AnyModel;
use rowscan_protocol::rig::Rig;
use rowscan_scenes::Scene;
use rowscan_scenes::optics::Plume;
use rowscan_study::trial::Trial;
use rowscan_vehicle::trajectory::StopAndGo;

/// An estimate of a row that is driven past through device optics, after a change of its scene, by the scene's rig after another change.
fn estimate(model: &str, change: impl Fn(&mut Scene), tell: impl Fn(&mut Rig)) -> Estimate {
    let mut scene = small_scene();
    scene.optics.stages = "device".parse().expect("stages");
    change(&mut scene);
    let stage = Stage::grow(scene, &|_, _| {}).expect("it grows");
    let mut told = stage.rig.clone();
    tell(&mut told);
    let model = AnyModel::by_name(model).expect("known");
    Trial::drive_past_told(&stage, &told, model, None, &[]).expect("it runs").estimate
}

fn withheld(estimate: &Estimate) -> Option<Withheld> {
    estimate.leaf.areas.best_m2().err()
}

fn warned(estimate: &Estimate, code: &str) -> bool {
    estimate.warnings.iter().any(|warning| warning.code() == code)
}

const MODELS: [&str; 7] = ["lms111", "lms511", "lms1000", "mrs1000", "picoscan150", "tim571", "lms291"];

#[test]
fn weather_before_the_row_is_told_by_every_model_and_clear_air_is_not() {
    type Change = fn(&mut Scene);
    let weather: [(&str, Change); 2] = [
        ("snow", |scene| scene.optics.air.snow_mm_h = 2.0),
        ("dust", |scene| scene.optics.air.dust_g_m3 = 0.3),
    ];
    for model in MODELS {
        let clear = estimate(model, |_| {}, |_| {});
        assert!(!warned(&clear, "in_the_air"), "{model}: {:?}", clear.warnings);
        for (what, change) in weather {
            let found = estimate(model, change, |_| {});
            assert_eq!(withheld(&found), Some(Withheld::InTheAir), "{model}, {what}: {:?}", found.warnings);
            assert!(warned(&found, "in_the_air"), "{model}, {what}");
        }
    }
}

/// What is a little too high is told with its warning; crowns close to the scanner are no weather.
#[test]
fn drizzle_is_told_with_the_leaf_area_and_near_crowns_are_no_weather() {
    let drizzle = estimate("lms111", |scene| scene.optics.air.rain_mm_h = 2.0, |_| {});
    assert_eq!(withheld(&drizzle), None, "{:?}", drizzle.warnings);
    let told = |warning: &Warning| matches!(warning, Warning::InTheAir { withheld: false, .. });
    assert!(drizzle.warnings.iter().any(told), "{:?}", drizzle.warnings);
    for model in ["lms111", "picoscan150"] {
        for distance_m in [0.9, 1.2, 1.5] {
            let near = |scene: &mut Scene| scene.rig.scanners[0].distance_m = distance_m;
            let found = estimate(model, near, |_| {});
            let is_air = warned(&found, "in_the_air") || warned(&found, "rides_along");
            assert!(!is_air, "{model}, {distance_m} m: {:?}", found.warnings);
        }
    }
}

/// An empty row in fog was told as twelve trees.
#[test]
fn fog_over_a_bare_field_is_no_canopy() {
    let bare = |scene: &mut Scene| {
        scene.orchard.missing = vec![0, 1, 2].into();
        scene.optics.air.visibility_m = Some(500.0);
    };
    let found = estimate("lms111", bare, |_| {});
    assert_eq!(withheld(&found), Some(Withheld::InTheAir), "{:?}", found.warnings);
}

#[test]
fn what_sprays_before_the_scanner_all_along_the_row_is_told() {
    let spray = |flow_l_min: f64| {
        estimate(
            "lms111",
            |scene| scene.optics.air.plumes = vec![Plume { flow_l_min, ..Plume::default() }],
            |_| {},
        )
    };
    for flow_l_min in [0.3, 1.0] {
        let found = spray(flow_l_min);
        assert_eq!(withheld(&found), Some(Withheld::RidesAlong), "{flow_l_min}: {:?}", found.warnings);
    }
    assert!(!warned(&spray(0.0), "rides_along"), "the nozzle is shut");
}

#[test]
fn a_tractor_that_stands_while_the_way_goes_on_has_no_leaf_area() {
    let stops = |scene: &mut Scene| {
        scene.drive.stop_and_go = Some(StopAndGo { go_s: 1.0, stop_s: 1.0, ramp_s: 0.2 });
    };
    for model in MODELS {
        let by_speed = |rig: &mut Rig| rig.encoder_ticks_per_m = None;
        let found = estimate(model, stops, by_speed);
        assert_eq!(withheld(&found), Some(Withheld::StoodStill), "{model}: {:?}", found.warnings);
        // An encoder tells the stand, and at the rig's speed there is none.
        let found = estimate(model, |_| {}, by_speed);
        assert!(!warned(&found, "stood_still"), "{model}: {:?}", found.warnings);
        // Some models tell no counts before they are asked to.
        let found = estimate(model, stops, |_| {});
        let by_encoder = found.advance_source == Some(AdvanceSource::Encoder);
        assert_eq!(warned(&found, "stood_still"), !by_encoder, "{model}: {:?}", found.warnings);
    }
}
