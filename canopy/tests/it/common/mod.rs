//! Scans of scenes with a closed form, unquantised, as a device would send them.

pub(crate) mod slab;

use rowscan_canopy::CanopyClass;
use rowscan_canopy::calibration::{CalibrationClass, EchoRule, Optics, Provenance};
use rowscan_canopy::{Estimate, Parameters, Pipeline};
use rowscan_protocol::angle::BeamGrid;
use rowscan_protocol::rig::{Attitude, Axes, BeamWidth, Mount, Rig};
use rowscan_protocol::scan::{Echo, NO_ECHO, Scan};

/// LMS111 at 50 Hz, 0.5°: all of −45°..225°.
pub(crate) fn lms111() -> BeamGrid {
    BeamGrid::spanning(-450_000, 2_250_000, 5000)
}

/// LMS511 at 25 Hz, 1/6°.
pub(crate) fn lms511() -> BeamGrid {
    BeamGrid::spanning(-50_000, 1_850_000, 1667)
}

/// A rig with no ground to remove and no next row.
pub(crate) fn open_rig() -> Rig {
    Rig { optics: Some(BeamWidth::Ideal), ground_clearance_m: -10.0, row_spacing_m: None, ..Rig::default() }
}

/// The default orchard: trees 1.5 m apart in rows 4 m apart.
pub(crate) fn orchard_rig() -> Rig {
    Rig {
        optics: Some(BeamWidth::Ideal),
        tree_spacing_m: Some(1.5),
        row_spacing_m: Some(4.0),
        ..Rig::default()
    }
}

/// θ of a beam, radians, and whether it looks ahead.
pub(crate) fn theta(mount: &Mount, grid: BeamGrid, beam: usize) -> (f64, bool) {
    let theta_deg = mount.theta_deg(grid.angle_deg(beam)) - mount.roll_deg;
    (theta_deg.to_radians(), theta_deg.abs() < 90.0)
}

/// The plane in which θ is counted.
pub(crate) fn plane_of(mount: &Mount) -> Axes {
    Attitude { roll_rad: 0.0, ..mount.attitude() }.axes()
}

/// How far below the rig's ground the real one lies, metres: rounding leaves none of its returns above.
const BELOW_M: f64 = 0.02;

/// A beam that meets nothing else ends on level ground, if the rig has one.
fn on_ground(rig: &Rig, theta: f64, range_m: f64) -> f64 {
    let mount = &rig.scanners[0];
    let height_m = mount.height_m;
    let [.., up] = plane_of(mount).beam(theta.cos(), theta.sin());
    let meets = range_m == NO_ECHO && up < 0.0 && rig.ground_clearance_m >= 0.0 && height_m > 0.0;
    if meets { (height_m + BELOW_M) / -up } else { range_m }
}

/// A scanner's own ranges scatter, those of rays do not, metres: some 4 mm.
fn scatter_m(rig: &Rig, line: u32, beam: usize) -> f64 {
    let number = (u64::from(line) << 16) | beam as u64;
    if rig.optics == Some(BeamWidth::Device) { 0.014 * (Random(number).unit() - 0.5) } else { 0.0 }
}

/// Line number `i` of a device at `hertz`, its ranges a function of y and θ.
pub(crate) fn line(
    rig: &Rig,
    grid: BeamGrid,
    hertz: u32,
    i: u32,
    range: &mut dyn FnMut(f64, f64) -> f64,
) -> Scan {
    let period_us = 1_000_000 / hertz;
    let y_m = rig.y_m(f64::from(i) * f64::from(period_us) * 1e-6);
    let range_m = (0..grid.len())
        .map(|beam| match theta(&rig.scanners[0], grid, beam) {
            (theta, true) => on_ground(rig, theta, range(y_m, theta)) + scatter_m(rig, i, beam),
            (_, false) => 0.7,
        })
        .collect();
    Scan {
        telegram_counter: 65_000u16.wrapping_add(i as u16),
        scan_time_us: (u32::MAX - 500_000).wrapping_add(i * period_us),
        scan_frequency_hz: f64::from(hertz),
        beams: grid,
        echoes: vec![Echo { range_m, remission: Vec::new() }],
        ..Scan::default()
    }
}

/// `lines` lines of a scene.
pub(crate) fn drive(
    rig: &Rig,
    grid: BeamGrid,
    hertz: u32,
    lines: u32,
    mut range: impl FnMut(f64, f64) -> f64,
) -> Vec<Scan> {
    (0..lines).map(|i| line(rig, grid, hertz, i, &mut range)).collect()
}

/// The estimate of scans with default parameters and no calibration.
pub(crate) fn estimate<'a>(rig: &Rig, scans: impl IntoIterator<Item = &'a Scan>) -> Estimate {
    estimate_with(rig, Parameters::default(), scans)
}

pub(crate) fn estimate_with<'a>(
    rig: &Rig,
    parameters: Parameters,
    scans: impl IntoIterator<Item = &'a Scan>,
) -> Estimate {
    let mut pipeline = Pipeline::with_parameters(Some(rig), 0, None, parameters).unwrap();
    scans.into_iter().for_each(|scan| pipeline.push(scan));
    pipeline.finish()
}

/// A wall x = x0 of any height.
pub(crate) fn wall(x0_m: f64) -> impl Fn(f64, f64) -> f64 {
    move |_, theta| if theta.cos() > 1e-9 { x0_m / theta.cos() } else { NO_ECHO }
}

pub(crate) fn relative(found: f64, expected: f64) -> f64 {
    (found / expected - 1.0).abs()
}

/// A small generator for tests: SplitMix64.
pub(crate) struct Random(pub(crate) u64);

impl Random {
    /// Uniform in [0, 1).
    pub(crate) fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// A number in [0, 1) of a place, the same each time: how deep in foliage its beam ends.
pub(crate) fn scatter(y_m: f64, theta: f64) -> f64 {
    ((y_m * 977.0 + theta * 7919.0).sin() * 43_758.547).fract().abs()
}

/// A hedge on the row axis, 0.12 m deep, 0.5..2.5 m high, but none in tree 1.
pub(crate) fn hedge(lines: u32) -> Vec<Scan> {
    hedge_at(1.75, lines)
}

/// The same with its face so far from the scanner.
pub(crate) fn hedge_at(face_m: f64, lines: u32) -> Vec<Scan> {
    drive(&orchard_rig(), lms111(), 50, lines, |y_m, theta| {
        let z_m = 1.6 + face_m * theta.tan();
        let gap = (1.5..3.0).contains(&(y_m + 1e-9));
        let x_m = face_m + 0.12 * scatter(y_m, theta);
        if !gap && (0.5..2.5).contains(&z_m) && theta.abs() < 1.5 { x_m / theta.cos() } else { NO_ECHO }
    })
}

/// What the hedge says a metre, raw: (I_T, contact).
pub(crate) fn hedge_per_metre() -> (f64, f64) {
    let raw = estimate(&orchard_rig(), &hedge(75));
    (raw.impacted_total_area_m2.unwrap() / 1.5, raw.leaf.areas.contact_raw_m2().ok().unwrap() / 1.5)
}

pub(crate) fn class() -> CalibrationClass {
    CalibrationClass {
        preset: "spindle".into(),
        shady_threshold_percent: 101.0,
        growth_stage: "10 iterations".into(),
        tree_spacing_m: 1.5,
        scanner_model: "lms111".into(),
        resolution_deg: 0.5,
        echo_rule: EchoRule::First,
        optics: Optics::Ideal,
        distance_m: None,
        height_m: None,
        yaw_deg: None,
        pitch_deg: None,
        line_spacing_m: None,
        crown_depth_m: None,
        voxel_m: None,
        canopy: CanopyClass::default(),
    }
}

pub(crate) fn provenance() -> Provenance {
    Provenance { command: "rowscan study areas --rows 8".into(), seeds: vec![1, 2, 3] }
}
