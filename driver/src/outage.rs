//! A lost link being restored: how long it has been lost, and how long to wait before the next attempt.

use std::time::Duration;

use crate::clock::{self, Stopwatch};
use crate::config::Backoff;
use crate::error::DriverError;
use crate::link_event::{LinkEvent, LinkEvents};

/// Follows a link's outages.
#[derive(Debug)]
pub(crate) struct Outages {
    backoff: Backoff,
    watch: Stopwatch,
    outage: Option<Outage>,
}

#[derive(Clone, Copy, Debug)]
struct Outage {
    since: Duration,
    attempt: u32,
}

impl Outages {
    pub(crate) fn new(backoff: Backoff, watch: Stopwatch) -> Self {
        Self { backoff, watch, outage: None }
    }

    /// Waits before the next attempt.
    pub(crate) async fn pause(&mut self) {
        if let Some(outage) = &mut self.outage {
            clock::pause(self.backoff.pause(outage.attempt)).await;
            outage.attempt = outage.attempt.saturating_add(1);
        }
    }

    /// The link works.
    pub(crate) fn over(&mut self) {
        self.outage = None;
    }

    /// Notes that the link to `place` is down; an error once it has been down for too long.
    pub(crate) fn lose(
        &mut self,
        place: &str,
        cause: DriverError,
        events: &mut LinkEvents,
    ) -> Result<(), DriverError> {
        let now = self.watch.now();
        let outage = *self.outage.get_or_insert(Outage { since: now, attempt: 0 });
        let after = now.saturating_sub(outage.since);
        if self.backoff.give_up_after.is_some_and(|limit| after >= limit) {
            return Err(DriverError::GaveUp { address: place.to_owned(), after, last: Box::new(cause) });
        }
        events.push(LinkEvent::Lost { cause, pause: self.backoff.pause(outage.attempt) });
        Ok(())
    }
}
