//! The tests of the crate in one binary, one module a subject.

#![allow(clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

mod closed_forms;
mod controller;
mod interception;
mod machine_faults;
mod rate_steps;
mod run_ends;
mod seasons;
mod slopes;
