//! How the driver behaves.

use std::time::Duration;

use rowscan_protocol::client::ColaConfig;
use rowscan_protocol::frame::Dialect;
use rowscan_protocol::lms2xx::client::Lms2xxConfig;
use rowscan_recording::Tap;

/// How a scanner is opened and kept.
#[derive(Clone, Debug)]
pub struct DriverConfig {
    /// How a CoLa scanner is set up.
    pub cola: ColaConfig,
    /// How an LMS2xx is set up; the rate is the source's.
    pub lms2xx: Lms2xxConfig,
    /// The dialect tried first; the other one is tried, over a new connection, if the device stays silent.
    pub prefer: Dialect,
    /// How long one attempt to connect may take.
    pub connect_timeout: Duration,
    /// A link that delivers nothing for this long counts as lost.
    pub stall_timeout: Duration,
    /// The same until a connection's first scan: a real LMS1xx may need more than 30 s to settle after its scan mode was set.
    pub first_scan_timeout: Duration,
    /// A scanner that sends datagrams has accepted its settings: so long the first one may take.
    pub first_datagram_timeout: Duration,
    /// Keep trying when the first connection fails, instead of failing fast.
    pub wait: bool,
    /// Pauses between attempts.
    pub backoff: Backoff,
    /// Gets a copy of all bytes, both ways, over all connections; does nothing unless something records.
    pub tap: Tap,
}

impl Default for DriverConfig {
    fn default() -> Self {
        Self {
            cola: ColaConfig::default(),
            lms2xx: Lms2xxConfig::default(),
            prefer: Dialect::B,
            connect_timeout: Duration::from_secs(3),
            stall_timeout: Duration::from_secs(5),
            first_scan_timeout: Duration::from_secs(60),
            first_datagram_timeout: Duration::from_secs(10),
            wait: false,
            backoff: Backoff::default(),
            tap: Tap::default(),
        }
    }
}

/// How long is waited for a device whose time is ours.
const PATIENCE: Duration = Duration::from_secs(3600);

impl DriverConfig {
    /// The same for a virtual scanner of this process: it is there and answers when the host lets it, however long that takes, so silence is no loss.
    /// An LMS2xx's rate is found by its silence at others: its replies are waited for as before.
    #[must_use]
    pub fn patient(self) -> Self {
        Self {
            cola: ColaConfig { reply_timeout: PATIENCE, ..self.cola },
            connect_timeout: PATIENCE,
            stall_timeout: PATIENCE,
            first_scan_timeout: PATIENCE,
            first_datagram_timeout: PATIENCE,
            ..self
        }
    }
}

/// Doubling pauses between connection attempts, and when to give up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Backoff {
    /// The first pause.
    pub first: Duration,
    /// No pause is longer.
    pub longest: Duration,
    /// Give up once a lost link could not be restored for this long; never, if `None`.
    pub give_up_after: Option<Duration>,
}

impl Default for Backoff {
    fn default() -> Self {
        Self {
            first: Duration::from_millis(100),
            longest: Duration::from_secs(5),
            give_up_after: Some(Duration::from_secs(60)),
        }
    }
}

impl Backoff {
    /// The pause before attempt `attempt` (0 is the first retry).
    pub fn pause(&self, attempt: u32) -> Duration {
        self.first.saturating_mul(2_u32.saturating_pow(attempt)).min(self.longest)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pauses_double_up_to_the_longest() {
        let backoff = Backoff::default();
        let pauses: Vec<u128> = (0..8).map(|attempt| backoff.pause(attempt).as_millis()).collect();
        assert_eq!(pauses, [100, 200, 400, 800, 1600, 3200, 5000, 5000]);
        assert_eq!(backoff.pause(u32::MAX), backoff.longest);
    }
}
