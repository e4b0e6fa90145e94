//! The reference controller by itself: when it opens and closes follows from distances, and it is shut whenever it cannot know.

use std::f64::consts::PI;

use rowscan_protocol::angle::BeamGrid;
use rowscan_protocol::rig::{Mount, Rig};
use rowscan_protocol::scan::{Echo, NO_ECHO, Scan};
use rowscan_sprayer::{Boom, Controller, nozzles_ahead_m};

/// From one scan to the next, seconds.
const TURN_S: f64 = 0.02;
/// What it reckons from scan to valve, seconds.
const LATE_S: f64 = 0.02;
/// Nozzles behind the scanner, metres.
const BEHIND_M: f64 = 1.0;
const STRIP_M: f64 = 0.02;

fn boom(on_ms: f64, off_ms: f64) -> Boom {
    let sections = [0.5, 1.0, 1.5].map(|z| {
        format!("[[section]]\nid = \"{z}\"\nside = \"right\"\nz_from_m = {z}\nz_to_m = {}\n", z + 0.5)
    });
    let text = format!(
        "version = 1\noffset_y_m = {BEHIND_M}\nstrip_m = {STRIP_M}\n[valve]\non_ms = {on_ms}\noff_ms = {off_ms}\nrise_ms = 0\nfall_ms = 0\n{}",
        sections.concat()
    );
    Boom::read(&text).expect("a boom")
}

/// A controller on a tractor that drives along a row, in its own time.
struct Trial {
    controller: Controller,
    mount: Mount,
    speed_m_s: f64,
    y_m: f64,
    turns: u32,
    has_speed: bool,
}

impl Trial {
    fn new(boom: Boom, speed_m_s: f64) -> Self {
        Self::on(Mount::default(), boom, speed_m_s)
    }

    fn on(mount: Mount, boom: Boom, speed_m_s: f64) -> Self {
        let controller = Controller::new(boom, std::slice::from_ref(&mount), LATE_S).expect("they fit");
        Self { controller, mount, speed_m_s, y_m: 0.0, turns: 0, has_speed: true }
    }

    /// One turn of the scanner: a wall from 1 to 2 m where `leaves` says so.
    fn turn(&mut self, leaves: impl Fn(f64) -> bool) -> Vec<f64> {
        if self.turns.is_multiple_of(5) && self.has_speed {
            self.controller.on_speed(Some(self.speed_m_s));
            self.controller.on_course(0.5);
        }
        let (mount, beams) = (&self.mount, BeamGrid::spanning(-450_000, 2_250_000, 5000));
        let at_m = self.y_m + mount.offset_y_m + self.speed_m_s * TURN_S / 2.0;
        let axes = mount.attitude().axes();
        let range_m = (0..beams.len()).map(|beam| {
            let theta_rad = mount.theta_deg(beams.angle_deg(beam)).to_radians();
            let [across, ahead, up] = axes.beam(theta_rad.cos(), theta_rad.sin());
            let range_m = mount.distance_m / across;
            let z_m = mount.height_m + range_m * up;
            let is_wall = across > 0.0 && (1.0..2.0).contains(&z_m);
            if is_wall && leaves(at_m + range_m * ahead) { range_m } else { NO_ECHO }
        });
        let echoes = vec![Echo { range_m: range_m.collect(), ..Echo::default() }];
        let scan = Scan {
            scan_time_us: self.turns * 20_000,
            scan_frequency_hz: 1.0 / TURN_S,
            beams,
            echoes,
            ..Scan::default()
        };
        self.controller.on_scan(0, &scan);
        self.turns += 1;
        self.y_m += self.speed_m_s * TURN_S;
        self.controller.duties()
    }

    /// So many turns before a wall without end.
    fn before_leaves(&mut self, turns: u32) -> Vec<f64> {
        (0..turns).map(|_| self.turn(|_| true)).last().unwrap_or_default()
    }
}

/// Where the scanner is when the middle section is opened for leaves from 3 to 4 m, and when it is closed; the lowest has nothing to do.
fn switched_at(boom: Boom, speed_m_s: f64) -> [f64; 2] {
    switched_by(Mount::default(), boom, speed_m_s)
}

fn switched_by(mount: Mount, boom: Boom, speed_m_s: f64) -> [f64; 2] {
    let mut trial = Trial::on(mount, boom, speed_m_s);
    let (mut was_open, mut edges) = (false, Vec::new());
    while trial.y_m < 8.0 {
        let duties = trial.turn(|y_m| (3.0..4.0).contains(&y_m));
        assert!(duties[0] == 0.0 && duties[1] == duties[2], "{duties:?}");
        if was_open != (duties[1] > 0.0) {
            was_open = !was_open;
            edges.push(trial.y_m);
        }
    }
    edges.try_into().expect("one edge that opens and one that closes")
}

#[test]
fn it_opens_and_closes_a_dead_time_and_a_latency_before_the_leaves() {
    for speed_m_s in [0.5, 1.5, 3.0] {
        for (on_ms, off_ms) in [(150.0, 100.0), (0.0, 0.0), (20.0, 200.0)] {
            let found = switched_at(boom(on_ms, off_ms), speed_m_s);
            let expected = [
                3.0 + BEHIND_M - STRIP_M / 2.0 - speed_m_s * (LATE_S + on_ms / 1e3),
                4.0 + BEHIND_M + STRIP_M / 2.0 - speed_m_s * (LATE_S + off_ms / 1e3),
            ];
            // It decides once a turn, and what a scan sees is the middle of one.
            let close_m = 1.5 * speed_m_s * TURN_S + 1e-9;
            for (found, expected) in found.iter().zip(expected) {
                let off_m = found - expected;
                assert!(off_m.abs() <= close_m, "{speed_m_s} m/s, {on_ms} and {off_ms} ms: {off_m} m");
            }
        }
    }
}

/// A rig that tells how its scanner is turned makes no difference to what the boom does.
#[test]
fn however_the_scanner_is_turned_it_opens_and_closes_where_a_level_one_does() {
    let level = switched_at(boom(50.0, 50.0), 1.0);
    let turned = |roll_deg, pitch_deg, yaw_deg| Mount { roll_deg, pitch_deg, yaw_deg, ..Mount::default() };
    let mounts = [-60.0, -45.0, -20.0, 20.0, 45.0, 60.0].map(|roll_deg| turned(roll_deg, 0.0, 0.0));
    let leaning = [-20.0, 10.0, 20.0].into_iter().flat_map(|lean_deg| {
        [turned(0.0, lean_deg, 0.0), turned(0.0, 0.0, lean_deg), turned(30.0, lean_deg, lean_deg)]
    });
    for mount in mounts.into_iter().chain(leaning) {
        let found = switched_by(mount.clone(), boom(50.0, 50.0), 1.0);
        for (found, level) in found.iter().zip(level) {
            // A leaning plane meets a section's upper and lower beams 1 m apart at different places.
            let across_m = 0.5 * mount.pitch_deg.to_radians().tan().abs();
            let off_m = (found - level).abs();
            assert!(off_m <= 0.05 + across_m, "{mount:?}: {found} {level}");
        }
    }
}

#[test]
fn nozzles_ahead_of_all_that_sees_for_them_are_told() {
    let at = |offset_y_m: f64, yaw_deg: f64| Mount { offset_y_m, yaw_deg, ..Mount::default() };
    let ahead_m = |mounts: &[Mount]| nozzles_ahead_m(&boom(0.0, 0.0), mounts);
    // They are a metre behind the reference point.
    assert_eq!((ahead_m(&[at(0.0, 0.0)]), ahead_m(&[at(-0.9, 0.0), at(-3.0, 0.0)])), (None, None));
    assert!(ahead_m(&[at(-3.0, 0.0)]).is_some_and(|m| (m - 2.0).abs() < 1e-9));
    // A scanner that looks ahead sees the row where the nozzles are not yet.
    assert_eq!(ahead_m(&[at(-1.5, 20.0)]), None);
    assert!(
        ahead_m(&[at(-1.5, -20.0)])
            .is_some_and(|m| (m - 0.5 - 1.9 * 20.0_f64.to_radians().tan()).abs() < 1e-3)
    );
}

/// Ground on a slope is no canopy where the rig tells the slope; and it is taken for canopy where nobody does.
#[test]
fn ground_that_the_rig_tells_opens_nothing() {
    const SLOPE_DEG: f64 = 30.0;
    let rise = SLOPE_DEG.to_radians().tan();
    let opens = |rig: &Rig, is_told: bool| {
        let mount = rig.scanners[0].clone();
        let controller = Controller::new(boom(50.0, 50.0), &rig.scanners, LATE_S).expect("they fit");
        let mut controller = if is_told { controller.with_ground(rig) } else { controller };
        let beams = BeamGrid::spanning(-450_000, 2_250_000, 5000);
        let to_ground = |beam: usize| {
            let (sin, cos) = mount.theta_deg(beams.angle_deg(beam)).to_radians().sin_cos();
            let falls = mount.side() * rise * cos - sin;
            // Z = 0 at the row's axis.
            let range_m = (mount.height_m + mount.side() * rise * mount.distance_m) / falls;
            if falls > 0.0 && range_m < 20.0 { range_m } else { NO_ECHO }
        };
        let echoes = vec![Echo { range_m: (0..beams.len()).map(to_ground).collect(), ..Echo::default() }];
        (0..200).any(|turn| {
            if turn % 5 == 0 {
                controller.on_speed(Some(1.0));
                controller.on_course(0.5);
            }
            let scan = Scan {
                scan_time_us: turn * 20_000,
                scan_frequency_hz: 1.0 / TURN_S,
                beams,
                echoes: echoes.clone(),
                ..Scan::default()
            };
            controller.on_scan(0, &scan);
            controller.duties().iter().any(|duty| *duty > 0.0)
        })
    };
    // It rises towards the row: a metre behind the axis it is 0.58 m high, in the lowest section.
    let rig = Rig { ground_slope_deg: Some(SLOPE_DEG), scanners: vec![Mount::default()], ..Rig::default() };
    assert!(!opens(&rig, true) && opens(&rig, false));
}

/// A look-ahead that reaches past the scanner: it opens and closes as soon as it sees, and is not shut for ever.
#[test]
fn valves_too_slow_for_the_way_to_the_scanner_open_late_and_not_never() {
    let speed_m_s = 2.0;
    for (on_ms, off_ms) in [(300.0, 700.0), (700.0, 700.0), (700.0, 100.0)] {
        let found = switched_at(boom(on_ms, off_ms), speed_m_s);
        let ideal = [(3.0 - STRIP_M / 2.0, on_ms), (4.0 + STRIP_M / 2.0, off_ms)]
            .map(|(at_m, ms)| at_m + BEHIND_M - speed_m_s * (LATE_S + ms / 1e3));
        for ((found, ideal), leaves_m) in found.iter().zip(ideal).zip([3.0, 4.0]) {
            let off_m = found - ideal.max(leaves_m);
            assert!(off_m.abs() <= 2.0 * speed_m_s * TURN_S, "{on_ms} and {off_ms} ms: {off_m} m");
        }
    }
}

#[test]
fn it_is_shut_where_it_must_not_spray_and_where_it_cannot_know() {
    let open = [0.0, 1.0, 1.0];
    let shut = [0.0; 3];
    let ready = || {
        let mut trial = Trial::new(boom(150.0, 100.0), 1.5);
        assert_eq!(trial.before_leaves(10), shut, "before its nozzles are at what it has seen");
        assert_eq!(trial.before_leaves(150), open);
        trial
    };
    // Standstill, reverse, a speed that is not available.
    for speed_m_s in [Some(0.05), Some(0.0), Some(-1.5), None] {
        let mut trial = ready();
        trial.controller.on_speed(speed_m_s);
        assert_eq!(trial.controller.duties(), shut, "{speed_m_s:?}");
        trial.controller.on_speed(Some(1.5));
        assert_eq!(trial.controller.duties(), open, "{speed_m_s:?}");
    }
    // On the headland; a row is driven either way.
    let mut trial = ready();
    trial.controller.on_course(0.5 + 0.5);
    assert_eq!(trial.controller.duties(), shut);
    trial.controller.on_course(0.5 + PI);
    assert_eq!(trial.controller.duties(), open);
    // Speeds without scans: after the fourth it is shut.
    let mut trial = ready();
    let duties: Vec<Vec<f64>> = (0..4)
        .map(|_| {
            trial.controller.on_speed(Some(1.5));
            trial.controller.duties()
        })
        .collect();
    assert!(duties[..3].iter().all(|duty| *duty == open) && duties[3] == shut, "{duties:?}");
    assert_eq!(trial.before_leaves(1), open, "scans are back");
    // Scans without speeds: shut after 0.3 s, which are 15 turns.
    trial = ready();
    trial.has_speed = false;
    let duties: Vec<bool> = (0..30).map(|_| trial.before_leaves(1) == open).collect();
    let held = duties.iter().take_while(|open| **open).count();
    assert!((10..=16).contains(&held) && duties[held..].iter().all(|open| !open), "{held}");
    // A scanner that says that it is lost.
    trial = ready();
    trial.controller.on_scanner_lost(0);
    assert_eq!(trial.controller.duties(), shut);
    // A number that the rig does not have changes nothing.
    trial = ready();
    trial.controller.on_scanner_lost(7);
    trial.controller.on_scan(7, &Scan::default());
    assert_eq!(trial.controller.duties(), open);
}

#[test]
fn a_rig_that_does_not_see_what_the_boom_sprays_is_refused() {
    let left = Mount { row: rowscan_protocol::rig::RowSide::Left, ..Mount::default() };
    let up = Mount { orientation: rowscan_protocol::rig::Orientation::Up, ..Mount::default() };
    for (mounts, says) in [
        (vec![left.clone()], "sprays to the right"),
        (vec![], "sprays to the right"),
        (vec![Mount::default(), up], "looks up"),
    ] {
        let error = Controller::new(boom(0.0, 0.0), &mounts, LATE_S).expect_err("it does not fit");
        assert!(error.to_string().contains(says), "{error}");
    }
    assert!(Controller::new(boom(0.0, 0.0), &[left, Mount::default()], LATE_S).is_ok());
}
