//! The shady index beside the same question asked by rays.

use crate::measure::Report;

/// Runs it.
pub fn run(_report: &mut Report, _arguments: &[String]) {}
