//! The rig that an estimate is made by.

use rowscan_protocol::rig::{EchoChoice, Rig};
use rowscan_scenes::Scene;
use rowscan_scenes::files;
use rowscan_study::reading::fitted_rig;

use super::super::{Failure, models};

/// The rig called `name`, these scanners being of `model` and sending this echo, and the scene it stands in, if it names one.
pub(super) fn load(
    name: &str,
    model: Option<&str>,
    scanners: &[usize],
    echo: Option<EchoChoice>,
) -> Result<(Rig, Option<Scene>), Failure> {
    let (rig, scene) = files::load_rig(name)?;
    let model = model.map(models::find).transpose()?;
    Ok((fitted_rig(rig, scanners, model, echo), scene))
}
