//! The crate's tests in one binary, one module a subject.
#![allow(
    missing_docs,
    unreachable_pub,
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stderr,
    reason = "a test fails by panicking and says what it skips"
)]

mod analytic;
mod caster_oracle;
mod cells;
mod closed_forms;
mod cones;
mod exchange;
mod ground;
mod growth;
mod headlands;
mod optics;
mod scans;
mod scene_files;
mod seen;
mod standing;
mod target;
mod trained;
mod truth;
