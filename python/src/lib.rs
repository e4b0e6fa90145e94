//! The Python package `rowscan`: virtual scanners, orchards with their truth, scans as NumPy arrays, recordings, estimates, scenarios.
//!
//! Nothing is measured here: every number comes from the crates that the command line uses, by the same calls. Long calls release the
//! interpreter's lock and can be interrupted (`wait`). Arrays take over the memory they were made in (`arrays`).

mod arrays;
mod check;
mod document;
mod estimate;
mod failure;
mod one_or_more;
mod orchard;
mod picture;
mod readings;
mod row_scan;
mod scanner;
mod scans;
mod seed;
mod study;
mod wait;
mod warning;

use pyo3::prelude::*;
use pyo3::wrap_pyfunction;

#[pymodule]
fn _native(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add("Error", module.py().get_type::<failure::Error>())?;
    module.add_class::<orchard::Orchard>()?;
    module.add_class::<orchard::Leaves>()?;
    module.add_class::<scans::ScanArrays>()?;
    module.add_class::<row_scan::RowScan>()?;
    module.add_class::<scanner::Scanner>()?;
    module.add_function(wrap_pyfunction!(scans::drive, module)?)?;
    module.add_function(wrap_pyfunction!(row_scan::scan_row, module)?)?;
    module.add_function(wrap_pyfunction!(scans::read, module)?)?;
    module.add_function(wrap_pyfunction!(estimate::estimate, module)?)?;
    module.add_function(wrap_pyfunction!(study::study, module)?)?;
    module.add_function(wrap_pyfunction!(check::check, module)?)?;
    // What pickles name.
    module.add_function(wrap_pyfunction!(orchard::_orchard, module)?)?;
    module.add_function(wrap_pyfunction!(scans::_scans, module)?)?;
    Ok(())
}
