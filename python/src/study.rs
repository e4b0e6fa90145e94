//! `study`: a study of docs/studies.md, run here.

use std::path::PathBuf;

use pyo3::prelude::*;
use rowscan_study::archive::Archive;
use rowscan_study::sweep::{self, SweepReport};
use rowscan_study::{Header, Shard, figure, run};

use crate::seed::Seed;
use crate::{document, wait, warning};

/// The report of `rowscan study run FILE --format json`, and its figure as SVG.
#[pyfunction]
#[pyo3(signature = (path, *, seed = None, repeats = None))]
pub(crate) fn study(
    py: Python<'_>,
    path: PathBuf,
    seed: Option<Seed>,
    repeats: Option<usize>,
) -> PyResult<(Py<PyAny>, String)> {
    let read = warning::of_file(py, |tell| sweep::read(&path, seed.map(|seed| seed.0), repeats, tell))?;
    let report: SweepReport = wait::for_work(py, "run the study", move || {
        let units = run(&read, Shard::WHOLE, Vec::new(), &Archive::none(), &|_| Ok(()))?;
        Ok(sweep::report(Header::of(&read), &units))
    })?;
    Ok((document::of(py, &report)?, figure::sweep(&report)))
}
