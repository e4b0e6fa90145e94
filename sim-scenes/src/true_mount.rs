//! What a scanner's mount really is, where the rig believes something else.

use rowscan_protocol::rig::{Mount, Rig};
use serde::{Deserialize, Serialize};

/// A scanner's true mount: table `[[true_mount]]`, in the order of the rig's scanners. Keys that are left out are as the rig has them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct TrueMount {
    /// Height of the mirror, metres.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(example = 1.65)]
    pub height_m: Option<f64>,
    /// Distance from the mirror to the row axis, metres.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(example = 1.95)]
    pub distance_m: Option<f64>,
    /// How far ahead of the tractor's reference point, metres.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(example = 0.05)]
    pub offset_y_m: Option<f64>,
    /// Beams at the row turned ahead, degrees.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(example = 2.0)]
    pub yaw_deg: Option<f64>,
    /// Top leant back, degrees.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(example = 1.0)]
    pub pitch_deg: Option<f64>,
    /// Top leant to the row, degrees.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(example = -3.0)]
    pub roll_deg: Option<f64>,
}

impl TrueMount {
    fn of(&self, believed: &Mount) -> Mount {
        Mount {
            height_m: self.height_m.unwrap_or(believed.height_m),
            distance_m: self.distance_m.unwrap_or(believed.distance_m),
            offset_y_m: self.offset_y_m.unwrap_or(believed.offset_y_m),
            yaw_deg: self.yaw_deg.unwrap_or(believed.yaw_deg),
            pitch_deg: self.pitch_deg.unwrap_or(believed.pitch_deg),
            roll_deg: self.roll_deg.unwrap_or(believed.roll_deg),
            ..believed.clone()
        }
    }
}

/// The rig with its scanners where they really are.
pub(crate) fn true_rig(believed: Rig, mounts: &[TrueMount]) -> Rig {
    let mut rig = believed;
    for (mount, really) in rig.scanners.iter_mut().zip(mounts) {
        *mount = really.of(mount);
    }
    rig
}
