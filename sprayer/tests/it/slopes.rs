//! A boom on a slope: the tractor is level, and as high as the foot of one of its rows. What its nozzles have before them is what the same nozzles have on level
//! ground, so much lower or higher.

use rowscan_protocol::time::SimTime;
use rowscan_scenes::orchard::{OrchardParameters, Preset};
use rowscan_scenes::{GroundOverrides, Orchard};
use rowscan_sprayer::interception::{Settings, Sink, intercept};
use rowscan_sprayer::{Boom, Drive, Pass};
use rowscan_vehicle::Tractor;
use rowscan_vehicle::trajectory::{Course, SpeedProfile, Trajectory};

/// Three rows of two small trees on this slope.
fn rows(slope_deg: f64) -> Orchard {
    let ground = GroundOverrides { slope_deg: Some(slope_deg), ..GroundOverrides::default() };
    let preset = OrchardParameters::of(Preset::Spindle);
    let mut parameters = OrchardParameters { trees: Some(2), rows: Some(3), ground, ..preset };
    parameters.tree.iterations = Some(6);
    Orchard::grow(&parameters, 7, &|_, _| {}).expect("it grows")
}

/// Leaf area before one section of this side, m², and the litres that meet leaves when it is open all the time.
fn before(orchard: &Orchard, (alley, looks_left): (i32, bool), side: &str, z_m: f64) -> (f64, f64) {
    let text = format!(
        "version = 1\noffset_y_m = 0\nstrip_m = 0\njoin_m = 0\n[valve]\non_ms = 0\noff_ms = 0\nrise_ms = 0\nfall_ms = 0\n\
         [[section]]\nid = \"s\"\nside = \"{side}\"\nz_from_m = {z_m}\nz_to_m = {}\nnozzles = 1\n",
        z_m + 0.5
    );
    let course = Course { alley, looks_left, row_spacing_m: 4.0, ..Course::default() };
    let tractor = Tractor::new(Trajectory::new(SpeedProfile::builder(1.0, 0.0).hold(), course, 1.0));
    tractor.begin(SimTime::ZERO);
    let drive = Drive::of(|at| tractor.motion(at), SimTime::ZERO, SimTime(3_000_000_000));
    let pass = Pass::new(Boom::read(&text).expect("a boom"), orchard, drive, 5);
    let flows = pass.constant_flows();
    let found = intercept(&pass, orchard, &[&flows], &Settings { rays: 8, step_m: 0.05, seed: 3 });
    let wanted_m2 = rowscan_sprayer::Score::of(&pass, &flows).wanted_area_m2;
    (wanted_m2, found[0].sinks.litres(Sink::Leaf))
}

#[test]
fn a_nozzle_has_before_it_what_stands_at_its_own_height_on_either_side_of_any_alley() {
    let level = rows(0.0);
    let mut found_m2 = 0.0;
    for slope_deg in [-8.0, 6.0_f64] {
        let slope = rows(slope_deg);
        let rise_m = 4.0 * slope_deg.to_radians().tan();
        for drive @ (alley, looks_left) in [(0, false), (1, false), (1, true), (2, true)] {
            for side in ["right", "left"] {
                let z_m = 1.2;
                // The row on the right stands higher by one row's rise than the one on the left.
                let above_m = match (side, looks_left) {
                    ("right", true) => -rise_m,
                    ("left", false) => rise_m,
                    _ => 0.0,
                };
                let (area_m2, leaf_l) = before(&slope, drive, side, z_m);
                let (level_m2, level_l) = before(&level, drive, side, z_m + above_m);
                let case = format!("{slope_deg}°, alley {alley}, {looks_left}, {side}");
                assert!(
                    (area_m2 - level_m2).abs() < 1e-9 * level_m2.max(1.0),
                    "{case}: {area_m2} {level_m2}"
                );
                assert!((leaf_l - level_l).abs() < 1e-6 * level_l.max(1.0), "{case}: {leaf_l} {level_l}");
                found_m2 += area_m2;
            }
        }
    }
    assert!(found_m2 > 1.0, "{found_m2}");
}
