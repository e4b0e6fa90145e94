//! A hectare of copies: 50 rows of 50 trees of 30 000 leaves, twenty of them distinct, beside one row of those twenty spelled out.

use std::hint::black_box;
use std::time::Instant;

use rowscan_protocol::scan::Pose;
use rowscan_scenes::{BeamFan, Caster, Orchard, Placement, Return, Scratch, Tree};

use crate::measure::{Case, Report};
use crate::row::{Planting, ROWS_M};

const ROWS: usize = 50;
const TREES: usize = 50;
const DISTINCT: usize = 20;

/// Distance between trees: 2500 of them on a hectare.
const SPACING_M: f64 = 1.0;

const TREE: Planting = Planting { rows: 1, trees: 1, leaves: 30_000, blade_m: 0.08, branches: 2_000 };

/// Beams of a line: 270° in steps of a quarter.
const BEAMS: usize = 1081;

/// Lines of one run.
const LINES: usize = 400;

/// Load time, memory and speed.
pub fn run(report: &mut Report, _arguments: &[String]) {
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let case =
        |name: &str, unit, peer, threads| Case { name: name.to_owned(), unit, peer, threads, work: [1.0; 2] };
    let before_gb = resident_gb();
    let start = Instant::now();
    let orchard = hectare(ROWS);
    let caster = Caster::new(&orchard);
    report.less_is_better(&case("load", "s", "the goal", threads), start.elapsed().as_secs_f64(), 5.0);
    report.less_is_better(&case("memory", "GB", "the goal", 1), resident_gb() - before_gb, 2.0);
    let fan = BeamFan::from_degrees(-135.0, 0.25, BEAMS);
    let row = Caster::new(&spelled_out());
    let few = Caster::new(&hectare(1));
    for (name, peer, of) in [
        ("lines, beside one row spelled out", "one row", &row),
        ("lines, beside one row of copies", "one row of copies", &few),
    ] {
        let case = Case { work: [LINES as f64; 2], ..case(name, "lines/s", peer, 1) };
        report.compare(&case, 5, || cast(&caster, &fan), || cast(of, &fan));
    }
}

/// Lines every 20 mm.
fn cast(caster: &Caster, fan: &BeamFan) {
    let mut scratch = Scratch::default();
    let mut found = vec![Return::MISS; fan.len()];
    for line in 0..LINES {
        let origin = Pose { x_m: -2.0, y_m: line as f64 * 0.02, z_m: 1.6 };
        caster.cast(origin, fan, &mut scratch, &mut found);
        black_box(&found);
    }
}

/// The distinct trees, at the origin.
fn distinct() -> Vec<Tree> {
    (0..DISTINCT).map(|number| TREE.tree_at_origin(number as u32)).collect()
}

/// Rows of copies, in both directions by turns.
fn hectare(rows: usize) -> Orchard {
    let places = (0..rows * TREES).map(|number| {
        let (row, place) = (number / TREES, number % TREES);
        let foot = [row as f64 * ROWS_M, (place as f64 + 0.5) * SPACING_M, 0.0];
        // Neighbours differ, along the row and across.
        let kind = (number * 7 + row * 3) % (2 * DISTINCT);
        (kind / 2, Placement::at(foot).turned(180.0 * (kind % 2) as f64))
    });
    Orchard::from_placed(distinct(), places.collect(), TREES as f64 * SPACING_M, None, None)
}

/// One row with every organ of its own.
fn spelled_out() -> Orchard {
    let trees = distinct().into_iter().enumerate();
    let trees = trees.map(|(place, tree)| tree.translated([0.0, (place as f64 + 0.5) * SPACING_M, 0.0]));
    Orchard::from_trees(trees.collect(), DISTINCT as f64 * SPACING_M, None, None)
}

/// Memory of this process that is resident, GB; 0 where the system does not tell.
fn resident_gb() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
    let kilobytes = line.and_then(|line| line.split_whitespace().next()?.parse::<f64>().ok());
    kilobytes.unwrap_or(0.0) * 1024.0 / 1e9
}
