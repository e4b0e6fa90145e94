//! A scene: an orchard and the rig that drives past it.

use rowscan_protocol::rig::{OldRoof, Rig, RigError};
use rowscan_vehicle::Encoder;
use rowscan_vehicle::gnss::Gnss;
use rowscan_vehicle::trajectory::{Drive, DriveError, Trajectory};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::optics::OpticsSettings;
use crate::orchard::OrchardParameters;
use crate::parameters::{ParameterError, SceneFile};
use crate::true_mount::{TrueMount, true_rig};
use crate::wind::Wind;

pub use rowscan_protocol::rig::{OLDEST_VERSION, VERSION};

/// A scene file. Unknown keys are refused. What is read from a file of an older version is of the present one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
// The derived reader takes every word for one of the present version: only `FromFile` calls it.
#[serde(deny_unknown_fields, remote = "Self")]
pub struct Scene {
    /// Format of the file. In version 1, `roof` of a scanner means something else: docs/rigs.md.
    #[schemars(range(min = OLDEST_VERSION, max = VERSION), example = VERSION)]
    pub version: u32,
    /// What to call it.
    #[serde(default)]
    pub name: String,
    /// Every random number of the scene follows from this.
    #[serde(default = "default_seed")]
    pub seed: u64,
    /// What grows there.
    #[serde(default)]
    pub orchard: OrchardParameters,
    /// What drives past; spacings and number of trees left out here are the orchard's.
    #[serde(default)]
    pub rig: Rig,
    /// How the scanners really sit on it, where the rig is wrong.
    #[serde(default, rename = "true_mount", skip_serializing_if = "Vec::is_empty")]
    pub true_mounts: Vec<TrueMount>,
    /// How the tractor really drives; without it, at the rig's speed.
    #[serde(default, skip_serializing_if = "is_default")]
    pub drive: Drive,
    /// The encoder on a wheel.
    #[serde(default, skip_serializing_if = "is_default")]
    pub encoder: Encoder,
    /// The GNSS receiver on the roof.
    #[serde(default, skip_serializing_if = "is_default")]
    pub gnss: Gnss,
    /// The wind that trees sway in; calm where left out.
    #[serde(default, skip_serializing_if = "is_default")]
    pub wind: Wind,
    /// How the scanners see; ideal beams where left out.
    #[serde(default, skip_serializing_if = "is_default")]
    pub optics: OpticsSettings,
}

/// A scene as read from a file of any version: for those who tell the user what in the file says something else today.
#[derive(Clone, Debug, PartialEq)]
pub struct FromFile {
    /// The scene.
    pub scene: Scene,
    /// Words of an older version whose meaning has changed; the scene has what they meant.
    pub old_roofs: Vec<OldRoof>,
}

impl<'de> Deserialize<'de> for FromFile {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let mut scene = Scene::deserialize(deserializer)?;
        let mut old_roofs = Vec::new();
        // An unknown version stays, and `validate` refuses it.
        if let Ok(changed) = scene.rig.migrate(scene.version) {
            (scene.version, old_roofs) = (VERSION, changed);
        }
        Ok(Self { scene, old_roofs })
    }
}

impl<'de> Deserialize<'de> for Scene {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        FromFile::deserialize(deserializer).map(|file| file.scene)
    }
}

impl Serialize for Scene {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        Self::serialize(self, serializer)
    }
}

fn is_default<T: Default + PartialEq>(table: &T) -> bool {
    *table == T::default()
}

fn default_seed() -> u64 {
    1
}

impl Scene {
    /// The rig with tree spacing, row spacing, number of trees, the ground's slope, encoder and beam width filled in from orchard, encoder and optics where it leaves them out.
    pub fn resolved_rig(&self) -> Rig {
        let layout = self.orchard.layout();
        let slope_deg = self.orchard.ground_parameters().slope_deg;
        let rig = self.rig.clone();
        Rig {
            tree_spacing_m: rig.tree_spacing_m.or(Some(layout.tree_spacing_m)),
            row_spacing_m: rig.row_spacing_m.or(Some(layout.row_spacing_m)),
            trees: rig.trees.or(Some(layout.trees)),
            // Level ground is what a rig has that says nothing.
            ground_slope_deg: rig.ground_slope_deg.or(Some(slope_deg).filter(|deg| *deg != 0.0)),
            encoder_ticks_per_m: rig.encoder_ticks_per_m.or(Some(self.encoder.ticks_a_metre_ahead())),
            optics: rig.optics.or(Some(self.optics.beam_width())),
            ..rig
        }
    }

    /// The same scene, each value written out that preset, orchard, encoder or optics give.
    #[must_use]
    pub fn spelled_out(&self) -> Self {
        Self { orchard: self.orchard.spelled_out(), rig: self.resolved_rig(), ..self.clone() }
    }

    /// The same with the scanners where they really are: what no estimator knows.
    pub fn true_rig(&self) -> Rig {
        true_rig(self.resolved_rig(), &self.true_mounts)
    }

    /// The drive past rows of this length, metres: where the tractor is at any time.
    pub fn trajectory(&self, row_m: f64) -> Trajectory {
        let ground = self.drive.road.as_ref().map(|road| road.ground(self.seed));
        self.drive.trajectory(&self.resolved_rig(), row_m).over(ground)
    }

    /// The files that it names. Their contents must be handed in before it can be grown.
    pub fn files_mut(&mut self) -> Vec<&mut SceneFile> {
        let mut files = self.orchard.files_mut();
        files.extend(self.drive.track.as_mut());
        files
    }

    /// Checks all values.
    ///
    /// # Errors
    /// The first key with an invalid value, with what was expected and found.
    pub fn validate(&self) -> Result<(), SceneError> {
        if self.version != VERSION {
            return Err(SceneError::Version { found: self.version });
        }
        self.orchard.validate()?;
        self.resolved_rig().validate()?;
        let (mounts, scanners) = (self.true_mounts.len(), self.rig.scanners.len());
        if mounts > scanners {
            return Err(SceneError::TooManyMounts { mounts, scanners });
        }
        self.true_rig().validate().map_err(SceneError::TrueMount)?;
        self.drive.validate()?;
        self.encoder.validate()?;
        self.gnss.validate()?;
        self.wind.validate()?;
        self.optics.validate()?;
        Ok(())
    }
}

/// Why a scene cannot be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SceneError {
    /// A format that this program does not know.
    #[error("version must be {OLDEST_VERSION} or {VERSION}, found {found}")]
    Version {
        /// The value found.
        found: u32,
    },
    /// A value in `[orchard]`, `[encoder]`, `[gnss]`, `[wind]` or `[optics]`.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
    /// A value in `[rig]`.
    #[error(transparent)]
    Rig(#[from] RigError),
    /// A value in `[[true_mount]]`.
    #[error("the rig with `[[true_mount]]`: {0}")]
    TrueMount(RigError),
    /// More true mounts than scanners.
    #[error(
        "`[[true_mount]]`: expected one a scanner at most, found {mounts}; the rig has {scanners} scanner(s)"
    )]
    TooManyMounts {
        /// Found.
        mounts: usize,
        /// Scanners of the rig.
        scanners: usize,
    },
    /// A value in `[drive]`.
    #[error(transparent)]
    Drive(#[from] DriveError),
}
