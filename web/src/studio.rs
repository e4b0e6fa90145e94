//! Where pictures and states are made, once for all browsers.

use std::sync::Arc;

use rowscan_control::Bench;
use tokio::sync::{Semaphore, watch};
use tokio_tungstenite::tungstenite::Utf8Bytes;

use crate::clock;
use crate::show::Show;

/// Browsers that may look at once.
pub const BROWSERS: usize = 32;
/// What every browser is served from.
#[derive(Clone, Debug)]
pub(crate) struct Studio {
    pub(crate) show: Show,
    pub(crate) bench: Option<Bench>,
    /// Places for browsers.
    pub(crate) seats: Arc<Semaphore>,
    pub(crate) exposures: watch::Receiver<Exposure>,
}

/// The newest picture and the newest state, made once for all browsers.
#[derive(Clone, Debug, Default)]
pub(crate) struct Exposure {
    pub(crate) picture: axum::body::Bytes,
    /// Goes up with every new state.
    pub(crate) state_number: u64,
    pub(crate) state: Utf8Bytes,
}

/// Makes pictures while anybody looks, one for all.
pub(crate) async fn expose(
    show: Show,
    bench: Option<Bench>,
    seats: Arc<Semaphore>,
    exposed: watch::Sender<Exposure>,
) {
    let mut ticks = clock::camera();
    let (mut number, mut tick, mut before) = (0_u32, 0_u32, None);
    loop {
        ticks.tick().await;
        if seats.available_permits() == BROWSERS {
            before = None;
            continue;
        }
        let moment = show.moment();
        let (is_new, tells) = (before != Some(moment), tick % clock::PICTURES_A_STATE == 0);
        tick = tick.wrapping_add(1);
        if is_new {
            before = Some(moment);
            number = number.wrapping_add(1);
        }
        if !is_new && !tells {
            continue;
        }
        let picture = is_new.then(|| show.picture(number));
        let state = tells.then(|| show.state(bench.as_ref()).to_string());
        exposed.send_modify(|exposure| {
            if let Some(picture) = picture {
                exposure.picture = picture.into();
            }
            if let Some(state) = state {
                exposure.state = state.into();
                exposure.state_number += 1;
            }
        });
    }
}
