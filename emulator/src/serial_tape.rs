//! The way of recorded telegrams to a replayed LMS2xx: a short queue before its line, and whether anybody wants them.

use std::future::pending;

use bytes::Bytes;
use tokio::sync::{mpsc, watch};

use super::world::World;
use crate::clock::TimeScale;
use crate::replay::TapeEvent;
use rowscan_ports::in_flight::{Backlog, UnderWay};

/// Recorded telegrams that may wait for the line.
const QUEUE: usize = 16;

/// The player's end.
#[derive(Clone, Debug)]
pub(crate) struct SerialTape {
    telegrams: mpsc::Sender<Telegram>,
    backlog: Backlog,
    /// Somebody wants values.
    wanted: watch::Receiver<bool>,
    patient: bool,
}

/// A recorded telegram on its way to the client.
#[derive(Debug)]
pub(crate) struct Telegram {
    pub(crate) bytes: Bytes,
    /// Kept until it has left the line, or is not wanted any more.
    pub(crate) slip: UnderWay,
}

/// Where an LMS2xx has its values from.
#[derive(Debug)]
pub(crate) enum Eye {
    World(Box<World>),
    Tape(mpsc::Receiver<Telegram>, watch::Sender<bool>),
}

/// Both ends.
pub(crate) fn tape(scale: TimeScale) -> (SerialTape, Eye) {
    let (telegrams, queue) = mpsc::channel(QUEUE);
    let (tell, wanted) = watch::channel(false);
    let tape =
        SerialTape { telegrams, backlog: Backlog::default(), wanted, patient: scale == TimeScale::Max };
    (tape, Eye::Tape(queue, tell))
}

impl SerialTape {
    /// Waits until somebody wants values. A line that is gone has no taker: what else is played goes on.
    pub(crate) async fn taker(&self) {
        let _ = self.wanted.clone().wait_for(|wanted| *wanted).await;
    }

    /// Hands a telegram over; false if it goes unheard because the client has stopped the scanner. A line that is slower than the recorded
    /// one loses some; at `--time-scale max` the tape waits for it.
    pub(crate) async fn put(&self, event: &TapeEvent) -> bool {
        if !*self.wanted.borrow() {
            return false;
        }
        let telegram = Telegram { bytes: event.bytes(), slip: self.backlog.enter() };
        match self.patient {
            true => self.telegrams.send(telegram).await.is_ok(),
            false => self.telegrams.try_send(telegram).is_ok(),
        }
    }

    /// Waits until everything handed over has left the line.
    pub(crate) async fn drain(&self) {
        self.backlog.clear().await;
    }
}

impl Eye {
    /// The next recorded telegram; never, without a tape. Cancel safe.
    pub(crate) async fn next_telegram(&mut self) -> Telegram {
        if let Self::Tape(telegrams, _) = self
            && let Some(telegram) = telegrams.recv().await
        {
            return telegram;
        }
        pending().await
    }

    /// Tells the player whether anybody wants values.
    pub(crate) fn tell(&self, wanted: bool) {
        if let Self::Tape(_, told) = self {
            told.send_if_modified(|told| std::mem::replace(told, wanted) != wanted);
        }
    }
}
