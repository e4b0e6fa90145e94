//! `check`: scenarios, as `rowscan check` tries them.

use std::collections::BTreeSet;
use std::path::PathBuf;

use pyo3::prelude::*;
use rowscan_check::{Options, Tried, Verdict, report, worst};
use serde::Serialize;
use tokio::sync::watch;

use crate::one_or_more::OneOrMore;
use crate::seed::Seed;
use crate::{document, wait, warning};

/// A scenario with one seed: its verdict, what the command line writes of it, and everything behind.
#[derive(Serialize)]
struct VerdictDocument<'a> {
    verdict: Verdict,
    text: String,
    #[serde(flatten)]
    tried: &'a Tried,
}

/// Tries scenarios, each with its seeds.
#[pyfunction]
#[pyo3(signature = (scenarios, *, seed = None, fail_fast = false, keep = None, program = None))]
pub(crate) fn check(
    py: Python<'_>,
    scenarios: OneOrMore<PathBuf>,
    seed: Option<Seed>,
    fail_fast: bool,
    keep: Option<PathBuf>,
    program: Option<PathBuf>,
) -> PyResult<Py<PyAny>> {
    let paths = scenarios.all();
    let seed = seed.map(|seed| seed.0);
    let options = Options { seed, fail_fast, keep, program, ..Options::default() };
    let (cancel, cancelled) = watch::channel(false);
    let tried = wait::for_work(py, "run the scenarios", move || {
        Ok(rowscan_check::check(&paths, &options, cancelled, &mut |_| {})?)
    });
    // Interrupted: what is being tried ends, its children with it.
    let tried = tried.inspect_err(|_| {
        let _ = cancel.send(true);
    })?;
    let warnings: BTreeSet<&str> = tried.iter().flat_map(Tried::warnings).collect();
    warnings.into_iter().try_for_each(|what| warning::warn(py, what))?;
    let told = tried.iter().map(|tried| VerdictDocument {
        verdict: worst([tried]),
        text: report::text(tried),
        tried,
    });
    document::of(py, &told.collect::<Vec<_>>())
}
