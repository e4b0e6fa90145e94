//! What commands do to the device, by theme.

mod access;
pub(super) mod compact;
mod filters;
mod fixed;
mod identity;
mod lines;
mod scan_data;
pub(super) mod scanning;
