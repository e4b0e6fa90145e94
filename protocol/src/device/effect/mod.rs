//! What commands do to the device, by theme.

mod access;
mod identity;
mod lines;
mod scan_data;
mod scanning;
