//! Colours of surfaces: what share of the light they throw back, red, green and blue.

use glam::{Vec2, Vec3};
use rowscan_scenes::season::Season;

use crate::mesh::{Finish, Patch};
use crate::model::Rows;
use crate::noise::{fields, hash, unit};
use crate::tone::linear_rgb;

/// Where on a surface a colour is asked for.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Spot {
    /// Scene frame, metres.
    pub(crate) at: Vec3,
    /// Along the patch's pattern, 0 to 1 from foot to tip, and across it, −1 to 1.
    pub(crate) on: Vec2,
    /// Size of a pixel there, metres: what is finer is left out.
    pub(crate) pixel_m: f32,
}

/// Half of the strip along the trees that is kept bare, metres.
const STRIP_M: f32 = 0.55;

const LEAF_DARK: Vec3 = Vec3::new(0.046, 0.100, 0.016);
const LEAF_LIGHT: Vec3 = Vec3::new(0.118, 0.190, 0.028);
const LEAF_YOUNG: Vec3 = Vec3::new(0.185, 0.265, 0.060);
const LEAF_YELLOW: Vec3 = Vec3::new(0.50, 0.34, 0.045);
const LEAF_BROWN: Vec3 = Vec3::new(0.27, 0.13, 0.045);
const LEAF_BELOW: Vec3 = Vec3::new(0.17, 0.22, 0.125);

const BARK: Vec3 = Vec3::new(0.150, 0.121, 0.097);
const BARK_LIGHT: Vec3 = Vec3::new(0.285, 0.255, 0.220);
const SHOOT: Vec3 = Vec3::new(0.150, 0.115, 0.052);
const TIMBER: Vec3 = Vec3::new(0.36, 0.30, 0.235);
const WIRE: Vec3 = Vec3::new(0.46, 0.47, 0.48);

const SOIL: Vec3 = Vec3::new(0.135, 0.094, 0.062);
const SOIL_LIGHT: Vec3 = Vec3::new(0.235, 0.172, 0.115);
const TURF: Vec3 = Vec3::new(0.062, 0.092, 0.028);
const TURF_LIGHT: Vec3 = Vec3::new(0.128, 0.156, 0.054);
const STRAW: Vec3 = Vec3::new(0.24, 0.215, 0.10);

/// The colour of a patch at a spot; `above` is true for the upper side of a leaf.
pub(crate) fn colour(patch: &Patch, spot: &Spot, above: bool, season: Season, rows: &Rows) -> Vec3 {
    match patch.finish {
        Finish::Leaf => leaf(patch.lot, spot, above, season),
        Finish::Bark => bark(patch.lot, spot),
        Finish::Shoot => SHOOT * (0.75 + 0.5 * unit(patch.lot)),
        Finish::Fruit => fruit(patch, spot),
        Finish::Post => {
            let streak = fields(spot.at.x * 90.0 + spot.at.y * 90.0, spot.at.z * 3.0, 1.0, 0.0, patch.lot);
            TIMBER * (0.62 + 0.7 * streak)
        }
        Finish::Wire => WIRE,
        Finish::Ground => {
            ground(spot, rows).lerp(STRAW * 0.8, if season == Season::Dormant { 0.35 } else { 0.0 })
        }
        Finish::Grass => {
            let tint = TURF.lerp(TURF_LIGHT, unit(patch.lot)).lerp(STRAW, 0.35 * unit(hash(patch.lot)));
            tint * (0.55 + 0.75 * spot.on.x.clamp(0.0, 1.0))
        }
        Finish::Plain(rgb) | Finish::Mark(rgb) => linear_rgb(rgb),
        Finish::Banded => {
            let height_m = spot.at.z - patch.foot.z;
            if (height_m * 2.0) as i32 % 2 == 0 {
                linear_rgb([196, 38, 30])
            } else {
                linear_rgb([232, 232, 228])
            }
        }
    }
}

fn leaf(lot: u32, spot: &Spot, above: bool, season: Season) -> Vec3 {
    let (shade, kind) = (unit(hash(lot ^ 0x51)), unit(hash(lot ^ 0xa7)));
    let green = match season {
        Season::BudBurst | Season::Unfolding | Season::Bloom => {
            LEAF_LIGHT.lerp(LEAF_YOUNG, 0.35 + 0.65 * shade)
        }
        Season::LeafFall => {
            let turned = LEAF_YELLOW.lerp(LEAF_BROWN, kind * kind);
            LEAF_LIGHT.lerp(turned, (2.2 * shade - 0.35).clamp(0.0, 1.0))
        }
        _ => LEAF_DARK.lerp(LEAF_LIGHT, shade).lerp(LEAF_YOUNG, (kind - 0.86).max(0.0) * 3.0),
    };
    let blade = if above { green } else { green.lerp(LEAF_BELOW, 0.55) };
    // A pale midrib, and side veins where the picture is fine enough.
    let off = spot.on.y.abs();
    let midrib = (1.0 - off / 0.09).clamp(0.0, 1.0);
    let phase = 9.0 * (spot.on.x - 0.33 * off);
    let vein = (1.0 - 7.0 * (phase - phase.round()).abs()).clamp(0.0, 1.0);
    let fine = (1.0 - spot.pixel_m / 0.003).clamp(0.0, 1.0);
    blade * (1.0 + 0.45 * midrib + 0.22 * fine * vein)
}

fn bark(lot: u32, spot: &Spot) -> Vec3 {
    let rough = fields(spot.at.x * 55.0 + spot.at.y * 41.0, spot.at.z * 26.0, 1.0, 22.0 * spot.pixel_m, 11);
    let lichen = fields(spot.at.x * 13.0 - spot.at.y * 9.0, spot.at.z * 7.0, 1.0, 0.0, 29);
    let tint = BARK.lerp(BARK_LIGHT, (rough * 1.1 - 0.15).clamp(0.0, 1.0));
    tint * (0.85 + 0.3 * unit(lot)) + Vec3::new(0.02, 0.03, 0.01) * (lichen - 0.6).max(0.0) * 3.0
}

/// A red cheek on a yellow ground.
fn fruit(patch: &Patch, spot: &Spot) -> Vec3 {
    let out = (spot.at - patch.foot).normalize_or_zero();
    let angle = unit(patch.lot) * std::f32::consts::TAU;
    let cheek = out.dot(Vec3::new(libm::cosf(angle), libm::sinf(angle), 0.5).normalize());
    let stripe = fields(out.x * 5.0 + out.y * 4.0, out.z * 1.2, 1.0, 0.1, patch.lot);
    let red = (0.75 + 0.7 * cheek + 0.5 * (stripe - 0.5)).clamp(0.0, 1.0);
    Vec3::new(0.52, 0.39, 0.075).lerp(Vec3::new(0.44, 0.028, 0.026), red)
}

/// Turf between the rows and bare soil along the trees; soil alone where rows are unknown.
fn ground(spot: &Spot, rows: &Rows) -> Vec3 {
    let Vec3 { x, y, .. } = spot.at;
    let at = |wave: f32, lot: u32| fields(x, y, wave, 1.5 * spot.pixel_m, lot);
    let crumbs = at(0.05, 1);
    let soil = SOIL.lerp(SOIL_LIGHT, (0.6 * at(0.8, 2) + 0.75 * crumbs - 0.2).clamp(0.0, 1.0));
    let Some(spacing_m) = rows.spacing_m.map(|spacing_m| spacing_m as f32) else { return soil };
    let row = (x / spacing_m).round().clamp(0.0, rows.count.saturating_sub(1) as f32);
    let off_m = (x - row * spacing_m).abs();
    let edge = STRIP_M + 0.28 * (at(0.5, 3) - 0.5) + 0.16 * (crumbs - 0.5);
    let blades = at(0.09, 5);
    let turf = TURF.lerp(TURF_LIGHT, (0.55 * at(1.7, 4) + 0.8 * blades - 0.2).clamp(0.0, 1.0));
    let turf = turf.lerp(STRAW, (0.8 * at(0.9, 6) - 0.42).clamp(0.0, 0.4));
    // Wheels wear the turf on both sides of an alley's middle.
    let wheel = 1.0 - ((off_m - 0.5 * spacing_m).abs() - 0.75).abs() / 0.24;
    let is_alley = off_m < spacing_m;
    let turf = turf.lerp(SOIL_LIGHT, if is_alley { (0.5 * wheel).clamp(0.0, 0.32) } else { 0.0 });
    turf.lerp(soil, ((edge - off_m) / 0.06 + 0.5).clamp(0.0, 1.0))
}
