//! The one place of this crate that reads the host's clock.

use std::time::{Duration, SystemTime, UNIX_EPOCH};

/// The host's date and time, since the beginning of 1970.
pub(crate) fn since_1970() -> Duration {
    SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default()
}
