//! Trees that are grown, and sorted for the caster, once for all that look at them: studies come back to a seed with another rig, other optics or another
//! estimator.

use std::collections::VecDeque;
use std::sync::{Mutex, PoisonError};

use rayon::prelude::*;
use rowscan_emulator::stage::Stage;
use rowscan_scenes::{GrowError, Scene};
use serde_json::json;

use crate::fingerprint;

/// The orchards that were grown last: as many as there are threads, for each works on one at a time.
#[derive(Debug, Default)]
pub struct Nursery(Mutex<VecDeque<(String, Stage)>>);

impl Nursery {
    /// The scene's stage, with its trees grown here or found here.
    ///
    /// # Errors
    /// Trees that do not grow.
    pub(crate) fn grow(&self, scene: Scene) -> Result<Stage, GrowError> {
        let key = key(&scene);
        if let Some(found) = self.find(&key, &scene) {
            return Ok(found);
        }
        // Nobody waits for a growing orchard: growth itself takes up other work of this pool while it waits for its parts.
        let stage = Stage::grow(scene.clone(), &|_, _| {})?;
        let shared = stage.beside(scene);
        let mut stages = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        while stages.len() >= rayon::current_num_threads() {
            stages.pop_front();
        }
        stages.push_back((key, shared));
        Ok(stage)
    }

    fn find(&self, key: &str, scene: &Scene) -> Option<Stage> {
        let stages = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let (_, stage) = stages.iter().find(|(other, _)| other == key)?;
        Some(stage.beside(scene.clone()))
    }
}

/// Does `work` on the scene of every pass, on all cores, passes of the same trees one after another; the results in the order of the passes.
///
/// # Errors
/// The first pass that failed.
pub(crate) fn each<P: Sync, T: Send, E: Send>(
    passes: &[P],
    scene_of: impl Fn(&P) -> Scene + Sync,
    work: impl Fn(&P, Scene, &Nursery) -> Result<T, E> + Sync,
) -> Result<Vec<T>, E> {
    let mut order: Vec<(usize, &P)> = passes.iter().enumerate().collect();
    order.sort_by_cached_key(|(_, pass)| key(&scene_of(pass)));
    let nursery = Nursery::default();
    let done = order.par_iter().map(|(number, pass)| Ok((*number, work(pass, scene_of(pass), &nursery)?)));
    let mut done: Vec<(usize, T)> = done.collect::<Result<_, E>>()?;
    done.sort_by_key(|(number, _)| *number);
    Ok(done.into_iter().map(|(_, result)| result).collect())
}

/// All that trees follow from. Scenes of the same key grow the same.
pub(crate) fn key(scene: &Scene) -> String {
    let mut orchard = scene.orchard.clone();
    let files: Vec<String> = orchard
        .files_mut()
        .into_iter()
        .map(|file| fingerprint::of_content(file.bytes().unwrap_or_default()))
        .collect();
    // A drive with headlands sees rows end: its trees are sorted anew.
    json!([scene.seed, scene.orchard, files, scene.drive.has_headlands()]).to_string()
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use rowscan_scenes::files::load_scene;

    use super::*;

    fn small(seed: u64) -> Scene {
        let mut scene = Scene { seed, ..load_scene("spindle", |_| {}).expect("built in") };
        scene.orchard.trees = Some(1);
        scene.orchard.tree.iterations = Some(3);
        scene
    }

    #[test]
    fn trees_are_grown_once_for_every_rig_and_anew_for_another_seed_or_tree() {
        let (nursery, rig) = (Nursery::default(), |scene: &Scene| scene.rig.speed_m_s);
        let first = nursery.grow(small(1)).expect("grown");
        let mut faster = small(1);
        faster.rig.speed_m_s = 2.5;
        let again = nursery.grow(faster.clone()).expect("grown");
        assert!(Arc::ptr_eq(&first.orchard, &again.orchard) && std::ptr::eq(first.caster(), again.caster()));
        assert_eq!((rig(&again.scene), again.rig.speed_m_s, rig(&first.scene)), (2.5, 2.5, 1.0));
        let alone = Stage::grow(faster, &|_, _| {}).expect("grown");
        assert_eq!((&alone.orchard, &alone.rig, &alone.scene), (&again.orchard, &again.rig, &again.scene));

        let other = nursery.grow(small(2)).expect("grown");
        assert!(!Arc::ptr_eq(&first.orchard, &other.orchard) && first.orchard != other.orchard);
        let mut taller = small(2);
        taller.orchard.tree.iterations = Some(4);
        assert!(nursery.grow(taller).expect("grown").orchard != other.orchard);
    }

    #[test]
    fn no_more_orchards_are_held_than_there_are_threads() {
        let nursery = Nursery::default();
        let most = rayon::current_num_threads();
        for seed in 0..most as u64 + 3 {
            nursery.grow(small(seed)).expect("grown");
        }
        assert_eq!(nursery.0.lock().expect("sound").len(), most);
    }
}
