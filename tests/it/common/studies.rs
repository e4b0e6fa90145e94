//! Studies quick enough for a test.

use rowscan_scenes::files::load_scene;
use rowscan_scenes::scan::ScanSettings;
use rowscan_study::archive::Archive;
use rowscan_study::areas::AreasStudy;
use rowscan_study::{Shard, Study, Unit};

use super::binary::{Ended, run};

/// The paper's study with coarse scans: it takes a second instead of ten.
pub fn quick_areas(seed: u64) -> AreasStudy {
    let mut scene = load_scene("paper", |_| {}).expect("built in");
    scene.seed = seed;
    let study = AreasStudy::new(scene);
    let coarse =
        |settings: ScanSettings| ScanSettings { dy_m: 0.04, dtheta_deg: 1.0, pitch_m: 0.04, ..settings };
    AreasStudy { lateral: coarse(study.lateral.clone()), zenith: coarse(study.zenith.clone()), ..study }
}

pub fn whole<S: Study>(study: &S) -> Vec<Unit<S::Result>> {
    rowscan_study::run(study, Shard::WHOLE, Vec::new(), &Archive::none(), &|_| Ok(())).expect("it runs")
}

/// Four quick orchards.
pub const SMALL: [&str; 16] = [
    "study",
    "areas",
    "--iterations",
    "7,8",
    "--shady",
    "60,101",
    "--trees",
    "1",
    "--dy",
    "0.05",
    "--pitch",
    "0.05",
    "--dtheta",
    "1",
    "--format",
    "json",
];

pub fn small(more: &[&str]) -> Ended {
    run(&[&SMALL, more].concat())
}
