//! Versions of what holds a rig: scene files, rig files, the rigs in recordings. What a word means in each is decided here.

use alloc::vec::Vec;
use core::fmt;

use super::{Orientation, Rig, RigError, Roof};

/// The version that is written.
pub const VERSION: u32 = 2;
/// The oldest that is read, and that of a rig without a version.
pub const OLDEST_VERSION: u32 = 1;

/// A `roof` of version 1 that says something else today.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OldRoof {
    /// Number of its scanner in the rig.
    pub scanner: usize,
    /// What is written.
    pub written: Roof,
    /// What it means.
    pub means: Roof,
}

impl fmt::Display for OldRoof {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { scanner, written, means } = self;
        write!(
            f,
            "scanner {scanner}: `roof = \"{}\"` in version {OLDEST_VERSION} means what version {VERSION} calls `roof = \"{}\"`",
            written.name(),
            means.name()
        )
    }
}

impl Rig {
    /// Gives the words of a rig that was written in this version the meaning that they had there; those that say something else today are
    /// returned.
    ///
    /// In version 1 `roof` had no effect on an up mount, and of a side mount it was no place but a sense, the same for either row: `forward` where
    /// device angles grow upwards (θ = α − 90°), `backward` where they grow downwards.
    ///
    /// # Errors
    /// A version that nothing is known of.
    pub fn migrate(&mut self, version: u32) -> Result<Vec<OldRoof>, RigError> {
        if !(OLDEST_VERSION..=VERSION).contains(&version) {
            return Err(RigError::Version { found: version });
        }
        let mut changed = Vec::new();
        if version == VERSION {
            return Ok(changed);
        }
        for (scanner, mount) in self.scanners.iter_mut().enumerate() {
            let Some(written) = mount.roof else { continue };
            let means = match (mount.orientation, written) {
                (Orientation::Side, Roof::Backward) => mount.default_roof().turned(),
                (Orientation::Side, Roof::Forward) | (Orientation::Up, _) => mount.default_roof(),
            };
            if means != written {
                mount.roof = Some(means);
                changed.push(OldRoof { scanner, written, means });
            }
        }
        Ok(changed)
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Mount, RowSide};
    use super::*;
    use alloc::string::ToString;

    #[test]
    fn version_1_keeps_the_angles_that_it_had() {
        use Orientation::{Side, Up};
        use Roof::{Backward, Forward};
        use RowSide::{Left, Right};
        for (orientation, row, written, map, means) in [
            (Side, Right, Forward, (1.0, -90.0), Backward),
            (Side, Right, Backward, (-1.0, 90.0), Forward),
            (Side, Left, Forward, (1.0, -90.0), Forward),
            (Side, Left, Backward, (-1.0, 90.0), Backward),
            (Up, Right, Forward, (1.0, 0.0), Backward),
            (Up, Right, Backward, (1.0, 0.0), Backward),
            (Up, Left, Forward, (-1.0, 180.0), Backward),
            (Up, Left, Backward, (-1.0, 180.0), Backward),
        ] {
            let mount = Mount { orientation, row, roof: Some(written), ..Mount::default() };
            let mut rig = Rig { scanners: alloc::vec![Mount::default(), mount], ..Rig::default() };
            let unchanged = rig.clone();
            let old = OldRoof { scanner: 1, written, means };
            let expected = if means == written { alloc::vec![] } else { alloc::vec![old] };
            assert_eq!(rig.migrate(1), Ok(expected), "{orientation:?} {row:?} {written:?}");
            assert_eq!(rig.scanners[1].angle_map(), map, "{orientation:?} {row:?} {written:?}");
            assert_eq!(rig.scanners[0], Mount::default());
            let mut rig = unchanged.clone();
            assert_eq!((rig.migrate(2), &rig), (Ok(alloc::vec![]), &unchanged));
        }
    }

    #[test]
    fn an_old_roof_names_the_new_word_and_other_versions_are_refused() {
        let mut rig = Rig::default();
        rig.scanners[0].roof = Some(Roof::Forward);
        let old = rig.migrate(1).unwrap();
        assert_eq!(
            old[0].to_string(),
            "scanner 0: `roof = \"forward\"` in version 1 means what version 2 calls `roof = \"backward\"`"
        );
        for found in [0, 3, u32::MAX] {
            assert_eq!(rig.migrate(found), Err(RigError::Version { found }));
        }
    }
}
