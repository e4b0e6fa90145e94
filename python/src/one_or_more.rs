//! An argument that is one thing or a list of them.

use pyo3::prelude::*;

/// One of something, or several.
#[derive(FromPyObject)]
pub(crate) enum OneOrMore<T> {
    /// One.
    One(T),
    /// A list of them.
    More(Vec<T>),
}

impl<T> OneOrMore<T> {
    /// All of them.
    pub(crate) fn all(self) -> Vec<T> {
        match self {
            Self::One(one) => vec![one],
            Self::More(more) => more,
        }
    }
}
