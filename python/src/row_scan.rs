//! `scan_row`: the paper's scans of one row.

use std::sync::Arc;

use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};
use rowscan_emulator::stage::Stage;
use rowscan_scenes::caster::Return;
use rowscan_scenes::scan::{Sampling, ScanKind, ScanPoint, ScanSettings};
use rowscan_study::row_scan::{self, Scanned};

use crate::failure::{Failure, Refusal};
use crate::orchard::SceneOf;
use crate::{arrays, document, wait};

/// One of the paper's scans of a row.
#[pyclass(frozen, get_all, module = "rowscan")]
pub(crate) struct RowScan {
    /// What `rowscan scan --format json` writes of it: areas I_L, I_T, I_3L, hits by class, the layout.
    areas: Py<PyAny>,
    /// Matrix L: ranges in metres, (lines, beams) float64; NaN where a beam escapes.
    ranges_m: Py<PyArray2<f64>>,
    /// What is swept at each beam: degrees of an angular scan, metres of an orthogonal one; (beams,) float64.
    swept: Py<PyArray1<f64>>,
    /// Where each line is along the row: metres, (lines,) float64.
    y_m: Py<PyArray1<f64>>,
    /// Every return with its truth, a column an array; None unless asked for.
    points: Option<Py<PyDict>>,
}

#[pymethods]
impl RowScan {
    #[new]
    fn new(
        areas: Py<PyAny>,
        ranges_m: Py<PyArray2<f64>>,
        swept: Py<PyArray1<f64>>,
        y_m: Py<PyArray1<f64>>,
        points: Option<Py<PyDict>>,
    ) -> Self {
        Self { areas, ranges_m, swept, y_m, points }
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        let none = py.None();
        let points = self.points.as_ref().map_or(none.bind(py), |points| points.bind(py).as_any());
        let parts = [
            self.areas.bind(py),
            self.ranges_m.bind(py).as_any(),
            self.swept.bind(py).as_any(),
            self.y_m.bind(py).as_any(),
            points,
        ];
        Ok((py.get_type::<Self>().into_any(), PyTuple::new(py, parts)?))
    }
}

/// The same before Python has it.
struct Found {
    scanned: Scanned,
    ranges_m: Vec<f64>,
    swept: Vec<f64>,
    y_m: Vec<f64>,
    points: Option<Vec<ScanPoint>>,
}

/// Scans a row in one of the paper's six ways, offline.
#[pyfunction]
#[pyo3(signature = (
    orchard, kind = "lateral", *, row = 0, dy_m = None, dtheta_deg = None, pitch_m = None, sampling = None, distance_m = None, height_m = None,
    overhead_m = None, range = None, points = false
))]
#[expect(clippy::too_many_arguments, reason = "keywords of a Python function")]
pub(crate) fn scan_row(
    py: Python<'_>,
    orchard: SceneOf,
    kind: &str,
    row: usize,
    dy_m: Option<f64>,
    dtheta_deg: Option<f64>,
    pitch_m: Option<f64>,
    sampling: Option<&str>,
    distance_m: Option<f64>,
    height_m: Option<f64>,
    overhead_m: Option<f64>,
    range: Option<(f64, f64)>,
    points: bool,
) -> PyResult<RowScan> {
    let kind = kind_named(kind)?;
    let sampling = sampling.map(sampling_named).transpose()?;
    let stage = orchard.stage(py, None, None)?;
    let base = row_scan::settings(&stage.scene, kind);
    let settings = ScanSettings {
        dy_m: dy_m.unwrap_or(base.dy_m),
        dtheta_deg: dtheta_deg.unwrap_or(base.dtheta_deg),
        pitch_m: pitch_m.unwrap_or(base.pitch_m),
        sampling: sampling.unwrap_or(base.sampling),
        distance_m: distance_m.unwrap_or(base.distance_m),
        height_m: height_m.unwrap_or(base.height_m),
        overhead_m: overhead_m.or(base.overhead_m),
        range,
        ..base
    };
    let found = wait::for_work(py, "scan the row", move || found(&stage, row, &settings, points))?;
    let columns = found.swept.len();
    Ok(RowScan {
        areas: document::of(py, &found.scanned)?,
        ranges_m: arrays::rows(py, found.ranges_m, columns)?,
        swept: arrays::line(py, found.swept),
        y_m: arrays::line(py, found.y_m),
        points: found.points.map(|points| table(py, &points)).transpose()?,
    })
}

fn found(stage: &Arc<Stage>, row: usize, settings: &ScanSettings, points: bool) -> Result<Found, Failure> {
    let scan = row_scan::RowScan::new(stage, row, settings)?;
    let plan = scan.plan();
    let (scanned, lines) = scan.lines(|line| {
        let or_nan = |met: &Return| if met.range_m.is_finite() { met.range_m } else { f64::NAN };
        let ranges: Vec<f64> = line.layers.nearest().iter().map(or_nan).collect();
        (ranges, points.then(|| ScanPoint::of_line(plan, line)))
    });
    let swept: Vec<f64> = (0..plan.beams().len()).map(|beam| plan.swept(beam)).collect();
    let mut ranges_m = Vec::with_capacity(lines.len() * swept.len());
    let mut all = points.then(Vec::new);
    for (ranges, of_line) in lines {
        ranges_m.extend(ranges);
        if let (Some(all), Some(of_line)) = (&mut all, of_line) {
            all.extend(of_line);
        }
    }
    let y_m = (0..plan.len()).map(|line| plan.origin(line).y_m).collect();
    Ok(Found { scanned, ranges_m, swept, y_m, points: all })
}

fn kind_named(name: &str) -> Result<ScanKind, Refusal> {
    let unknown =
        || Refusal::Usage(format!("kind: expected one of {}, found `{name}`", ScanKind::NAMES.join(", ")));
    ScanKind::from_name(name).ok_or_else(unknown)
}

fn sampling_named(name: &str) -> Result<Sampling, Refusal> {
    let unknown =
        || Refusal::Usage(format!("sampling: expected {}, found `{name}`", Sampling::NAMES.join(" or ")));
    let known = Sampling::ALL.iter().zip(Sampling::NAMES).find(|(_, known)| **known == name);
    known.map(|(sampling, _)| *sampling).ok_or_else(unknown)
}

/// Points by column.
fn table(py: Python<'_>, points: &[ScanPoint]) -> PyResult<Py<PyDict>> {
    let label =
        |number: u32| if number == Return::NO_LABEL { -1 } else { i32::try_from(number).unwrap_or(i32::MAX) };
    let columns = PyDict::new(py);
    columns.set_item("points_m", arrays::points(py, points.iter().map(|point| point.at_m).collect())?)?;
    columns.set_item("class", arrays::line(py, points.iter().map(ScanPoint::class_number).collect()))?;
    columns.set_item("tree", arrays::line(py, points.iter().map(|point| label(point.tree)).collect()))?;
    columns.set_item("organ", arrays::line(py, points.iter().map(|point| label(point.organ)).collect()))?;
    columns.set_item("order", arrays::line(py, points.iter().map(|point| point.order).collect()))?;
    columns.set_item("range_m", arrays::line(py, points.iter().map(|point| point.range_m).collect()))?;
    columns.set_item("beam", arrays::line(py, points.iter().map(|point| point.beam).collect()))?;
    columns.set_item("line", arrays::line(py, points.iter().map(|point| point.line).collect()))?;
    let cosines = points.iter().map(|point| point.cos_incidence).collect();
    columns.set_item("cos_incidence", arrays::line(py, cosines))?;
    Ok(columns.unbind())
}
