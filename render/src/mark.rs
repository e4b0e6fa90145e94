//! Returns of a scan in the picture.

use std::f64::consts::TAU;

use glam::DVec3;

use crate::mesh::{Finish, Mesh, Patch};

/// A return: a disc that faces the camera, of a colour that is not shaded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mark {
    /// Where, metres.
    pub at: [f64; 3],
    /// Radius, metres.
    pub radius_m: f64,
    /// Red, green, blue as they stand in the picture.
    pub rgb: [u8; 3],
}

/// Corners of a disc.
const CORNERS: u32 = 8;

/// The marks as discs square to a direction, a little nearer to the camera than what the beam met.
pub(crate) fn mesh(marks: &[Mark], towards: DVec3) -> Mesh {
    let mut mesh = Mesh::default();
    let u = towards.any_orthonormal_vector();
    let v = towards.cross(u);
    for mark in marks {
        let at = DVec3::from_array(mark.at) - towards * mark.radius_m;
        let foot = at.as_vec3();
        let flat = DVec3::ZERO.as_vec3();
        let patch =
            mesh.patch(Patch { finish: Finish::Mark(mark.rgb), lot: 0, foot, along: flat, across: flat });
        let rim = |k: u32| {
            let angle = TAU * f64::from(k) / f64::from(CORNERS);
            at + (u * libm::cos(angle) + v * libm::sin(angle)) * mark.radius_m
        };
        let first = mesh.corners.len() as u32;
        (0..CORNERS).for_each(|k| {
            mesh.corner(rim(k), -towards);
        });
        (1..CORNERS - 1).for_each(|k| mesh.triangle([first, first + k, first + k + 1], patch));
    }
    mesh
}
