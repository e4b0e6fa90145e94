//! Matrix L as text: the paper's output, with a header that says what it is.

use std::fmt::Write;

use rowscan_scenes::scan::ScanPlan;

use crate::stage::Stage;

/// What stands for a beam that met nothing, metres: far beyond anything it could meet.
const ESCAPE_M: f64 = 1000.0;

/// N rows of beams and M columns of lines; `columns` holds the ranges of each line, infinite for an escape.
pub(super) fn csv(plan: &ScanPlan, stage: &Stage, columns: &[&[f64]]) -> Vec<u8> {
    let settings = plan.settings();
    let beams = plan.beams().len();
    let (unit, step) =
        if settings.kind.is_angular() { ("deg", settings.dtheta_deg) } else { ("m", settings.pitch_m) };
    let origin = plan.origin(0);
    let mut text = String::new();
    // Writing to a string does not fail.
    let _ = write!(
        text,
        "# rowscan {} matrix L: ranges in metres, a row a beam, a column a line\n\
         # type: {}\n# template: {}\n# axis_x_m: {}\n# beams: {beams}\n# lines: {}\n# dy_m: {}\n# y_first_m: {}\n# step_{unit}: {step}\n\
         # first_{unit}: {}\n# D_m: {}\n# z0_m: {}\n# sampling: {}\n# escape_m: {ESCAPE_M}\n# scene: {}\n# seed: {}\n",
        env!("CARGO_PKG_VERSION"),
        settings.kind,
        settings.kind.template(),
        (plan.target().near_axis_x_m + plan.target().far_axis_x_m) / 2.0,
        plan.len(),
        settings.dy_m,
        origin.y_m,
        plan.swept(0),
        settings.distance_m,
        origin.z_m,
        settings.sampling,
        stage.scene.name,
        stage.scene.seed,
    );
    for beam in 0..beams {
        for (line, column) in columns.iter().enumerate() {
            let range_m = column.get(beam).copied().filter(|range| range.is_finite()).unwrap_or(ESCAPE_M);
            let comma = if line == 0 { "" } else { "," };
            let _ = write!(text, "{comma}{range_m}");
        }
        text.push('\n');
    }
    text.into_bytes()
}
