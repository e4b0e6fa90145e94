//! What happens to a link beside its scans.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use rowscan_protocol::frame::Dialect;
use rowscan_protocol::lms2xx::Rate;
use rowscan_protocol::telegram::SopasError;
use tokio::sync::Notify;

use crate::error::DriverError;

/// Something the user may want to be told; taken from [`Scanner::link_events`](crate::Scanner::link_events).
#[derive(Debug)]
pub enum LinkEvent {
    /// The device is configured and streams.
    Ready {
        /// Its own identification.
        ident: String,
        /// Its firmware version.
        firmware: String,
        /// The dialect spoken.
        dialect: Dialect,
    },
    /// An LMS2xx is configured and streams.
    SerialReady {
        /// Name and variant.
        ident: String,
        /// Software version.
        software: String,
        /// The line's rate.
        rate: Rate,
    },
    /// An LMS2xx refused an optional step; it goes on with its own setting.
    Declined {
        /// What it was asked to do.
        what: &'static str,
    },
    /// The device refused an optional setting; it goes on with its own.
    Refused {
        /// The command.
        command: &'static str,
        /// The device's reason.
        code: SopasError,
    },
    /// A scan telegram that passed the checksum and made no sense.
    Malformed {
        /// Why.
        reason: String,
    },
    /// The link was lost and will be dialled again after `pause`.
    Lost {
        /// What happened.
        cause: DriverError,
        /// The pause before the next attempt.
        pause: Duration,
    },
}

/// Link events kept for a user who does not take them.
const EVENTS_KEPT: usize = 64;

/// The newest link events, oldest first. Clones share them, so that one can be told of them while another waits for a scan.
#[derive(Clone, Debug, Default)]
pub struct LinkEvents(Arc<Kept>);

#[derive(Debug, Default)]
struct Kept {
    events: Mutex<VecDeque<LinkEvent>>,
    more: Notify,
}

impl LinkEvents {
    pub(crate) fn push(&self, event: LinkEvent) {
        let mut events = self.lock();
        if events.len() == EVENTS_KEPT {
            events.pop_front();
        }
        events.push_back(event);
        self.0.more.notify_one();
    }

    /// The oldest event not yet taken, if there is one.
    pub fn take(&self) -> Option<LinkEvent> {
        self.lock().pop_front()
    }

    /// The oldest event not yet taken, once there is one. Cancel safe.
    pub async fn next(&self) -> LinkEvent {
        loop {
            if let Some(event) = self.take() {
                return event;
            }
            self.0.more.notified().await;
        }
    }

    fn lock(&self) -> MutexGuard<'_, VecDeque<LinkEvent>> {
        self.0.events.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
