//! The one place of this crate that reads the host's clock.

use std::time::SystemTime;

/// The host's date and time.
pub(crate) fn date() -> SystemTime {
    SystemTime::now()
}
