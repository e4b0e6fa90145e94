//! The way of recorded telegrams to a replayed LMS2xx: a short queue before its line, and how it stands with that.

use std::future::pending;

use bytes::Bytes;
use tokio::sync::{mpsc, watch};

use super::world::World;
use crate::clock::{self, TimeScale};
use crate::replay::TapeEvent;

/// Recorded telegrams that may wait for the line.
const QUEUE: usize = 16;

/// The player's end.
#[derive(Clone, Debug)]
pub(super) struct SerialTape {
    telegrams: mpsc::Sender<Bytes>,
    line: watch::Receiver<LineState>,
    patient: bool,
}

/// How it stands with the line.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct LineState {
    /// Somebody wants values.
    pub(super) wanted: bool,
    /// Something is on its way to the client.
    pub(super) busy: bool,
}

/// Where an LMS2xx has its values from.
#[derive(Debug)]
pub(super) enum Eye {
    World(Box<World>),
    Tape(mpsc::Receiver<Bytes>, watch::Sender<LineState>),
}

/// Both ends.
pub(super) fn tape(scale: TimeScale) -> (SerialTape, Eye) {
    let (telegrams, queue) = mpsc::channel(QUEUE);
    let (state, line) = watch::channel(LineState::default());
    (SerialTape { telegrams, line, patient: scale == TimeScale::Max }, Eye::Tape(queue, state))
}

impl SerialTape {
    /// Waits until somebody wants values. A line that is gone has no taker: what else is played goes on.
    pub(super) async fn taker(&self) {
        let _ = self.line.clone().wait_for(|line| line.wanted).await;
    }

    /// Hands a telegram over; false if it goes unheard because the client has stopped the scanner. A line that is slower than the recorded
    /// one loses some; at `--time-scale max` the tape waits for it.
    pub(super) async fn put(&self, event: &TapeEvent) -> bool {
        if !self.line.borrow().wanted {
            return false;
        }
        match self.patient {
            true => self.telegrams.send(event.bytes()).await.is_ok(),
            false => self.telegrams.try_send(event.bytes()).is_ok(),
        }
    }

    /// Waits until everything handed over has left the line.
    pub(super) async fn drain(&self) {
        let waits = || self.telegrams.capacity() < self.telegrams.max_capacity();
        while !self.telegrams.is_closed() && (waits() || self.line.borrow().busy) {
            clock::breathe().await;
        }
    }
}

impl Eye {
    /// The next recorded telegram; never, without a tape. Cancel safe.
    pub(super) async fn next_telegram(&mut self) -> Bytes {
        if let Self::Tape(telegrams, _) = self
            && let Some(telegram) = telegrams.recv().await
        {
            return telegram;
        }
        pending().await
    }

    /// Tells the player how it stands.
    pub(super) fn tell(&self, now: LineState) {
        if let Self::Tape(_, state) = self {
            state.send_if_modified(|told| std::mem::replace(told, now) != now);
        }
    }
}
