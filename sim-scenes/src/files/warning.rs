//! What the user should know of a file that was read.

use std::fmt;

use rowscan_protocol::rig::{OldRoof, VERSION};

/// Something in a file of an older version that would mean something else in one of the present version.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Warning {
    /// File or built-in name.
    pub place: String,
    /// What it is; it was read with the meaning that it had.
    pub about: OldRoof,
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}; write that, and `version = {VERSION}`", self.place, self.about)
    }
}
