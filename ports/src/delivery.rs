//! What happens to data that somebody is too slow to take.

use tokio::sync::mpsc;
use tokio::sync::mpsc::error::TrySendError;

/// The policy towards a slow taker, one for a whole run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Delivery {
    /// Time does not wait: what does not fit the taker's queue is lost, and counted.
    #[default]
    Paced,
    /// Time waits: nothing is lost.
    Patient,
}

/// How a delivery ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Delivered {
    /// The item is in the taker's queue.
    Taken,
    /// The taker was behind and has lost it.
    Lost,
    /// The taker is gone.
    Gone,
}

impl Delivery {
    /// Puts `item` into a taker's queue. Cancel safe: an item that is not in the queue yet is dropped.
    pub async fn put<T>(self, queue: &mpsc::Sender<T>, item: T) -> Delivered {
        let full = match queue.try_send(item) {
            Ok(()) => return Delivered::Taken,
            Err(TrySendError::Closed(_)) => return Delivered::Gone,
            Err(TrySendError::Full(item)) => item,
        };
        match self {
            Self::Paced => Delivered::Lost,
            Self::Patient => match queue.send(full).await {
                Ok(()) => Delivered::Taken,
                Err(_) => Delivered::Gone,
            },
        }
    }

    /// Whether nothing is lost.
    pub fn is_patient(self) -> bool {
        self == Self::Patient
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn a_full_queue_loses_when_paced_and_waits_when_patient() {
        let (queue, mut items) = mpsc::channel(1);
        assert_eq!(Delivery::Paced.put(&queue, 1).await, Delivered::Taken);
        assert_eq!(Delivery::Paced.put(&queue, 2).await, Delivered::Lost);
        let (delivered, first) = tokio::join!(Delivery::Patient.put(&queue, 3), items.recv());
        assert_eq!((delivered, first), (Delivered::Taken, Some(1)));
        assert_eq!(items.recv().await, Some(3));
        drop(items);
        assert_eq!(Delivery::Patient.put(&queue, 4).await, Delivered::Gone);
    }
}
