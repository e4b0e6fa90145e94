//! Which settings take something from a scan, by their places in a table.

/// A set of settings that take something away: 16 at most. What they are the table of leftovers tells.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LeftoverSet(u16);

impl LeftoverSet {
    /// Places that a set can hold.
    pub const MOST: usize = u16::BITS as usize;

    /// True if the setting at this place is in it.
    pub fn holds(self, place: usize) -> bool {
        place < Self::MOST && self.0 >> place & 1 == 1
    }

    /// The setting at this place is in it from now on, or is not; a place beyond [`Self::MOST`] changes nothing.
    pub fn put(&mut self, place: usize, is_in: bool) {
        if place < Self::MOST {
            self.0 = self.0 & !(1 << place) | u16::from(is_in) << place;
        }
    }

    /// Those that are in one of two sets and not in the other.
    #[must_use]
    pub fn differing(self, other: Self) -> Self {
        Self(self.0 ^ other.0)
    }

    /// Those that are in either of two sets.
    #[must_use]
    pub fn or(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_set_holds_what_was_put_into_it_and_places_beyond_it_change_nothing() {
        let mut set = LeftoverSet::default();
        for place in [0, 3, 15, 16, 200] {
            set.put(place, true);
        }
        let held = |set: LeftoverSet| (0..40).filter(|place| set.holds(*place)).sum::<usize>();
        assert_eq!(held(set), 18);
        let before = set;
        set.put(3, false);
        assert_eq!((held(set), held(set.differing(before)), set.or(before)), (15, 3, before));
    }
}
