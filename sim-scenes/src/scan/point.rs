//! The returns of a scan as points with their truth.

use super::plan::{CastLine, ScanPlan};
use crate::caster::{Class, Return};

/// One return.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScanPoint {
    /// Where it is, metres.
    pub at_m: [f64; 3],
    /// What was met.
    pub class: Class,
    /// The tree, or [`Return::NO_LABEL`].
    pub tree: u32,
    /// The leaf or branch within its tree, or [`Return::NO_LABEL`].
    pub organ: u32,
    /// 1 for what the beam met first; the leaves behind it count on.
    pub order: u8,
    /// Returns of the same beam.
    pub of: u8,
    /// From the sensor, metres.
    pub range_m: f64,
    /// The beam, from 0.
    pub beam: u32,
    /// The line, from 0.
    pub line: u32,
    /// Cosine of the angle between beam and normal.
    pub cos_incidence: f32,
    /// The beam's angle, degrees; 0 in an orthogonal scan.
    pub scan_angle_deg: f32,
}

impl ScanPoint {
    /// Names of classes, at the numbers that [`ScanPoint::class_number`] gives them.
    pub const CLASSES: &'static [&'static str] =
        &["ground", "leaf", "wood", "fruit", "post", "wire", "grass"];

    /// Number of its class.
    pub fn class_number(&self) -> u8 {
        number(self.class)
    }

    /// The returns of one line: of every beam what it met first, and the leaves behind a first leaf. Escapes are no points.
    pub fn of_line(plan: &ScanPlan, line: &CastLine<'_>) -> Vec<Self> {
        let mut points = Vec::new();
        let angular = plan.settings().kind.is_angular();
        for (beam, (start, direction)) in plan.beams().rays(line.origin).enumerate() {
            let Some(nearest) = line.layers.nearest().get(beam).filter(|found| found.is_hit()) else {
                continue;
            };
            let behind = line.layers.leaves(beam).get(1..).unwrap_or(&[]);
            let behind = if nearest.class == Class::Leaf { behind } else { &[] };
            let of = 1 + behind.len() as u8;
            for (order, found) in (1..).zip(std::iter::once(nearest).chain(behind)) {
                let &Return { range_m, class, tree, organ, cos_incidence } = found;
                let [x, y, z] = start;
                let [dx, dy, dz] = direction;
                points.push(Self {
                    at_m: [x + range_m * dx, y + range_m * dy, z + range_m * dz],
                    class,
                    tree,
                    organ,
                    order,
                    of,
                    range_m,
                    beam: beam as u32,
                    line: line.index as u32,
                    cos_incidence,
                    scan_angle_deg: if angular { plan.swept(beam) as f32 } else { 0.0 },
                });
            }
        }
        points
    }
}

fn number(class: Class) -> u8 {
    match class {
        Class::Leaf => 1,
        Class::Wood => 2,
        Class::Fruit => 3,
        Class::Post => 4,
        Class::Wire => 5,
        Class::Grass => 6,
        Class::Ground | Class::None => 0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_class_of_a_return_has_its_name_at_its_number() {
        for class in Class::ALL.iter().filter(|class| **class != Class::None) {
            assert_eq!(ScanPoint::CLASSES.get(usize::from(number(*class))), Some(&class.name()));
        }
    }
}
