//! What a [`Show`](crate::Show) shows, live in Foxglove and Lichtblick: scans, points, frames of reference, positions, and the estimate by metre to
//! plot. Foxglove's own library serves its WebSocket protocol; the messages are those of recordings, as JSON
//! ([`rowscan_recording::foxglove`]).
//!
//! A client that is too slow loses the oldest messages. Messages that nobody has subscribed to are not made.

mod frames;
mod server;
mod topics;

pub use server::{FoxgloveError, FoxgloveServer};
