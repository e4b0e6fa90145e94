//! The rig that an estimate is made by.

use rowscan_protocol::rig::{EchoChoice, Rig};
use rowscan_scenes::Scene;
use rowscan_scenes::files;

use super::super::{Failure, models};

/// The rig called `name`, these scanners being of `model` and sending this echo, and the scene it stands in, if it names one.
pub(super) fn load(
    name: &str,
    model: Option<&str>,
    scanners: &[usize],
    echo: Option<EchoChoice>,
) -> Result<(Rig, Option<Scene>), Failure> {
    let (mut rig, scene) = files::load_rig(name)?;
    if let Some(model) = model.map(models::find).transpose()? {
        for scanner in scanners {
            if let Some(mount) = rig.scanners.get_mut(*scanner) {
                model.name().clone_into(&mut mount.model);
            }
        }
    }
    for scanner in scanners {
        if let Some(mount) = rig.scanners.get_mut(*scanner) {
            mount.echo = echo.or(mount.echo);
        }
    }
    Ok((rig, scene))
}
