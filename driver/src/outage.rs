//! A lost link being restored: how long it has been lost, and how long to wait before the next attempt.

use std::time::Duration;

use crate::clock::Stopwatch;
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
    /// When the next attempt is due, once it is waited for.
    until: Option<Duration>,
}

impl Outages {
    pub(crate) fn new(backoff: Backoff, watch: Stopwatch) -> Self {
        Self { backoff, watch, outage: None }
    }

    /// Waits before the next attempt. Cancel safe: whoever is called off and waits again waits for the rest.
    pub(crate) async fn pause(&mut self) {
        if let Some(outage) = &mut self.outage {
            let now = self.watch.now();
            let until = *outage.until.get_or_insert(now + self.backoff.pause(outage.attempt));
            self.watch.until(Some(until)).await;
            outage.until = None;
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
        events: &LinkEvents,
    ) -> Result<(), DriverError> {
        let now = self.watch.now();
        let outage = *self.outage.get_or_insert(Outage { since: now, attempt: 0, until: None });
        let after = now.saturating_sub(outage.since);
        if self.backoff.give_up_after.is_some_and(|limit| after >= limit) {
            return Err(DriverError::GaveUp { address: place.to_owned(), after, last: Box::new(cause) });
        }
        events.push(LinkEvent::Lost { cause, pause: self.backoff.pause(outage.attempt) });
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A select loop that hears something else every hundred milliseconds calls the wait off each time.
    #[tokio::test(start_paused = true)]
    async fn a_pause_that_is_called_off_again_and_again_still_ends() {
        let backoff = Backoff::default();
        let first = backoff.pause(0);
        let mut outages = Outages::new(backoff, Stopwatch::start());
        outages.outage = Some(Outage { since: Duration::ZERO, attempt: 0, until: None });
        let step = first / 4;
        let mut called_off = 0;
        while tokio::time::timeout(step, outages.pause()).await.is_err() {
            called_off += 1;
            assert!(called_off < 10, "it begins anew each time");
        }
        assert!(called_off >= 2, "{called_off}");
    }
}
