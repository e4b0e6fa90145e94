//! From a model and a camera to a picture.

use glam::{DVec3, Vec3};
use rayon::prelude::*;
use rowscan_scenes::season::Season;

use crate::camera::Camera;
use crate::light::Lighting;
use crate::mesh::{Finish, Mesh};
use crate::model::Model;
use crate::picture::Picture;
use crate::shade::{Shading, lot};
use crate::tone::{developed, linear_rgb, srgb};
use crate::visible::{Band, Bands, NOTHING};

/// Samples along a pixel's side.
const SAMPLES: u32 = 3;

/// Rows of pixels of a task.
const BAND: usize = 16;

/// Light that is shown at half of full brightness, about.
const EXPOSURE: f32 = 0.92;

/// What is behind the trees, and how strongly they are drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Backdrop {
    /// Ground to the horizon, and the sky.
    #[default]
    Landscape,
    /// White paper. Colours of trees are drawn as pale as this says, from 0 (as they are) to 1 (not at all); those of returns are not changed.
    Paper {
        /// From 0 to 1.
        pale: f32,
    },
}

/// How a picture is to look.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    /// For the colour of leaves.
    pub season: Season,
    /// Where the sun is, from the trees.
    pub sun: [f64; 3],
    /// What is behind.
    pub backdrop: Backdrop,
    /// True where returns are drawn over everything, also over what stands before them.
    pub returns_on_top: bool,
}

impl Default for Look {
    /// A summer's afternoon, the sun on the scanner's side of the row.
    fn default() -> Self {
        Self {
            season: Season::FullLeaf,
            sun: [-0.62, 0.50, 0.80],
            backdrop: Backdrop::Landscape,
            returns_on_top: false,
        }
    }
}

/// Draws a model. The picture is the same on any number of threads of the current rayon pool.
pub fn render(model: &Model, camera: &Camera, look: &Look) -> Picture {
    let sun = DVec3::from_array(look.sun).normalize_or(DVec3::Z).as_vec3();
    let lighting = Lighting::of(model, sun);
    let shading = Shading { model, lighting: &lighting, camera, season: look.season };
    let marks = model.marks_facing(camera.forward);
    let bands = Bands::of(&[&model.mesh, &marks], camera, SAMPLES, BAND * SAMPLES as usize);
    let own = model.mesh.triangles.len() as u32;
    let first_on_top = if look.returns_on_top { own } else { NOTHING };
    let page = Page { shading, marks: &marks, look, width: camera.size().0 as usize };
    let rows: Vec<Vec<u8>> =
        (0..bands.len()).into_par_iter().map(|band| page.pixels(&bands.band(band, first_on_top))).collect();
    Picture::new(camera.size(), rows.concat())
}

/// What a picture is made of.
struct Page<'a> {
    shading: Shading<'a>,
    marks: &'a Mesh,
    look: &'a Look,
    /// Pixels.
    width: usize,
}

impl Page<'_> {
    /// The pixels of a band, three bytes each.
    fn pixels(&self, band: &Band) -> Vec<u8> {
        let samples = SAMPLES as usize;
        let across = self.width * samples;
        let mut bytes = Vec::with_capacity(3 * band.numbers.len() / (samples * samples));
        for row in 0..band.rows.len() / samples {
            for column in 0..self.width {
                let mut sum = Vec3::ZERO;
                for sample in 0..samples * samples {
                    let (i, j) = (column * samples + sample % samples, row * samples + sample / samples);
                    sum += self.sample(band.numbers[j * across + i], i, band.rows.start + j);
                }
                bytes.extend(srgb(sum / (samples * samples) as f32));
            }
        }
        bytes
    }

    /// The colour of a sample as it is shown.
    fn sample(&self, number: u32, column: usize, row: usize) -> Vec3 {
        let place = [column, row].map(|k| (k as f64 + 0.5) / f64::from(SAMPLES));
        let ray = self.shading.camera.ray(place);
        let lot = lot(column, row);
        let own = self.shading.model.mesh.triangles.len() as u32;
        if number == NOTHING {
            return match self.look.backdrop {
                Backdrop::Landscape => developed(self.shading.open(&ray, lot), EXPOSURE),
                Backdrop::Paper { .. } => Vec3::ONE,
            };
        }
        if let Some(triangle) =
            number.checked_sub(own).and_then(|mark| self.marks.triangles.get(mark as usize))
        {
            return match self.marks.patches[triangle.patch as usize].finish {
                Finish::Mark(rgb) => linear_rgb(rgb),
                _ => Vec3::ZERO,
            };
        }
        let shown = developed(self.shading.surface(number, &ray, lot), EXPOSURE);
        match self.look.backdrop {
            Backdrop::Landscape => shown,
            Backdrop::Paper { pale } => {
                let grey = Vec3::splat(shown.dot(Vec3::new(0.21, 0.72, 0.07)));
                shown.lerp(grey, pale).lerp(Vec3::ONE, pale)
            }
        }
    }
}
