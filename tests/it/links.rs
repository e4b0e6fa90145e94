//! Links of the driver to emulated scanners: many at once, lost and restored, given up.

use crate::common;

use std::time::Duration;

use common::bench;
use rowscan_driver::{Backoff, DriverConfig, DriverError, LinkEvent, Scanner, Source};
use rowscan_emulator::clock::TimeScale;
use rowscan_emulator::{Emulator, EmulatorConfig};
use rowscan_protocol::client::ColaConfig;
use rowscan_protocol::model::ScanMode;

fn emulator() -> Emulator {
    let (device, world) = bench("lms111");
    Emulator::start(device, world, EmulatorConfig { time_scale: TimeScale::Max, ..EmulatorConfig::default() })
}

fn quick() -> DriverConfig {
    DriverConfig {
        backoff: Backoff {
            first: Duration::from_millis(20),
            longest: Duration::from_millis(100),
            give_up_after: Some(Duration::from_secs(20)),
        },
        ..DriverConfig::default()
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn eight_scanners_in_one_process_lose_nothing() {
    let mut followed = tokio::task::JoinSet::new();
    for _ in 0..8 {
        followed.spawn(async {
            let mut emulator = emulator();
            let address = emulator.listen("127.0.0.1:0").await.expect("a free port").address.to_string();
            let mut scanner = Scanner::open(&Source::Tcp { address }, quick()).await.expect("it answers");
            let mut last = None;
            for _ in 0..300 {
                let scan = scanner.next().await.expect("the link holds").expect("a scan").scan;
                if let Some(last) = last.replace(scan.telegram_counter) {
                    assert_eq!(scan.telegram_counter, u16::wrapping_add(last, 1));
                }
            }
            scanner.stop(Duration::from_secs(5)).await
        });
    }
    let mut scanners = 0;
    while let Some(counts) = followed.join_next().await {
        let counts = counts.expect("no panic");
        assert_eq!((counts.connections, counts.telegrams_bad), (1, 0));
        scanners += 1;
    }
    assert_eq!(scanners, 8);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_lost_scanner_is_dialled_again_and_configured_anew() {
    let mut first = emulator();
    let address = first.listen("127.0.0.1:0").await.expect("a free port").address.to_string();
    // Not the mode the device boots with: only a driver that configures anew gets 1081 points after the loss.
    let client = ColaConfig {
        scan_mode: Some(ScanMode { frequency_centihz: 2500, step: 2500 }),
        ..ColaConfig::default()
    };
    let config = DriverConfig { cola: client, ..quick() };
    let mut scanner =
        Scanner::open(&Source::Tcp { address: address.clone() }, config).await.expect("it answers");
    for _ in 0..10 {
        assert_eq!(scanner.next().await.expect("held").expect("a scan").scan.beams.count, 1081);
    }
    drop(first);

    let restored = tokio::spawn(async move {
        // The old sockets need a moment to leave the port.
        tokio::time::sleep(Duration::from_millis(200)).await;
        let mut second = emulator();
        second.listen(&address).await.expect("the port is free again");
        second
    });
    let (mut lost, events) = (Vec::new(), scanner.link_events());
    while scanner.counts().connections < 2 {
        // Scans that were on their way when the link broke still come.
        assert_eq!(scanner.next().await.expect("restored").expect("a scan").scan.beams.count, 1081);
        while let Some(event) = events.take() {
            if let LinkEvent::Lost { cause, .. } = event {
                lost.push(cause.to_string());
            }
        }
    }
    let _second = restored.await.expect("no panic");
    assert!(!lost.is_empty(), "the loss was told");
    for _ in 0..10 {
        assert_eq!(scanner.next().await.expect("held").expect("a scan").scan.beams.count, 1081);
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_scanner_that_stays_away_is_given_up() {
    let mut emulator = emulator();
    let address = emulator.listen("127.0.0.1:0").await.expect("a free port").address.to_string();
    let patience = Duration::from_millis(300);
    let backoff = Backoff { give_up_after: Some(patience), ..quick().backoff };
    let config = DriverConfig { backoff, ..quick() };
    let mut scanner =
        Scanner::open(&Source::Tcp { address: address.clone() }, config).await.expect("it answers");
    drop(emulator);
    let events = scanner.link_events();
    let told = tokio::spawn(async move {
        loop {
            if let LinkEvent::Lost { cause, .. } = events.next().await {
                break cause.to_string();
            }
        }
    });
    let error = loop {
        // While no scan comes the loss is told already.
        match scanner.next().await {
            Ok(Some(_)) => {}
            Ok(None) => panic!("a live stream does not end"),
            Err(error) => break error,
        }
    };
    assert!(told.is_finished(), "the loss is told before the end");
    let DriverError::GaveUp { address: named, after, .. } = &error else { panic!("{error}") };
    assert_eq!(*named, address);
    assert!(*after >= patience);
    assert!(error.to_string().contains("the last attempt said: cannot connect"), "{error}");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_driver_that_waits_finds_the_scanner_when_it_comes() {
    let free = std::net::TcpListener::bind("127.0.0.1:0").expect("a free port").local_addr().expect("bound");
    let address = free.to_string();
    let waiting = {
        let address = address.clone();
        tokio::spawn(async move {
            let config = DriverConfig { wait: true, ..quick() };
            let mut scanner = Scanner::open(&Source::Tcp { address }, config).await.expect("it waits");
            scanner.next().await.expect("it came").map(|record| record.scan.beams.count)
        })
    };
    tokio::time::sleep(Duration::from_millis(200)).await;
    let mut late = emulator();
    late.listen(&address).await.expect("the port is free");
    assert_eq!(waiting.await.expect("no panic"), Some(541));
}

#[test]
fn an_emulator_that_is_dropped_in_full_flight_ends() {
    // On a runtime of its own: a mirror that never rests would keep the runtime from ending, and this test with it.
    let (ended, end) = std::sync::mpsc::channel();
    std::thread::spawn(move || {
        for _ in 0..20 {
            let runtime = tokio::runtime::Builder::new_multi_thread()
                .worker_threads(2)
                .enable_all()
                .build()
                .expect("a runtime");
            runtime.block_on(async {
                let mut emulator = emulator();
                let address = emulator.listen("127.0.0.1:0").await.expect("a free port").address.to_string();
                let mut scanner = Scanner::open(&Source::Tcp { address }, quick()).await.expect("it answers");
                for _ in 0..50 {
                    scanner.next().await.expect("the link holds").expect("a scan");
                }
                drop(emulator);
            });
        }
        ended.send(()).expect("someone waits");
    });
    end.recv_timeout(Duration::from_secs(60)).expect("every emulator ended with its runtime");
}
