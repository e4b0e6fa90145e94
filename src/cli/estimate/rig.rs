//! What a rig says of one of its scanners: how to set it up, and what to make of its scans.

use rowscan_canopy::Pipeline;
use rowscan_driver::DriverConfig;
use rowscan_protocol::client::ColaConfig;
use rowscan_protocol::lms2xx;
use rowscan_protocol::lms2xx::client::Lms2xxConfig;
use rowscan_protocol::model::ScanMode;
use rowscan_protocol::rig::Rig;
use rowscan_scenes::Scene;
use rowscan_scenes::files;

use super::super::{Failure, models};
use rowscan_emulator::stage;
use rowscan_study::calibrations;

/// What the rig asks of an LMS2xx: the widest variant with its resolution; the device keeps its own where the rig leaves that open.
fn lms2xx_config(rig: Option<&Rig>, scanner: usize) -> Lms2xxConfig {
    let step = rig.and_then(|rig| rig.scanners.get(scanner)).and_then(stage::asked_step);
    let variants = lms2xx::model::MODELS.iter().flat_map(|model| model.variants.iter().copied());
    let variant = variants
        .filter(|variant| Some(variant.step_centideg.saturating_mul(100)) == step)
        .max_by_key(|variant| variant.angle_deg);
    Lms2xxConfig { variant, ..Default::default() }
}

/// The scan mode the rig asks of its scanner; the device keeps its own where the rig leaves frequency or resolution open.
fn scan_mode(rig: Option<&Rig>, scanner: usize) -> Option<ScanMode> {
    let mount = rig?.scanners.get(scanner)?;
    Some(ScanMode {
        frequency_centihz: stage::asked_frequency_centihz(mount)?,
        step: stage::asked_step(mount)?,
    })
}

/// How the driver sets the scanner up.
pub(super) fn driver_config(rig: Option<&Rig>, scanner: usize, wants_encoder: bool) -> DriverConfig {
    let encoder = rig.filter(|_| wants_encoder).and_then(|rig| rig.encoder_ticks_per_m);
    let cola = ColaConfig {
        scan_mode: scan_mode(rig, scanner),
        encoder_ticks_per_m: encoder.map(|ticks| ticks.abs().round() as u32),
        ..ColaConfig::default()
    };
    DriverConfig { cola, lms2xx: lms2xx_config(rig, scanner), ..DriverConfig::default() }
}

/// The rig called `name`, these scanners being of `model`, and the scene it stands in, if it names one.
pub(super) fn load(
    name: &str,
    model: Option<&str>,
    scanners: &[usize],
) -> Result<(Rig, Option<Scene>), Failure> {
    let (mut rig, scene) = files::load_rig(name)?;
    if let Some(model) = model.map(models::find).transpose()? {
        for scanner in scanners {
            if let Some(mount) = rig.scanners.get_mut(*scanner) {
                model.name().clone_into(&mut mount.model);
            }
        }
    }
    Ok((rig, scene))
}

/// The pipeline of a rig's scanner, with the calibration named, or the rig's own.
pub(crate) fn pipeline(
    rig: Option<&Rig>,
    scanner: usize,
    calibration: Option<&str>,
) -> Result<Pipeline, Failure> {
    let mount = rig.and_then(|rig| rig.scanners.get(scanner));
    let calibration = match (calibration, rig.and_then(|rig| rig.calibration.as_deref()), mount) {
        (Some(name), ..) => Some(calibrations::load_calibration(name)?),
        (None, Some(name), Some(mount)) => calibrations::load_calibration_for(name, &mount.model)?,
        _ => None,
    };
    Ok(Pipeline::new(rig, scanner, calibration)?)
}
