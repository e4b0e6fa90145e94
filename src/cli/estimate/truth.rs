//! The truth beside the estimators: that of the rig's scene, as far as a recording was made there.

use rowscan_driver::Source;
use rowscan_scenes::Scene;

use super::super::output::say;
use super::rig::Recorded;

/// The rig's scene as the sources were recorded there, with the seed of the first; none if all of them were recorded elsewhere, which is said. With a seed
/// the user says that it is this scene. A seed that no source tells is said: another seed is another orchard.
pub(super) fn true_scene(
    (name, scene): (&str, Scene),
    asked: Option<u64>,
    sources: &[Source],
    recorded: &mut [Recorded],
) -> Option<Scene> {
    let mut here = Vec::new();
    for (source, recorded) in sources.iter().zip(recorded) {
        match (asked, recorded.other_scene.take()) {
            (None, Some(why)) => {
                say(format_args!(
                    "{source}: no truth is told: {why}; --seed N says that this scene is the right one, with seed N"
                ));
                recorded.other_scene = Some(why);
            }
            _ => here.push((source, recorded.seed)),
        }
    }
    let (first, _) = here.first()?;
    // The first that tells: a live scanner knows of no seed, nor does what was recorded from one.
    let known = asked.or_else(|| here.iter().find_map(|(_, seed)| *seed));
    let seed = known.unwrap_or(scene.seed);
    if known.is_none() {
        say(format_args!(
            "{first} does not tell its seed: the truth is that of {name} with seed {seed}; --seed N names another"
        ));
    }
    for (source, made) in here.iter().filter_map(|(source, made)| Some((source, (*made)?))) {
        if made != seed {
            say(format_args!(
                "{source} was made with seed {made}: the truth is that of {name} with seed {seed}, another orchard"
            ));
        }
    }
    Some(Scene { seed, ..scene })
}
