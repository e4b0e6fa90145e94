//! Which way the roof of a scanner looks, and with it where its device angles point.
//!
//! SICK counts the device angle α counter-clockwise as seen from above the roof: 0° to the device's right, 90° ahead. So a roof that looks the
//! other way turns the sense of the angle.

use super::{Mount, Orientation, Phi, RowSide};
use crate::scan::elevation_deg;

/// Which way along the drive the roof of the housing looks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
pub enum Roof {
    /// Ahead: 0° points up where a side mount looks right and down where it looks left, and to the tractor's left of an up mount.
    Forward,
    /// Back: 0° points down where a side mount looks right and up where it looks left, and to the tractor's right of an up mount.
    Backward,
}

impl Roof {
    /// As files have it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Forward => "forward",
            Self::Backward => "backward",
        }
    }

    /// The other way.
    #[must_use]
    pub fn turned(self) -> Self {
        match self {
            Self::Forward => Self::Backward,
            Self::Backward => Self::Forward,
        }
    }
}

impl Mount {
    /// Which way the roof looks: what the rig says, or else [`default_roof`](Self::default_roof).
    pub fn roof_in_force(&self) -> Roof {
        self.roof.unwrap_or(self.default_roof())
    }

    /// Which way it looks where the rig says nothing: device angles of a side mount grow upwards, and 0° of an up mount points to the tractor's
    /// right.
    pub fn default_roof(&self) -> Roof {
        match (self.orientation, self.row) {
            (Orientation::Side, RowSide::Left) => Roof::Forward,
            (Orientation::Side, RowSide::Right) | (Orientation::Up, _) => Roof::Backward,
        }
    }

    /// Which way along the row the roof looks, and with it layers of positive elevation: 1 towards larger Y, −1 towards smaller.
    pub fn roof_sense(&self) -> f64 {
        match self.roof_in_force() {
            Roof::Forward => 1.0,
            Roof::Backward => -1.0,
        }
    }

    /// Elevation of the layer with this code, degrees, as this rig reads its sign: to the side of the roof where it is positive.
    pub fn layer_deg(&self, layer_centideg: i16) -> f64 {
        match self.phi {
            Phi::Up => elevation_deg(layer_centideg),
            Phi::Down => elevation_deg(layer_centideg.saturating_neg()),
        }
    }

    /// θ (degrees from +X, up positive) of a beam at device angle `alpha_deg`.
    pub fn theta_deg(&self, alpha_deg: f64) -> f64 {
        let (sense, offset_deg) = self.angle_map();
        sense * alpha_deg + offset_deg
    }

    /// θ = sense · α + offset (degrees).
    pub fn angle_map(&self) -> (f64, f64) {
        // Seen from behind the tractor, θ of the row on the right grows counter-clockwise, as α does seen from above a roof that looks back.
        let sense = -self.roof_sense() * self.side();
        let ahead_deg = match self.orientation {
            Orientation::Side => 0.0,
            Orientation::Up => 90.0,
        };
        (sense, ahead_deg - sense * 90.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_a_word_angles_are_those_of_all_rigs_that_say_nothing() {
        let map = |orientation, row| Mount { orientation, row, ..Mount::default() }.angle_map();
        assert_eq!(map(Orientation::Side, RowSide::Right), (1.0, -90.0));
        assert_eq!(map(Orientation::Side, RowSide::Left), (1.0, -90.0));
        assert_eq!(map(Orientation::Up, RowSide::Right), (1.0, 0.0));
        assert_eq!(map(Orientation::Up, RowSide::Left), (-1.0, 180.0));
    }
}
