//! Scans of beams that the rig does not say: rays for a scanner's beams, and a scanner's for rays. By the wrong ones LAI 0.2 was told eight times too high.

use crate::common::small_scene;

use rowscan_canopy::Withheld;
use rowscan_emulator::stage::Stage;
use rowscan_protocol::model::AnyModel;
use rowscan_protocol::rig::{BeamWidth, Rig};
use rowscan_scenes::Scene;
use rowscan_study::trial::Trial;

/// Why there is no leaf area of a row that was cast by such stages, by a rig that says such beams; `None` where there is one.
fn withheld(stages: &str, model: &str, told: BeamWidth) -> Option<Withheld> {
    withheld_of(stages, model, told, |_| {})
}

/// The same of another scene.
fn withheld_of(stages: &str, model: &str, told: BeamWidth, change: impl Fn(&mut Scene)) -> Option<Withheld> {
    let mut scene = small_scene();
    scene.optics.stages = stages.parse().expect("stages");
    change(&mut scene);
    let stage = Stage::grow(scene, &|_, _| {}).expect("it grows");
    let told = Rig { optics: Some(told), ..stage.rig.clone() };
    let model = AnyModel::by_name(model).expect("known");
    let trial = Trial::drive_past_told(&stage, &told, model, None, &[]).expect("it runs");
    let estimate = trial.estimate;
    let why = estimate.leaf.areas.best_m2().err();
    let warned = estimate.warnings.iter().any(|warning| warning.code() == "other_beams");
    assert_eq!(warned, why == Some(Withheld::OtherBeams), "{model:?}, {stages} as {told:?}");
    why
}

#[test]
fn no_model_has_a_leaf_area_by_other_beams_than_its_scans_are_of() {
    let other = Some(Withheld::OtherBeams);
    for model in [
        "lms111",
        "lms511",
        "lms1000",
        "tim571",
        "tim551",
        "mrs1000",
        "picoscan150",
        "multiscan136",
        "lms291",
    ] {
        for (stages, cast, wrong) in
            [("ideal", BeamWidth::Ideal, BeamWidth::Device), ("device", BeamWidth::Device, BeamWidth::Ideal)]
        {
            assert_ne!(withheld(stages, model, cast), other, "{model}, {stages}: as the rig says");
            assert_eq!(withheld(stages, model, wrong), other, "{model}, {stages} as {wrong:?}");
        }
    }
}

/// Weather, a scanner that stands far away and rough ground: the same for the rig that is right.
#[test]
fn neither_weather_nor_distance_nor_ground_hides_it() {
    type Change = fn(&mut Scene);
    let changes: [(&str, Change); 6] = [
        ("drizzle", |scene| scene.optics.air.rain_mm_h = 0.2),
        ("rain", |scene| scene.optics.air.rain_mm_h = 20.0),
        ("snow", |scene| scene.optics.air.snow_mm_h = 2.0),
        ("4 m away", |scene| scene.rig.scanners[0].distance_m = 4.0),
        ("6 m away", |scene| scene.rig.scanners[0].distance_m = 6.0),
        ("clods", |scene| scene.orchard.ground.roughness_m = Some(0.03)),
    ];
    for (what, change) in changes {
        for (stages, cast) in [("ideal", BeamWidth::Ideal), ("device", BeamWidth::Device)] {
            let right = withheld_of(stages, "lms111", cast, change);
            assert_ne!(right, Some(Withheld::OtherBeams), "{what}, {stages}: as the rig says");
        }
        let wrong = withheld_of("device", "lms111", BeamWidth::Ideal, change);
        assert_eq!(wrong, Some(Withheld::OtherBeams), "{what}");
    }
}

#[test]
fn rays_with_noise_are_still_rays_and_a_spot_without_any_is_still_one() {
    for model in ["lms111", "picoscan150"] {
        assert_ne!(withheld("noise", model, BeamWidth::Ideal), Some(Withheld::OtherBeams), "{model}");
        assert_ne!(withheld("spot", model, BeamWidth::Device), Some(Withheld::OtherBeams), "{model}");
    }
}
