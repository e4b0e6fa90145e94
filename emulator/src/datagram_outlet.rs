//! Where recorded Compact telegrams go: to the place that a client has directed them to, as those of a scanner do.

use std::sync::Arc;
use std::sync::atomic::Ordering;

use rowscan_protocol::compact::Telegram;
use rowscan_protocol::device::Stream;
use rowscan_protocol::time::SimTime;

use crate::datagram_source::DatagramSource;
use crate::replay::PlaybackEvent;
use crate::shared::Shared;

/// A replayed scanner's datagrams.
#[derive(Debug)]
pub(crate) struct DatagramOutlet {
    shared: Arc<Shared>,
    source: DatagramSource,
    /// The number of the last turn that something was sent of.
    turn: Option<u64>,
}

impl DatagramOutlet {
    pub(crate) fn new(shared: &Arc<Shared>) -> Self {
        Self { shared: Arc::clone(shared), source: DatagramSource::new(Arc::clone(shared)), turn: None }
    }

    /// Waits until scans go somewhere.
    pub(crate) async fn taker(&self) {
        self.until(true).await;
    }

    /// Waits until a client has ended the stream.
    pub(crate) async fn left(&self) {
        self.until(false).await;
    }

    async fn until(&self, streams: bool) {
        loop {
            let interest = self.shared.interest.notified();
            if self.shared.datagrams.is_streaming(&self.shared.device()) == streams {
                return;
            }
            interest.await;
        }
    }

    /// Sends a telegram as it was recorded; false where its stream is off, or may not go where it is directed to.
    pub(crate) async fn put(&mut self, event: &PlaybackEvent, due: SimTime) -> bool {
        let bytes = event.bytes();
        let (stream, turn) = match Telegram::decode(&bytes) {
            Ok(Telegram::Scan(scan)) => {
                (Stream::Scan, scan.modules.0.first().map(|module| module.frame_number))
            }
            Ok(Telegram::Imu(_)) => (Stream::Imu, None),
            Ok(Telegram::Encoder(_)) => (Stream::Encoder, None),
            // Bytes that are no telegram have no place to go to.
            Err(_) => return false,
        };
        let directed = self.shared.device().destination(stream).ok();
        let Some(to) = directed.filter(|to| self.shared.datagrams.admits(*to)) else { return false };
        self.source.pass(due, (stream, to), bytes.to_vec()).await;
        self.source.release(due).await;
        if turn.is_some() && turn != self.turn {
            self.turn = turn;
            self.shared.counts.sent.fetch_add(1, Ordering::Relaxed);
        }
        true
    }
}
