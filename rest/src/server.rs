//! The interface at an address, over HTTP/1.1.

use std::net::SocketAddr;
use std::pin::Pin;
use std::sync::{Arc, Mutex, PoisonError};

use axum::Router;
use axum::body::{Body, to_bytes};
use axum::extract::Request as HttpRequest;
use axum::http::{HeaderValue, Method, StatusCode, header};
use axum::response::Response;
use rowscan_control::{Guard, Served, ServerError};
use rowscan_protocol::device::Device;
use rowscan_protocol::time::SimTime;

use crate::answer::{Answer, Status};
use crate::rest::{Request, Rest, Verb};

/// Connections at once: clients open one a request.
const MAX_CONNECTIONS: usize = 32;
/// Largest body, bytes. Settings have a few hundred.
const MAX_BODY: usize = 64 * 1024;
/// What comes before the names.
const PREFIX: &str = "/api/";

/// A scanner that is asked over REST.
pub trait Scanner: Send + Sync + 'static {
    /// Lets `ask` have the device as it is now, and does what follows from a change: takers are looked at, saved settings are kept.
    fn ask(&self, ask: &mut dyn FnMut(&mut Device, SimTime)) -> Kept;
}

/// Whether saved settings could be kept.
pub type Kept = Pin<Box<dyn Future<Output = bool> + Send>>;

/// Why the interface cannot be served.
#[derive(Debug, thiserror::Error)]
#[error("{0}; --rest takes HOST:PORT such as 127.0.0.1:8080")]
pub struct RestError(#[from] ServerError);

/// The interface at an address. Dropping it closes its connections.
#[derive(Debug)]
pub struct Server(rowscan_control::Server);

impl Server {
    /// Serves `rest` of `scanner` at `address`; port 0 takes a free one.
    ///
    /// # Errors
    /// The address cannot be bound.
    pub async fn open(address: &str, rest: Rest, scanner: Arc<dyn Scanner>) -> Result<Self, RestError> {
        let rest = Arc::new(Mutex::new(rest));
        let routes = Router::new().fallback(move |request: HttpRequest| {
            let (rest, scanner) = (Arc::clone(&rest), Arc::clone(&scanner));
            async move { told(answer(request, &rest, &*scanner).await) }
        });
        // Open to every client that reaches it, as a scanner's own port is; but not to web pages in a browser.
        let served = Served { guarded: routes, public: Router::new(), connections: MAX_CONNECTIONS };
        Ok(Self(rowscan_control::Server::open(address, served, |_| Guard::open()).await?))
    }

    /// Where it is.
    pub fn address(&self) -> SocketAddr {
        self.0.address()
    }
}

async fn answer(request: HttpRequest, rest: &Mutex<Rest>, scanner: &dyn Scanner) -> Answer {
    let (head, body) = request.into_parts();
    let verb = match head.method {
        Method::GET => Verb::Get,
        Method::POST => Verb::Post,
        _ => return Status::ParsingFailed.into(),
    };
    let Some(name) = head.uri.path().strip_prefix(PREFIX) else { return Status::NotFound.into() };
    let Ok(body) = to_bytes(body, MAX_BODY).await else { return Status::OutOfBounds.into() };
    let request = Request { verb, name, body: &body };
    let mut answered = Answer::from(Status::InternalError);
    let kept = scanner.ask(&mut |device, now| {
        let mut rest = rest.lock().unwrap_or_else(PoisonError::into_inner);
        answered = rest.answer(&request, device, now);
    });
    if kept.await { answered } else { Status::InternalError.into() }
}

fn told(answer: Answer) -> Response {
    let mut response = Response::new(Body::from(answer.body.to_string()));
    *response.status_mut() = StatusCode::from_u16(answer.http).unwrap_or(StatusCode::INTERNAL_SERVER_ERROR);
    response.headers_mut().insert(header::CONTENT_TYPE, HeaderValue::from_static("application/json"));
    response
}
