//! Matrix L: the paper's output, and a text beside it that says what it is.

use std::fmt::Write;

use rowscan_scenes::scan::{ScanKind, ScanPlan};

use crate::export::npy;
use rowscan_emulator::stage::Stage;

/// What stands for a beam that met nothing, metres: far beyond anything it could meet.
const ESCAPE_M: f64 = 1000.0;

/// What a matrix is, in words: its files hold numbers alone.
pub(super) fn about(plan: &ScanPlan, stage: &Stage) -> String {
    let settings = plan.settings();
    let beams = plan.beams().len();
    let (unit, step) =
        if settings.kind.is_angular() { ("deg", settings.dtheta_deg) } else { ("m", settings.pitch_m) };
    let origin = plan.origin(0);
    let mut text = String::new();
    // Writing to a string does not fail.
    let _ = write!(
        text,
        "rowscan {} matrix L: ranges in metres, a row a beam, a column a line\n\
         type: {}\ntemplate: {}\naxis_x_m: {}\nbeams: {beams}\nlines: {}\ndy_m: {}\ny_first_m: {}\nstep_{unit}: {step}\n\
         first_{unit}: {}\nD_m: {}\nz0_m: {}\nsampling: {}\nescape_m: {ESCAPE_M}\nscene: {}\nseed: {}\n",
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

/// What a beam is told by in the first column: its angle, or where it starts.
fn swept(plan: &ScanPlan) -> &'static str {
    match plan.settings().kind {
        kind if kind.is_angular() => "theta_deg",
        ScanKind::Zenith | ScanKind::ZenithOrthogonal => "x_m",
        _ => "z_m",
    }
}

/// A header, then N rows of beams and M columns of lines: the first column says which beam, the header where along the row each line is (Y, metres).
/// `columns` holds the ranges of each line, infinite for an escape.
pub(super) fn csv(plan: &ScanPlan, columns: &[&[f64]]) -> Vec<u8> {
    let mut text = swept(plan).to_owned();
    for line in 0..columns.len() {
        let y_m = (plan.origin(line).y_m * 1e9).round() / 1e9;
        let _ = write!(text, ",{y_m}");
    }
    text.push('\n');
    for beam in 0..plan.beams().len() {
        let _ = write!(text, "{}", (plan.swept(beam) * 1e9).round() / 1e9);
        for range_m in row(columns, beam) {
            let _ = write!(text, ",{range_m}");
        }
        text.push('\n');
    }
    text.into_bytes()
}

/// The same matrix as 32-bit floats in NumPy's format, version 1.0: what `numpy.load` reads. Metres to about 0.2 µm at 3 m.
pub(super) fn npy(plan: &ScanPlan, columns: &[&[f64]]) -> Vec<u8> {
    let (beams, lines) = (plan.beams().len(), columns.len());
    let mut bytes = npy::head("'<f4'", &format!("({beams}, {lines})"));
    for beam in 0..beams {
        bytes.extend(row(columns, beam).flat_map(|range_m| (range_m as f32).to_le_bytes()));
    }
    bytes
}
