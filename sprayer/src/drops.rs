//! The drops that a boom's nozzles make.

use rowscan_scenes::optics::Plume;
use serde::{Deserialize, Serialize};

/// The drops that its nozzles make: table `[drops]`. With it, scanners see the spray.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Drops {
    /// Their volume-mean diameter, µm.
    pub drop_um: f64,
    /// Their speed, m/s.
    pub speed_m_s: f64,
}

impl Default for Drops {
    fn default() -> Self {
        let Plume { drop_um, speed_m_s, .. } = Plume::default();
        Self { drop_um, speed_m_s }
    }
}
