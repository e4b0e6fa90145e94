//! A scan with beams and lines so fine that finer ones change nothing, unquantised, the tractor standing in each line.

use rowscan_canopy::{Estimate, Pipeline, PipelineError};
use rowscan_emulator::stage::Stage;
use rowscan_protocol::angle::BeamGrid;
use rowscan_protocol::rig::{Mount, Rig};
use rowscan_protocol::scan::{Echo, NO_ECHO, Scan};
use rowscan_scenes::caster::Class;
use rowscan_scenes::{BeamFan, Return, Scratch};

/// Steps: lines, metres, and beams, 1/10000°.
const STEPS: (f64, u16) = (0.01, 1000);

/// The row that the first scanner of a stage sees, from the side where it stands, as a pipeline sees it that `make` makes for the rig of such a scan.
pub(crate) fn fine_scan(
    stage: &Stage,
    mount: &Mount,
    make: impl FnOnce(&Rig) -> Result<Pipeline, PipelineError>,
) -> Result<Estimate, PipelineError> {
    let (dy_m, step) = STEPS;
    let frequency_hz = 100.0;
    let rig = Rig { speed_m_s: dy_m * frequency_hz, ..stage.rig.clone() };
    let mut pipeline = make(&rig)?;
    let grid = BeamGrid::spanning(0, 1_800_000, step);
    let fan = BeamFan::of_mount(mount, grid, stage.row_seen(0).towards_x);
    let mut returns = vec![Return::MISS; grid.len()];
    let (mut scratch, mut scan) = (Scratch::default(), Scan::default());
    scan.beams = grid;
    scan.scan_frequency_hz = frequency_hz;
    scan.echoes = vec![Echo { range_m: vec![NO_ECHO; grid.len()], remission: Vec::new() }];
    let lines = (stage.orchard.length_m() / dy_m).round() as u32;
    for line in 0..lines {
        let y_m = rig.y_m(f64::from(line) / frequency_hz);
        stage.caster().cast(stage.pose(0, mount, y_m), &fan, &mut scratch, &mut returns);
        scan.telegram_counter = line as u16;
        scan.scan_time_us = line.wrapping_mul(10_000);
        for (range_m, found) in scan.echoes.iter_mut().flat_map(|echo| &mut echo.range_m).zip(&returns) {
            *range_m = if found.class == Class::None { NO_ECHO } else { found.range_m };
        }
        pipeline.push(&scan);
    }
    Ok(pipeline.finish())
}
