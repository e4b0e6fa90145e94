//! Where light reaches: the sun by one fine map, the sky by many coarse ones.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use crate::depth_map::DepthMap;
use crate::model::Model;
use crate::noise::{hash2, unit};

/// Directions that stand for the sky.
const SKY: u32 = 48;

/// Cells of the sun's map and of the sky's, metres.
const SUN_CELL_M: f32 = 0.005;
const SKY_CELL_M: f32 = 0.025;

/// A surface nearer than this before another does not shade it: the maps are no finer. Metres.
const SUN_SLACK_M: f32 = 0.012;
const SKY_SLACK_M: f32 = 0.05;

/// Share of the skylight that passes leaves and gaps between them where a map says shade.
const LEAK: f32 = 0.08;

/// How far shadows are blurred, metres.
const BLUR_M: f32 = 0.010;

/// Ground around the trees for which skylight is found, metres, and its cells.
const AROUND_M: f64 = 2.5;
const GROUND_CELL_M: f64 = 0.08;

/// Skylight on both sides of a surface; 1 is that of a level surface under the open sky.
pub(crate) type Sides = [f32; 2];

/// The light on a model.
#[derive(Debug)]
pub(crate) struct Lighting {
    /// Of unit length.
    pub(crate) sun: Vec3,
    map: DepthMap,
    /// By corner of the mesh.
    pub(crate) sky: Vec<Sides>,
    ground: Grid,
}

/// Skylight on the ground, by place.
#[derive(Debug)]
struct Grid {
    low: [f32; 2],
    columns: usize,
    rows: usize,
    light: Vec<f32>,
}

impl Lighting {
    pub(crate) fn of(model: &Model, sun: Vec3) -> Self {
        let mesh = &model.mesh;
        let corners = mesh_box(model);
        let at = |numbers: [u32; 3]| numbers.map(|number| mesh.corners[number as usize].at);
        let maps: Vec<(Vec3, DepthMap)> = sky_directions()
            .into_par_iter()
            .map(|towards| {
                let shades = mesh.shades.iter().map(|triangle| at(*triangle));
                (towards, DepthMap::of(shades, &corners, towards, SKY_CELL_M))
            })
            .collect();
        let all = mesh.triangles.iter().map(|triangle| at(triangle.corners));
        let map = DepthMap::of(all, &corners, sun, SUN_CELL_M);
        let sky = mesh.corners.par_iter().map(|corner| skylight(&maps, corner.at, corner.normal)).collect();
        let ground = Grid::of(&maps, model);
        Self { sun, map, sky, ground }
    }

    /// Share of the sun that reaches a point of a surface, blurred; `lot` chooses where the blur is sampled.
    pub(crate) fn sunlight(&self, point: Vec3, lot: u32) -> f32 {
        const TAPS: u32 = 3;
        let lit = |tap: u32| {
            let bits = hash2(lot, tap);
            let aside = [unit(bits), unit(hash2(bits, 1))].map(|share| (2.0 * share - 1.0) * BLUR_M);
            let gap_m = self.map.gap_m(self.map.aside(point, aside));
            if gap_m < SUN_SLACK_M { 1.0 } else { 0.0 }
        };
        (0..TAPS).map(lit).sum::<f32>() / TAPS as f32
    }

    /// Skylight on the level ground.
    pub(crate) fn on_ground(&self, x: f32, y: f32) -> f32 {
        self.ground.at(x, y)
    }
}

/// The corners of the box around every corner of the mesh.
fn mesh_box(model: &Model) -> Vec<DVec3> {
    let [low, high] = model.mesh.extent().unwrap_or_default().map(|end| end.as_dvec3());
    let ends = [low, high];
    (0..8).map(|k| DVec3::new(ends[k & 1].x, ends[k >> 1 & 1].y, ends[k >> 2].z)).collect()
}

/// Directions evenly spread over the upper half, by the golden angle.
fn sky_directions() -> Vec<Vec3> {
    const GOLDEN_RAD: f64 = 2.399_963_229_728_653;
    let direction = |k: u32| {
        let up = (f64::from(k) + 0.5) / f64::from(SKY);
        let (out, angle) = ((1.0 - up * up).sqrt(), GOLDEN_RAD * f64::from(k));
        DVec3::new(out * libm::cos(angle), out * libm::sin(angle), up).as_vec3()
    };
    (0..SKY).map(direction).collect()
}

/// Skylight on the side that a normal points to, and on the other.
fn skylight(maps: &[(Vec3, DepthMap)], point: Vec3, normal: Vec3) -> Sides {
    let mut sides = [0.0; 2];
    for (towards, map) in maps {
        let cos = normal.dot(*towards);
        let share = if map.gap_m(point) < SKY_SLACK_M { 1.0 } else { LEAK };
        sides[usize::from(cos < 0.0)] += share * cos.abs();
    }
    sides.map(|sum| 2.0 * sum / SKY as f32)
}

impl Grid {
    fn of(maps: &[(Vec3, DepthMap)], model: &Model) -> Self {
        let [low, high] = model.extent();
        let low = [low[0] - AROUND_M, low[1] - AROUND_M];
        let cells = |axis: usize| {
            let length_m = high[axis] + AROUND_M - low[axis];
            (length_m / GROUND_CELL_M).ceil().clamp(1.0, 4000.0) as usize + 1
        };
        let (columns, rows) = (cells(0), cells(1));
        let light = (0..columns * rows).into_par_iter().map(|cell| {
            let at = |axis: usize, step: usize| low[axis] + step as f64 * GROUND_CELL_M;
            let point = DVec3::new(at(0, cell % columns), at(1, cell / columns), model.plane_m);
            skylight(maps, point.as_vec3(), Vec3::Z)[0]
        });
        Self { low: low.map(|c| c as f32), columns, rows, light: light.collect() }
    }

    fn at(&self, x: f32, y: f32) -> f32 {
        let place = |value: f32, low: f32| (value - low) / GROUND_CELL_M as f32;
        let (column, row) = (place(x, self.low[0]), place(y, self.low[1]));
        let inside =
            column >= 0.0 && row >= 0.0 && column < (self.columns - 1) as f32 && row < (self.rows - 1) as f32;
        if !inside {
            return 1.0;
        }
        let (i, j) = (column as usize, row as usize);
        let (u, v) = (column - i as f32, row - j as f32);
        let light = |i: usize, j: usize| self.light[j * self.columns + i];
        let mix = |a: f32, b: f32, t: f32| a + (b - a) * t;
        mix(mix(light(i, j), light(i + 1, j), u), mix(light(i, j + 1), light(i + 1, j + 1), u), v)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rowscan_scenes::{Leaf, Orchard};

    #[test]
    fn under_the_open_sky_a_level_surface_has_all_of_it_and_a_wall_half() {
        let nothing: Vec<(Vec3, DepthMap)> = sky_directions()
            .into_iter()
            .map(|towards| (towards, DepthMap::of(std::iter::empty(), &[DVec3::ZERO], towards, 1.0)))
            .collect();
        let [up, down] = skylight(&nothing, Vec3::ZERO, Vec3::Z);
        assert!((up - 1.0).abs() < 0.01 && down == 0.0, "{up} {down}");
        let [front, back] = skylight(&nothing, Vec3::ZERO, Vec3::X);
        assert!((front - 0.5).abs() < 0.05 && (back - 0.5).abs() < 0.05, "{front} {back}");
    }

    #[test]
    fn below_a_wide_roof_there_is_neither_sun_nor_sky() {
        let roof = [[-5.0, -5.0, 2.0], [5.0, -5.0, 2.0], [5.0, 5.0, 2.0], [-5.0, 5.0, 2.0]];
        let orchard = Orchard::from_organs(vec![Leaf::new(roof).unwrap()], Vec::new(), f64::INFINITY);
        let lighting = Lighting::of(&Model::of(&orchard, 1).unwrap(), Vec3::Z);
        assert_eq!(lighting.sunlight(Vec3::new(0.1, 0.2, 1.0), 3), 0.0);
        assert_eq!(lighting.sunlight(Vec3::new(0.1, 0.2, 2.0), 3), 1.0, "on the roof");
        assert!(lighting.on_ground(0.0, 0.0) < 0.35 && lighting.on_ground(30.0, 0.0) == 1.0);
    }
}
