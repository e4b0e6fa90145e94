//! The truth beside the estimators: that of the rig's scene, as far as a recording was made there.

use rowscan_driver::Source;
use rowscan_scenes::Scene;

use super::super::output::say;
use super::rig::Recorded;

/// The rig's scene as the sources were recorded there, with the seed of the first; none if all of them were recorded elsewhere, which is said. With a seed
/// the user says that it is this scene.
pub(super) fn true_scene(
    scene: Scene,
    seed: Option<u64>,
    sources: &[Source],
    recorded: &mut [Recorded],
) -> Option<Scene> {
    if let Some(seed) = seed {
        recorded.iter_mut().for_each(|recorded| recorded.other_scene = None);
        return Some(Scene { seed, ..scene });
    }
    let mut here = Vec::new();
    for (source, recorded) in sources.iter().zip(recorded) {
        match &recorded.other_scene {
            Some(why) => say(format_args!(
                "{source}: no truth is told: {why}; --seed N says that this scene is the right one, with seed N"
            )),
            None => here.push((source, recorded.seed)),
        }
    }
    // The first recording's: a live scanner knows of no seed.
    let first = here.iter().find(|(source, _)| matches!(source, Source::Recording { .. }));
    let seed = first.and_then(|(_, seed)| *seed).unwrap_or(scene.seed);
    (!here.is_empty()).then_some(Scene { seed, ..scene })
}
