//! How one scanner of a rig is read: what a driver asks of the device, and what is made of its scans. Every command, online or offline, and
//! every study derives both from the rig here.

use rowscan_canopy::{
    Calibration, EdgeBy, Field, Footprint, FrontWindow, LeafShape, Parameters, Pipeline, PipelineError,
    RemissionScale, Sampling,
};
use rowscan_emulator::stage;
use rowscan_protocol::angle::exact_step_deg;
use rowscan_protocol::client::ColaConfig;
use rowscan_protocol::lms2xx;
use rowscan_protocol::lms2xx::client::Lms2xxConfig;
use rowscan_protocol::model::{AnyModel, ScanMode};
use rowscan_protocol::rig::{BeamWidth, EchoChoice, Mount, RemissionReading, Rig};

use crate::calibrations::{self, ConfigError};

/// What is asked of a scanner, and what takes its scans.
#[derive(Debug)]
pub struct Reading {
    /// How a CoLa scanner is set up.
    pub cola: ColaConfig,
    /// How an LMS2xx is set up.
    pub lms2xx: Lms2xxConfig,
    /// What the scans go into.
    pub pipeline: Pipeline,
}

/// Which calibration turns impacted into leaf area.
#[derive(Clone, Debug, Default)]
pub enum CalibrationChoice<'a> {
    /// The one that the rig names, if it is shipped for the scanner's model or is a file.
    #[default]
    OfRig,
    /// A shipped name or a file.
    Named(&'a str),
    /// This one, or none.
    Given(Option<Box<Calibration>>),
}

/// Why a rig cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum ReadingError {
    /// The calibration.
    #[error(transparent)]
    Calibration(#[from] ConfigError),
    /// The rig allows no estimate.
    #[error(transparent)]
    Pipeline(#[from] PipelineError),
}

impl Reading {
    /// Scanner number `scanner` of `rig`. With `encoder`, a CoLa scanner is asked for its encoder, if the rig has one.
    pub fn of(
        rig: Option<&Rig>,
        scanner: usize,
        encoder: bool,
        calibration: CalibrationChoice<'_>,
    ) -> Result<Self, ReadingError> {
        Self::made(rig, scanner, encoder, calibration, true)
    }

    /// The same of a recording: nothing is asked of it, so which echo it holds is known only where the rig says so or the model's factory setting
    /// is the first.
    pub fn of_recording(
        rig: Option<&Rig>,
        scanner: usize,
        encoder: bool,
        calibration: CalibrationChoice<'_>,
    ) -> Result<Self, ReadingError> {
        Self::made(rig, scanner, encoder, calibration, false)
    }

    fn made(
        rig: Option<&Rig>,
        scanner: usize,
        encoder: bool,
        calibration: CalibrationChoice<'_>,
        live: bool,
    ) -> Result<Self, ReadingError> {
        let mount = rig.and_then(|rig| rig.scanners.get(scanner));
        let of_rig = rig.and_then(|rig| rig.calibration.as_deref());
        let beams = rig.and_then(|rig| rig.optics);
        let calibration = match (calibration, of_rig, mount) {
            (CalibrationChoice::Given(calibration), ..) => calibration.map(|given| *given),
            (CalibrationChoice::Named(name), ..) => {
                let model = mount.map(|mount| mount.model.as_str()).unwrap_or_default();
                Some(calibrations::load_named_calibration(name, model, beams)?)
            }
            (CalibrationChoice::OfRig, Some(name), Some(mount)) => {
                calibrations::load_calibration_for(name, &mount.model, beams)?
            }
            (CalibrationChoice::OfRig, ..) => None,
        };
        let asked = rig.filter(|rig| encoder && tells_ticks(rig, scanner));
        let ticks = asked.and_then(|rig| rig.encoder_ticks_per_m);
        Ok(Self {
            cola: ColaConfig {
                scan_mode: scan_mode(rig, scanner),
                echo: Some(mount.and_then(|mount| mount.echo).unwrap_or(EchoChoice::First)),
                remission: mount.is_some_and(|mount| mount.remission.is_some()),
                encoder_ticks_per_m: ticks.map(|ticks| ticks.abs().round() as u32),
                ..ColaConfig::default()
            },
            lms2xx: lms2xx_config(rig, scanner),
            pipeline: {
                let parameters = rig.zip(mount).map(|(rig, mount)| parameters(rig, mount, live));
                let parameters = parameters.transpose()?.unwrap_or_default();
                let pipeline = Pipeline::with_parameters(rig, scanner, calibration, parameters)?;
                match mount.and_then(field) {
                    Some(field) => pipeline.within_field(field),
                    None => pipeline,
                }
            },
        })
    }
}

/// Whether this scanner's model tells what an encoder counts: one that does not is not asked for it. One that is not known may.
fn tells_ticks(rig: &Rig, scanner: usize) -> bool {
    let model = rig.scanners.get(scanner).and_then(|mount| AnyModel::by_name(&mount.model));
    model.is_none_or(AnyModel::tells_ticks)
}

/// The rig with `model` on its mount number `scanner`.
pub fn rig_with(rig: &Rig, scanner: usize, model: &str) -> Rig {
    let mut rig = rig.clone();
    if let Some(mount) = rig.scanners.get_mut(scanner) {
        model.clone_into(&mut mount.model);
    }
    rig
}

/// The rig with these of its scanners being of `model` and sending this echo, where they are given.
pub fn fitted_rig(
    mut rig: Rig,
    scanners: &[usize],
    model: Option<AnyModel>,
    echo: Option<EchoChoice>,
) -> Rig {
    for scanner in scanners {
        if let Some(mount) = rig.scanners.get_mut(*scanner) {
            if let Some(model) = model {
                model.name().clone_into(&mut mount.model);
            }
            mount.echo = echo.or(mount.echo);
        }
    }
    rig
}

/// The rig with remission of this scanner read by its model's curve; `None` where that tells no power.
pub fn reading_remission(rig: &Rig, scanner: usize) -> Option<Rig> {
    let mut rig = rig.clone();
    let mount = rig.scanners.get_mut(scanner)?;
    mount.remission = Some(RemissionReading::Model);
    remission(LeafShape::default(), mount).ok()?;
    Some(rig)
}

/// How a mount's scans are estimated, calibration apart; of a live scanner, or of a recording.
///
/// # Errors
/// Remission that cannot be read as the rig says.
pub fn parameters(rig: &Rig, mount: &Mount, live: bool) -> Result<Parameters, PipelineError> {
    let sampling = sampling(rig, mount);
    let (edge_m, by) =
        rig.voxel_edge_m.map_or_else(|| sampling.voxel_edge(), |edge_m| (edge_m, EdgeBy::Given));
    let line_spacing_m = sampling.spacing_m.map(|[_, lines_m]| lines_m);
    let remission = remission(leaves(rig), mount)?;
    let footprint = footprint(rig, mount, live);
    Ok(Parameters { footprint, remission, line_spacing_m, ..Parameters::default() }
        .with_voxel_edge(edge_m, by))
}

/// The leaves that the rig says are scanned.
fn leaves(rig: &Rig) -> LeafShape {
    let leaf = LeafShape::default();
    let leaf = rig.leaf_area_cm2.map_or(leaf, |area_cm2| leaf.of_area(area_cm2 * 1e-4));
    let reflectance = rig.leaf_reflectance.unwrap_or(leaf.reflectance);
    LeafShape { reflectance, reflectance_sd: rig.leaf_reflectance_sd, ..leaf }
}

/// What remission says of shares, where the mount wants it read.
fn remission(leaf: LeafShape, mount: &Mount) -> Result<Option<RemissionScale>, PipelineError> {
    let Some(reading) = &mount.remission else { return Ok(None) };
    let Some(model @ AnyModel::Cola(_)) = AnyModel::by_name(&mount.model) else {
        return Err(PipelineError::RemissionTellsNoPower);
    };
    RemissionScale::read(reading, model.optics(), leaf, window(mount)).map(Some)
}

/// The scanner's window.
fn window(mount: &Mount) -> FrontWindow {
    FrontWindow { transmission: mount.window_transmission, sd: mount.window_transmission_sd }
}

/// What the rule for the voxel edge asks of a mount: beams and lines at the row axis, by the rig or the model's own mode.
fn sampling(rig: &Rig, mount: &Mount) -> Sampling {
    let default = Sampling::default();
    let model = AnyModel::by_name(&mount.model);
    let own = match model {
        Some(AnyModel::Cola(model)) => Some(model.default_mode),
        _ => None,
    };
    let step_deg = mount.resolution_deg.or(own.map(|mode| exact_step_deg(mode.step)));
    let frequency_hz = mount.frequency_hz.or(own.map(|mode| f64::from(mode.frequency_centihz) / 100.0));
    // A line is a turn of the layer that is used.
    let lines_hz = frequency_hz.map(|hertz| hertz / f64::from(model.map_or(1, AnyModel::turns_a_line)));
    Sampling {
        spacing_m: step_deg
            .zip(lines_hz)
            .map(|(step_deg, hertz)| [mount.distance_m * step_deg.to_radians(), rig.speed_m_s / hertz]),
        leaf_area_m2: rig.leaf_area_cm2.map_or(default.leaf_area_m2, |area_cm2| area_cm2 * 1e-4),
        ..default
    }
}

/// What is known of the beams' width, where they have one.
fn footprint(rig: &Rig, mount: &Mount, live: bool) -> Option<Footprint> {
    rig.optics.filter(|width| *width == BeamWidth::Device)?;
    let model = AnyModel::by_name(&mount.model)?;
    let first_by_itself = model.optics().factory_echo.begins_with_first();
    let echo = mount.echo.or((live || first_by_itself).then_some(EchoChoice::First));
    let (least_share, least_share_sd) = (mount.min_share, mount.min_share_sd);
    let of_model = Footprint::of(model.optics(), leaves(rig));
    Some(Footprint { echo, least_share, least_share_sd, ..of_model }.behind(window(mount)))
}

/// Where the mount's model can measure, if the model is known.
fn field(mount: &Mount) -> Option<Field> {
    let degrees = |angle: i32| f64::from(angle) / 10_000.0;
    Some(match AnyModel::by_name(&mount.model)? {
        AnyModel::Cola(model) => {
            Field { start_deg: degrees(model.start_angle), stop_deg: degrees(model.stop_angle) }
        }
        // The widest variant of all.
        AnyModel::Lms2xx(_) => Field { start_deg: 0.0, stop_deg: 180.0 },
    })
}

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

#[cfg(test)]
mod tests {
    use super::*;
    use rowscan_canopy::Warning;
    use rowscan_protocol::angle::BeamGrid;
    use rowscan_protocol::scan::{Echo, Scan};

    #[test]
    fn an_encoder_is_asked_of_the_models_that_count_one_and_missing_in_the_scans_of_all() {
        for model in AnyModel::all() {
            let mount = Mount { model: model.name().to_owned(), ..Mount::default() };
            let rig = Rig { scanners: vec![mount], encoder_ticks_per_m: Some(1000.0), ..Rig::default() };
            let reading = Reading::of(Some(&rig), 0, true, CalibrationChoice::Given(None)).unwrap();
            let counts = matches!(model, AnyModel::Cola(model) if model.tells_ticks());
            assert_eq!(reading.cola.encoder_ticks_per_m, counts.then_some(1000), "{}", model.name());
            // Where its scans have no reading, the rig's speed is taken, and that is told.
            let mut pipeline = reading.pipeline;
            let beams = BeamGrid::spanning(0, 1_800_000, 10_000);
            let echoes = vec![Echo { range_m: vec![1.8; beams.len()], remission: Vec::new() }];
            let mut scan = Scan { scan_frequency_hz: 15.0, beams, echoes, ..Scan::default() };
            for _ in 0..60 {
                scan.telegram_counter = scan.telegram_counter.wrapping_add(1);
                scan.scan_time_us = scan.scan_time_us.wrapping_add(66_667);
                pipeline.push(&scan);
            }
            let told = pipeline.finish().warnings;
            let found = told.iter().find_map(|warning| match warning {
                Warning::ConstantSpeed { scans, has_encoder, .. } => Some((*scans, *has_encoder)),
                _ => None,
            });
            assert_eq!(found, Some((60, counts)), "{}: {told:?}", model.name());
        }
    }
}
