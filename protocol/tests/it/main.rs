//! The crate's tests in one binary, one module a subject.
#![cfg(feature = "telegrams")]
#![allow(
    missing_docs,
    unreachable_pub,
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stderr,
    reason = "a test fails by panicking and says what it skips"
)]

mod bench;
mod datagrams;
mod facts;

mod compact;
mod compact_frames;
mod conditions;
mod contradicting;
mod device;
mod examples;
mod frames;
mod hidden;
mod last_tells;
mod leftovers;
mod listening;
mod lms1000;
mod lms2xx;
mod lms2xx_host;
mod lms2xx_line;
mod lms2xx_listing;
mod lms2xx_parts;
mod lms2xx_start_ups;
mod mrs1000;
mod multiscan;
mod mutated_frames;
mod pair;
mod picoscan;
mod properties;
mod published_telegrams;
mod readings;
mod recorded_start_ups;
mod recorded_telegrams;
mod recorded_times;
mod refusals;
mod restarts;
mod scan_faults;
mod senders;
mod settings;
mod tells;
