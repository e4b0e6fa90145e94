//! The tests of the crate in one binary, one module a subject.

mod closing;
mod search;
