//! Links to a device in memory, under virtual time: lost, restored, given up, with the future dropped at every await.

use std::future::{pending, poll_fn};
use std::pin::pin;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use rowscan_protocol::client::{ColaClient, ColaConfig};
use rowscan_protocol::frame::{Dialect, FrameCounts};
use rowscan_protocol::host::{DeviceInfo, Refusal};
use rowscan_protocol::lms2xx::Rate;
use tokio::io::DuplexStream;
use tokio::time::{sleep, timeout};

use super::*;
use crate::config::Backoff;
use crate::error::JunkBytes;
use crate::fake_device::{Behaviour, serve};
use crate::scanner::Scanner;

/// What an attempt to connect meets.
#[derive(Clone, Copy, Debug)]
enum Peer {
    /// A device that answers.
    Serves,
    /// Nobody: the attempt fails after a moment.
    Refuses,
    /// An address from which nothing ever comes back.
    Unreachable,
    /// Someone who accepts and says nothing.
    Silent,
}

/// A device in memory; how its peers behave is listed by connection, the last one for all that follow.
#[derive(Clone)]
struct FakeEndpoint {
    peers: &'static [Peer],
    scans: usize,
    opened: Arc<AtomicUsize>,
    cola: ColaConfig,
    reply_delay: Duration,
}

impl FakeEndpoint {
    fn new(peers: &'static [Peer], scans: usize) -> Self {
        let reply_delay = Duration::from_millis(40);
        Self { peers, scans, opened: Arc::default(), cola: ColaConfig::default(), reply_delay }
    }
}

impl Endpoint for FakeEndpoint {
    type Stream = DuplexStream;
    type Session = ColaClient;

    fn address(&self) -> &str {
        "fake:2112"
    }

    fn open(&self) -> Opening<DuplexStream> {
        let attempt = self.opened.fetch_add(1, Ordering::Relaxed);
        let peer = self.peers[attempt.min(self.peers.len() - 1)];
        let reply_delay = self.reply_delay;
        let behaviour = Behaviour { reply_delay, scan_period: Duration::from_millis(10), scans: self.scans };
        Box::pin(async move {
            sleep(Duration::from_millis(30)).await;
            let (here, there) = tokio::io::duplex(16 * 1024);
            match peer {
                Peer::Serves => drop(tokio::spawn(serve(there, behaviour))),
                Peer::Refuses => return Err(io::ErrorKind::ConnectionRefused.into()),
                Peer::Unreachable => pending().await,
                Peer::Silent => drop(tokio::spawn(async move {
                    let _there = there;
                    pending::<()>().await;
                })),
            }
            Ok(here)
        })
    }

    fn set_rate(_: &mut DuplexStream, _: Rate) -> io::Result<()> {
        Ok(())
    }

    fn session(&self) -> ColaClient {
        ColaClient::new(self.cola.clone(), Dialect::A)
    }

    fn ready(&mut self, _: &DeviceInfo) {}

    fn no_answer(&mut self, _: &'static str, _: FrameCounts) -> Result<(), DriverError> {
        let (address, timeout) = (self.address().to_owned(), Duration::from_secs(2));
        Err(DriverError::NoDialect { address, timeout, junk: JunkBytes(0) })
    }

    fn failed(&mut self) {}

    fn cannot_open(&self, cause: io::Error) -> DriverError {
        DriverError::Connect { address: self.address().to_owned(), cause }
    }

    fn refused(&self, command: &'static str, _: Option<Refusal>) -> DriverError {
        DriverError::Declined { place: self.address().to_owned(), what: command }
    }
}

fn config() -> DriverConfig {
    let backoff = Backoff { give_up_after: Some(Duration::from_secs(20)), ..Backoff::default() };
    DriverConfig { backoff, ..DriverConfig::default() }
}

async fn open(endpoint: FakeEndpoint) -> Scanner {
    Scanner::open_endpoint(endpoint, config()).await.expect("the first connection serves")
}

/// Polls `future` until it is ready, at most `polls` times, and drops it then.
async fn polled<F: Future>(future: F, polls: usize) -> Option<F::Output> {
    let mut future = pin!(future);
    let mut left = polls;
    poll_fn(|cx| {
        left -= 1;
        match future.as_mut().poll(cx) {
            Poll::Ready(output) => Poll::Ready(Some(output)),
            Poll::Pending if left == 0 => Poll::Ready(None),
            Poll::Pending => Poll::Pending,
        }
    })
    .await
}

#[tokio::test(start_paused = true)]
async fn a_future_dropped_after_any_number_of_polls_loses_nothing() {
    const SCANS: usize = 6;
    for polls in 1..=40 {
        let endpoint = FakeEndpoint::new(&[Peer::Serves, Peer::Refuses, Peer::Serves], SCANS);
        let mut scanner = open(endpoint.clone()).await;
        let mut counters = Vec::new();
        let followed = timeout(Duration::from_secs(30), async {
            while counters.len() < 2 * SCANS {
                match polled(scanner.next(), polls).await {
                    Some(record) => {
                        counters.push(record.expect("restored").expect("a scan").scan.telegram_counter);
                    }
                    // Something else keeps the caller for a moment.
                    None => sleep(Duration::from_millis(1)).await,
                }
            }
        });
        let outcome = followed.await;
        assert!(outcome.is_ok(), "dropped after {polls} polls: {counters:?}");
        assert_eq!(counters, [0, 1, 2, 3, 4, 5, 0, 1, 2, 3, 4, 5], "dropped after {polls} polls");
        assert_eq!(endpoint.opened.load(Ordering::Relaxed), 3, "dropped after {polls} polls");
    }
}

/// A `select!` loop whose tick is shorter than a start-up, a pause or an attempt to connect.
async fn ticked(scanner: &mut Scanner) -> Result<u16, DriverError> {
    loop {
        if let Ok(record) = timeout(Duration::from_millis(200), scanner.next()).await {
            return record.map(|record| record.expect("a live stream does not end").scan.telegram_counter);
        }
    }
}

#[tokio::test(start_paused = true)]
async fn ticks_shorter_than_a_start_up_do_not_keep_a_link_from_being_restored() {
    let endpoint = FakeEndpoint::new(&[Peer::Serves], 3);
    let mut scanner = open(endpoint.clone()).await;
    let mut counters = Vec::new();
    for _ in 0..9 {
        counters.push(ticked(&mut scanner).await.expect("restored"));
    }
    assert_eq!(counters, [0, 1, 2, 0, 1, 2, 0, 1, 2]);
    assert_eq!((scanner.counts().connections, endpoint.opened.load(Ordering::Relaxed)), (3, 3));
    // Two losses, each with a pause of 100 ms, a connection of 30 ms and a start-up of 8 replies.
    assert!(scanner.now().0 < Duration::from_secs(3), "{:?}", scanner.now());
}

#[tokio::test(start_paused = true)]
async fn a_lost_link_is_given_up_although_every_tick_drops_the_future() {
    for (peers, said) in [
        (&[Peer::Serves, Peer::Refuses] as &'static [Peer], "cannot connect"),
        (&[Peer::Serves, Peer::Unreachable], "no connection within 3s"),
        (&[Peer::Serves, Peer::Silent], "does not answer"),
    ] {
        let mut scanner = open(FakeEndpoint::new(peers, 1)).await;
        assert_eq!(ticked(&mut scanner).await.expect("a scan"), 0);
        let began = scanner.now().0;
        let error = ticked(&mut scanner).await.expect_err("nobody answers");
        let DriverError::GaveUp { after, last, .. } = &error else { panic!("{error}") };
        assert!(*after >= Duration::from_secs(20) && *after < Duration::from_secs(30), "{after:?}");
        assert!(scanner.now().0 - began < Duration::from_secs(31), "{:?}", scanner.now());
        assert!(last.to_string().contains(said), "{last}");
    }
}

#[tokio::test(start_paused = true)]
async fn a_device_on_a_host_that_is_busy_is_waited_for_where_its_time_is_ours() {
    // Every reply of the start-up takes as long as ten time-outs.
    let open = |config: DriverConfig| {
        let slow =
            FakeEndpoint { reply_delay: Duration::from_secs(20), ..FakeEndpoint::new(&[Peer::Serves], 3) };
        Scanner::open_endpoint(FakeEndpoint { cola: config.cola.clone(), ..slow }, config)
    };
    let error = open(config()).await.expect_err("2 s are over");
    assert!(matches!(error, DriverError::NoDialect { .. }), "{error}");
    let mut scanner = open(config().patient()).await.expect("it is waited for");
    let record = scanner.next().await.expect("a link").expect("a scan");
    assert_eq!((record.scan.telegram_counter, scanner.counts().connections), (0, 1));
}
