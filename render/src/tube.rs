//! Wood as tubes: pieces that go on one after the other are joined without a seam, and taper from one thickness to the next.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use glam::DVec3;
use rowscan_scenes::Cylinder;

use crate::mesh::Mesh;

/// Pieces whose ends are as near as this are joined, metres.
const JOIN_M: f64 = 1e-5;

/// Thickness of a free end over that of its piece.
const TIP: f64 = 0.7;

/// Wood as thick as this keeps skylight away, metres.
const SHADING_RADIUS_M: f64 = 0.004;

/// One end of a tube.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Ring {
    pub(crate) middle: DVec3,
    /// Square to the ring.
    pub(crate) axis: DVec3,
    pub(crate) radius_m: f64,
}

/// Both ends of every piece, joined where pieces go on.
pub(crate) fn rings(wood: &[Cylinder]) -> Vec<[Ring; 2]> {
    let ends: Vec<(DVec3, DVec3, DVec3)> = wood.iter().map(ends).collect();
    // By place: the thickest piece that begins there.
    let mut begins: BTreeMap<[i64; 3], usize> = BTreeMap::new();
    for (number, (base, ..)) in ends.iter().enumerate() {
        let thickest = begins.entry(place(*base)).or_insert(number);
        if wood[number].radius_m() > wood[*thickest].radius_m() {
            *thickest = number;
        }
    }
    let ring = |middle, axis, radius_m| Ring { middle, axis, radius_m };
    let mut rings: Vec<[Ring; 2]> = ends
        .iter()
        .zip(wood)
        .map(|((base, tip, axis), piece)| {
            let radius_m = piece.radius_m();
            [ring(*base, *axis, radius_m), ring(*tip, *axis, TIP * radius_m)]
        })
        .collect();
    for (number, (_, tip, axis)) in ends.iter().enumerate() {
        let Some(&next) = begins.get(&place(*tip)).filter(|next| **next != number) else { continue };
        let joint_m = wood[next].radius_m().min(wood[number].radius_m());
        let between = (*axis + ends[next].2).try_normalize().unwrap_or(*axis);
        rings[number][1] = ring(*tip, between, joint_m);
        rings[next][0] = ring(*tip, between, wood[next].radius_m());
    }
    rings
}

fn ends(piece: &Cylinder) -> (DVec3, DVec3, DVec3) {
    let (base, tip) = (DVec3::from_array(piece.base()), DVec3::from_array(piece.tip()));
    (base, tip, (tip - base).normalize_or_zero())
}

fn place(point: DVec3) -> [i64; 3] {
    (point / JOIN_M).round().to_array().map(|c| c as i64)
}

/// Sides of a tube of this radius.
pub(crate) fn sides(radius_m: f64) -> u32 {
    match radius_m {
        r if r > 0.02 => 14,
        r if r > 0.006 => 8,
        r if r > 0.002 => 6,
        _ => 4,
    }
}

/// Adds the surface between two rings, and a lid on the second.
pub(crate) fn add(mesh: &mut Mesh, [base, tip]: [Ring; 2], patch: u32) {
    stretched(mesh, [base, tip], DVec3::ONE, sides(base.radius_m), patch);
}

/// The same, its rings flattened along the axes of the scene by `by`.
pub(crate) fn stretched(mesh: &mut Mesh, [base, tip]: [Ring; 2], by: DVec3, sides: u32, patch: u32) {
    let along = tip.middle - base.middle;
    let axis = along.try_normalize().unwrap_or(base.axis);
    let u = axis.any_orthonormal_vector();
    let v = axis.cross(u);
    let slant = (base.radius_m - tip.radius_m) / along.length().max(1e-9);
    let out = |k: u32| {
        let angle = TAU * f64::from(k) / f64::from(sides);
        u * libm::cos(angle) + v * libm::sin(angle)
    };
    let first = mesh.corners.len() as u32;
    for k in 0..sides {
        let out = out(k);
        let normal = ((out + axis * slant) / by).normalize_or(out);
        for ring in [base, tip] {
            // The ring is cut slantwise by the plane between two pieces.
            let lean = out.dot(ring.axis) / axis.dot(ring.axis).max(0.4);
            mesh.corner(ring.middle + (out - axis * lean) * ring.radius_m * by, normal);
        }
    }
    let mut quad = |[a, b, c, d]: [u32; 4]| {
        mesh.triangle([a, b, c], patch);
        mesh.triangle([a, c, d], patch);
        if base.radius_m >= SHADING_RADIUS_M {
            mesh.shades.extend([[a, b, c], [a, c, d]]);
        }
    };
    for k in 0..sides {
        let (here, next) = (first + 2 * k, first + 2 * ((k + 1) % sides));
        quad([here, next, next + 1, here + 1]);
    }
    lid(mesh, tip, first + 1, sides, patch);
}

/// Closes a tube; corners of its end stand at `first`, and at every second number from there.
fn lid(mesh: &mut Mesh, end: Ring, first: u32, sides: u32, patch: u32) {
    let middle = mesh.corner(end.middle, end.axis);
    for k in 0..sides {
        mesh.triangle([first + 2 * k, first + 2 * ((k + 1) % sides), middle], patch);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn piece(base: [f64; 3], tip: [f64; 3], radius_m: f64) -> Cylinder {
        Cylinder::new(base, tip, radius_m).unwrap()
    }

    #[test]
    fn pieces_that_go_on_share_a_ring_and_others_do_not() {
        let wood = [
            piece([0.0, 0.0, 0.0], [0.0, 0.0, 1.0], 0.03),
            piece([0.0, 0.0, 1.0], [0.5, 0.0, 2.0], 0.02),
            // A side branch, thinner.
            piece([0.0, 0.0, 1.0], [0.0, 0.8, 1.0], 0.01),
        ];
        let rings = rings(&wood);
        assert_eq!(rings[0][1], rings[1][0], "the thickest goes on");
        assert_eq!(rings[0][1].radius_m, 0.02);
        assert_eq!(rings[2][0].axis, DVec3::Y);
        assert!(rings[1][1].radius_m < 0.02 && rings[2][1].radius_m < 0.01, "free ends taper");
    }
}
