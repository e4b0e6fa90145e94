//! The tests of the crate in one binary, one module a subject.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

mod about;
mod behind;
mod chunk_heads;
mod crash;
mod damage;
#[cfg(feature = "files")]
mod ros2;
