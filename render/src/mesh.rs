//! Triangles and what they are painted with.

use glam::{DVec3, Vec3};

use rowscan_scenes::triangles::triangulate;

/// What a surface looks like.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Finish {
    /// A leaf blade.
    Leaf,
    /// Bark of old wood.
    Bark,
    /// Shoots of the season and petioles.
    Shoot,
    Fruit,
    Post,
    Wire,
    /// Soil or turf, by place.
    Ground,
    /// A blade of grass or the leaf of a weed.
    Grass,
    /// A colour of its own: clothes, a pole.
    Plain([u8; 3]),
    /// Red and white bands of half a metre.
    Banded,
    /// A return of a scan: a colour that neither light nor exposure changes.
    Mark([u8; 3]),
}

/// A surface that is painted as one, with the axes of its pattern.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Patch {
    pub(crate) finish: Finish,
    /// Makes every patch look a little different.
    pub(crate) lot: u32,
    /// Where the pattern begins.
    pub(crate) foot: Vec3,
    /// Multiplied with the way from the foot: 0 at the foot, 1 at the tip.
    pub(crate) along: Vec3,
    /// Likewise: −1 and 1 at the sides.
    pub(crate) across: Vec3,
}

/// Three corners and their patch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Triangle {
    pub(crate) corners: [u32; 3],
    pub(crate) patch: u32,
}

/// A corner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Corner {
    pub(crate) at: Vec3,
    /// Of unit length; the surface is smooth where corners of one place have one normal.
    pub(crate) normal: Vec3,
}

/// Triangles with their corners.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Mesh {
    pub(crate) corners: Vec<Corner>,
    pub(crate) triangles: Vec<Triangle>,
    pub(crate) patches: Vec<Patch>,
    /// What keeps skylight away: the same surfaces, coarser.
    pub(crate) shades: Vec<[u32; 3]>,
}

impl Mesh {
    /// Adds a patch and gives its number.
    pub(crate) fn patch(&mut self, patch: Patch) -> u32 {
        self.patches.push(patch);
        self.patches.len() as u32 - 1
    }

    /// Adds a corner and gives its number.
    pub(crate) fn corner(&mut self, at: DVec3, normal: DVec3) -> u32 {
        self.corners.push(Corner { at: at.as_vec3(), normal: normal.as_vec3() });
        self.corners.len() as u32 - 1
    }

    /// Adds a triangle.
    pub(crate) fn triangle(&mut self, corners: [u32; 3], patch: u32) {
        self.triangles.push(Triangle { corners, patch });
    }

    /// Adds a plane polygon. `shades` says whether it keeps skylight away.
    pub(crate) fn polygon(
        &mut self,
        outline: &[[f64; 3]],
        normals: impl Fn(DVec3) -> DVec3,
        normal: [f64; 3],
        patch: u32,
        shades: bool,
    ) {
        let first = self.corners.len() as u32;
        for vertex in outline {
            let at = DVec3::from_array(*vertex);
            self.corner(at, normals(at));
        }
        for triangle in triangulate(outline, normal) {
            self.triangle(triangle.map(|corner| first + corner as u32), patch);
        }
        if shades {
            // Every second corner of an outline that has many.
            let step = if outline.len() >= 6 { 2 } else { 1 };
            let coarse: Vec<u32> =
                (0..outline.len()).step_by(step).map(|corner| first + corner as u32).collect();
            let fan = coarse.windows(2).skip(1).filter_map(|pair| Some([*coarse.first()?, pair[0], pair[1]]));
            self.shades.extend(fan);
        }
    }

    /// Lowest and highest coordinates; None where there is nothing.
    pub(crate) fn extent(&self) -> Option<[Vec3; 2]> {
        let first = self.corners.first()?.at;
        let fold = |[low, high]: [Vec3; 2], corner: &Corner| [low.min(corner.at), high.max(corner.at)];
        Some(self.corners.iter().fold([first; 2], fold))
    }
}
