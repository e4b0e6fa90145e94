//! The parts of a calibration file, and the leaf area they give.

use rowscan_protocol::rig::BeamWidth;
use serde::{Deserialize, Serialize};

use super::canopy::CanopyClass;
use super::contact_scale::{CONTACT_KEYS, ContactScale, SHARE_KEYS};
use super::error::CalibrationError;
use super::quality::{FitQuality, QualityKeys, quality_keys};
use super::witness::Witness;
use super::wood::{WOOD_BY_SPOT, leafy_share};

/// How areas become leaf area, for one class. `class` and `units` are required in a file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Calibration {
    /// The unit of every area in it; must be written, so that dm² are never taken for m².
    pub units: Units,
    /// Of all other values, by whoever wrote the file: one that was changed since is told from one that was made so. `None` where the values are somebody's own, and in
    /// files of versions before this key.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fingerprint: Option<String>,
    /// What it is valid for.
    pub class: CalibrationClass,
    /// How the position was determined.
    pub provenance: Provenance,
    /// The rows it was fitted on.
    pub training: Training,
    /// The straight line on I_T.
    pub linear: Linear,
    /// The power law on I_T.
    pub power: Power,
    /// The scale of the contact frequency.
    pub contact: ContactScale,
    /// The scale of what shares of spots tell; `None` where remission tells no power, and in files of versions before this key.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub share: Option<ContactScale>,
    /// How shares and contact agreed on the fitted rows; without it no row goes by shares.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub witness: Option<Witness>,
}

/// The unit of a calibration's areas.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Units {
    /// Square metres, and square metres a metre of row.
    #[serde(rename = "m2")]
    SquareMetres,
}

/// What a calibration is valid for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CalibrationClass {
    /// Orchard preset: `spindle`, `mature`, `paper`, or a name of your own.
    pub preset: String,
    /// Shady threshold of the growth model, percent; over 100 keeps every leaf.
    pub shady_threshold_percent: f64,
    /// Growth stage in words, e.g. `10 iterations` or `full leaf`.
    pub growth_stage: String,
    /// Distance between trees, metres.
    pub tree_spacing_m: f64,
    /// Scanner model, by the name `rowscan models` lists.
    pub scanner_model: String,
    /// Angle between beams, degrees.
    pub resolution_deg: f64,
    /// Which echo was taken.
    pub echo_rule: EchoRule,
    /// How the beam was modelled.
    pub optics: Optics,
    /// From the scanner to the row plane, metres; unknown in files of versions before this key.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub distance_m: Option<f64>,
    /// Height of the mirror above the ground, metres; unknown in files of versions before this key.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub height_m: Option<f64>,
    /// By how much its scan plane was turned about the vertical, degrees; upright to the row where left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub yaw_deg: Option<f64>,
    /// By how much it leant forward or back, degrees; upright where left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pitch_deg: Option<f64>,
    /// How far apart lines lay, the mean over the rows' length, metres; unknown in files of versions before this key.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub line_spacing_m: Option<f64>,
    /// How deep the crowns were seen, the mean of the rows, metres; unknown in files of versions before this key.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub crown_depth_m: Option<f64>,
    /// Edge of the voxels that contact was measured in, metres; unknown in files of versions before this key.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub voxel_m: Option<f64>,
    /// Leaves and wood; unknown in files of versions before these keys.
    #[serde(default, skip_serializing_if = "CanopyClass::is_unknown")]
    pub canopy: CanopyClass,
}

/// Which echo a calibration was made with.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum EchoRule {
    /// The first.
    #[default]
    First,
    /// The last.
    Last,
}

/// How the beam of a calibration's scans was made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Optics {
    /// A ray: first hit.
    #[default]
    Ideal,
    /// A beam with a footprint.
    Footprint,
    /// A real device in a real orchard.
    Measured,
}

impl From<Option<BeamWidth>> for Optics {
    /// How simulated scans through such beams are made; a rig that says nothing has rays.
    fn from(width: Option<BeamWidth>) -> Self {
        match width {
            Some(BeamWidth::Device) => Self::Footprint,
            Some(BeamWidth::Ideal) | None => Self::Ideal,
        }
    }
}

/// How a calibration was made.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Provenance {
    /// The command that made it.
    pub command: String,
    /// The seeds of its rows.
    pub seeds: Vec<u64>,
}

/// The rows a calibration was fitted on.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Training {
    /// How many.
    pub n: u32,
    /// Reference length, metres: what the fits' values are per. Always 1.
    pub reference_length_m: f64,
    /// Mean leaf area, m² a metre of row: the null estimate.
    pub mean_leaf_area_m2_per_m: f64,
}

/// L = a · length + b · I_T.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Linear {
    /// m² a metre of row.
    pub a_m2_per_m: f64,
    /// m² of leaf a m² impacted.
    pub b: f64,
    /// How good it is.
    pub quality: FitQuality,
}

/// L / length = c · (I_T / length)^p.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Power {
    /// Leaf area a metre, m²/m, at an impacted area of 1 m²/m.
    pub c: f64,
    /// Exponent.
    pub p: f64,
    /// How good it is.
    pub quality: FitQuality,
}

/// The regressions on I_T.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RegressionKind {
    /// [`Linear`].
    Linear,
    /// [`Power`].
    Power,
}

impl Calibration {
    /// The share of a raw leaf area of so many m² a metre that is no wood, by what is known of the wood of the rows that were fitted: `[contact.wood]`, else
    /// their class's share of wood beside their mean leaf area. 1 where neither is told.
    pub(crate) fn leafy_share(&self, raw_m2_per_m: f64) -> f64 {
        let of_class = || {
            let share = self.class.canopy.wood_share.filter(|share| (0.0..1.0).contains(share))?;
            // Of wood the whole surface counts, of leaves both faces.
            Some(self.training.mean_leaf_area_m2_per_m * share / (1.0 - share))
        };
        let wood = self.contact.wood.map(|wood| wood.m2_per_m).or_else(of_class);
        let met = if self.class.optics == Optics::Ideal { 1.0 } else { WOOD_BY_SPOT };
        wood.map_or(1.0, |wood_m2_per_m| leafy_share(met * wood_m2_per_m, raw_m2_per_m))
    }

    /// Refuses coefficients and classes that no estimate could be made with.
    pub fn validate(&self) -> Result<(), CalibrationError> {
        for (key, text) in [
            ("class.preset", &self.class.preset),
            ("class.growth_stage", &self.class.growth_stage),
            ("class.scanner_model", &self.class.scanner_model),
        ] {
            if text.trim().is_empty() {
                return Err(CalibrationError::EmptyClass { key });
            }
        }
        for (key, value) in [
            ("class.shady_threshold_percent", self.class.shady_threshold_percent),
            ("linear.a_m2_per_m", self.linear.a_m2_per_m),
            ("linear.b", self.linear.b),
            ("power.p", self.power.p),
            ("linear.quality.loo_rmse_relative", self.linear.quality.loo_rmse_relative),
            ("power.quality.loo_rmse_relative", self.power.quality.loo_rmse_relative),
        ] {
            if !value.is_finite() {
                return Err(CalibrationError::NotFinite { key, value });
            }
        }
        for (key, value) in [
            ("class.tree_spacing_m", self.class.tree_spacing_m),
            ("class.resolution_deg", self.class.resolution_deg),
            ("training.reference_length_m", self.training.reference_length_m),
            ("training.mean_leaf_area_m2_per_m", self.training.mean_leaf_area_m2_per_m),
            ("linear.quality.high_m2_per_m", self.linear.quality.high_m2_per_m),
            ("power.c", self.power.c),
            ("power.quality.high_m2_per_m", self.power.quality.high_m2_per_m),
        ] {
            if !(value.is_finite() && value > 0.0) {
                return Err(CalibrationError::NotPositive { key, value });
            }
        }
        self.linear.quality.validate(&quality_keys!("linear"))?;
        self.power.quality.validate(&quality_keys!("power"))?;
        let canopy = &self.class.canopy;
        for (key, value, most, expected) in [
            ("class.canopy.wood_share", canopy.wood_share, 1.0, "a share from 0 to 1"),
            ("class.canopy.leaf_angle_deg", canopy.leaf_angle_deg, 90.0, "0 to 90 degrees"),
            ("class.canopy.leaf_area_cm2", canopy.leaf_area_cm2, f64::MAX, "0 or more"),
        ] {
            if let Some(value) = value.filter(|value| !(0.0..=most).contains(value)) {
                return Err(CalibrationError::OutOfRange { key, expected, value });
            }
        }
        self.contact.validate(&CONTACT_KEYS)?;
        self.share.map_or(Ok(()), |share| share.validate(&SHARE_KEYS))?;
        self.witness.map_or(Ok(()), |witness| witness.validate())?;
        for (key, value) in [
            ("class.distance_m", self.class.distance_m),
            ("class.voxel_m", self.class.voxel_m),
            ("class.crown_depth_m", self.class.crown_depth_m),
        ] {
            if let Some(value) = value.filter(|value| !(value.is_finite() && *value > 0.0)) {
                return Err(CalibrationError::NotPositive { key, value });
            }
        }
        Ok(())
    }

    /// The regression with the smaller leave-one-out error.
    pub fn best_regression(&self) -> RegressionKind {
        if self.power.quality.loo_rmse_relative < self.linear.quality.loo_rmse_relative {
            RegressionKind::Power
        } else {
            RegressionKind::Linear
        }
    }

    /// Leaf area, m², of `length_m` of row with the impacted area `impacted_m2`; never negative. 0 where nothing was hit.
    pub fn regression_m2(&self, kind: RegressionKind, length_m: f64, impacted_m2: f64) -> f64 {
        if !(length_m > 0.0 && impacted_m2 > 0.0) {
            return 0.0;
        }
        let leaf = match kind {
            RegressionKind::Linear => self.linear.a_m2_per_m * length_m + self.linear.b * impacted_m2,
            RegressionKind::Power => length_m * self.power.c * (impacted_m2 / length_m).powf(self.power.p),
        };
        leaf.max(0.0)
    }

    /// The quality of a regression.
    pub fn quality(&self, kind: RegressionKind) -> &FitQuality {
        match kind {
            RegressionKind::Linear => &self.linear.quality,
            RegressionKind::Power => &self.power.quality,
        }
    }
}

impl RegressionKind {
    /// Its name, as it stands in results.
    pub fn name(self) -> &'static str {
        match self {
            Self::Linear => "linear",
            Self::Power => "power",
        }
    }
}
