//! The page at an address.

use std::net::SocketAddr;
use std::sync::Arc;

use rowscan_control::{Bench, Guard, Served, Server, ServerError, router};
use tokio::sync::{Semaphore, watch};
use tokio::task::JoinSet;

use crate::clock;
use crate::routes;
use crate::show::Show;

/// Browsers that may look at once.
pub const BROWSERS: usize = 32;
/// Connections at once: a browser has one for what is live and six for the rest.
const CONNECTIONS: usize = BROWSERS * 4;

/// The page, served. Dropping it closes its connections.
#[derive(Debug)]
pub struct Web {
    server: Server,
    _camera: JoinSet<()>,
}

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
    pub(crate) state: axum::extract::ws::Utf8Bytes,
}

impl Web {
    /// Serves the page for `show` at `address` (port 0 takes a free one), with the routes of `bench` beside it if there is one. `guard` hears where that is.
    ///
    /// # Errors
    /// The address is not to be had.
    pub async fn open(
        address: &str,
        show: Show,
        bench: Option<Bench>,
        guard: impl FnOnce(&SocketAddr) -> Guard,
    ) -> Result<Self, ServerError> {
        let (exposed, exposures) = watch::channel(Exposure::default());
        let seats = Arc::new(Semaphore::new(BROWSERS));
        let studio =
            Studio { show: show.clone(), bench: bench.clone(), seats: Arc::clone(&seats), exposures };
        let watched = routes::watched(studio);
        let guarded = match bench.clone() {
            Some(bench) => watched.merge(router(bench)),
            None => watched.fallback(routes::unknown),
        };
        let served = Served { guarded, public: crate::page::routes(), connections: CONNECTIONS };
        let server = Server::open(address, served, guard).await?;
        let mut camera = JoinSet::new();
        camera.spawn(expose(show, bench, seats, exposed));
        Ok(Self { server, _camera: camera })
    }

    /// Where it listens.
    pub fn address(&self) -> SocketAddr {
        self.server.address()
    }
}

/// Makes pictures while anybody looks, one for all.
async fn expose(show: Show, bench: Option<Bench>, seats: Arc<Semaphore>, exposed: watch::Sender<Exposure>) {
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
