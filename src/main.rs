//! rowscan.
fn main() {}
