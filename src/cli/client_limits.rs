//! How many clients a scanner serves at once.

use std::time::Duration;

use rowscan_emulator::{IDLE_LIMIT, MAX_CLIENTS};

/// Flags for the limits.
#[derive(Clone, Copy, Debug, clap::Args)]
pub(super) struct ClientLimitArgs {
    /// Clients served at once by each scanner
    #[arg(long, value_name = "N", default_value_t = MAX_CLIENTS, value_parser = clients)]
    max_clients: usize,
    /// With all places taken, a client through which nothing has passed for so many seconds makes room for the next; one that waits for
    /// scans does not
    #[arg(long, value_name = "SECONDS", default_value_t = IDLE_LIMIT.as_secs_f64(), value_parser = seconds)]
    idle_limit: f64,
}

fn clients(text: &str) -> Result<usize, String> {
    let number = text.parse().ok().filter(|number| (1..=1000).contains(number));
    number.ok_or_else(|| format!("expected 1 to 1000 clients, found `{text}`"))
}

fn seconds(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|number| (0.0..=1e6).contains(number));
    number.ok_or_else(|| format!("expected 0 to 1000000 seconds, found `{text}`"))
}

impl ClientLimitArgs {
    /// Clients served at once, and after how long an idle one makes room.
    pub(super) fn limits(self) -> (usize, Duration) {
        (self.max_clients, Duration::from_secs_f64(self.idle_limit))
    }
}
