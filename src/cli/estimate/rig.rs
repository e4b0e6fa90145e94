//! The rig that an estimate is made by.

use rowscan_driver::Source;
use rowscan_protocol::rig::{EchoChoice, Rig};
use rowscan_recording::{About, StreamKind};
use rowscan_scenes::Scene;
use rowscan_scenes::files;
use rowscan_study::reading::fitted_rig;

use super::super::output::say;
use super::super::{Failure, models};

/// The rig called `name`, and the scene it stands in, if it names one. Its scanners, one a source, are of `model`, or else of the model that the
/// source's recording names, and send this echo.
pub(super) fn load(
    name: &str,
    model: Option<&str>,
    (sources, scanners): (&[Source], &[usize]),
    echo: Option<EchoChoice>,
) -> Result<(Rig, Option<Scene>), Failure> {
    let (mut rig, scene) = files::load_rig(name, say)?;
    let asked = model.map(models::find).transpose()?;
    for (source, scanner) in sources.iter().zip(scanners) {
        let recorded = source.recorded_model();
        if let (None, Some(recorded), Some(mount)) = (asked, recorded, rig.scanners.get(*scanner))
            && mount.model != recorded.name()
        {
            let (told, of_rig) = (recorded.name(), &mount.model);
            say(format_args!(
                "{source} names the model {told}, and is read as one; the rig has {of_rig} there; --model decides"
            ));
        }
        rig = fitted_rig(rig, &[*scanner], asked.or(recorded), echo);
    }
    Ok((rig, scene))
}

/// What the first scanner's bytes are in a recording.
pub(super) fn recorded_kind(source: &Source) -> Option<StreamKind> {
    source.peek()?.streams().iter().map(|stream| stream.kind).find(|kind| kind.is_scanner())
}

/// The seed that the first recording among `sources` was made with, as far as it is of the scene called `name`.
pub(super) fn recorded_seed(sources: &[Source], name: Option<&str>) -> Option<u64> {
    let recording = sources.iter().find_map(Source::peek)?;
    let About { scene, seed, .. } = recording.about();
    seed.filter(|_| scene.is_none() || scene.as_deref() == name)
}
