//! The one place of this crate that waits by the host's clock.

use std::future::Future;
use std::time::Duration;

use tokio::time::{Interval, MissedTickBehavior};

/// From one picture to the next: 25 a second.
const PICTURE: Duration = Duration::from_millis(40);
/// From one state to the next, as messages tell it.
pub(crate) const PICTURES_A_STATE: u32 = 5;
/// How long a browser may take to take a picture from its socket.
const SEND: Duration = Duration::from_secs(10);
/// After so long without a word a browser is asked for one.
const QUIET: Duration = Duration::from_secs(20);

/// Ticks of the camera. One that comes late moves the rest.
pub(crate) fn camera() -> Interval {
    let mut ticks = tokio::time::interval(PICTURE);
    ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
    ticks
}

/// Waits for a browser to take what it is sent; none if it does not.
pub(crate) async fn send<F: Future>(work: F) -> Option<F::Output> {
    rowscan_ports::clock::within(SEND, work).await
}

/// Waits as long as a browser may say nothing.
pub(crate) async fn quiet() {
    rowscan_ports::clock::rest(QUIET).await;
}
