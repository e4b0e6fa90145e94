//! Slabs of leaves around the row, with a closed form: infinitely small ones, and discs of one size.

use rowscan_canopy::Parameters;
use rowscan_protocol::rig::{Mount, Rig};
use rowscan_protocol::scan::{NO_ECHO, Scan};

use super::*;

/// The slabs stand around the row, 0.5..3 m high; their faces lie on voxel faces.
pub(crate) const HIGH_M: f64 = 2.5;
pub(crate) const DISTANCE_M: f64 = 2.0;
pub(crate) const HEIGHT_M: f64 = 1.6;

pub(crate) fn rig() -> Rig {
    let mount = Mount { distance_m: DISTANCE_M, height_m: HEIGHT_M, ..Mount::default() };
    Rig { ground_clearance_m: 0.0, scanners: vec![mount], ..orchard_rig() }
}

pub(crate) fn parameters() -> Parameters {
    Parameters { half_width_m: Some(1.5), ..Parameters::default() }
}

/// Where a beam enters and leaves the slab, if it meets it.
pub(crate) fn chord(thick_m: f64, theta: f64) -> Option<(f64, f64)> {
    let (sin, cos) = theta.sin_cos();
    chord_towards(thick_m, cos, sin)
}

/// The same of a beam that goes so far towards the row and so far up a metre.
fn chord_towards(thick_m: f64, cos: f64, sin: f64) -> Option<(f64, f64)> {
    let (near, far) = ((DISTANCE_M - thick_m / 2.0) / cos, (DISTANCE_M + thick_m / 2.0) / cos);
    let (a, b) = ((0.5 - HEIGHT_M) / sin, (0.5 + HIGH_M - HEIGHT_M) / sin);
    let (near, far) = if sin.abs() < 1e-9 { (near, far) } else { (near.max(a.min(b)), far.min(a.max(b))) };
    (near < far).then_some((near, far))
}

/// A slab of infinitely small leaves: free paths are exponential with rate G · LAD (G = 0.5).
pub(crate) fn turbid(thick_m: f64, density: f64, lines: u32, seed: u64) -> Vec<Scan> {
    let mut random = Random(seed);
    drive(&rig(), lms111(), 50, lines, |_, theta| {
        let path_m = -(1.0 - random.unit()).ln() / (0.5 * density);
        chord(thick_m, theta)
            .filter(|(near, far)| near + path_m < *far)
            .map_or(NO_ECHO, |(near, _)| near + path_m)
    })
}

/// The same past a scanner on this mount, which may be turned.
pub(crate) fn turbid_from(
    mount: Mount,
    thick_m: f64,
    density: f64,
    lines: u32,
    seed: u64,
) -> (Rig, Vec<Scan>) {
    let mut random = Random(seed);
    let axes = plane_of(&mount);
    let rig = Rig { scanners: vec![mount], ..rig() };
    let scans = drive(&rig, lms111(), 50, lines, |_, theta| {
        let path_m = -(1.0 - random.unit()).ln() / (0.5 * density);
        let [towards, _, up] = axes.beam(theta.cos(), theta.sin());
        chord_towards(thick_m, towards, up)
            .filter(|(near, far)| towards > 0.0 && near + path_m < *far)
            .map_or(NO_ECHO, |(near, _)| near + path_m)
    });
    (rig, scans)
}

/// A round leaf.
pub(crate) struct Disc {
    centre: [f64; 3],
    normal: [f64; 3],
}

/// Discs of one size, thrown and turned at random into the slab, over a length of row a little longer than scanned.
pub(crate) fn discs(
    random: &mut Random,
    thick_m: f64,
    length_m: f64,
    density: f64,
    radius_m: f64,
) -> Vec<Disc> {
    let (y0, y1) = (-0.1, length_m + 0.1);
    let area_m2 = std::f64::consts::PI * radius_m * radius_m;
    let count = (density * thick_m * HIGH_M * (y1 - y0) / area_m2).round() as usize;
    (0..count)
        .map(|_| {
            let centre = [
                DISTANCE_M + thick_m * (random.unit() - 0.5),
                y0 + (y1 - y0) * random.unit(),
                0.5 + HIGH_M * random.unit(),
            ];
            let up = 2.0 * random.unit() - 1.0;
            let round = std::f64::consts::TAU * random.unit();
            let flat = (1.0 - up * up).sqrt();
            Disc { centre, normal: [flat * round.cos(), flat * round.sin(), up] }
        })
        .collect()
}

/// The first disc a beam from the sensor meets in the scan plane at `y_m`.
pub(crate) fn first_hit(discs: &[&Disc], radius_m: f64, y_m: f64, theta: f64) -> f64 {
    let (sin, cos) = theta.sin_cos();
    discs
        .iter()
        .filter_map(|disc| {
            let [nx, ny, nz] = disc.normal;
            let [x, y, z] = [disc.centre[0], disc.centre[1] - y_m, disc.centre[2] - HEIGHT_M];
            let range_m = (nx * x + ny * y + nz * z) / (nx * cos + nz * sin);
            let off = (range_m * cos - x).powi(2) + y * y + (range_m * sin - z).powi(2);
            (range_m > 0.0 && off < radius_m * radius_m).then_some(range_m)
        })
        .fold(NO_ECHO, f64::min)
}

/// A slab of discs turned any way, driven past at 50 Hz.
pub(crate) fn leafy(thick_m: f64, density: f64, radius_m: f64, lines: u32, seed: u64) -> Vec<Scan> {
    let length_m = f64::from(lines) * 0.02;
    let leaves = discs(&mut Random(seed), thick_m, length_m, density, radius_m);
    let mut near: Vec<&Disc> = Vec::new();
    let mut near_y_m = f64::NAN;
    drive(&rig(), lms111(), 50, lines, |y_m, theta| {
        if y_m != near_y_m {
            near_y_m = y_m;
            near = leaves.iter().filter(|d| (d.centre[1] - y_m).abs() < radius_m).collect();
        }
        // Steeper beams pass above and below the slab.
        if theta.abs() < 1.3 { first_hit(&near, radius_m, y_m, theta) } else { NO_ECHO }
    })
}
