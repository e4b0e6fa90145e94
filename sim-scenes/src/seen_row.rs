//! Which row a scanner sees, and from which side: that of its side of the tractor, beside the alley in which the drive begins.

use rowscan_protocol::rig::RowSide;
use rowscan_vehicle::trajectory::Alley;

use crate::scene::Scene;

/// A row as a scanner sees it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SeenRow {
    /// Its number, from 0; there may be no such row.
    pub row: usize,
    /// The scanner stands on its −X side and looks towards +X.
    pub towards_x: bool,
}

/// The first row, seen from its −X side: what a scanner on the right sees in alley 0.
impl Default for SeenRow {
    fn default() -> Self {
        Self { row: 0, towards_x: true }
    }
}

impl SeenRow {
    /// A place of the scene from the row's axis: X grows away from the scanner. `row_spacing_m` is the distance between rows.
    pub fn before(self, [x_m, y_m, z_m]: [f64; 3], row_spacing_m: Option<f64>) -> [f64; 3] {
        // Without a spacing there is one row.
        let axis_m = self.row as f64 * row_spacing_m.unwrap_or(0.0);
        [self.sense() * (x_m - axis_m), y_m, z_m]
    }

    /// 1 if X grows away from the scanner, else −1.
    pub fn sense(self) -> f64 {
        if self.towards_x { 1.0 } else { -1.0 }
    }
}

impl Scene {
    /// The row that the rig's scanner of this number sees in the drive's first alley; none where it looks away from all rows. Rows on its other side may end
    /// before that number.
    pub fn row_seen(&self, scanner: usize) -> Option<SeenRow> {
        let side = self.rig.scanners.get(scanner).map_or(RowSide::default(), |mount| mount.row);
        let alley = Alley { number: self.drive.first_alley(&self.rig), backwards: false };
        let (row, towards_x) = alley.row_beside(side == RowSide::Right);
        Some(SeenRow { row: usize::try_from(row).ok()?, towards_x })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::scene_from_text;

    #[test]
    fn each_side_of_an_alley_is_another_row() {
        let seen = |drive: &str, sides: &[&str]| -> Vec<Option<SeenRow>> {
            let mounts: String =
                sides.iter().map(|side| format!("[[rig.scanner]]\nrow = \"{side}\"\n")).collect();
            let scene = scene_from_text(&format!("version = 2\n{drive}\n{mounts}"), |_| {}).unwrap();
            (0..sides.len()).map(|number| scene.row_seen(number)).collect()
        };
        let row = |row, towards_x| Some(SeenRow { row, towards_x });
        assert_eq!(seen("", &["right"]), [row(0, true)]);
        assert_eq!(seen("", &["left"]), [row(0, false)], "without an alley it looks at the first row");
        assert_eq!(seen("[drive]\nalley = 1", &["right", "left"]), [row(1, true), row(0, false)]);
        assert_eq!(seen("[drive]\nalley = 0", &["right", "left"]), [row(0, true), None]);
        assert_eq!(seen("[drive]\nalley = 3", &["right", "left"]), [row(3, true), row(2, false)]);
    }

    #[test]
    fn a_place_before_the_row_is_negative_on_the_scanners_side() {
        let right = SeenRow { row: 1, towards_x: true };
        assert_eq!(right.before([3.0, 5.0, 2.0], Some(4.0)), [-1.0, 5.0, 2.0]);
        let left = SeenRow { row: 1, towards_x: false };
        assert_eq!(left.before([5.0, 5.0, 2.0], Some(4.0)), [-1.0, 5.0, 2.0]);
        assert_eq!(SeenRow::default().before([-1.0, 0.0, 0.0], None), [-1.0, 0.0, 0.0]);
    }
}
