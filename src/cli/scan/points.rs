//! The returns of a scan as points with their truth: the columns of CSV, PLY and LAS.

use rowscan_scenes::Orchard;
use rowscan_scenes::caster::{Class, Return};
use rowscan_scenes::scan::ScanPoint;

use crate::export::{Column, Kind, Table, TableFormat};

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

    fn holds(&self, point: &ScanPoint) -> bool {
        let [low_m, high_m] = self.x_m;
        (low_m..=high_m).contains(&point.at_m[0])
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
    pub(super) fn holds(&self, point: &ScanPoint, format: TableFormat) -> bool {
        let asked = self.only.is_empty() || self.only.contains(&point.class);
        asked && (format != TableFormat::Las || point.class != Class::Ground || self.ground.holds(point))
    }
}

/// A column of the points' table, and its number for a point.
type Field = (&'static str, Kind, fn(&ScanPoint) -> f64);

/// Text; no tree and no organ for the ground.
const CSV: &[Field] = &[
    ("x_m", Kind::F64, |point| point.at_m[0]),
    ("y_m", Kind::F64, |point| point.at_m[1]),
    ("z_m", Kind::F64, |point| point.at_m[2]),
    ("class", Kind::Class(ScanPoint::CLASSES), |point| f64::from(point.class_number())),
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
    ("x", Kind::F64, |point| point.at_m[0]),
    ("y", Kind::F64, |point| point.at_m[1]),
    ("z", Kind::F64, |point| point.at_m[2]),
    ("range", Kind::F64, |point| point.range_m),
    ("class", Kind::U8, |point| f64::from(point.class_number())),
    ("order", Kind::U8, |point| f64::from(point.order)),
    ("tree", Kind::Label, |point| label(point.tree)),
    ("organ", Kind::Label, |point| label(point.organ)),
    ("beam", Kind::Label, |point| f64::from(point.beam)),
    ("step", Kind::Label, |point| f64::from(point.line)),
];

/// LAS: GPS time holds the number of the line, the point source the number of the tree (counted from 1, 0 for the ground), the extra bytes
/// the number of the leaf or branch within its tree.
const LAS: &[Field] = &[
    ("x_m", Kind::F64, |point| point.at_m[0]),
    ("y_m", Kind::F64, |point| point.at_m[1]),
    ("z_m", Kind::F64, |point| point.at_m[2]),
    ("return_number", Kind::U8, |point| f64::from(point.order)),
    ("number_of_returns", Kind::U8, |point| f64::from(point.of)),
    ("classification", Kind::U8, |point| f64::from(las_class(point.class))),
    ("scan_angle", Kind::F32, |point| f64::from(point.scan_angle_deg)),
    ("point_source_id", Kind::U32, |point| {
        f64::from(u16::try_from(point.tree.wrapping_add(1)).unwrap_or(u16::MAX))
    }),
    ("gps_time", Kind::F64, |point| f64::from(point.line)),
    ("organ", Kind::Label, |point| label(point.organ)),
];

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
pub(super) fn row(point: &ScanPoint, format: TableFormat, row: &mut Vec<f64>) {
    row.clear();
    row.extend(fields(format).iter().map(|(_, _, of)| of(point)));
}
