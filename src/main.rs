//! The `rowscan` command.

use std::process::ExitCode;

fn main() -> ExitCode {
    rowscan::cli::report(rowscan::cli::run(std::env::args_os()))
}
