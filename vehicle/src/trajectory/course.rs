//! From distance to place: along a row, round the headland, back along the next alley.
//!
//! Alley `a` lies between row `a − 1` and row `a`; its middle is X = (a − ½) · row spacing. The tractor drives +Y in its first alley,
//! −Y in the next, and so on: so the same scanner sees a row from one side and, an alley later, from the other.

use std::f64::consts::PI;

/// So far before the first row and behind the end of the last one, metres, nothing that the tractor carries is beside it.
const CLEAR_M: f64 = 8.0;

/// Where the tractor is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Place {
    /// Across the rows, metres.
    pub x_m: f64,
    /// Along the rows, metres.
    pub y_m: f64,
    /// Clockwise from +Y as seen from above, radians.
    pub heading_rad: f64,
    /// How fast the heading turns clockwise with the way, radians a metre; 0 straight ahead.
    pub curvature_1_m: f64,
    /// The alley it drives in; none on the headland.
    pub alley: Option<Alley>,
    /// The row at whose foot the tractor stands, on a slope: all heights of what it carries count from there. None on the headland.
    pub stands_by: Option<i32>,
}

/// An alley being driven.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Alley {
    /// Its number: the row on its +X side.
    pub number: i32,
    /// Driven towards −Y.
    pub backwards: bool,
}

impl Alley {
    /// The row that a scanner sees which looks to the tractor's right (or left), and whether it looks towards +X at it.
    pub fn row_beside(self, right: bool) -> (i32, bool) {
        let towards_x = right != self.backwards;
        (if towards_x { self.number } else { self.number - 1 }, towards_x)
    }
}

/// The way through the orchard. Rows begin at Y = 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Course {
    /// Y of the start, metres; negative for a lead-in before the row.
    pub start_m: f64,
    /// The alley of the start.
    pub alley: i32,
    /// Distance between rows, metres.
    pub row_spacing_m: f64,
    /// A scanner looks to the tractor's left: it stands as high as the row there, else as the one on its right.
    pub looks_left: bool,
    /// Alleys driven one after the other, and the length of a row, metres: turns are where the rows end. None: straight on forever.
    pub turns: Option<(u32, f64)>,
}

impl Default for Course {
    fn default() -> Self {
        Self { start_m: 0.0, alley: 0, row_spacing_m: 4.0, looks_left: false, turns: None }
    }
}

impl Course {
    /// Way of one turn on the headland: half a circle from the middle of an alley to that of the next, metres.
    pub fn turn_m(&self) -> f64 {
        PI * self.row_spacing_m / 2.0
    }

    /// The place after `way_m` metres. Past the last alley's end it goes straight on, from 8 m on over the headland; before the start, straight back, and
    /// farther off than that over the headland, too.
    pub fn at(&self, way_m: f64) -> Place {
        let (passes, row_m) = self.turns.unwrap_or((1, f64::INFINITY));
        // A start beyond the rows turns at once.
        let row_m = row_m.max(self.start_m);
        // Counted from where the rows begin, so that every pass has the same length whatever the lead-in.
        let way_m = self.start_m + way_m;
        let last = passes.saturating_sub(1);
        let pass = if row_m.is_finite() {
            (way_m / (row_m + self.turn_m())).floor().clamp(0.0, f64::from(last)) as u32
        } else {
            0
        };
        let into_m = if pass == 0 { way_m } else { way_m - f64::from(pass) * (row_m + self.turn_m()) };
        let number = self.alley + pass as i32;
        let backwards = pass % 2 == 1;
        let middle_m = (f64::from(number) - 0.5) * self.row_spacing_m;
        if into_m <= row_m || pass == last {
            let y_m = if backwards { row_m - into_m } else { into_m };
            let heading_rad = if backwards { PI } else { 0.0 };
            let alley = Alley { number, backwards };
            let (stands_by, _) = alley.row_beside(!self.looks_left);
            // Straight on before the first row, and behind the last one, it is on the headland, too.
            let is_between_rows = self.turns.is_none() || (-CLEAR_M..=row_m + CLEAR_M).contains(&into_m);
            let (alley, stands_by) = (Some(alley), Some(stands_by));
            let (alley, stands_by) = if is_between_rows { (alley, stands_by) } else { (None, None) };
            return Place { x_m: middle_m, y_m, heading_rad, curvature_1_m: 0.0, alley, stands_by };
        }
        let radius_m = self.row_spacing_m / 2.0;
        let angle = (into_m - row_m) / radius_m;
        let (sin, cos) = (libm::sin(angle), libm::cos(angle));
        let end_m = if backwards { 0.0 } else { row_m };
        Place {
            x_m: middle_m + radius_m * (1.0 - cos),
            y_m: if backwards { end_m - radius_m * sin } else { end_m + radius_m * sin },
            heading_rad: if backwards { PI - angle } else { angle },
            curvature_1_m: if backwards { -1.0 } else { 1.0 } / radius_m,
            alley: None,
            stands_by: None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_rows_are_driven_to_and_fro_without_a_jump() {
        let course = Course { start_m: -5.0, alley: 0, turns: Some((3, 20.0)), ..Course::default() };
        let mut before = course.at(-1.0);
        assert_eq!((before.x_m, before.y_m), (-2.0, -6.0));
        for step in -99..9000 {
            let here = course.at(f64::from(step) * 0.01);
            let moved_m = (here.x_m - before.x_m).hypot(here.y_m - before.y_m);
            assert!((moved_m - 0.01).abs() < 1e-5, "step {step}: {moved_m} m from {before:?} to {here:?}");
            // It moves where it heads, and turns as it says: but where a turn begins or ends.
            let turned = (here.heading_rad - before.heading_rad) / 0.01;
            if here.curvature_1_m == before.curvature_1_m {
                assert!((turned - here.curvature_1_m).abs() < 1e-6, "step {step}: {turned}");
            }
            let (sin, cos) = (libm::sin(before.heading_rad), libm::cos(before.heading_rad));
            let ahead_m = (here.x_m - before.x_m) * sin + (here.y_m - before.y_m) * cos;
            assert!(ahead_m > 0.0099, "step {step}");
            before = here;
        }
        let second = course.at(25.0 + course.turn_m() + 5.0);
        assert_eq!(second.alley, Some(Alley { number: 1, backwards: true }));
        assert!((second.y_m - 15.0).abs() < 1e-9 && (second.x_m - 2.0).abs() < 1e-9, "{second:?}");
    }

    #[test]
    fn turns_are_where_the_rows_end_wherever_the_start_is() {
        for start_m in [-5.0, 0.0, 3.0] {
            let course = Course { start_m, alley: 0, turns: Some((3, 20.0)), ..Course::default() };
            let way = |from_row_m: f64| course.at(from_row_m - start_m);
            assert!(way(19.99).alley.is_some_and(|alley| !alley.backwards), "{start_m}: before the end");
            let turning = way(20.0 + course.turn_m() / 2.0);
            assert!(turning.alley.is_none() && turning.y_m > 20.0, "{start_m}: {turning:?}");
            // The second turn is at the rows' other end, not at the end of the lead-in.
            let back = way(40.0 + course.turn_m() * 1.5);
            assert!(back.alley.is_none() && back.y_m < 0.0, "{start_m}: {back:?}");
            assert!((back.y_m + 2.0).abs() < 1e-9, "{start_m}: {back:?}");
        }
    }

    #[test]
    fn behind_the_last_row_it_is_on_the_headland_and_a_row_without_end_has_none() {
        for alleys in 1..4 {
            let course = Course { turns: Some((alleys, 20.0)), ..Course::default() };
            let end_m = f64::from(alleys) * (20.0 + course.turn_m()) - course.turn_m();
            assert!(
                course.at(end_m + 0.99 * CLEAR_M).alley.is_some(),
                "{alleys}: its boom may be in the row"
            );
            let (left, far) = (course.at(end_m + 1.01 * CLEAR_M), course.at(end_m + 500.0));
            assert_eq!((left.alley, far.alley, left.stands_by), (None, None, None), "{alleys}");
            assert_eq!(left.x_m, far.x_m, "straight on");
            let before = |m: f64| Course { start_m: -50.0, ..course }.at(50.0 - m).alley;
            assert!(before(0.99 * CLEAR_M).is_some() && before(1.01 * CLEAR_M).is_none(), "{alleys}");
        }
        assert!(Course::default().at(1e6).alley.is_some());
    }

    #[test]
    fn a_start_beyond_the_rows_turns_at_once() {
        let course = Course { start_m: 25.0, alley: 0, turns: Some((2, 20.0)), ..Course::default() };
        assert_eq!((course.at(0.0).y_m, course.at(1.0).alley), (25.0, None));
        let back = course.at(course.turn_m() + 1.0);
        assert!((back.y_m - 24.0).abs() < 1e-9 && back.heading_rad == PI, "{back:?}");
    }

    #[test]
    fn a_right_hand_scanner_sees_each_row_from_both_sides() {
        let beside = |number, backwards, right| Alley { number, backwards }.row_beside(right);
        assert_eq!(
            [beside(0, false, true), beside(1, true, true), beside(2, false, true)],
            [(0, true), (0, false), (2, true)]
        );
        assert_eq!([beside(1, false, false), beside(2, true, false)], [(0, false), (2, true)]);
    }
}
