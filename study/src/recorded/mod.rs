//! A recording of a scene that stands still, and the model's view of the same scene, by the same statistics.

mod edges;
mod replica;
mod statistics;

use rowscan_protocol::model::AnyModel;
use rowscan_protocol::scan::Scan;
use serde::Serialize;

pub use edges::Edge;
pub use statistics::Scatter;

/// Fewest scans that scatter is told of.
pub const MIN_SCANS: usize = 20;

/// The ranges of a scene that stands still: scan by beam, millimetres; NaN where there was no echo.
#[derive(Clone, Debug, Default)]
pub struct Series {
    /// Angles of the beams, degrees.
    pub angles_deg: Vec<f64>,
    /// Scans of first echoes, mm.
    pub scans_mm: Vec<Vec<f64>>,
}

/// Why there is nothing to compare.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SeriesError {
    /// Too few scans.
    #[error(
        "expected at least {MIN_SCANS} scans of one beam grid, found {found}: record a scene that stands still for longer"
    )]
    TooFew {
        /// Scans of the first one's grid.
        found: usize,
    },
    /// No beam measured all the time.
    #[error(
        "expected beams with an echo in every scan, found none: record a scene that stands still, before walls"
    )]
    NothingSteady,
}

/// What was found in one series.
#[derive(Clone, Debug, Serialize)]
pub struct Found {
    /// How ranges scatter.
    pub scatter: Scatter,
    /// Its edges between two surfaces.
    pub edges: Vec<Edge>,
}

/// A device beside our model of it.
#[derive(Clone, Debug, Serialize)]
pub struct SideBySide {
    /// The model.
    pub model: &'static str,
    /// What the device did.
    pub recorded: Found,
    /// What the model does before the same scene.
    pub modelled: Found,
}

impl Series {
    /// The scans of the first one's beam grid.
    pub fn push(&mut self, scan: &Scan) {
        let Some(echo) = scan.echoes.first() else { return };
        if self.scans_mm.is_empty() {
            self.angles_deg = (0..scan.beams.len()).map(|beam| scan.beams.angle_deg(beam)).collect();
        }
        if echo.range_m.len() == self.angles_deg.len() {
            let mm =
                |range_m: &f64| if range_m.is_finite() && *range_m > 0.0 { 1e3 * range_m } else { f64::NAN };
            self.scans_mm.push(echo.range_m.iter().map(mm).collect());
        }
    }

    fn found(&self, model: AnyModel) -> Result<Found, SeriesError> {
        let scatter = statistics::scatter(self).ok_or(SeriesError::NothingSteady)?;
        let edges = edges::edges(self, &model.optics().spot);
        Ok(Found { scatter, edges })
    }

    /// Mean of each beam over the scans, mm; NaN where a scan had no echo.
    fn means_mm(&self) -> Vec<f64> {
        let n = self.scans_mm.len() as f64;
        let of = |beam: usize| self.scans_mm.iter().filter_map(|scan| scan.get(beam)).sum::<f64>() / n;
        (0..self.angles_deg.len()).map(of).collect()
    }
}

/// Compares a recorded series with what `model` sees of the same surfaces.
///
/// # Errors
/// Too few scans, or no beam that measured in all of them.
pub fn compare(series: &Series, model: AnyModel, seed: u64) -> Result<SideBySide, SeriesError> {
    if series.scans_mm.len() < MIN_SCANS {
        return Err(SeriesError::TooFew { found: series.scans_mm.len() });
    }
    let recorded = series.found(model)?;
    let modelled = replica::seen(series, model, seed).found(model)?;
    Ok(SideBySide { model: model.name(), recorded, modelled })
}
