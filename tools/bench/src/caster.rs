//! The caster beside parry3d's hierarchy: leaf rows of several sizes, deep scenes, moving origins, three layers.

use std::hint::black_box;

use rowscan_protocol::scan::Pose;
use rowscan_scenes::{BeamFan, Beams, Caster, Layers, Orchard, Return, Scratch};

use crate::measure::{Case, Report};
use crate::peer::{PARRY, Peer, before_ground};
use crate::row::Planting;

/// Beams of a line: 270° in steps of a quarter.
const BEAMS: usize = 1081;

/// A row to be measured on.
struct Scene {
    name: &'static str,
    planting: Planting,
    /// Lines of one run of ours, and of the peer.
    lines: [usize; 2],
}

const ONE_ROW: Planting = Planting { rows: 1, trees: 10, leaves: 5_000, blade_m: 0.08, branches: 2_000 };

const SCENES: &[Scene] = &[
    Scene { name: "50 k leaves", planting: ONE_ROW, lines: [700, 100] },
    Scene {
        name: "500 k leaves",
        planting: Planting { trees: 20, leaves: 25_000, blade_m: 0.05, ..ONE_ROW },
        lines: [700, 100],
    },
    Scene {
        name: "5 M leaves",
        planting: Planting { trees: 100, leaves: 50_000, blade_m: 0.05, ..ONE_ROW },
        lines: [700, 100],
    },
    Scene {
        name: "5 rows deep, 5 M leaves",
        planting: Planting { rows: 5, trees: 20, leaves: 50_000, blade_m: 0.05, ..ONE_ROW },
        lines: [200, 60],
    },
];

/// A scene made ready for both.
struct Bench {
    name: &'static str,
    caster: Caster,
    peer: Peer,
    length_m: f64,
    lines: [usize; 2],
    fan: BeamFan,
}

/// Runs all cases; `--quick` leaves out those of 5 M leaves.
pub fn run(report: &mut Report, arguments: &[String]) {
    let quick = arguments.iter().any(|argument| argument == "--quick");
    for scene in SCENES {
        let leaves = scene.planting.rows * scene.planting.trees * scene.planting.leaves;
        if quick && leaves > 1_000_000 {
            continue;
        }
        let orchard = scene.planting.orchard();
        memory(report, scene.name, &orchard);
        let bench = Bench {
            name: scene.name,
            caster: Caster::new(&orchard),
            peer: Peer::new(&orchard),
            length_m: orchard.length_m(),
            lines: scene.lines,
            fan: BeamFan::from_degrees(-135.0, 0.25, BEAMS),
        };
        drop(orchard);
        bench.nearest(report, "every 20 mm", |line| line as f64 * 0.020);
        bench.nearest(report, "every 2 mm", |line| line as f64 * 0.002);
        // The golden section visits the whole row evenly, never a place near the last one.
        bench.nearest(report, "spread along the row", |line| {
            (line as f64 * 0.618_033_988_749_895).fract() * bench.length_m
        });
        bench.moving(report);
        bench.layers(report);
        bench.two_threads(report);
    }
    flatness(report);
}

/// What the caster keeps, and takes while it is built on one thread, beside the peer; and how long it takes on all threads.
fn memory(report: &mut Report, name: &str, orchard: &Orchard) {
    let ours = std::thread::scope(|scope| {
        // Allocations are counted by thread, so all of the work must be this one's.
        let alone = || {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build().ok()?;
            Some(pool.install(|| megabytes(|| Caster::new(orchard))))
        };
        scope.spawn(alone).join().ok().flatten()
    });
    let peer = megabytes(|| Peer::new(orchard));
    let case = |what: &str, unit, threads| Case {
        name: format!("{name}, {what}"),
        unit,
        peer: PARRY,
        threads,
        work: [1.0; 2],
    };
    if let Some(ours) = ours {
        for ((what, ours), peer) in ["kept", "at most, while built"].into_iter().zip(ours).zip(peer) {
            report.less_is_better(&case(what, "MB", 1), ours, peer);
        }
    }
    let threads = rayon::current_num_threads();
    let builds = || drop(black_box(Caster::new(orchard)));
    report.compare(&case("built", "builds/s", threads), 2, builds, || drop(black_box(Peer::new(orchard))));
}

/// What is kept of a thing, and what making it takes at most, MB.
fn megabytes<T>(make: impl FnOnce() -> T) -> [f64; 2] {
    let mut kept = None;
    let used = allocation_counter::measure(|| kept = Some(make()));
    drop(kept);
    [used.bytes_current as f64, used.bytes_max as f64].map(|bytes| bytes * 1e-6)
}

/// Lines a second in rows of 100 and 1000 like trees, beside 10: what a line costs must not depend on the trees it does not cut.
fn flatness(report: &mut Report) {
    let row = |trees| {
        let orchard = Planting { trees, leaves: 1_000, branches: 100, ..ONE_ROW }.orchard();
        (Caster::new(&orchard), orchard.length_m())
    };
    let fan = BeamFan::from_degrees(-135.0, 0.25, BEAMS);
    let lines = 700;
    let drive = |(caster, length_m): &(Caster, f64)| {
        let (mut scratch, mut out) = (Scratch::default(), vec![Return::MISS; BEAMS]);
        for line in 0..lines {
            // Through the middle of every row alike: 14 m at 20 mm.
            caster.cast(pose(length_m / 2.0 + line as f64 * 0.02), &fan, &mut scratch, &mut out);
            black_box(&out);
        }
    };
    let ten = row(10);
    for trees in [100, 1000] {
        let many = row(trees);
        let case = Case {
            name: format!("{trees} trees in a row beside 10"),
            unit: "lines/s",
            peer: "rowscan, 10 trees",
            threads: 1,
            work: [lines as f64; 2],
        };
        report.compare(&case, 9, || drive(&many), || drive(&ten));
    }
}

impl Bench {
    fn case(&self, what: &str, threads: usize) -> Case {
        Case {
            name: format!("{}, {what}", self.name),
            unit: "Mrays/s",
            peer: PARRY,
            threads,
            work: self.lines.map(|lines| (lines * BEAMS) as f64 * 1e-6),
        }
    }

    fn nearest(&self, report: &mut Report, what: &str, y_m: impl Fn(usize) -> f64) {
        let (mut scratch, mut out) = (Scratch::default(), vec![Return::MISS; BEAMS]);
        let ours = || {
            for line in 0..self.lines[0] {
                self.caster.cast(pose(y_m(line)), &self.fan, &mut scratch, &mut out);
                black_box(&out);
            }
        };
        let peer = || {
            for line in 0..self.lines[1] {
                let at = pose(y_m(line));
                let origin = [at.x_m, at.y_m.rem_euclid(self.length_m), at.z_m];
                for (cos, sin) in self.fan.directions() {
                    black_box(self.peer.nearest(origin, [cos, 0.0, sin], before_ground(at.z_m, sin)));
                }
            }
        };
        report.compare(&self.case(what, 1), 9, ours, peer);
    }

    /// 15 mm of advance in a turn: every ray has its own origin.
    fn moving(&self, report: &mut Report) {
        let advance = 0.015 / BEAMS as f64;
        let fan = self.fan.clone().advancing(advance);
        let (mut scratch, mut out) = (Scratch::default(), vec![Return::MISS; BEAMS]);
        let ours = || {
            for line in 0..self.lines[0] {
                self.caster.cast(pose(line as f64 * 0.02), &fan, &mut scratch, &mut out);
                black_box(&out);
            }
        };
        let peer = || {
            for line in 0..self.lines[1] {
                let at = pose(line as f64 * 0.02);
                for (beam, (cos, sin)) in self.fan.directions().enumerate() {
                    let y_m = at.y_m + beam as f64 * advance;
                    let origin = [at.x_m, y_m.rem_euclid(self.length_m), at.z_m];
                    black_box(self.peer.nearest(origin, [cos, 0.0, sin], before_ground(at.z_m, sin)));
                }
            }
        };
        report.compare(&self.case("moving origin", 1), 9, ours, peer);
    }

    /// All threads of the pool beside one thread.
    fn two_threads(&self, report: &mut Report) {
        let origins: Vec<Pose> = (0..self.lines[0]).map(|line| pose(line as f64 * 0.02)).collect();
        let mut out = vec![Return::MISS; BEAMS * origins.len()];
        let ours = || {
            self.caster.cast_lines(&origins, &self.fan, &mut out);
            black_box(&out);
        };
        let mut line = vec![Return::MISS; BEAMS * origins.len()];
        let mut scratch = Scratch::default();
        let peer = || {
            for (origin, line) in origins.iter().zip(line.chunks_mut(BEAMS)) {
                self.caster.cast(*origin, &self.fan, &mut scratch, line);
            }
            black_box(&line);
        };
        let threads = std::thread::available_parallelism().map_or(1, usize::from);
        let work = (self.lines[0] * BEAMS) as f64 * 1e-6;
        let case = Case { peer: "rowscan, 1 thread", work: [work; 2], ..self.case("all threads", threads) };
        report.compare(&case, 9, ours, peer);
    }

    fn layers(&self, report: &mut Report) {
        let beams = Beams::from(self.fan.clone());
        let (mut scratch, mut out) = (Scratch::default(), Layers::default());
        let ours = || {
            for line in 0..self.lines[0] {
                self.caster.cast_layers(pose(line as f64 * 0.02), &beams, 3, &mut scratch, &mut out);
                black_box(&out);
            }
        };
        let peer = || {
            for line in 0..self.lines[1] {
                let at = pose(line as f64 * 0.02);
                let origin = [at.x_m, at.y_m.rem_euclid(self.length_m), at.z_m];
                for (cos, sin) in self.fan.directions() {
                    black_box(self.peer.layers(origin, [cos, 0.0, sin], before_ground(at.z_m, sin)));
                }
            }
        };
        report.compare(&self.case("first 3 leaves", 1), 9, ours, peer);
    }
}

fn pose(y_m: f64) -> Pose {
    Pose { x_m: -1.9, y_m, z_m: 1.6 }
}
