//! `seed`: a whole number of 0 or more.

use pyo3::prelude::*;

use crate::failure::Refusal;

/// A seed as Python gives it.
#[derive(Clone, Copy)]
pub(crate) struct Seed(pub(crate) u64);

impl<'py> FromPyObject<'_, 'py> for Seed {
    type Error = PyErr;

    fn extract(given: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        given.extract::<u64>().map(Self).map_err(|_| {
            let most = u64::MAX;
            let found = given.repr().map_or_else(|_| "something else".to_owned(), |text| text.to_string());
            Refusal::Usage(format!("seed: expected a whole number of 0 to {most}, found {found}")).into()
        })
    }
}
