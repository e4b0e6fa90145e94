//! The returns of a scan as points with their truth: the columns of CSV, PLY and LAS.

use rowscan_scenes::Orchard;
use rowscan_scenes::caster::{Class, Return};
use rowscan_scenes::scan::{CastLine, ScanPlan};

use crate::export::{Column, Kind, Table, TableFormat};

/// One return.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Point {
    at: [f64; 3],
    class: Class,
    tree: u32,
    organ: u32,
    /// 1 for what the beam met first; the leaves behind it count on.
    order: u8,
    /// Returns of the same beam.
    of: u8,
    range_m: f64,
    beam: u32,
    line: u32,
    cos_incidence: f32,
    /// The beam's angle, degrees; 0 in an orthogonal scan.
    scan_angle: f32,
}

/// The returns of one line: of every beam what it met first, and the leaves behind a first leaf. Escapes are no points; matrix L
/// has them.
pub(super) fn of_line(plan: &ScanPlan, line: &CastLine<'_>) -> Vec<Point> {
    let mut points = Vec::new();
    let angular = plan.settings().kind.is_angular();
    for (beam, (start, direction)) in plan.beams().rays(line.origin).enumerate() {
        let Some(nearest) = line.layers.nearest().get(beam).filter(|found| found.is_hit()) else { continue };
        let behind = line.layers.leaves(beam).get(1..).unwrap_or(&[]);
        let behind = if nearest.class == Class::Leaf { behind } else { &[] };
        let of = 1 + behind.len() as u8;
        for (order, found) in (1..).zip(std::iter::once(nearest).chain(behind)) {
            let &Return { range_m, class, tree, organ, cos_incidence } = found;
            let [x, y, z] = start;
            let [dx, dy, dz] = direction;
            points.push(Point {
                at: [x + range_m * dx, y + range_m * dy, z + range_m * dz],
                class,
                tree,
                organ,
                order,
                of,
                range_m,
                beam: beam as u32,
                line: line.index as u32,
                cos_incidence,
                scan_angle: if angular { plan.swept(beam) as f32 } else { 0.0 },
            });
        }
    }
    points
}

/// The ground of an orchard: half a row spacing beyond its outer rows. The rows themselves repeat, and lines end with them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Ground {
    x_m: [f64; 2],
}

impl Ground {
    pub(super) fn of(orchard: &Orchard) -> Self {
        let spacing_m = orchard.row_spacing_m().unwrap_or(f64::INFINITY);
        let last_m = if orchard.rows() > 1 { (orchard.rows() - 1) as f64 * spacing_m } else { 0.0 };
        Self { x_m: [-spacing_m / 2.0, last_m + spacing_m / 2.0] }
    }

    fn holds(&self, point: &Point) -> bool {
        let [low_m, high_m] = self.x_m;
        (low_m..=high_m).contains(&point.at[0])
    }
}

/// Which points are written.
#[derive(Clone, Copy, Debug)]
pub(super) struct Kept<'a> {
    /// Of these classes; of all where there is none.
    pub(super) only: &'a [Class],
    /// LAS is for programs that look at orchards, where a beam that grazes the ground a hundred metres off is in the way.
    pub(super) ground: Ground,
}

impl Kept<'_> {
    pub(super) fn holds(&self, point: &Point, format: TableFormat) -> bool {
        let asked = self.only.is_empty() || self.only.contains(&point.class);
        asked && (format != TableFormat::Las || point.class != Class::Ground || self.ground.holds(point))
    }
}

/// A column of the points' table, and its number for a point.
type Field = (&'static str, Kind, fn(&Point) -> f64);

/// Text; no tree and no organ for the ground.
const CSV: &[Field] = &[
    ("x_m", Kind::F64, |point| point.at[0]),
    ("y_m", Kind::F64, |point| point.at[1]),
    ("z_m", Kind::F64, |point| point.at[2]),
    ("class", Kind::Class(CLASSES), |point| f64::from(code(point.class))),
    ("tree", Kind::Label, |point| label(point.tree)),
    ("organ", Kind::Label, |point| label(point.organ)),
    ("order", Kind::U8, |point| f64::from(point.order)),
    ("range_m", Kind::F64, |point| point.range_m),
    ("beam", Kind::U32, |point| f64::from(point.beam)),
    ("step", Kind::U32, |point| f64::from(point.line)),
    ("cos_incidence", Kind::F32, |point| f64::from(point.cos_incidence)),
];

/// Binary PLY; -1 for no tree and no organ.
const PLY: &[Field] = &[
    ("x", Kind::F64, |point| point.at[0]),
    ("y", Kind::F64, |point| point.at[1]),
    ("z", Kind::F64, |point| point.at[2]),
    ("range", Kind::F64, |point| point.range_m),
    ("class", Kind::U8, |point| f64::from(code(point.class))),
    ("order", Kind::U8, |point| f64::from(point.order)),
    ("tree", Kind::Label, |point| label(point.tree)),
    ("organ", Kind::Label, |point| label(point.organ)),
    ("beam", Kind::Label, |point| f64::from(point.beam)),
    ("step", Kind::Label, |point| f64::from(point.line)),
];

/// LAS: GPS time holds the number of the line, the point source the number of the tree (counted from 1, 0 for the ground), the extra bytes
/// the number of the leaf or branch within its tree.
const LAS: &[Field] = &[
    ("x_m", Kind::F64, |point| point.at[0]),
    ("y_m", Kind::F64, |point| point.at[1]),
    ("z_m", Kind::F64, |point| point.at[2]),
    ("return_number", Kind::U8, |point| f64::from(point.order)),
    ("number_of_returns", Kind::U8, |point| f64::from(point.of)),
    ("classification", Kind::U8, |point| f64::from(las_class(point.class))),
    ("scan_angle", Kind::F32, |point| f64::from(point.scan_angle)),
    ("point_source_id", Kind::U32, |point| {
        f64::from(u16::try_from(point.tree.wrapping_add(1)).unwrap_or(u16::MAX))
    }),
    ("gps_time", Kind::F64, |point| f64::from(point.line)),
    ("organ", Kind::Label, |point| label(point.organ)),
];

/// Names of classes, at the numbers that PLY has for them.
const CLASSES: &[&str] = &["ground", "leaf", "wood", "fruit", "post", "wire", "grass"];

/// Number of a class, as PLY's header says.
fn code(class: Class) -> u8 {
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

/// Class of LAS: ground, low and high vegetation as the format has them, what it has no class for from 64 on, the first that is left to the user.
fn las_class(class: Class) -> u8 {
    match class {
        Class::None => 1,
        Class::Ground => 2,
        Class::Grass => 3,
        Class::Leaf => 5,
        Class::Wood => 64,
        Class::Fruit => 65,
        Class::Post => 66,
        Class::Wire => 67,
    }
}

/// A number; -1 for none.
fn label(number: u32) -> f64 {
    if number == Return::NO_LABEL { -1.0 } else { f64::from(number) }
}

fn fields(format: TableFormat) -> &'static [Field] {
    match format {
        TableFormat::Ply => PLY,
        TableFormat::Las => LAS,
        _ => CSV,
    }
}

/// The table of points as a format has it.
pub(super) fn table(format: TableFormat) -> Table {
    let columns = fields(format).iter().map(|(name, kind, _)| Column::new(*name, *kind)).collect();
    let note = "; class 0 ground, 1 leaf, 2 wood, 3 fruit, 4 post, 5 wire";
    Table { columns, note, ..Table::default() }
}

/// A point as a row of that table.
pub(super) fn row(point: &Point, format: TableFormat, row: &mut Vec<f64>) {
    row.clear();
    row.extend(fields(format).iter().map(|(_, _, of)| of(point)));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_class_of_a_return_has_its_name_at_its_number() {
        for class in Class::ALL.iter().filter(|class| **class != Class::None) {
            assert_eq!(CLASSES.get(usize::from(code(*class))), Some(&class.name()));
        }
    }
}
