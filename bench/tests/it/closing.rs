//! A bench that is closed is still: a recording that ends after it holds all that was sent.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use rowscan_bench::{Bench, BenchSpec, BusSpec};
use rowscan_emulator::StartWhen;
use rowscan_emulator::clock::TimeScale;
use rowscan_emulator::stage::Stage;
use rowscan_recording::{Tap, Taps};
use rowscan_scenes::files::load_scene;

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn nothing_is_sent_after_a_bench_is_closed() -> Result<(), Box<dyn std::error::Error>> {
    let stage = Stage::grow(load_scene("spindle", |_| {})?, &|_, _| {})?;
    let recorded = Arc::new(AtomicU64::new(0));
    let counter = Arc::clone(&recorded);
    // A tap that takes its time: frames that are due have gathered before it has taken the first.
    let taps = Taps::new(move |_, _| {
        let counter = Arc::clone(&counter);
        Tap::new(move |_, _| {
            std::thread::sleep(Duration::from_millis(2));
            counter.fetch_add(1, Ordering::SeqCst);
        })
    });
    let mut spec = BenchSpec::new(&stage, TimeScale::Paced(1000.0));
    spec.time.start = Some(StartWhen::Now);
    let folder = tempfile::tempdir()?;
    let log = format!("candump:{}", folder.path().join("bus.log").display());
    let bus = BusSpec::new("can0", [log.parse()?]);
    spec.buses.push(BusSpec { taps, ..bus });
    let mut bench = Bench::open(spec).await?;
    bench.run();
    while recorded.load(Ordering::SeqCst) < 20 {
        tokio::time::sleep(Duration::from_millis(1)).await;
    }
    bench.close().await;
    let at_the_close = recorded.load(Ordering::SeqCst);
    tokio::time::sleep(Duration::from_millis(200)).await;
    assert_eq!(recorded.load(Ordering::SeqCst), at_the_close);
    Ok(())
}
