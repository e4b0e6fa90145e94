//! rowscan.
