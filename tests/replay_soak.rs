//! Ten hours of replay in simulated time. Alone in its process, whose memory it watches.
#![allow(
    clippy::expect_used,
    clippy::panic,
    clippy::print_stderr,
    reason = "a test fails by panicking and says what it skips"
)]

#[path = "it/common/mod.rs"]
mod common;

use std::time::Duration;

use common::replayed::{next_scan, played, replay, subscribed, ticking};
use rowscan_emulator::clock::TimeScale;
use rowscan_emulator::replay::{Played, Stamps};
use rowscan_recording::Taps;
use tokio::time::Instant;

#[tokio::test(start_paused = true)]
async fn ten_hours_of_loops_neither_drift_nor_grow() {
    let folder = tempfile::tempdir().expect("a folder");
    let x = folder.path().join("x.mcap");
    ticking(&x, 60);
    let resident = || {
        let statm = std::fs::read_to_string("/proc/self/statm").unwrap_or_default();
        statm.split(' ').nth(1).and_then(|pages| pages.parse::<u64>().ok()).unwrap_or_default() * 4096
    };
    let looped = Played { every_ns: Some(60_000_000_000), stamps: Stamps::Now, ..played() };
    let mut replayed = replay(&x, Some("lms111"), TimeScale::Paced(1.0), looped, Taps::default());
    let mut client = subscribed(&mut replayed).await;
    let began = Instant::now();
    let mut after_an_hour = 0;
    for second in 0..36_000_u32 {
        let (counter, _) = next_scan(&mut client).await;
        assert_eq!(u32::from(counter), second & 0xFFFF, "counters run on over the loops");
        let late = began.elapsed().checked_sub(Duration::from_secs(second.into())).expect("never early");
        assert!(late <= Duration::from_millis(2), "{late:?} late after {second} s");
        if second == 3600 {
            after_an_hour = resident();
        }
    }
    let grown = resident().saturating_sub(after_an_hour);
    assert!(grown < 4 << 20, "{grown} bytes more after ten hours than after one");
}
