//! What is told of faults.

use serde::Serialize;
use tokio::sync::mpsc;

/// Which way bytes go.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Direction {
    /// From the device to its client.
    ToClient,
    /// From the client to the device.
    ToDevice,
}

impl Direction {
    /// Both.
    pub const BOTH: [Self; 2] = [Self::ToClient, Self::ToDevice];

    pub(crate) fn index(self) -> usize {
        match self {
            Self::ToClient => 0,
            Self::ToDevice => 1,
        }
    }
}

/// What a fault did.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum What {
    /// It began.
    Begin,
    /// It acted on one telegram or connection; a fault that loses several in a row acts on each.
    Act,
    /// It could not act on one telegram; the reason says why.
    Skipped,
    /// It ended: its time or count is over.
    End,
    /// It was ended by a reset, a removal or the end of the program.
    Healed,
}

/// One line of the log of faults. What is not known is left out.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FaultEvent {
    /// What happened.
    pub what: What,
    /// The fault's id.
    pub id: String,
    /// The fault's name in the table.
    pub name: &'static str,
    /// The stream.
    pub on: String,
    /// When, seconds on the faults' clock.
    pub at_s: f64,
    /// Where the tractor was along the row, metres.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub row_m: Option<f64>,
    /// Which connection of the stream, from 1; absent where it is no single one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub connection: Option<u64>,
    /// Which way the bytes went.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub direction: Option<Direction>,
    /// Place in that connection and direction, before faults: of the telegram's first byte, or bytes passed so far.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub offset: Option<u64>,
    /// Number of the scan telegram on its connection, from 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scan: Option<u64>,
    /// At the end: telegrams, pieces or connections acted on.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub acts: Option<u64>,
    /// Why it could not act.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
}

/// Events that wait for a host that does not take them; more are counted and lost.
pub(crate) const QUEUE: usize = 4096;

/// The events of a [`FaultControl`](crate::FaultControl), in their order.
#[derive(Debug)]
pub struct FaultEvents(pub(crate) mpsc::Receiver<FaultEvent>);

impl FaultEvents {
    /// The next event; none once the control and its streams are gone. Cancel safe.
    pub async fn next(&mut self) -> Option<FaultEvent> {
        self.0.recv().await
    }

    /// The next event, if there is one already.
    pub fn take(&mut self) -> Option<FaultEvent> {
        self.0.try_recv().ok()
    }
}
