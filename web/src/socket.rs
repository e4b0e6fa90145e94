//! WebSockets (RFC 6455) on axum's routes. axum's own are those of an older tungstenite, with all that it brings.

use std::future::Future;

use axum::body::Body;
use axum::extract::Request;
use axum::http::header::SEC_WEBSOCKET_PROTOCOL;
use axum::http::{HeaderValue, StatusCode};
use axum::response::Response;
use hyper::upgrade::Upgraded;
use hyper_util::rt::TokioIo;
use rowscan_control::Problem;
use rowscan_ports::task;
use tokio_tungstenite::WebSocketStream;
use tokio_tungstenite::tungstenite::handshake::server::create_response_with_body;
use tokio_tungstenite::tungstenite::protocol::{Role, WebSocketConfig};

/// A socket that a browser opened.
pub(crate) type Socket = WebSocketStream<TokioIo<Upgraded>>;

/// Answers a request for a WebSocket and hands the socket to `serve`. `protocol` is agreed on if it is asked for; longer messages than `message_bytes` end
/// the socket.
///
/// # Errors
/// The request is none for a WebSocket.
pub(crate) fn upgrade<F: Future<Output = ()> + Send>(
    mut request: Request,
    protocol: &'static str,
    message_bytes: usize,
    serve: impl FnOnce(Socket) -> F + Send + 'static,
) -> Result<Response, Problem> {
    let mut response = create_response_with_body(&request, Body::empty)
        .map_err(|cause| Problem::new(StatusCode::BAD_REQUEST, cause.to_string()))?;
    let offered = request.headers().get_all(SEC_WEBSOCKET_PROTOCOL).iter();
    let mut offered = offered.filter_map(|names| names.to_str().ok()).flat_map(|names| names.split(','));
    if offered.any(|name| name.trim() == protocol) {
        response.headers_mut().insert(SEC_WEBSOCKET_PROTOCOL, HeaderValue::from_static(protocol));
    }
    let limits =
        WebSocketConfig::default().max_message_size(Some(message_bytes)).max_frame_size(Some(message_bytes));
    let upgraded = hyper::upgrade::on(&mut request);
    tokio::spawn(task(async move {
        // A browser that breaks off before has its reasons.
        let Ok(upgraded) = upgraded.await else { return };
        let upgraded = TokioIo::new(upgraded);
        serve(Socket::from_raw_socket(upgraded, Role::Server, Some(limits)).await).await;
    }));
    Ok(response)
}
