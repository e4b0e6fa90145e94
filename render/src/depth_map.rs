//! What a light sees first, from one direction: where it does not reach.

use glam::{DVec3, Vec3};

use crate::raster;

/// Most cells of a side.
const MOST_SIDE: f64 = 8192.0;

/// A raster square to a direction; each cell knows how far towards the light the first surface in it lies.
#[derive(Clone, Debug)]
pub(crate) struct DepthMap {
    right: Vec3,
    up: Vec3,
    towards: Vec3,
    low: [f32; 2],
    per_m: f32,
    width: usize,
    height: usize,
    nearness: Vec<f32>,
}

impl DepthMap {
    /// Of triangles within a box, for a light that is towards a direction (of unit length), with cells of `cell_m` or larger.
    pub(crate) fn of(
        triangles: impl Iterator<Item = [Vec3; 3]>,
        corners: &[DVec3],
        towards: Vec3,
        cell_m: f32,
    ) -> Self {
        let right = towards.any_orthonormal_vector();
        let up = towards.cross(right);
        let (mut low, mut high) = ([f32::INFINITY; 2], [f32::NEG_INFINITY; 2]);
        for corner in corners {
            let corner = corner.as_vec3();
            for (axis, value) in [corner.dot(right), corner.dot(up)].into_iter().enumerate() {
                low[axis] = low[axis].min(value);
                high[axis] = high[axis].max(value);
            }
        }
        let size = (high[0] - low[0]).max(high[1] - low[1]).max(cell_m);
        let cell_m = cell_m.max(size / MOST_SIDE as f32);
        let per_m = cell_m.recip();
        let cells =
            |axis: usize| ((high[axis] - low[axis]) * per_m).ceil().clamp(1.0, MOST_SIDE as f32) as usize;
        let (width, height) = (cells(0), cells(1));
        let mut nearness = vec![f32::NEG_INFINITY; width * height];
        for triangle in triangles {
            let flat = triangle.map(|p| {
                let place = |axis: Vec3, low: f32| f64::from((p.dot(axis) - low) * per_m);
                [place(right, low[0]), place(up, low[1]), f64::from(p.dot(towards))]
            });
            raster::fill(flat, width, 0..height, |column, row, near| {
                let cell = &mut nearness[row * width + column];
                *cell = cell.max(near as f32);
            });
        }
        Self { right, up, towards, low, per_m, width, height, nearness }
    }

    /// How far before a point, towards the light, the first surface stands; not positive where the light reaches it.
    pub(crate) fn gap_m(&self, point: Vec3) -> f32 {
        let column = (point.dot(self.right) - self.low[0]) * self.per_m;
        let row = (point.dot(self.up) - self.low[1]) * self.per_m;
        if column < 0.0 || row < 0.0 || column >= self.width as f32 || row >= self.height as f32 {
            return f32::NEG_INFINITY;
        }
        let cell = row as usize * self.width + column as usize;
        self.nearness[cell] - point.dot(self.towards)
    }

    /// A point moved square to the light by metres.
    pub(crate) fn aside(&self, point: Vec3, [right, up]: [f32; 2]) -> Vec3 {
        point + self.right * right + self.up * up
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_roof_shades_what_is_below_and_nothing_beside() {
        let corner = |x: f32, y: f32| Vec3::new(x, y, 2.0);
        let roof = [
            [corner(0.0, 0.0), corner(1.0, 0.0), corner(1.0, 1.0)],
            [corner(0.0, 0.0), corner(1.0, 1.0), corner(0.0, 1.0)],
        ];
        let around = [DVec3::new(-1.0, -1.0, 0.0), DVec3::new(3.0, 3.0, 2.0)];
        let slant = Vec3::new(1.0, 0.0, 1.0).normalize();
        let box_of = |ends: [DVec3; 2]| -> Vec<DVec3> {
            (0..8).map(|k| DVec3::new(ends[k & 1].x, ends[k >> 1 & 1].y, ends[k >> 2].z)).collect()
        };
        let map = DepthMap::of(roof.into_iter(), &box_of(around), slant, 0.02);
        // The light comes from +X: the shadow of the roof at 2 m lies 2 m towards −X on the ground.
        let root2 = std::f32::consts::SQRT_2;
        assert!((map.gap_m(Vec3::new(-0.5, 0.5, 1.0)) - root2).abs() < 0.05);
        assert!(
            map.gap_m(Vec3::new(0.5, 0.5, 1.0)) < 0.0 || map.gap_m(Vec3::new(0.5, 0.5, 1.0)) > root2 - 0.1
        );
        assert!(map.gap_m(Vec3::new(1.5, 0.5, 0.0)) < 0.0);
        assert!(map.gap_m(Vec3::new(0.5, 0.5, 2.5)) < 0.0, "above the roof");
        assert!(map.gap_m(Vec3::new(90.0, 0.0, 0.0)) < 0.0, "off the map");
    }
}
