//! The scanner's eye beside the thin beam, and beside parry3d's hierarchy that casts the same rays; and what a line of thin beams costs by the
//! leaves that its plane cuts.

use std::hint::black_box;

use rowscan_protocol::model::AnyModel;
use rowscan_protocol::scan::Pose;
use rowscan_scenes::optics::{Eye, EyeModel, OpticsSettings, RangeLimits, Stages};
use rowscan_scenes::{BeamFan, Beams, Caster, Layers, Orchard, Return, Scratch};

use crate::measure::{Case, Report};
use crate::peer::{PARRY, Peer, before_ground};
use crate::row::Planting;

/// An LMS511 at 50 Hz: 190° in steps of half a degree.
const BEAMS: usize = 381;
const STEP_DEG: f64 = 0.5;
const SCANNER: &str = "lms511";

/// Metres between lines: 1 m/s at 50 Hz.
const APART_M: f64 = 0.02;

/// Planes and rays of the spot by quality, as docs/optics.md has them.
const QUALITIES: [(u8, &str); 4] = [(1, "3 x 5"), (2, "5 x 9"), (3, "7 x 9"), (4, "9 x 15")];

/// What a line of thin beams is to cut: leaves a tree, rows.
const CUTS: [(usize, usize); 4] = [(4_150, 1), (16_600, 1), (41_500, 1), (45_700, 5)];

const ROW: Planting = Planting { rows: 1, trees: 10, leaves: 5_000, blade_m: 0.08, branches: 2_000 };

/// Runs all cases; `--quick` leaves out rows of 50 k leaves a tree, `--cut` all but lines of thin beams by the leaves that they cut.
pub fn run(report: &mut Report, arguments: &[String]) {
    let asked = |flag: &str| arguments.iter().any(|argument| argument == flag);
    let (quick, cuts) = (asked("--quick"), asked("--cut"));
    for leaves in [5_000, 50_000] {
        if cuts || quick && leaves > 5_000 {
            continue;
        }
        let blade_m = if leaves > 5_000 { 0.05 } else { 0.08 };
        let orchard = Planting { leaves, blade_m, ..ROW }.orchard();
        eyes(report, &format!("{} k leaves a tree", leaves / 1_000), &orchard);
    }
    for (leaves, rows) in CUTS {
        let planting = Planting { rows, trees: 4, leaves, blade_m: 0.06, branches: 200 };
        if !quick || rows == 1 {
            cut(report, planting);
        }
    }
}

fn fan(step_deg: f64, count: usize) -> BeamFan {
    BeamFan::from_degrees(-95.0, step_deg, count)
}

fn pose(line: usize) -> Pose {
    Pose { x_m: -1.9, y_m: line as f64 * APART_M, z_m: 1.6 }
}

/// The eye at every quality, beside the thin beam and beside the peer.
fn eyes(report: &mut Report, name: &str, orchard: &Orchard) {
    let (caster, peer, length_m) = (Caster::new(orchard), Peer::new(orchard), orchard.length_m());
    let model = AnyModel::by_name(SCANNER).expect("a model of ours");
    let limits = RangeLimits { min_range_m: 0.05, max_range_m: 80.0 };
    let thin = fan(STEP_DEG, BEAMS);
    for (quality, planes_by_rays) in QUALITIES {
        let settings = OpticsSettings { stages: Stages::device(), quality, ..OpticsSettings::default() };
        let eye_model = EyeModel { optics: model.optics(), echoes: model.echoes(), limits };
        let mut eye = Eye::new(eye_model, &settings, 1, 0);
        eye.turn_to(&thin, true);
        let rays = eye.rays();
        let lines = 200;
        let mut look = || {
            for line in 0..lines {
                eye.look(&caster, pose(line), 0.0, line as u64);
                black_box(eye.beam(0));
            }
        };
        let (mut scratch, mut out) = (Scratch::default(), vec![Return::MISS; BEAMS]);
        let ideal = || {
            for line in 0..lines {
                caster.cast(pose(line), &thin, &mut scratch, &mut out);
                black_box(&out);
            }
        };
        let case = |what: &str, unit, peer, work| Case {
            name: format!("{name}, {planes_by_rays}, {what}"),
            unit,
            peer,
            threads: 1,
            work,
        };
        let [planes, in_plane] = rays;
        report.compare(
            &case("beside thin beams", "lines/s", "rowscan, thin", [lines as f64; 2]),
            5,
            &mut look,
            ideal,
        );
        let fine = fan(STEP_DEG * (BEAMS - 1) as f64 / (in_plane - 1) as f64, in_plane);
        let peer_lines = 8;
        let cast = || {
            for line in 0..peer_lines {
                for plane in 0..planes {
                    let y_m = pose(line).y_m + (plane as f64 - planes as f64 / 2.0) * 0.005;
                    let origin = [-1.9, y_m.rem_euclid(length_m), 1.6];
                    for (cos, sin) in fine.directions() {
                        black_box(peer.nearest(origin, [cos, 0.0, sin], before_ground(1.6, sin)));
                    }
                }
            }
        };
        let mrays = (planes * in_plane) as f64 * 1e-6;
        let work = [lines as f64 * mrays, peer_lines as f64 * mrays];
        report.compare(&case("the same rays", "Mrays/s", PARRY, work), 5, &mut look, cast);
    }
}

/// Thin beams on lines that cut so many leaves: nanoseconds a cut leaf, beside the peer. At rest, moving by 15 mm a turn, and the first three
/// leaves of every beam.
fn cut(report: &mut Report, planting: Planting) {
    let orchard = planting.orchard();
    let (caster, peer, length_m) = (Caster::new(&orchard), Peer::new(&orchard), orchard.length_m());
    let still = BeamFan::from_degrees(-135.0, 0.25, 1081);
    let advance_m = 0.015 / still.len() as f64;
    let moving = still.clone().advancing(advance_m);
    let lines = [200, 40];
    let place = |line: usize| (line as f64 * 0.618_033_988_749_895).fract() * length_m;
    let leaves_cut = (0..lines[0]).map(|line| leaves_at(&orchard, place(line))).sum::<usize>() / lines[0];
    let case = |what: &str| Case {
        name: format!("{} rows, {leaves_cut} leaves cut by a line, {what}", planting.rows),
        unit: "ns a cut leaf",
        peer: PARRY,
        threads: 1,
        work: lines.map(|lines| (lines * leaves_cut) as f64),
    };
    let rays = |line: usize, advance_m: f64| {
        let y_m = place(line);
        still.directions().enumerate().map(move |(beam, (cos, sin))| {
            let origin = [-1.9, (y_m + beam as f64 * advance_m).rem_euclid(length_m), 1.6];
            (origin, [cos, 0.0, sin], before_ground(1.6, sin))
        })
    };
    let mut scratch = Scratch::default();
    let mut out = vec![Return::MISS; still.len()];
    for (what, fan, advance_m) in [("at rest", &still, 0.0), ("moving", &moving, advance_m)] {
        let ours = || {
            for line in 0..lines[0] {
                caster.cast(Pose { y_m: place(line), ..pose(0) }, fan, &mut scratch, &mut out);
                black_box(&out);
            }
        };
        let theirs = || {
            for (origin, direction, most_m) in (0..lines[1]).flat_map(|line| rays(line, advance_m)) {
                black_box(peer.nearest(origin, direction, most_m));
            }
        };
        report.compare_costs(&case(what), 7, ours, theirs);
    }
    let (beams, mut layers) = (Beams::from(still.clone()), Layers::default());
    let ours = || {
        for line in 0..lines[0] {
            let origin = Pose { y_m: place(line), ..pose(0) };
            caster.cast_layers(origin, &beams, 3, &mut scratch, &mut layers);
            black_box(&layers);
        }
    };
    let theirs = || {
        for (origin, direction, most_m) in (0..lines[1]).flat_map(|line| rays(line, 0.0)) {
            black_box(peer.layers(origin, direction, most_m));
        }
    };
    report.compare_costs(&case("first 3 leaves"), 5, ours, theirs);
}

/// Leaves that the plane of a line cuts, images across the period's border included.
fn leaves_at(orchard: &Orchard, y_m: f64) -> usize {
    let length_m = orchard.length_m();
    let cuts = |outline: &[[f64; 3]], shift_m: f64| {
        let ys = || outline.iter().map(|vertex| vertex[1] + shift_m);
        ys().fold(f64::MAX, f64::min) <= y_m && y_m <= ys().fold(f64::MIN, f64::max)
    };
    let images = |outline: &[[f64; 3]]| {
        [-length_m, 0.0, length_m].into_iter().filter(|shift| cuts(outline, *shift)).count()
    };
    orchard.trees().map(|tree| tree.leaves.iter().map(|leaf| images(leaf.outline())).sum::<usize>()).sum()
}
