//! The returns of a scan as points with their truth: CSV, PLY, LAS.

use std::error::Error;
use std::io::Cursor;

use las::point::{Classification, Format};
use las::{Builder, Transform, Vector, Vlr};
use ply_rs_bw::ply::{
    Addable, ElementDef, Encoding, Ply, Property, PropertyAccess, PropertyAccessResult, PropertyDef,
    PropertyType, ScalarType,
};
use rowscan_scenes::caster::{Class, Return};
use rowscan_scenes::scan::{CastLine, ScanPlan};
use serde::Serialize;

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
    swept: f32,
}

/// The returns of one line: of every beam what it met first, and the leaves behind a first leaf. Escapes are no points; matrix L
/// has them.
pub(super) fn of_line(plan: &ScanPlan, line: &CastLine<'_>) -> Vec<Point> {
    let mut points = Vec::new();
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
                swept: plan.swept(beam) as f32,
            });
        }
    }
    points
}

/// A point as a line of text; no tree and no organ for the ground.
#[derive(Serialize)]
struct Record {
    x_m: f64,
    y_m: f64,
    z_m: f64,
    class: &'static str,
    tree: Option<u32>,
    organ: Option<u32>,
    order: u8,
    range_m: f64,
    beam: u32,
    step: u32,
    cos_incidence: f32,
}

pub(super) fn csv(points: &[Point]) -> Result<Vec<u8>, Box<dyn Error>> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    for point in points {
        let [x_m, y_m, z_m] = point.at;
        let label = |number: u32| Some(number).filter(|number| *number != Return::NO_LABEL);
        writer.serialize(Record {
            x_m,
            y_m,
            z_m,
            class: point.class.name(),
            tree: label(point.tree),
            organ: label(point.organ),
            order: point.order,
            range_m: point.range_m,
            beam: point.beam,
            step: point.line,
            cos_incidence: point.cos_incidence,
        })?;
    }
    Ok(writer.into_inner()?)
}

/// Number of a class in PLY, as its header says.
fn code(class: Class) -> u8 {
    match class {
        Class::Leaf => 1,
        Class::Wood => 2,
        Class::Fruit => 3,
        Class::Post => 4,
        Class::Wire => 5,
        Class::Ground | Class::None => 0,
    }
}

impl PropertyAccess for Point {
    /// Reading is not what this is for.
    fn new() -> Self {
        let Return { range_m, class, tree, organ, cos_incidence } = Return::MISS;
        Self {
            at: [0.0; 3],
            class,
            tree,
            organ,
            order: 0,
            of: 0,
            range_m,
            beam: 0,
            line: 0,
            cos_incidence,
            swept: 0.0,
        }
    }

    fn set_property(&mut self, _: &str, _: Property) -> PropertyAccessResult {
        PropertyAccessResult::Ignored
    }

    fn get_double(&self, property: &str) -> Option<f64> {
        let [x, y, z] = self.at;
        match property {
            "x" => Some(x),
            "y" => Some(y),
            "z" => Some(z),
            "range" => Some(self.range_m),
            _ => None,
        }
    }

    fn get_uchar(&self, property: &str) -> Option<u8> {
        match property {
            "class" => Some(code(self.class)),
            "order" => Some(self.order),
            _ => None,
        }
    }

    fn get_int(&self, property: &str) -> Option<i32> {
        // The ground's missing labels become -1.
        let number = |value: u32| Some(i32::try_from(value).unwrap_or(-1));
        match property {
            "tree" => number(self.tree),
            "organ" => number(self.organ),
            "beam" => number(self.beam),
            "step" => number(self.line),
            _ => None,
        }
    }
}

pub(super) fn ply(points: Vec<Point>) -> Result<Vec<u8>, Box<dyn Error>> {
    let mut ply = Ply::<Point>::new();
    ply.header.encoding = Encoding::BinaryLittleEndian;
    ply.header.comments.push(format!(
        "rowscan {}; metres; class 0 ground, 1 leaf, 2 wood, 3 fruit, 4 post, 5 wire",
        env!("CARGO_PKG_VERSION")
    ));
    let mut vertex = ElementDef::new("vertex".to_owned());
    for (name, kind) in [
        ("x", ScalarType::Double),
        ("y", ScalarType::Double),
        ("z", ScalarType::Double),
        ("range", ScalarType::Double),
        ("class", ScalarType::UChar),
        ("order", ScalarType::UChar),
        ("tree", ScalarType::Int),
        ("organ", ScalarType::Int),
        ("beam", ScalarType::Int),
        ("step", ScalarType::Int),
    ] {
        vertex.properties.add(PropertyDef::new(name.to_owned(), PropertyType::Scalar(kind)));
    }
    ply.header.elements.add(vertex);
    ply.payload.insert("vertex".to_owned(), points);
    let mut bytes = Vec::new();
    ply_rs_bw::writer::Writer::new().write_ply(&mut bytes, &mut ply)?;
    Ok(bytes)
}

/// LAS class for wood, the first that is left to the user; fruit, post and wire follow. Leaves are high vegetation, as the format
/// has it.
const LAS_WOOD: u8 = 64;

/// The record that names the extra bytes of every point: one unsigned 32-bit number `organ` (LAS 1.4 R15, "Extra Bytes").
fn organ_record() -> Vlr {
    const UNSIGNED_32: u8 = 5;
    const HAS_NO_DATA: u8 = 1;
    let mut data = vec![0; 192];
    let mut put = |from: usize, bytes: &[u8]| {
        data.iter_mut().skip(from).zip(bytes).for_each(|(place, byte)| *place = *byte);
    };
    put(2, &[UNSIGNED_32, HAS_NO_DATA]);
    put(4, b"organ");
    put(40, &u64::from(Return::NO_LABEL).to_le_bytes());
    put(160, b"leaf or branch within its tree");
    Vlr { user_id: "LASF_Spec".to_owned(), record_id: 4, description: "Extra bytes".to_owned(), data }
}

/// LAS 1.4, point format 6, tenths of a millimetre. GPS time holds the number of the line, the point source the number of the tree
/// (counted from 1, 0 for the ground), the extra bytes the number of the leaf or branch within its tree.
pub(super) fn las(plan: &ScanPlan, points: &[Point]) -> Result<Vec<u8>, Box<dyn Error>> {
    let mut builder = Builder::from((1, 4));
    builder.point_format = Format::new(6)?;
    builder.point_format.extra_bytes = 4;
    builder.vlrs.push(organ_record());
    builder.generating_software = format!("rowscan {}", env!("CARGO_PKG_VERSION"));
    let tenth = Transform { scale: 1e-4, offset: 0.0 };
    builder.transforms = Vector { x: tenth, y: tenth, z: tenth };
    let mut writer = las::Writer::new(Cursor::new(Vec::new()), builder.into_header()?)?;
    let angular = plan.settings().kind.is_angular();
    for point in points {
        let [x, y, z] = point.at;
        writer.write_point(las::Point {
            x,
            y,
            z,
            return_number: point.order,
            number_of_returns: point.of,
            classification: match point.class {
                Class::Leaf => Classification::HighVegetation,
                Class::Wood => Classification::new(LAS_WOOD)?,
                Class::Fruit => Classification::new(LAS_WOOD + 1)?,
                Class::Post => Classification::new(LAS_WOOD + 2)?,
                Class::Wire => Classification::new(LAS_WOOD + 3)?,
                Class::Ground => Classification::Ground,
                Class::None => Classification::Unclassified,
            },
            scan_angle: if angular { point.swept } else { 0.0 },
            point_source_id: u16::try_from(point.tree.wrapping_add(1)).unwrap_or(u16::MAX),
            gps_time: Some(f64::from(point.line)),
            extra_bytes: point.organ.to_le_bytes().to_vec(),
            ..las::Point::default()
        })?;
    }
    writer.close()?;
    Ok(writer.into_inner()?.into_inner())
}
