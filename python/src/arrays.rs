//! Vectors handed over to NumPy: an array owns the memory that its numbers were written to, and nothing is copied.

use numpy::{Element, PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;

/// An array of one dimension.
pub(crate) fn line<T: Element>(py: Python<'_>, values: Vec<T>) -> Py<PyArray1<T>> {
    PyArray1::from_vec(py, values).unbind()
}

/// An array of rows with `columns` values each, row by row in memory.
pub(crate) fn rows<T: Element>(py: Python<'_>, values: Vec<T>, columns: usize) -> PyResult<Py<PyArray2<T>>> {
    let rows = values.len().checked_div(columns).unwrap_or(0);
    PyArray1::from_vec(py, values).reshape([rows, columns]).map(Bound::unbind)
}

/// An array of points: a row each with x, y and z.
pub(crate) fn points(py: Python<'_>, points: Vec<[f64; 3]>) -> PyResult<Py<PyArray2<f64>>> {
    rows(py, points.into_flattened(), 3)
}
