//! What happens to a link beside its scans.

use std::collections::VecDeque;
use std::time::Duration;

use rowscan_protocol::frame::Dialect;
use rowscan_protocol::lms2xx::Rate;
use rowscan_protocol::telegram::SopasError;

use crate::error::DriverError;

/// Something the user may want to be told; taken by [`Scanner::take_link_event`](crate::Scanner::take_link_event).
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

/// The newest link events, oldest first.
#[derive(Debug, Default)]
pub(crate) struct LinkEvents(VecDeque<LinkEvent>);

impl LinkEvents {
    pub(crate) fn push(&mut self, event: LinkEvent) {
        if self.0.len() == EVENTS_KEPT {
            self.0.pop_front();
        }
        self.0.push_back(event);
    }

    pub(crate) fn take(&mut self) -> Option<LinkEvent> {
        self.0.pop_front()
    }
}
