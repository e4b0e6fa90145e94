//! An encoder that sticks is told by the scans of each model that counts one, and a tractor that stands is not taken for one.

use rowscan_canopy::{Estimate, Warning};
use rowscan_emulator::stage::Stage;
use rowscan_protocol::model::{AnyModel, MODELS, Model};
use rowscan_scenes::files::load_scene;
use rowscan_scenes::optics::Stages;
use rowscan_vehicle::trajectory::StopAndGo;

use crate::reading::{CalibrationChoice, Reading, rig_with};
use crate::trial::{StartUpRequests, each_scan};

/// A row of three trees, driven past by stop and go or evenly; the encoder sticks from this scan on.
fn estimate(model: &'static Model, stages: Stages, stops: bool, sticks_at: Option<u64>) -> Estimate {
    let mut scene = load_scene("spindle", |_| {}).unwrap();
    scene.orchard.trees = Some(3);
    scene.orchard.tree.iterations = Some(7);
    scene.optics.stages = stages;
    scene.drive.stop_and_go = stops.then_some(StopAndGo { go_s: 1.0, stop_s: 3.0, ramp_s: 0.5 });
    let stage = Stage::grow(scene, &|_, _| {}).unwrap();
    let rig = rig_with(&stage.rig, 0, model.name);
    let reading = Reading::of(Some(&rig), 0, true, CalibrationChoice::Given(None)).unwrap();
    let asked = StartUpRequests { cola: reading.cola, lms2xx: reading.lms2xx };
    let (mut pipeline, mut scans, mut stuck) = (reading.pipeline, 0, 0);
    each_scan(&stage, AnyModel::Cola(model), asked, &mut |scan| {
        let mut scan = scan.clone();
        scans += 1;
        for encoder in &mut scan.encoders {
            match sticks_at {
                Some(at) if scans > at => encoder.position_ticks = stuck,
                _ => stuck = encoder.position_ticks,
            }
        }
        pipeline.push(&scan);
    })
    .unwrap();
    pipeline.finish()
}

#[test]
fn scans_tell_an_encoder_that_sticks_from_a_tractor_that_stands() {
    for model in MODELS.iter().copied().filter(|model| model.encoders > 0) {
        for stages in [Stages::IDEAL, Stages::device()] {
            let told = |stops, sticks_at| {
                let estimate = estimate(model, stages, stops, sticks_at);
                let stuck = estimate.warnings.iter().find_map(|warning| match warning {
                    Warning::EncoderStuck { scans, .. } => Some(*scans),
                    _ => None,
                });
                (stuck, estimate.impacted_total_area_m2.is_some())
            };
            assert_eq!(told(false, None), (None, true), "{}: driven evenly", model.name);
            assert_eq!(told(true, None), (None, true), "{}: by stop and go", model.name);
            let (stuck, is_told) = told(false, Some(60));
            assert!(stuck > Some(20) && !is_told, "{}: {stuck:?} scans, areas told: {is_told}", model.name);
        }
    }
}
