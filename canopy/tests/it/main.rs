//! The tests of the crate in one binary, one module a subject.

#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a test fails by panicking")]

mod arbitrary_scans;
mod calibration;
mod class;
mod clumping;
mod common;
mod contact_frequency;
mod estimators;
mod footprint;
mod ground;
mod impacted_area;
mod leaning;
mod planting;
mod profile;
mod row_axis;
mod rows_law;
mod share;
mod validity;
mod window;
mod wood;
