//! The sprayer's whole loop on one core: two scanners, the reference controller, a boom of two sides with eight sections each, beside what is wanted.

use std::fmt::Write as _;
use std::hint::black_box;
use std::time::Instant;

use rowscan_emulator::stage::Stage;
use rowscan_scenes::files;
use rowscan_sprayer::{Boom, Edges, Score, oracle};
use rowscan_study::spraying::{self, Controlled};

use crate::measure::{Case, Report};

/// Simulated seconds a second that are wanted.
const WANTED: f64 = 20.0;
/// Sections of a side.
const SECTIONS: usize = 8;

const SCENE: &str = "version = 2
[orchard]
preset = \"spindle\"
trees = 12
rows = 2
[rig]
speed_m_s = 1.5
[[rig.scanner]]
row = \"right\"
[[rig.scanner]]
row = \"left\"
";

/// Scans and commands alone, and with the scores and the oracle.
pub fn run(report: &mut Report, _arguments: &[String]) {
    let Ok(pool) = rayon::ThreadPoolBuilder::new().num_threads(1).build() else { return };
    let set_up = files::scene_from_text(SCENE, |_| {})
        .and_then(|scene| Stage::grow(scene, &|_, _| {}).map_err(|error| error.to_string()))
        .and_then(|stage| Ok((stage, Boom::read(&boom()).map_err(|error| error.to_string())?)));
    let (stage, boom) = match set_up {
        Ok(set_up) => set_up,
        Err(why) => return eprintln!("sprayer: {why}"),
    };
    pool.install(|| {
        let start = Instant::now();
        let sprayed = match spraying::spray(&stage, boom, Controlled::default()) {
            Ok(sprayed) => sprayed,
            Err(why) => return eprintln!("sprayer: {why}"),
        };
        let loop_s = start.elapsed().as_secs_f64();
        let pass = &sprayed.pass;
        let flows = pass.flows(&sprayed.log);
        black_box((Score::of(pass, &flows), Edges::of(pass, &flows)));
        black_box(Score::of(pass, &pass.flows(&oracle::commands(pass))));
        let whole_s = start.elapsed().as_secs_f64();
        let simulated_s = pass.drive().going(0.0).length();
        for (name, took_s) in [("scans, commands, wanted leaves", loop_s), ("and scores, oracle", whole_s)] {
            let case = Case {
                name: format!("2 scanners, 2 × 8 sections: {name}"),
                unit: "simulated s/s",
                peer: "the goal",
                threads: 1,
                work: [1.0; 2],
            };
            report.more_is_better(&case, simulated_s / took_s, WANTED);
        }
    });
}

/// Two sides with their sections.
fn boom() -> String {
    let mut text = "version = 1\noffset_y_m = 2\n".to_owned();
    for (side, place) in ["right", "left"].iter().flat_map(|side| (0..SECTIONS).map(move |n| (side, n))) {
        let from_m = 0.4 + 0.35 * place as f64;
        let to_m = from_m + 0.35;
        let _ = write!(
            text,
            "[[section]]\nid = \"{side}-{place}\"\nside = \"{side}\"\nz_from_m = {from_m}\nz_to_m = {to_m}\n"
        );
    }
    text
}
