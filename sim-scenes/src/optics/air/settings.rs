//! The table `[optics.air]` of a scene.

use rowscan_vehicle::ParameterError;
use rowscan_vehicle::parameter::require_within;
use serde::{Deserialize, Serialize};

use super::plume::Plume;
use super::sun::Sun;
use super::window::WindowSector;

/// Weather, spray and dirt: table `[optics.air]`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Air {
    /// Rain, mm/h.
    pub rain_mm_h: f64,
    /// Snow, mm/h of water.
    pub snow_mm_h: f64,
    /// Reflectance of rain drops; 0 stands for 0.02, what water returns; 0.33 is an upper bound.
    pub drop_reflectance: f64,
    /// Visibility in fog, metres; without it the air is clear.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(example = 200.0)]
    pub visibility_m: Option<f64>,
    /// Dust, g/m³, in gusts.
    pub dust_g_m3: f64,
    /// Share of shots, 0 to 1, that a drop on the window takes 5 to 30 % of.
    pub window_drops: f64,
    /// Where the sun stands; without it no beam looks into it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sun: Option<Sun>,
    /// Spraying nozzles.
    #[serde(rename = "plume", skip_serializing_if = "Vec::is_empty")]
    pub plumes: Vec<Plume>,
    /// Dirt on the window.
    #[serde(rename = "window", skip_serializing_if = "Vec::is_empty")]
    pub windows: Vec<WindowSector>,
}

impl Air {
    /// What a scanner reports of its window: the level of the dirtiest sector.
    pub(in crate::optics) fn contamination(&self) -> u8 {
        self.windows.iter().map(WindowSector::contamination).max().unwrap_or(0)
    }

    /// # Errors
    /// The first key with an invalid value.
    pub(in crate::optics) fn validate(&self) -> Result<(), ParameterError> {
        require_within("optics.air.rain_mm_h", self.rain_mm_h, 0.0, 500.0)?;
        require_within("optics.air.snow_mm_h", self.snow_mm_h, 0.0, 100.0)?;
        require_within("optics.air.drop_reflectance", self.drop_reflectance, 0.0, 1.0)?;
        require_within("optics.air.visibility_m", self.visibility_m.unwrap_or(1e3), 1.0, 1e6)?;
        require_within("optics.air.dust_g_m3", self.dust_g_m3, 0.0, 100.0)?;
        require_within("optics.air.window_drops", self.window_drops, 0.0, 1.0)?;
        self.sun.iter().try_for_each(Sun::validate)?;
        self.plumes.iter().try_for_each(Plume::validate)?;
        self.windows.iter().try_for_each(WindowSector::validate)
    }
}
