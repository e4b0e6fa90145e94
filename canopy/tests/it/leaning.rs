//! A scanner that sits askew, against closed forms: what is believed of it puts returns where they are, and what is believed wrongly puts
//! them where geometry says.

use crate::common::*;
use rowscan_canopy::Estimate;
use rowscan_protocol::angle::BeamGrid;
use rowscan_protocol::rig::{Mount, Rig};
use rowscan_protocol::scan::{Echo, NO_ECHO, Scan};

/// An upright board x = 2 m before the mirror, from y to y, from −1 to 1.2 m about it.
struct Board {
    y_m: [f64; 2],
}

const AWAY_M: f64 = 2.0;
const BELOW_M: f64 = -1.0;
const ABOVE_M: f64 = 1.2;

impl Board {
    fn range_m(&self, y_m: f64, [x, y, z]: [f64; 3]) -> f64 {
        let range_m = AWAY_M / x;
        let (at_m, height_m) = (y_m + range_m * y, range_m * z);
        let met =
            x > 1e-9 && (self.y_m[0]..self.y_m[1]).contains(&at_m) && (BELOW_M..=ABOVE_M).contains(&height_m);
        if met { range_m } else { NO_ECHO }
    }
}

/// Lines of a scanner that really sits as `really`, 8 m at 1 m/s.
fn drive_past(board: &Board, really: &Mount, grid: impl Fn(u32) -> BeamGrid) -> Vec<Scan> {
    let axes = really.attitude().axes();
    let line = |number: u32| {
        let grid = grid(number);
        let y_m = f64::from(number) * 0.02 + really.offset_y_m;
        let ranges = (0..grid.len()).map(|beam| {
            let (sin, cos) = really.theta_deg(grid.angle_deg(beam)).to_radians().sin_cos();
            board.range_m(y_m, axes.beam(cos, sin))
        });
        Scan {
            telegram_counter: number as u16,
            scan_time_us: number * 20_000,
            scan_frequency_hz: 50.0,
            beams: grid,
            echoes: vec![Echo { range_m: ranges.collect(), remission: Vec::new() }],
            ..Scan::default()
        }
    };
    (0..400).map(line).collect()
}

fn believing(mount: &Mount, scans: &[Scan]) -> Estimate {
    estimate(&Rig { scanners: vec![mount.clone()], ..open_rig() }, scans)
}

/// I_T by metre.
fn metres(found: &Estimate) -> Vec<f64> {
    let mut metres = vec![0.0; 10];
    for slice in &found.slices {
        metres[slice.y_m.max(0.0) as usize] += slice.impacted_total_area_m2;
    }
    metres
}

fn level() -> Mount {
    Mount { distance_m: AWAY_M, ..Mount::default() }
}

/// Impacted area of a metre of the board: each beam's patch is square to it, as wide as beams are apart, and counts as high as it is seen from the
/// side (paper eq. 3).
fn impacted_a_metre(mount: &Mount) -> f64 {
    let (grid, axes) = (lms511(), mount.attitude().axes());
    let patches = (0..grid.len()).map(|beam| {
        let (sin, cos) = mount.theta_deg(grid.angle_deg(beam)).to_radians().sin_cos();
        let [x, _, z] = axes.beam(cos, sin);
        let [.., rise] = axes.beam(-sin, cos);
        let range_m = AWAY_M / x;
        let met = x > 1e-9 && (BELOW_M..=ABOVE_M).contains(&(range_m * z));
        if met { 2.0 * range_m * (grid.step_deg().to_radians() / 2.0).sin() * rise } else { 0.0 }
    });
    patches.sum()
}

#[test]
fn a_board_has_its_area_where_it_stands_however_the_scanner_sits() {
    // A metre wide, in the fourth metre.
    let board = Board { y_m: [3.0, 4.0] };
    for (yaw_deg, pitch_deg, roll_deg, offset_y_m) in [
        (0.0, 0.0, 0.0, 0.0),
        (12.0, 0.0, 0.0, 0.0),
        (0.0, -10.0, 0.0, 0.4),
        (0.0, 0.0, 5.0, -0.3),
        (-8.0, 9.0, 3.0, 0.2),
    ] {
        let mount = Mount { yaw_deg, pitch_deg, roll_deg, offset_y_m, ..level() };
        let found = believing(&mount, &drive_past(&board, &mount, |_| lms511()));
        let (by_metre, area_m2) = (metres(&found), impacted_a_metre(&mount));
        // Half a line at either side, half a beam above and below.
        assert!((by_metre[3] / area_m2 - 1.0).abs() < 0.025, "{mount:?}: {by_metre:?}");
        let total = found.impacted_total_area_m2.unwrap();
        assert!((total / area_m2 - 1.0).abs() < 0.015, "{mount:?}: {total}");
    }
}

#[test]
fn a_yaw_that_is_not_believed_shifts_the_board_by_its_tangent() {
    let board = Board { y_m: [3.0, 3.5] };
    let really = Mount { yaw_deg: 8.0, ..level() };
    let by_metre = metres(&believing(&level(), &drive_past(&board, &really, |_| lms511())));
    // It is met when the scanner is so far behind.
    let shift_m = AWAY_M * 8f64.to_radians().tan();
    let before = shift_m / 0.5;
    let found = by_metre[2] / by_metre.iter().sum::<f64>();
    assert!((found - before).abs() < 0.03, "{found}, expected {before}");
    let believed = metres(&believing(&really, &drive_past(&board, &really, |_| lms511())));
    assert!(believed[2] < 0.03 * believed[3], "{believed:?}");
}

#[test]
fn a_pitch_that_is_not_believed_smears_the_board_by_height() {
    let board = Board { y_m: [3.0, 4.0] };
    let really = Mount { pitch_deg: 12.0, ..level() };
    let by_metre = metres(&believing(&level(), &drive_past(&board, &really, |_| lms511())));
    // At height z it is met z tan(pitch) later: that share of its metre leaves it.
    let (sin, cos) = 12f64.to_radians().sin_cos();
    let [top, bottom] = [ABOVE_M, -BELOW_M].map(|height_m| (height_m / (AWAY_M * cos)).atan());
    // Beams are evenly spaced in θ, and z = 2 m · tan θ cos(pitch).
    let share = |to: f64| -AWAY_M * sin * to.cos().ln() / (top + bottom);
    let (after, before) = (share(top), share(bottom));
    let total: f64 = by_metre.iter().sum();
    assert!((by_metre[4] / total - after).abs() < 0.01, "{by_metre:?}, expected {after}");
    assert!((by_metre[2] / total - before).abs() < 0.01, "{by_metre:?}, expected {before}");
}

#[test]
fn a_roll_that_is_not_believed_lifts_the_board() {
    let board = Board { y_m: [1.0, 7.0] };
    let really = Mount { roll_deg: 4.0, ..level() };
    let scans = drive_past(&board, &really, |_| lms511());
    let rig =
        |mount: Mount| Rig { tree_spacing_m: Some(8.0), trees: Some(1), scanners: vec![mount], ..open_rig() };
    let height = |mount: Mount| estimate(&rig(mount), &scans).trees[0].height_m.unwrap();
    // The beam that meets its top is taken for one 4° higher.
    let top = (ABOVE_M / AWAY_M).atan() + 4f64.to_radians();
    let range_m = AWAY_M.hypot(ABOVE_M);
    let (wrong, right) = (1.6 + range_m * top.sin(), 1.6 + ABOVE_M);
    assert!((height(level()) - wrong).abs() < 0.03, "{} {wrong}", height(level()));
    assert!((height(really.clone()) - right).abs() < 0.03, "{} {right}", height(really));
}

#[test]
fn interlaced_turns_are_put_upright_as_others_are() {
    let mount = Mount { yaw_deg: 12.0, pitch_deg: 3.0, ..Mount::default() };
    let board = Board { y_m: [2.3, 4.6] };
    let whole = drive_past(&board, &mount, |_| BeamGrid::spanning(-480_000, 2_280_000, 7500));
    let whole = metres(&believing(&mount, &whole));
    for turns in [2, 4] {
        let grid = |number: u32| {
            BeamGrid::spanning(-480_000 + (number % turns * 7500 / turns) as i32, 2_280_000, 7500)
        };
        let found = metres(&believing(&mount, &drive_past(&board, &mount, grid)));
        for (metre, (found, whole)) in found.iter().zip(&whole).enumerate() {
            assert!((found - whole).abs() < 0.04, "{turns} turns, metre {metre}: {found} m² for {whole} m²");
        }
        assert!(relative(found.iter().sum(), whole.iter().sum()) < 0.01, "{turns} turns");
    }
}
