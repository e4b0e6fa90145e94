//! A sprayer's map while the run goes on, for those who look on: drawn as `rowscan score` draws it afterwards.

use std::sync::Arc;

use rowscan_bus::isobus::role::SectionLog;
use rowscan_emulator::LiveMap;
use rowscan_emulator::clock::SimClock;
use rowscan_emulator::stage::Stage;
use rowscan_sprayer::map;
use rowscan_vehicle::Tractor;

use super::part::SprayerPart;
use super::run::SprayerRun;
use super::spec::SprayerSpec;
use crate::frames::Frames;

/// The map of this sprayer on this stage, by what it has heard on its bus and as a task controller's client.
pub(crate) fn live_map(
    spec: &SprayerSpec,
    stage: &Stage,
    (tractor, clock): (Tractor, Arc<SimClock>),
    (part, frames, sections): (Arc<SprayerPart>, Frames, SectionLog),
) -> LiveMap {
    let (spec, scene, orchard) = (spec.clone(), stage.scene.clone(), stage.orchard.clone());
    LiveMap::new(move || {
        // A drive that has not begun has nothing to draw.
        tractor.began()?;
        let bus = frames.so_far(&spec.bus)?;
        let driven = ((&tractor, clock.now()), part.troubles());
        let run = SprayerRun::of(&spec, (&scene, &orchard), driven, (&bus, &sections)).ok()?;
        Some(map::svg(&run.pass, &run.flows, &format!("so far: {}", run.words())))
    })
}
