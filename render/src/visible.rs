//! What every sample of the picture sees: the number of the nearest triangle.

use std::ops::Range;

use glam::DVec3;
use rayon::prelude::*;

use crate::camera::{Camera, NEAR_M};
use crate::mesh::Mesh;
use crate::raster::{self, Vertex};

/// Samples that see no triangle.
pub(crate) const NOTHING: u32 = u32::MAX;

/// Triangles at which a task ends.
const CHUNK: usize = 8192;

/// A triangle on the picture, in samples.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Flat {
    vertices: [Vertex; 3],
    number: u32,
}

/// Triangles on the picture, by the bands of rows that they touch.
#[derive(Debug)]
pub(crate) struct Bands {
    flats: Vec<Flat>,
    bands: Vec<Vec<u32>>,
    width: usize,
    height: usize,
    rows: usize,
}

/// The samples of a band of rows.
#[derive(Debug)]
pub(crate) struct Band {
    pub(crate) rows: Range<usize>,
    /// By sample, row by row: the triangle.
    pub(crate) numbers: Vec<u32>,
}

impl Bands {
    /// The triangles of meshes, numbered on from mesh to mesh, with `samples` samples along a pixel's side; in bands of `rows` rows of samples.
    pub(crate) fn of(meshes: &[&Mesh], camera: &Camera, samples: u32, rows: usize) -> Self {
        let mut flats = Vec::new();
        let mut first = 0;
        for mesh in meshes {
            let chunks = mesh.triangles.par_chunks(CHUNK).enumerate();
            let found: Vec<Vec<Flat>> = chunks
                .map(|(chunk, triangles)| {
                    let mut flats = Vec::with_capacity(triangles.len());
                    for (at, triangle) in triangles.iter().enumerate() {
                        let number = first + (chunk * CHUNK + at) as u32;
                        let corners = triangle.corners.map(|k| mesh.corners[k as usize].at.as_dvec3());
                        flatten(corners, camera, samples, number, &mut flats);
                    }
                    flats
                })
                .collect();
            flats.extend(found.into_iter().flatten());
            first += mesh.triangles.len() as u32;
        }
        let (width, height) = camera.size();
        let (width, height) = ((width * samples) as usize, (height * samples) as usize);
        let mut bands = vec![Vec::new(); height.div_ceil(rows)];
        for (place, flat) in flats.iter().enumerate() {
            let along = flat.vertices.map(|vertex| vertex[1]);
            let [low, high] = [
                along.iter().copied().fold(f64::INFINITY, f64::min),
                along.iter().copied().fold(f64::NEG_INFINITY, f64::max),
            ];
            let touched =
                (low.max(0.0) as usize / rows)..=(high.max(0.0) as usize / rows).min(bands.len() - 1);
            if high >= 0.0 {
                touched.for_each(|band| bands[band].push(place as u32));
            }
        }
        Self { flats, bands, width, height, rows }
    }

    /// Number of bands.
    pub(crate) fn len(&self) -> usize {
        self.bands.len()
    }

    /// Finds what a band's samples see. Of two triangles equally near, the first is seen; those numbered `first_on_top` or more are before
    /// all others.
    pub(crate) fn band(&self, band: usize, first_on_top: u32) -> Band {
        let rows = band * self.rows..((band + 1) * self.rows).min(self.height);
        let count = rows.len() * self.width;
        let mut nearness = vec![f32::NEG_INFINITY; count];
        let mut numbers = vec![NOTHING; count];
        for place in &self.bands[band] {
            let Flat { vertices, number } = self.flats[*place as usize];
            raster::fill(vertices, self.width, rows.clone(), |column, row, near| {
                let sample = (row - rows.start) * self.width + column;
                let seen = numbers[sample];
                let is_above = number >= first_on_top && (seen < first_on_top || seen == NOTHING);
                if is_above || near as f32 > nearness[sample] {
                    nearness[sample] = near as f32;
                    numbers[sample] = number;
                }
            });
        }
        Band { rows, numbers }
    }
}

/// A triangle on the picture: none behind the camera or off the picture, two where the lens cuts a corner off.
fn flatten(corners: [DVec3; 3], camera: &Camera, samples: u32, number: u32, flats: &mut Vec<Flat>) {
    let local = corners.map(|corner| camera.local(corner));
    let (width, height) = camera.size();
    let scale = f64::from(samples);
    let on_picture = |point: &DVec3| {
        let seen = camera.seen(*point);
        [seen.at[0] * scale, seen.at[1] * scale, seen.nearness]
    };
    let mut push = |vertices: [Vertex; 3]| {
        let outside = |axis: usize, size: u32| {
            let size = f64::from(size) * scale;
            vertices.iter().all(|vertex| vertex[axis] < 0.0)
                || vertices.iter().all(|vertex| vertex[axis] > size)
        };
        if !outside(0, width) && !outside(1, height) {
            flats.push(Flat { vertices, number });
        }
    };
    if local.iter().all(|point| point.z >= NEAR_M) {
        push([on_picture(&local[0]), on_picture(&local[1]), on_picture(&local[2])]);
        return;
    }
    let mut before: Vec<DVec3> = Vec::with_capacity(4);
    for k in 0..3 {
        let (from, to) = (local[k], local[(k + 1) % 3]);
        if from.z >= NEAR_M {
            before.push(from);
        }
        if (from.z >= NEAR_M) != (to.z >= NEAR_M) {
            let cut = from.lerp(to, (NEAR_M - from.z) / (to.z - from.z));
            before.push(DVec3::new(cut.x, cut.y, NEAR_M));
        }
    }
    for pair in before.windows(2).skip(1) {
        push([on_picture(&before[0]), on_picture(&pair[0]), on_picture(&pair[1])]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Model;
    use rowscan_scenes::{Leaf, Orchard};

    /// Share of the samples that see anything.
    fn share(outline: &[[f64; 3]], camera: &Camera) -> f64 {
        let orchard =
            Orchard::from_organs(vec![Leaf::new(outline.to_vec()).unwrap()], Vec::new(), f64::INFINITY);
        let model = Model::of(&orchard, usize::MAX).unwrap();
        let bands = Bands::of(&[&model.mesh], camera, 3, 24);
        let seen = |band: usize| {
            bands.band(band, NOTHING).numbers.iter().filter(|number| **number != NOTHING).count()
        };
        let (width, height) = camera.size();
        (0..bands.len()).map(seen).sum::<usize>() as f64 / (9.0 * f64::from(width) * f64::from(height))
    }

    #[test]
    fn a_rectangle_that_faces_the_camera_covers_its_projection() {
        let wall = [[2.0, -0.37, 1.0], [2.0, 0.41, 1.0], [2.0, 0.41, 1.52], [2.0, -0.37, 1.52]];
        let camera = Camera::at([0.0, 0.0, 1.2], [2.0, 0.0, 1.2], 60.0, (300, 200)).unwrap();
        // At 2 m the picture is 2 · 2 · tan 30° wide.
        let width_m = 4.0 / 3f64.sqrt();
        let expected = 0.78 * 0.52 / (width_m * width_m * 200.0 / 300.0);
        let found = share(&wall, &camera);
        assert!((found / expected - 1.0).abs() < 0.01, "{found} {expected}");
        let parallel = Camera::parallel([2.0, 0.0, 1.2], [1.0, 0.0, 0.0], 3.0, (300, 200)).unwrap();
        let expected = 0.78 * 0.52 / (3.0 * 2.0);
        let found = share(&wall, &parallel);
        assert!((found / expected - 1.0).abs() < 0.01, "{found} {expected}");
    }

    #[test]
    fn a_floor_that_reaches_behind_the_camera_covers_the_lower_half() {
        let floor = [[-50.0, -500.0, 0.0], [900.0, -500.0, 0.0], [900.0, 500.0, 0.0], [-50.0, 500.0, 0.0]];
        let camera = Camera::at([0.0, 0.0, 1.2], [2.0, 0.0, 1.2], 60.0, (300, 200)).unwrap();
        let found = share(&floor, &camera);
        assert!((found - 0.5).abs() < 0.01, "{found}");
    }

    #[test]
    fn the_nearer_of_two_is_seen() {
        let square =
            |x: f64| Leaf::new(vec![[x, -1.0, 0.0], [x, 1.0, 0.0], [x, 1.0, 2.0], [x, -1.0, 2.0]]).unwrap();
        let camera = Camera::at([0.0, 0.0, 1.0], [1.0, 0.0, 1.0], 20.0, (8, 8)).unwrap();
        for (leaves, nearest) in [([square(3.0), square(2.0)], 1), ([square(2.0), square(3.0)], 0)] {
            let model =
                Model::of(&Orchard::from_organs(leaves.into(), Vec::new(), f64::INFINITY), 9).unwrap();
            let band = Bands::of(&[&model.mesh], &camera, 1, 8).band(0, NOTHING);
            assert!(
                band.numbers.iter().all(|number| model.mesh.triangles[*number as usize].patch == nearest)
            );
        }
    }
}
