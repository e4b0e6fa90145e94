//! A scene made ready to be scanned: orchard grown, caster built, devices set up as the rig says.

use std::sync::Arc;

use rowscan_protocol::device::{Device, Identity, ModeError};
use rowscan_protocol::lms2xx;
use rowscan_protocol::model::{AnyModel, Model, ScanMode};
use rowscan_protocol::rig::{Mount, Rig};
use rowscan_protocol::scan::Pose;
use rowscan_scenes::optics::{self, Eye, EyeModel, Plume, RangeLimits};
use rowscan_scenes::{Caster, GrowError, Orchard, Scene, SeenRow, Truth, TruthGrid};
use rowscan_vehicle::Tractor;
use rowscan_vehicle::gnss::Receiver;
use rowscan_vehicle::trajectory::{Course, Drive};

use crate::{ScannerView, ViewError};

/// A grown scene with its rig.
#[derive(Debug)]
pub struct Stage {
    /// The scene as it was handed in.
    pub scene: Scene,
    /// The rig, with what the scene knows filled in.
    pub rig: Rig,
    /// The same with its scanners where they really are.
    true_rig: Rig,
    /// The grown orchard; stages that differ by their rig share it.
    pub orchard: Arc<Orchard>,
    caster: Arc<Caster>,
    /// What the nozzles of a boom spray before each scanner, besides the scene's own plumes.
    plumes: Vec<Vec<Plume>>,
}

/// Why a scanner could not be put on the stage.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum StageError {
    /// The rig lacks it.
    #[error(transparent)]
    ScannerView(#[from] ViewError),
    /// The model has no such scan mode.
    #[error(transparent)]
    Mode(#[from] ModeError),
    /// The model would not tell of dirt on its window.
    #[error(
        "a {model} takes no contamination (`optics`, --contamination): what it tells of it is not emulated, and its Compact telegrams have no status, so beams that see nothing would be taken for gaps; leave it out, or take a model whose scans tell it, such as lms111"
    )]
    Contamination {
        /// The model.
        model: &'static str,
    },
}

/// Dirt on the window of a scanner, at this level of LCMstate: only where its scans tell of it, as for faults.
///
/// # Errors
/// They do not.
pub fn contaminate(device: &mut Device, model: &Model, level: u8) -> Result<(), StageError> {
    if level > 0 && !model.scans_tell_status() {
        return Err(StageError::Contamination { model: model.title });
    }
    device.set_contamination(level);
    Ok(())
}

impl Stage {
    /// Grows the scene's orchard; `progress` hears of trees done and trees in all.
    pub fn grow(scene: Scene, progress: &(dyn Fn(usize, usize) + Sync)) -> Result<Self, GrowError> {
        let orchard = Orchard::grow(&scene.orchard, scene.seed, progress)?;
        Ok(Self::of_orchard(scene, orchard))
    }

    /// A stage on which another orchard stands than the scene grows: one that was grown before, or changed. Its rows end where the scene's drive has headlands.
    pub fn of_orchard(scene: Scene, orchard: impl Into<Arc<Orchard>>) -> Self {
        let mut orchard = orchard.into();
        if !orchard.is_beside(&scene.drive) {
            orchard = Arc::new(Arc::unwrap_or_clone(orchard).beside(&scene.drive));
        }
        let caster = Arc::new(Caster::new(&orchard));
        Self {
            rig: scene.resolved_rig(),
            true_rig: scene.true_rig(),
            scene,
            orchard,
            caster,
            plumes: Vec::new(),
        }
    }

    /// The same with these plumes before each scanner of the rig, in their order, found by where it really sits.
    #[must_use]
    pub fn with_plumes(self, of_mount: impl Fn(&Mount) -> Vec<Plume>) -> Self {
        let plumes = self.true_rig.scanners.iter().map(of_mount).collect();
        Self { plumes, ..self }
    }

    /// The same orchard with another rig or other optics; what `scene` says of trees is not looked at.
    #[must_use]
    pub fn with_scene(self, scene: Scene) -> Self {
        if scene.drive.has_headlands() != self.scene.drive.has_headlands() {
            return Self { plumes: self.plumes, ..Self::of_orchard(scene, self.orchard) };
        }
        Self { rig: scene.resolved_rig(), true_rig: scene.true_rig(), scene, ..self }
    }

    /// Another stage of the same orchard, which both share, as [`with_scene`](Self::with_scene) makes it; without plumes.
    #[must_use]
    pub fn beside(&self, scene: Scene) -> Self {
        let shared = Self {
            scene: self.scene.clone(),
            rig: self.rig.clone(),
            true_rig: self.true_rig.clone(),
            orchard: Arc::clone(&self.orchard),
            caster: Arc::clone(&self.caster),
            plumes: Vec::new(),
        };
        shared.with_scene(scene)
    }

    /// A tractor at its start, for the rig's scanners to ride on.
    pub fn tractor(&self) -> Tractor {
        Tractor::new(self.scene.trajectory(self.orchard.length_m()))
    }

    /// The GNSS receiver on its roof.
    pub fn receiver(&self) -> Receiver {
        Receiver::new(self.scene.gnss.clone(), self.scene.seed)
    }

    /// The rig's scanner number `index` as a device of `model`, with its view, on a tractor of its own.
    pub fn scanner(&self, index: usize, model: &'static Model) -> Result<(Device, ScannerView), StageError> {
        self.scanner_on(&self.tractor(), index, model)
    }

    /// The same on a tractor that carries other things too.
    pub fn scanner_on(
        &self,
        tractor: &Tractor,
        index: usize,
        model: &'static Model,
    ) -> Result<(Device, ScannerView), StageError> {
        let limits = RangeLimits { min_range_m: model.min_range_m, max_range_m: model.max_range_m };
        let world =
            ScannerView::new(Arc::clone(&self.caster), tractor.clone(), &self.true_rig, index, limits)?
                .with_encoder(self.scene.encoder)
                .on_slope(self.orchard.ground().rise)
                .with_wind(self.scene.wind, self.scene.seed)
                .with_eye(self.eye(index, model.into()));
        let unit = self.scene.optics.unit_of(self.scene.seed, index);
        let identity = Identity::of(model, index).of_run(self.scene.seed);
        let mut device = Device::new(model, Identity { unit, ..identity });
        if self.scene.optics.stages.has(optics::Stage::Echoes) {
            device.set_factory_echo(model.optics.factory_echo);
        }
        contaminate(&mut device, model, self.scene.optics.contamination())?;
        if let Some(mount) = self.rig.scanners.get(index) {
            let mode = scan_mode(model, mount)?;
            device.set_scan_mode(mode.frequency_centihz, mode.step)?;
        }
        Ok((device, world))
    }

    /// The rig's scanner number `index` as an LMS2xx, with its view, on a tractor of its own. Its variant has the mount's resolution, where the
    /// model has one that does.
    pub fn serial_scanner(
        &self,
        index: usize,
        model: &'static lms2xx::model::Model,
        options: lms2xx::device::Options,
    ) -> Result<(lms2xx::device::Device, ScannerView), StageError> {
        self.serial_scanner_on(&self.tractor(), index, model, options)
    }

    /// The same on a tractor that carries other things too.
    pub fn serial_scanner_on(
        &self,
        tractor: &Tractor,
        index: usize,
        model: &'static lms2xx::model::Model,
        options: lms2xx::device::Options,
    ) -> Result<(lms2xx::device::Device, ScannerView), StageError> {
        let limits = RangeLimits { min_range_m: model.min_range_m, max_range_m: model.max_range_m };
        let world =
            ScannerView::new(Arc::clone(&self.caster), tractor.clone(), &self.true_rig, index, limits)?
                .on_slope(self.orchard.ground().rise)
                .with_wind(self.scene.wind, self.scene.seed)
                .with_eye(self.eye(index, model.into()));
        let mut device = lms2xx::device::Device::new(model, options);
        let asked = self.rig.scanners.get(index).and_then(asked_step);
        let fits = |variant: &&lms2xx::Variant| asked == Some(variant.step_centideg.saturating_mul(100));
        if let Some(variant) = model.variants.iter().find(fits) {
            device.set_variant(*variant);
        }
        Ok((device, world))
    }

    /// The eye of the rig's scanner number `index`, a device of `model`; none where the scene's optics are ideal.
    fn eye(&self, index: usize, model: AnyModel) -> Option<Eye> {
        let mut settings = self.scene.optics.clone();
        settings.air.plumes.extend(self.plumes.get(index).into_iter().flatten().cloned());
        let (min_range_m, max_range_m) = model.range_m();
        let limits = RangeLimits { min_range_m, max_range_m };
        let of_model = EyeModel { optics: model.optics(), echoes: model.echoes(), limits };
        let roof_sense = self
            .true_rig
            .scanners
            .get(index)
            .map_or_else(|| Mount::default().roof_sense(), Mount::roof_sense);
        (!settings.stages.is_ideal())
            .then(|| Eye::new(of_model, &settings, self.scene.seed, index).under_roof(roof_sense))
    }

    /// The row that the rig's scanner number `index` sees; one that is not there where it looks away from all of them.
    pub fn row_seen(&self, index: usize) -> SeenRow {
        let nowhere = SeenRow { row: self.orchard.rows(), towards_x: true };
        self.scene.row_seen(index).unwrap_or(nowhere)
    }

    /// Where a mirror on this mount is in the scene, in the place of the rig's scanner number `index`, as the tractor drives ahead in its first alley and is
    /// at `y_m`. It drives level, on a slope as high as beside the row that [`Rig::stands_at_m`] names.
    pub fn pose(&self, index: usize, mount: &Mount, y_m: f64) -> Pose {
        let seen = self.row_seen(index);
        let spacing_m = self.rig.row_spacing_m.unwrap_or(Course::default().row_spacing_m);
        let stands_by = self.scene.drive.first_alley(&self.rig) - i32::from(self.rig.looks_left());
        let Pose { x_m, y_m, z_m } = mount.pose(y_m);
        Pose {
            x_m: seen.row as f64 * spacing_m + seen.sense() * x_m,
            y_m,
            z_m: z_m + self.orchard.ground().rise * f64::from(stands_by) * spacing_m,
        }
    }

    /// What is there of the row that the rig's scanner number `index` sees.
    pub fn truth(&self, index: usize) -> Truth {
        self.orchard.truth_of_row(self.row_seen(index).row, TruthGrid::default())
    }

    /// What the beams meet.
    pub fn caster(&self) -> &Caster {
        &self.caster
    }

    /// Scans a client receives while the tractor drives past as much as a row from its start on, at most an hour's. Where the row repeats (no headlands), that is
    /// the whole row, wherever the drive starts.
    pub fn scans_per_row(&self, device: &Device) -> u64 {
        self.scans_of_row(f64::from(device.mirror().frequency_centihz) / 100.0)
    }

    /// The same of a scanner that sends `hertz` scans a second.
    pub fn scans_of_row(&self, hertz: f64) -> u64 {
        self.scans_of_way(self.orchard.length_m(), hertz)
    }

    /// Scans of a scanner that sends `hertz` a second, until the tractor has come from its start to the end of the first row.
    pub fn scans_to_row_end(&self, hertz: f64) -> u64 {
        self.scans_of_way((self.orchard.length_m() - self.rig.start_m).max(0.0), hertz)
    }

    fn scans_of_way(&self, way_m: f64, hertz: f64) -> u64 {
        let length_m = self.orchard.length_m();
        if self.scene.drive == Drive::default() {
            return ((way_m / self.rig.speed_m_s * hertz).min(LONGEST_PASS_S * hertz)).round() as u64;
        }
        let trajectory = self.scene.trajectory(length_m);
        let scans = 0..(LONGEST_PASS_S * hertz) as u64;
        scans.clone().find(|scan| trajectory.at(*scan as f64 / hertz).way_m >= way_m).unwrap_or(scans.end)
    }
}

/// How long a pass of a row may take, simulated seconds.
const LONGEST_PASS_S: f64 = 3600.0;

/// The scan frequency a mount asks for, in the wire's 1/100 Hz.
pub fn asked_frequency_centihz(mount: &Mount) -> Option<u32> {
    mount.frequency_hz.map(|hertz| (hertz * 100.0).round() as u32)
}

/// The angle between beams a mount asks for, in the wire's 1/10000°.
pub fn asked_step(mount: &Mount) -> Option<u16> {
    mount.resolution_deg.map(|degrees| (degrees * 10_000.0).round() as u16)
}

/// The model's scan mode that fits what the mount asks for; its default where the mount leaves it open.
///
/// # Errors
/// There is none.
pub fn scan_mode(model: &Model, mount: &Mount) -> Result<ScanMode, ModeError> {
    let (frequency_centihz, step) = (asked_frequency_centihz(mount), asked_step(mount));
    let fits = |mode: &&ScanMode| {
        frequency_centihz.is_none_or(|asked| mode.frequency_centihz == asked)
            && step.is_none_or(|asked| mode.step == asked)
    };
    let refused = ModeError {
        model: model.title,
        frequency_centihz: frequency_centihz.unwrap_or(model.default_mode.frequency_centihz),
        step: step.unwrap_or(model.default_mode.step),
    };
    std::iter::once(&model.default_mode).chain(model.modes).find(fits).copied().ok_or(refused)
}
