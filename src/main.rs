//! The `rowscan` command.

use std::process::ExitCode;

use clap::Parser;
use rowscan::cli::{Cli, report};

fn main() -> ExitCode {
    report(rowscan::cli::run(Cli::parse()))
}
