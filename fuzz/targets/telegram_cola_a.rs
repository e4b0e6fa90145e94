//! Any payload of CoLa A.
#![no_main]

mod telegram;

use libfuzzer_sys::fuzz_target;
use rowscan_protocol::frame::Dialect;

fuzz_target!(|payload: &[u8]| telegram::read(Dialect::A, payload));
