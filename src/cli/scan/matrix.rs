//! Matrix L: the paper's output, with a head that says what it is.

use std::fmt::Write;

use rowscan_scenes::scan::ScanPlan;

use crate::export::npy;
use rowscan_emulator::stage::Stage;

/// What stands for a beam that met nothing, metres: far beyond anything it could meet.
const ESCAPE_M: f64 = 1000.0;

/// What a matrix is, as lines that begin with `#`.
pub(super) fn head(plan: &ScanPlan, stage: &Stage) -> String {
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
    text
}

/// Beam `beam` of every line: its range in metres, [`ESCAPE_M`] for an escape.
fn row<'a>(columns: &'a [&[f64]], beam: usize) -> impl Iterator<Item = f64> + 'a {
    columns
        .iter()
        .map(move |column| column.get(beam).copied().filter(|range| range.is_finite()).unwrap_or(ESCAPE_M))
}

/// N rows of beams and M columns of lines under the head; `columns` holds the ranges of each line, infinite for an escape.
pub(super) fn csv(plan: &ScanPlan, stage: &Stage, columns: &[&[f64]]) -> Vec<u8> {
    let mut text = head(plan, stage);
    for beam in 0..plan.beams().len() {
        for (line, range_m) in row(columns, beam).enumerate() {
            let comma = if line == 0 { "" } else { "," };
            let _ = write!(text, "{comma}{range_m}");
        }
        text.push('\n');
    }
    text.into_bytes()
}

/// The same matrix as 32-bit floats in NumPy's format, version 1.0: what `numpy.load` reads. Metres to about 0.2 µm at 3 m. The format
/// has no place for the head.
pub(super) fn npy(plan: &ScanPlan, columns: &[&[f64]]) -> Vec<u8> {
    let (beams, lines) = (plan.beams().len(), columns.len());
    let mut bytes = npy::head("'<f4'", &format!("({beams}, {lines})"));
    for beam in 0..beams {
        bytes.extend(row(columns, beam).flat_map(|range_m| (range_m as f32).to_le_bytes()));
    }
    bytes
}
