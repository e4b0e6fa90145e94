//! What the user should know of a file that was read.

use std::fmt;

use rowscan_protocol::rig::{BeamWidth, OldRoof, VERSION};

use crate::orchard::WithoutEffect;

/// Something in a file that does other than it seems to.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Warning {
    /// A mount of an older version that would mean something else in one of the present version.
    OldRoof {
        /// File or built-in name.
        place: String,
        /// What it is; it was read with the meaning that it had.
        about: OldRoof,
    },
    /// Weather, spray or dirt that no beam meets: the stage `air` is off.
    AirIsOff {
        /// File or built-in name.
        place: String,
    },
    /// Keys of the orchard that what makes its trees does not look at.
    NoEffect {
        /// File or built-in name.
        place: String,
        /// Which.
        keys: WithoutEffect,
    },
    /// A rig that says another width of the beams than those that the scene casts.
    OtherOptics {
        /// File or built-in name.
        place: String,
        /// What the rig says.
        rig: BeamWidth,
        /// What the scene casts.
        cast: BeamWidth,
    },
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::OldRoof { place, about } => {
                write!(f, "{place}: {about}; write that, and `version = {VERSION}`")
            }
            Self::AirIsOff { place } => write!(
                f,
                "{place}: `[optics.air]` has no effect, for its stage is off; write `[optics] stages = \"device\"`, or another list with `air`, or give --optics"
            ),
            Self::NoEffect { place, keys } => {
                write!(f, "{place}: {keys}")
            }
            Self::OtherOptics { place, rig, cast } => write!(
                f,
                "{place}: `[rig] optics = \"{}\"`, and the scene casts {} beams (`[optics] stages`): estimates of its scans are wrong by it; leave the rig's \
                 key out, or write `[optics] stages = \"{0}\"`, or give --optics",
                rig.name(),
                cast.name()
            ),
        }
    }
}
