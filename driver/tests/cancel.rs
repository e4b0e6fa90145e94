//! `Scanner::next` in a `select!` loop, over real sockets.
#![cfg(feature = "tcp")]

mod fake_device;

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use fake_device::{Behaviour, serve};
use rowscan_driver::{DriverConfig, Scanner, Source};
use rowscan_protocol::frame::Dialect;
use tokio::net::TcpListener;
use tokio::time::{interval, timeout};

/// The start-up takes about nine replies of 40 ms: longer than the ticks that drop the future.
const BEHAVIOUR: Behaviour =
    Behaviour { reply_delay: Duration::from_millis(40), scan_period: Duration::from_millis(10), scans: 5 };

#[tokio::test]
async fn a_lost_link_is_restored_although_every_tick_drops_the_future() {
    let listener = TcpListener::bind("127.0.0.1:0").await.expect("a free port");
    let address = listener.local_addr().expect("bound").to_string();
    let accepted = Arc::new(AtomicUsize::new(0));
    let counted = Arc::clone(&accepted);
    tokio::spawn(async move {
        while let Ok((stream, _)) = listener.accept().await {
            counted.fetch_add(1, Ordering::Relaxed);
            tokio::spawn(serve(stream, BEHAVIOUR));
        }
    });
    let config = DriverConfig { prefer: Dialect::A, ..DriverConfig::default() };
    let mut scanner = Scanner::open(&Source::Tcp { address }, config).await.expect("it answers");
    let mut ticks = interval(Duration::from_millis(200));
    let mut scans = 0;
    let followed = timeout(Duration::from_secs(10), async {
        while scans < 8 {
            tokio::select! {
                record = scanner.next() => {
                    record.expect("the link is restored").expect("a live stream does not end");
                    scans += 1;
                }
                _ = ticks.tick() => {}
            }
        }
    });
    let outcome = followed.await;
    assert!(outcome.is_ok(), "{scans} scans over {} connections", accepted.load(Ordering::Relaxed));
    assert_eq!((scanner.counts().connections, accepted.load(Ordering::Relaxed)), (2, 2));
}
