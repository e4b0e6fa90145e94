//! The six types of scan.

use crate::parameters::choices;

choices! {
    /// Where the beams come from and how they are spread (paper Fig. 4; its Table 4 is lost and rebuilt from the geometry).
    pub enum ScanKind {
        /// From beside the row, by angle: a mirror.
        Lateral = "lateral",
        /// The same from the other side.
        Opposite = "opposite",
        /// From beside the row, level beams one above the other: a bar of sensors.
        LateralOrthogonal = "lateral-orthogonal",
        /// The same from the other side.
        OppositeOrthogonal = "opposite-orthogonal",
        /// From above the row, by angle.
        Zenith = "zenith",
        /// From above, plumb beams side by side.
        ZenithOrthogonal = "zenith-orthogonal",
    }
}

choices! {
    /// Where in its cell a sample is taken.
    pub enum Sampling {
        /// At the cell's start, as the paper does: θ_j = θ_min + j Δθ stands for [θ_j, θ_j + Δθ].
        Start = "start",
        /// In its middle.
        Centre = "centre",
    }
}

impl ScanKind {
    /// The type of this name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.iter().zip(Self::NAMES).find(|(_, known)| **known == name).map(|(kind, _)| *kind)
    }

    /// True if the beams spread by angle from one point; false if they are parallel.
    pub fn is_angular(self) -> bool {
        matches!(self, Self::Lateral | Self::Opposite | Self::Zenith)
    }

    /// True if they come from above.
    pub fn is_zenith(self) -> bool {
        matches!(self, Self::Zenith | Self::ZenithOrthogonal)
    }

    /// Origin and direction of beam j of line i, in words; D is the distance, Zs the height overhead. X = 0 is the row's axis.
    pub fn template(self) -> &'static str {
        match self {
            Self::Lateral => "P = (-D, y_i, z0); d = (cos theta_j, 0, sin theta_j)",
            Self::Opposite => "P = (+D, y_i, z0); d = (-cos theta_j, 0, sin theta_j)",
            Self::LateralOrthogonal => "P = (-D, y_i, z_j); d = (1, 0, 0)",
            Self::OppositeOrthogonal => "P = (+D, y_i, z_j); d = (-1, 0, 0)",
            Self::Zenith => "P = (0, y_i, Zs); d = (sin phi_j, 0, -cos phi_j)",
            Self::ZenithOrthogonal => "P = (x_j, y_i, Zs); d = (0, 0, -1)",
        }
    }
}
