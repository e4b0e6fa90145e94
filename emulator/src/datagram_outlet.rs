//! Where recorded Compact telegrams go: to the place that a client has directed them to, as those of a scanner do.

use std::sync::Arc;

use rowscan_protocol::compact::Telegram;
use rowscan_protocol::device::Stream;
use rowscan_protocol::time::SimTime;

use crate::datagram_source::{DatagramSource, Outgoing};
use crate::replay::PlaybackEvent;
use crate::shared::Shared;

/// A replayed scanner's datagrams.
#[derive(Debug)]
pub(crate) struct DatagramOutlet {
    shared: Arc<Shared>,
    source: DatagramSource,
}

impl DatagramOutlet {
    pub(crate) fn new(shared: &Arc<Shared>) -> Self {
        Self { shared: Arc::clone(shared), source: DatagramSource::new(Arc::clone(shared)) }
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
        // Bytes that are no telegram have no place to go to.
        let Ok(telegram) = Telegram::decode(&bytes) else { return false };
        let stream = match &telegram {
            Telegram::Scan(_) => Stream::Scan,
            Telegram::Imu(_) => Stream::Imu,
            Telegram::Encoder(_) => Stream::Encoder,
        };
        let directed = self.shared.device().destination(stream).ok();
        let Some(to) = directed.filter(|to| self.shared.datagrams.admits(*to)) else { return false };
        let turn = telegram.turn();
        self.source.pass(due, Outgoing { stream, to, turn, bytes: bytes.to_vec() }).await;
        self.source.release(due).await;
        true
    }
}
