//! What the user should know and need not act on: Python's `warnings`.

use std::ffi::CString;
use std::fmt::Display;

use pyo3::exceptions::PyUserWarning;
use pyo3::prelude::*;
use rowscan_scenes::files::Warning;

use crate::failure::Failure;

/// Warns. An error where the user has asked for warnings to be errors.
pub(crate) fn warn(py: Python<'_>, what: impl Display) -> PyResult<()> {
    PyErr::warn(py, &py.get_type::<PyUserWarning>(), &CString::new(what.to_string())?, 1)
}

/// What `load` reads; warns of what it tells.
pub(crate) fn of_file<T, E: Into<Failure>>(
    py: Python<'_>,
    load: impl FnOnce(&mut dyn FnMut(Warning)) -> Result<T, E>,
) -> PyResult<T> {
    let mut told = Vec::new();
    let loaded = load(&mut |warning| told.push(warning)).map_err(Into::into)?;
    told.iter().try_for_each(|warning| warn(py, warning))?;
    Ok(loaded)
}
