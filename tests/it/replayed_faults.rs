//! A recording played through faults that hold its scans back: all of them leave, or those that do not are counted. On a frozen clock.

use crate::common;

use std::sync::Arc;
use std::time::Duration;

use common::replayed::{played, replay_through, subscribed, ticking};
use rowscan_emulator::EmulatorConfig;
use rowscan_emulator::clock::{SimClock, TimeScale};
use rowscan_faults::{Clock, FaultControl, Language, Medium, read};
use tokio::io::AsyncReadExt;
use tokio::time::timeout;

/// Scans a second apart in the recording.
const SCANS: u64 = 300;

/// Scans that came to the client, and those that were counted as sent and as dropped, by a fault of these keys.
async fn through(fault: &str, scale: TimeScale) -> [u64; 3] {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("x.mcap");
    ticking(&path, SCANS);
    let clock = Arc::new(SimClock::start(scale));
    let (control, _events) = FaultControl::new(1, Arc::clone(&clock) as Arc<dyn Clock>, None);
    let faults = control.stream("scanner", Medium::Tcp, Language::Cola);
    control.add_all(read(&format!("[[fault]]\n{fault}")).expect("sound")).expect("fits");
    let config = EmulatorConfig { faults: Some(faults), ..EmulatorConfig::default() };
    let mut replayed = replay_through(&path, Some("lms111"), clock, played(), config);
    let driven = control.clone();
    let driving = tokio::spawn(async move { driven.drive().await });
    let client = subscribed(&mut replayed).await;
    let reading = tokio::spawn(async move {
        let (mut client, mut chunk, mut scans) = (client, vec![0; 64 * 1024], 0);
        while let Ok(Ok(read @ 1..)) = timeout(Duration::from_secs(3600), client.read(&mut chunk)).await {
            scans += chunk[..read].iter().filter(|byte| **byte == 3).count() as u64;
        }
        scans
    });
    replayed.player.ended().await;
    let counts = replayed.emulator.counts();
    control.reset();
    drop(replayed);
    driving.abort();
    let came = reading.await.expect("it reads");
    [came, counts.scans_sent, counts.scans_dropped]
}

/// Faults that hold back and let go. They begin with a scan: the subscription is answered.
#[tokio::test(start_paused = true)]
async fn what_a_fault_delays_comes_before_a_replay_ends() {
    for fault in [
        "name = \"delay\"\nms = 50000\nat = { scan = 2 }\n",
        "name = \"delay\"\nms = 2500\nat = { scan = 2 }\n",
        "name = \"delay\"\nms = 2500\n",
        "name = \"stall\"\nfor = { s = 20 }\n",
        "name = \"jitter\"\nmean_ms = 4000\nsd_ms = 3000\nat = { scan = 2 }\n",
        "name = \"bandwidth\"\nbytes_s = 150\nat = { scan = 2 }\n",
        "name = \"stall\"\nat = { scan = 20 }\nfor = { s = 281 }\n",
        "name = \"reorder\"\nby = 5\nat = { scan = 298 }\n",
        "name = \"dribble\"\nbytes = 3\ngap_us = 100000\nat = { scan = 298 }\nfor = { scans = 2 }\n",
        "name = \"coalesce\"\ntelegrams = 9\nat = { scan = 296 }\n",
    ] {
        for scale in [TimeScale::Max, TimeScale::Paced(1.0)] {
            let [came, sent, dropped] = through(fault, scale).await;
            assert_eq!((came, sent, dropped), (SCANS, SCANS, 0), "{fault} at {scale:?}");
        }
    }
}

#[tokio::test(start_paused = true)]
async fn what_a_fault_never_lets_go_is_counted_as_dropped() {
    for fault in
        ["name = \"stall\"\nat = { scan = 20 }\n", "name = \"bandwidth\"\nbytes_s = 1\nat = { scan = 20 }\n"]
    {
        let [came, sent, dropped] = through(fault, TimeScale::Paced(1.0)).await;
        assert_eq!(came, sent, "{fault}");
        assert_eq!(sent + dropped, SCANS, "{fault}: {sent} sent, {dropped} dropped");
        assert!(dropped > 250, "{fault}: {dropped} dropped");
    }
    let [came, sent, dropped] = through("name = \"stall\"\nat = { scan = 20 }\n", TimeScale::Max).await;
    assert_eq!((came, sent + dropped), (sent, SCANS));
    assert!((19..=20).contains(&sent), "{sent} sent");
}
