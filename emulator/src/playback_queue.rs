//! The way of recorded telegrams to a replayed LMS2xx: a short queue before its line, and whether anybody wants them.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::task::{Context, Poll};

use bytes::Bytes;
use rowscan_ports::in_flight::{InFlight, Pending};
use rowscan_ports::{Delivered, Delivery};
use tokio::sync::{mpsc, watch};

use crate::replay::PlaybackEvent;
use crate::view::ScannerView;

/// Recorded telegrams that may wait for the line.
const QUEUE: usize = 16;

/// The player's end.
#[derive(Clone, Debug)]
pub(crate) struct PlaybackQueue {
    telegrams: mpsc::Sender<Recorded>,
    in_flight: InFlight,
    /// Somebody wants values.
    wanted: watch::Receiver<bool>,
    delivery: Delivery,
    /// Telegrams that came faster than the line carries them.
    dropped: Arc<AtomicU64>,
    /// Of those that the line has taken: lost behind it.
    lost: Arc<AtomicU64>,
}

/// A recorded telegram on its way to the client.
#[derive(Debug)]
pub(crate) struct Recorded {
    pub(crate) bytes: Bytes,
    /// Kept until it has left the line, or is not wanted any more.
    pub(crate) pending: Pending,
}

/// Where an LMS2xx has its values from.
#[derive(Debug)]
pub(crate) enum Values {
    /// It measures them.
    Seen(Box<ScannerView>),
    /// They come from a recording; the player is told whether anybody wants them.
    Recorded(mpsc::Receiver<Recorded>, watch::Sender<bool>),
}

/// Both ends.
pub(crate) fn queue(delivery: Delivery) -> (PlaybackQueue, Values) {
    let (telegrams, queued) = mpsc::channel(QUEUE);
    let (tell, wanted) = watch::channel(false);
    let in_flight = InFlight::default();
    let (dropped, lost) = (Arc::default(), Arc::default());
    let queue = PlaybackQueue { telegrams, in_flight, wanted, delivery, dropped, lost };
    (queue, Values::Recorded(queued, tell))
}

impl PlaybackQueue {
    /// Waits until somebody wants values. A line that is gone has no taker: what else is played goes on.
    pub(crate) async fn taker(&self) {
        let _ = self.wanted.clone().wait_for(|wanted| *wanted).await;
    }

    /// Hands a telegram over; false if it goes unheard because the client has stopped the scanner. A line that is slower than the recorded
    /// one loses some; at `--time-scale max` the player waits for it.
    pub(crate) async fn put(&self, event: &PlaybackEvent) -> bool {
        if !*self.wanted.borrow() {
            return false;
        }
        let telegram = Recorded { bytes: event.bytes(), pending: self.in_flight.enter() };
        let delivered = self.delivery.put(&self.telegrams, telegram).await;
        if delivered == Delivered::Lost {
            self.dropped.fetch_add(1, Ordering::Relaxed);
        }
        delivered == Delivered::Taken
    }

    /// The same, of which the player waits for the line.
    pub(crate) fn patient(self) -> Self {
        Self { delivery: Delivery::Patient, ..self }
    }

    /// True if nothing is dropped.
    pub(crate) fn is_patient(&self) -> bool {
        self.delivery.is_patient()
    }

    /// Telegrams that came faster than the line carries them, or were lost behind it.
    pub(crate) fn dropped(&self) -> u64 {
        self.dropped.load(Ordering::Relaxed) + self.lost()
    }

    /// Telegrams that the line has taken and no client will have.
    pub(crate) fn lost(&self) -> u64 {
        self.lost.load(Ordering::Relaxed)
    }

    /// So many telegrams that the line has taken are lost behind it.
    pub(crate) fn lose(&self, telegrams: u64) {
        self.lost.fetch_add(telegrams, Ordering::Relaxed);
    }

    /// Telegrams that have not left the line.
    pub(crate) fn pending(&self) -> u64 {
        self.in_flight.pending()
    }

    /// Waits until everything handed over has left the line.
    pub(crate) async fn flushed(&self) {
        self.in_flight.flushed().await;
    }
}

impl Values {
    pub(crate) fn are_recorded(&self) -> bool {
        matches!(self, Self::Recorded(..))
    }

    /// The next recorded telegram; never, where the device measures.
    pub(crate) fn poll_recorded(&mut self, cx: &mut Context<'_>) -> Poll<Option<Recorded>> {
        match self {
            Self::Seen(_) => Poll::Pending,
            Self::Recorded(telegrams, _) => telegrams.poll_recv(cx),
        }
    }

    /// Tells the player whether anybody wants values.
    pub(crate) fn tell(&self, wanted: bool) {
        if let Self::Recorded(_, told) = self {
            told.send_if_modified(|told| std::mem::replace(told, wanted) != wanted);
        }
    }
}
