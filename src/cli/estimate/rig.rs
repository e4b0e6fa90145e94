//! The rig that an estimate is made by.

use rowscan_driver::Source;
use rowscan_protocol::rig::{EchoChoice, Rig};
use rowscan_recording::{About, Recording};
use rowscan_scenes::Scene;
use rowscan_scenes::files;
use rowscan_study::reading::fitted_rig;

use super::super::output::say;
use super::super::{Failure, models};

/// The rig called `name`, these scanners being of `model` and sending this echo, and the scene it stands in, if it names one.
pub(super) fn load(
    name: &str,
    model: Option<&str>,
    scanners: &[usize],
    echo: Option<EchoChoice>,
) -> Result<(Rig, Option<Scene>), Failure> {
    let (rig, scene) = files::load_rig(name, say)?;
    let model = model.map(models::find).transpose()?;
    Ok((fitted_rig(rig, scanners, model, echo), scene))
}

/// The seed that the first recording among `sources` was made with, as far as it is of the scene called `name`.
pub(super) fn recorded_seed(sources: &[Source], name: Option<&str>) -> Option<u64> {
    let path = sources.iter().find_map(|source| match source {
        // What is no file, as a pipe, is read only once.
        Source::Recording { path, .. } => path.is_file().then_some(path),
        _ => None,
    })?;
    // Whatever is wrong with the file is told by whoever reads its scans.
    let mut recording = Recording::open(path).ok()?;
    recording.next_packet().ok()?;
    let About { scene, seed, .. } = recording.about();
    seed.filter(|_| scene.is_none() || scene.as_deref() == name)
}
