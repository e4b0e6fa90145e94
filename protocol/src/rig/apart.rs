//! Distances between scanners: how far two are apart, and scanners placed by the distance to the one before, as a tape measures it.

#[cfg(feature = "serde")]
use alloc::vec::Vec;

#[cfg(any(feature = "serde", test))]
use super::RigError;
use super::{Mount, Rig};

/// How far one scanner's mirror is from another's, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Apart {
    /// Ahead of it, along the tractor.
    pub ahead_m: f64,
    /// Above it.
    pub above_m: f64,
    /// To its right, across the tractor; None where they look at rows whose distance the rig does not know.
    pub right_m: Option<f64>,
}

impl Apart {
    /// In a straight line; None where one of its parts is unknown.
    pub fn straight_m(&self) -> Option<f64> {
        self.right_m.map(|right_m| {
            libm::sqrt(self.ahead_m * self.ahead_m + self.above_m * self.above_m + right_m * right_m)
        })
    }
}

impl Rig {
    /// Where a mirror is to the right of the middle between the rows, metres; None without `row_spacing_m`.
    pub fn right_of_middle_m(&self, mount: &Mount) -> Option<f64> {
        self.row_spacing_m.map(|spacing_m| mount.side() * (spacing_m / 2.0 - mount.distance_m))
    }

    /// Whether a scanner looks to the tractor's left: heights count from the foot of the row there, else from that of the row on its right.
    pub fn looks_left(&self) -> bool {
        self.scanners.iter().any(|mount| mount.row == super::RowSide::Left)
    }

    /// Z of the plane from which heights count, on ground of this rig's slope, metres: 0 beside the row at X = 0, and another where the tractor drives in
    /// another `alley`.
    pub fn stands_at_m(&self, alley: Option<i32>) -> f64 {
        let Some(alley) = alley else { return 0.0 };
        let row = f64::from(alley - i32::from(self.looks_left()));
        let rise = libm::tan(self.ground_slope_deg.unwrap_or(0.0).to_radians());
        rise * row * self.row_spacing_m.unwrap_or(0.0)
    }

    /// X of the axis of the row that a mount looks at, metres, where the tractor drives ahead in alley `alley`: row `alley` is on its right, the one before
    /// on its left. Left out, that is 0, or 1 where a scanner of the rig looks left, as a scene's drive has it. Rows of a rig that does not say how far
    /// apart they are stand at X = 0.
    pub fn row_axis_m(&self, mount: &Mount, alley: Option<i32>) -> f64 {
        let alley = f64::from(alley.unwrap_or(i32::from(self.looks_left())));
        let spacing_m = self.row_spacing_m.unwrap_or(0.0);
        match mount.row {
            super::RowSide::Right => alley * spacing_m,
            super::RowSide::Left => (alley - 1.0) * spacing_m,
        }
    }

    /// How far `other` is from `one`.
    pub fn apart(&self, one: &Mount, other: &Mount) -> Apart {
        let right_m = if one.row == other.row {
            Some(one.side() * (one.distance_m - other.distance_m))
        } else {
            self.right_of_middle_m(one).zip(self.right_of_middle_m(other)).map(|(one, other)| other - one)
        };
        Apart { ahead_m: other.offset_y_m - one.offset_y_m, above_m: other.height_m - one.height_m, right_m }
    }
}

impl Mount {
    /// 1 where the row it looks at is on the tractor's right, −1 where it is on the left.
    pub fn side(&self) -> f64 {
        match self.row {
            super::RowSide::Right => 1.0,
            super::RowSide::Left => -1.0,
        }
    }
}

/// Reads the list of scanners, each at its place.
#[cfg(feature = "serde")]
pub(super) fn placed<'de, D: serde::Deserializer<'de>>(deserializer: D) -> Result<Vec<Mount>, D::Error> {
    let mut mounts = <Vec<Mount> as serde::Deserialize>::deserialize(deserializer)?;
    place(&mut mounts).map_err(serde::de::Error::custom)?;
    Ok(mounts)
}

/// Turns distances to the scanner before into places on the tractor.
#[cfg(any(feature = "serde", test))]
fn place(mounts: &mut [Mount]) -> Result<(), RigError> {
    let unplaced = Mount::default();
    let mut before: Option<(f64, f64)> = None;
    for mount in mounts {
        if let Some(ahead_m) = mount.ahead_of_previous_m.take() {
            let (key, other) = ("ahead_of_previous_m", "offset_y_m");
            let (offset_y_m, _) = before.ok_or(RigError::NoneBefore { key, instead: other })?;
            if mount.offset_y_m != unplaced.offset_y_m {
                return Err(RigError::BothGiven { key, other });
            }
            mount.offset_y_m = offset_y_m + ahead_m;
        }
        if let Some(above_m) = mount.above_previous_m.take() {
            let (key, other) = ("above_previous_m", "height_m");
            let (_, height_m) = before.ok_or(RigError::NoneBefore { key, instead: other })?;
            if mount.height_m != unplaced.height_m {
                return Err(RigError::BothGiven { key, other });
            }
            mount.height_m = height_m + above_m;
        }
        before = Some((mount.offset_y_m, mount.height_m));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mount() -> Mount {
        Mount::default()
    }

    #[test]
    fn distances_add_up_from_scanner_to_scanner() {
        let mut mounts = [
            Mount { offset_y_m: 0.4, height_m: 1.2, ..mount() },
            Mount { ahead_of_previous_m: Some(0.9), above_previous_m: Some(0.5), ..mount() },
            Mount { ahead_of_previous_m: Some(-0.3), ..mount() },
        ];
        place(&mut mounts).expect("they fit");
        let places = mounts.clone().map(|mount| (mount.offset_y_m, mount.height_m));
        assert_eq!(places, [(0.4, 1.2), (1.3, 1.7), (1.0, 1.6)]);
        assert!(mounts.iter().all(|mount| mount.ahead_of_previous_m.is_none()), "read once");
    }

    #[test]
    fn scanners_of_two_rows_are_apart_by_what_the_rows_leave() {
        let left = Mount { row: super::super::RowSide::Left, distance_m: 1.5, height_m: 1.2, ..mount() };
        let rig = Rig { row_spacing_m: Some(4.0), ..Rig::default() };
        let apart = rig.apart(&left, &mount());
        assert!((apart.right_m.expect("known") - 0.6).abs() < 1e-12, "4 m less 1.5 m and 1.9 m");
        assert!((apart.straight_m().expect("known") - 0.52_f64.sqrt()).abs() < 1e-12);
        assert_eq!(Rig::default().apart(&left, &mount()).right_m, None, "the rows' distance is unknown");
        let farther = Mount { distance_m: 2.4, ..mount() };
        assert_eq!(Rig::default().apart(&farther, &mount()).right_m, Some(0.5));
    }

    #[test]
    fn what_has_no_scanner_before_it_or_two_places_is_refused() {
        let first = &mut [Mount { ahead_of_previous_m: Some(0.9), ..mount() }];
        let why = RigError::NoneBefore { key: "ahead_of_previous_m", instead: "offset_y_m" };
        assert_eq!(place(first), Err(why));
        let twice = Mount { above_previous_m: Some(0.9), height_m: 2.0, ..mount() };
        let why = RigError::BothGiven { key: "above_previous_m", other: "height_m" };
        assert_eq!(place(&mut [mount(), twice]), Err(why));
    }
}
