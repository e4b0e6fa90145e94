//! Faults on in-memory streams, in virtual time.
#![allow(clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]
#![allow(unreachable_pub, reason = "the modules share what they test with")]

mod client;
mod connections;
mod control;
mod files;
mod script;
mod table;
