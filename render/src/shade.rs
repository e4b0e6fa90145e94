//! The light that comes from what a sample sees.

use glam::{DVec3, Vec2, Vec3};
use rowscan_scenes::season::Season;

use crate::camera::{Camera, Ray};
use crate::light::{Lighting, Sides};
use crate::mesh::{Finish, Mesh, Patch, Triangle};
use crate::model::Model;
use crate::noise::hash2;
use crate::paint::{self, Spot};
use crate::sky;

/// All that shading looks at.
pub(crate) struct Shading<'a> {
    pub(crate) model: &'a Model,
    pub(crate) lighting: &'a Lighting,
    pub(crate) camera: &'a Camera,
    pub(crate) season: Season,
}

/// Where a line of sight meets a triangle.
struct Hit {
    at: Vec3,
    distance_m: f32,
    /// Of the corners.
    weights: [f32; 3],
}

/// A side of a surface, towards the camera.
struct Face {
    /// Towards the camera's side.
    normal: Vec3,
    /// Towards the camera.
    view: Vec3,
    /// Skylight on this side and on the other.
    sides: Sides,
    /// Share of the light that it throws back.
    albedo: Vec3,
    lot: u32,
}

/// How a finish throws light about.
struct Gloss {
    /// Of a highlight: strength and sharpness.
    strength: f32,
    sharpness: f32,
}

impl Shading<'_> {
    /// Light from a triangle of the mesh along a line of sight; `lot` makes samples differ.
    pub(crate) fn surface(&self, number: u32, ray: &Ray, lot: u32) -> Vec3 {
        let mesh = &self.model.mesh;
        let triangle = &mesh.triangles[number as usize];
        let patch = &mesh.patches[triangle.patch as usize];
        let Hit { at, distance_m, weights } = meet(mesh, triangle, ray);
        let view = -ray.to.as_vec3();
        let corners = triangle.corners.map(|k| k as usize);
        let smooth =
            corners.iter().zip(weights).map(|(k, weight)| mesh.corners[*k].normal * weight).sum::<Vec3>();
        let sides = corners.iter().zip(weights).fold([0.0; 2], |sum: Sides, (k, weight)| {
            let [front, back] = self.lighting.sky[*k];
            [sum[0] + weight * front, sum[1] + weight * back]
        });
        let normal = smooth.normalize_or(view);
        let from_front = normal.dot(view) >= 0.0;
        let is_leaf = matches!(patch.finish, Finish::Leaf | Finish::Grass);
        let (normal, sides) = match (from_front, is_leaf) {
            (true, _) => (normal, sides),
            (false, true) => (-normal, [sides[1], sides[0]]),
            // A smooth normal may turn away at the rim of a tube.
            (false, false) => ((normal - view * normal.dot(view) * 1.02).normalize_or(view), sides),
        };
        let off = at - patch.foot;
        let spot = Spot {
            at,
            on: Vec2::new(off.dot(patch.along), off.dot(patch.across)),
            pixel_m: self.camera.pixel_m(f64::from(distance_m)) as f32,
        };
        let albedo = paint::colour(patch, &spot, normal.z >= 0.0, self.season, &self.model.rows);
        let face = Face { normal, view, sides, albedo, lot };
        let lit = if is_leaf {
            self.blade(patch, &spot, &face)
        } else {
            self.solid(at, &face, &gloss(patch.finish))
        };
        sky::hazy(lit, self.camera.air_m(distance_m))
    }

    /// Light from where there is no surface: the ground, or the sky.
    pub(crate) fn open(&self, ray: &Ray, lot: u32) -> Vec3 {
        let to = ray.to.as_vec3();
        let down = ray.from.z - self.model.plane_m;
        if ray.to.z >= -1e-4 || down <= 0.0 {
            return sky::colour(to);
        }
        let distance_m = -down / ray.to.z;
        let at = (ray.from + ray.to * distance_m).as_vec3();
        let distance_m = distance_m as f32;
        // Seen at a slant a pixel covers more ground.
        let slant = (self.camera.pixel_m(f64::from(distance_m)) as f32) / (-to.z).max(0.02).sqrt();
        let spot = Spot { at, on: Vec2::ZERO, pixel_m: slant };
        let flat = Vec3::ZERO;
        let patch = Patch { finish: Finish::Ground, lot: 0, foot: flat, along: flat, across: flat };
        let albedo = paint::colour(&patch, &spot, true, self.season, &self.model.rows);
        let sun = self.lighting.sun.z.max(0.0) * self.lighting.sunlight(at + Vec3::Z * 0.005, lot);
        let light = sky::SUN * sun + sky::SKY * self.lighting.on_ground(at.x, at.y);
        sky::hazy(albedo * light, self.camera.air_m(distance_m))
    }

    fn solid(&self, at: Vec3, face: &Face, gloss: &Gloss) -> Vec3 {
        let &Face { normal, view, sides, albedo, lot } = face;
        let sun = self.lighting.sun;
        let cos = normal.dot(sun).max(0.0);
        let lit = if cos > 0.0 { self.lighting.sunlight(at + normal * 0.006, lot) } else { 0.0 };
        let light = sky::SUN * (cos * lit) + around(normal, sides[0], sides);
        albedo * light + highlight(normal, view, sun, gloss) * lit
    }

    /// A leaf: its halves are folded up a little, its tip bends down, and light passes through it.
    fn blade(&self, patch: &Patch, spot: &Spot, face: &Face) -> Vec3 {
        let &Face { normal, view, sides, albedo, lot } = face;
        let across = patch.across.normalize_or_zero();
        let along = patch.along.normalize_or_zero();
        let up = if normal.z >= 0.0 { 1.0 } else { -1.0 };
        let fold = -0.30 * spot.on.y.signum() * spot.on.y.abs().min(1.0).sqrt();
        let bend = 0.45 * (spot.on.x - 0.45);
        let bent = (normal + (across * fold + along * bend) * up).normalize_or(normal);
        let sun = self.lighting.sun;
        let cos = bent.dot(sun);
        let lit = self.lighting.sunlight(spot.at + sun * 0.004, lot);
        let through = Vec3::new(1.05, 1.12, 0.55);
        let direct = if cos >= 0.0 { albedo * cos } else { albedo * through * (-0.85 * cos) };
        let diffuse =
            albedo * around(bent, sides[0], sides) + albedo * through * sky::SKY * (0.45 * sides[1]);
        let is_upper = normal.z >= 0.0 && patch.finish == Finish::Leaf;
        let gloss = Gloss { strength: if is_upper { 0.24 } else { 0.05 }, sharpness: 18.0 };
        // What the wax of the upper side mirrors of the sky, more at a slant.
        let slant = 1.0 - bent.dot(view).clamp(0.0, 1.0);
        let sheen = if is_upper { 0.022 + 0.16 * slant * slant * slant * slant } else { 0.0 };
        sky::SUN * direct * lit
            + diffuse
            + highlight(bent, view, sun, &gloss) * lit
            + sky::SKY * (sheen * sides[0])
    }
}

/// Light of sky and ground on a side of a surface.
fn around(normal: Vec3, side: f32, sides: Sides) -> Vec3 {
    let open = 0.25 + 0.75 * (sides[0] + sides[1]).min(1.0);
    sky::SKY * side + sky::BOUNCE * ((0.5 - 0.5 * normal.z) * open)
}

/// The sun in a rough mirror (Blinn).
fn highlight(normal: Vec3, view: Vec3, sun: Vec3, gloss: &Gloss) -> Vec3 {
    let half = (view + sun).normalize_or_zero();
    let cos = normal.dot(half).max(0.0);
    if gloss.strength == 0.0 || normal.dot(sun) <= 0.0 || cos <= 0.0 {
        return Vec3::ZERO;
    }
    sky::SUN * (gloss.strength * libm::powf(cos, gloss.sharpness))
}

fn gloss(finish: Finish) -> Gloss {
    match finish {
        Finish::Fruit => Gloss { strength: 0.22, sharpness: 40.0 },
        Finish::Wire => Gloss { strength: 0.35, sharpness: 12.0 },
        _ => Gloss { strength: 0.0, sharpness: 1.0 },
    }
}

/// Where a line of sight meets the plane of a triangle, with the corners' weights; near an edge-on triangle the nearest corner's place.
fn meet(mesh: &Mesh, triangle: &Triangle, ray: &Ray) -> Hit {
    let [a, b, c] = triangle.corners.map(|k| mesh.corners[k as usize].at.as_dvec3());
    let (ab, ac) = (b - a, c - a);
    let normal = ab.cross(ac);
    let steep = normal.dot(ray.to);
    let distance =
        if steep.abs() > 1e-14 { normal.dot(a - ray.from) / steep } else { (a - ray.from).dot(ray.to) };
    let at = ray.from + ray.to * distance;
    let square = normal.length_squared().max(1e-30);
    let off = at - a;
    let (v, w) = (off.cross(ac).dot(normal) / square, ab.cross(off).dot(normal) / square);
    let (v, w) = (v.clamp(0.0, 1.0), w.clamp(0.0, 1.0));
    let u = (1.0 - v - w).max(0.0);
    let sum = u + v + w;
    let weights = DVec3::new(u, v, w) / sum;
    Hit { at: at.as_vec3(), distance_m: distance as f32, weights: weights.as_vec3().to_array() }
}

/// A number that differs from sample to sample.
pub(crate) fn lot(column: usize, row: usize) -> u32 {
    hash2(column as u32, row as u32)
}
