//! Who may ask.
//!
//! On loopback everyone on this machine may, as for the scanner's own ports; but no web page that a browser there shows. Elsewhere a token is
//! needed.

use std::net::IpAddr;

use axum::extract::{Request, State};
use axum::http::header::{AUTHORIZATION, HOST, ORIGIN, SEC_WEBSOCKET_PROTOCOL};
use axum::http::{HeaderMap, StatusCode, Uri};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};

use crate::clock;
use crate::problem::Problem;

/// What a request must show.
#[derive(Clone, Debug)]
pub struct Guard {
    token: Option<String>,
}

impl Guard {
    /// Everyone who reaches the address. For loopback.
    pub fn open() -> Self {
        Self { token: None }
    }

    /// Who sends `Authorization: Bearer TOKEN`, or opens a WebSocket that offers the protocol `bearer.TOKEN`: a web page cannot add a header there.
    pub fn token(token: String) -> Self {
        Self { token: Some(token) }
    }

    fn refuses(&self, headers: &HeaderMap) -> Option<Problem> {
        let text = |name| headers.get(name).and_then(|value| value.to_str().ok());
        let host = text(HOST).unwrap_or_default();
        // A name that somebody's own name server leads here is how a web page gets round the next rule.
        if self.token.is_none() && !is_local(host) {
            let message = format!("expected `Host` to be localhost or an address, found `{host}`");
            return Some(Problem::new(StatusCode::FORBIDDEN, message));
        }
        if let Some(origin) = headers.get(ORIGIN) {
            let own = origin.to_str().ok().and_then(|origin| origin.parse::<Uri>().ok());
            if own.and_then(|origin| origin.authority().map(|authority| authority.as_str() != host))
                != Some(false)
            {
                let message = format!(
                    "a page of another site asks ({origin:?}); its `Origin` must be this server's own"
                );
                return Some(Problem::new(StatusCode::FORBIDDEN, message));
            }
        }
        let token = self.token.as_ref()?;
        let header = text(AUTHORIZATION).and_then(|value| value.strip_prefix("Bearer "));
        let offered = || {
            let protocols = text(SEC_WEBSOCKET_PROTOCOL)?.split(',');
            protocols.map(str::trim).find_map(|protocol| protocol.strip_prefix("bearer."))
        };
        let shown = header.or_else(offered).unwrap_or_default();
        (!same(shown.as_bytes(), token.as_bytes())).then(|| {
            Problem::new(
                StatusCode::UNAUTHORIZED,
                "send `Authorization: Bearer TOKEN`; TOKEN is --control-token's, or was printed at the start",
            )
        })
    }
}

/// A host as `Host` has it, by address or as localhost.
fn is_local(host: &str) -> bool {
    let bare = match host.strip_prefix('[') {
        Some(rest) => rest.split(']').next().unwrap_or_default(),
        None => host.rsplit_once(':').map_or(host, |(bare, _)| bare),
    };
    bare == "localhost" || bare.parse::<IpAddr>().is_ok()
}

/// Compares in a time that tells nothing of where they differ.
fn same(shown: &[u8], token: &[u8]) -> bool {
    shown.len() == token.len() && shown.iter().zip(token).fold(0, |differ, (a, b)| differ | (a ^ b)) == 0
}

/// The guard as a layer.
pub(crate) async fn check(State(guard): State<Guard>, request: Request, next: Next) -> Response {
    match guard.refuses(request.headers()) {
        Some(problem) => problem.into_response(),
        None => clock::within(clock::BODY, next.run(request)).await.unwrap_or_else(|| {
            Problem::new(StatusCode::REQUEST_TIMEOUT, "the body did not come in time").into_response()
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn headers(pairs: &[(&'static str, &'static str)]) -> HeaderMap {
        pairs.iter().map(|(name, value)| (name.parse().unwrap(), value.parse().unwrap())).collect()
    }

    #[test]
    fn pages_of_other_sites_may_not_ask_and_programs_may() {
        let open = Guard::open();
        for good in [
            &[("host", "127.0.0.1:8474")][..],
            &[("host", "localhost:8474"), ("origin", "http://localhost:8474")],
            &[("host", "[::1]:8474")],
        ] {
            assert_eq!(open.refuses(&headers(good)), None, "{good:?}");
        }
        for bad in [
            &[("host", "127.0.0.1:8474"), ("origin", "http://evil.example")][..],
            &[("host", "127.0.0.1:8474"), ("origin", "null")],
            &[("host", "evil.example:8474")],
            &[],
        ] {
            assert!(open.refuses(&headers(bad)).is_some(), "{bad:?}");
        }
    }

    #[test]
    fn a_token_must_be_shown_where_one_is_asked_for() {
        let guard = Guard::token("secret".to_owned());
        let asks = |token| guard.refuses(&headers(&[("host", "bench.example:1"), ("authorization", token)]));
        assert_eq!(asks("Bearer secret"), None);
        for wrong in ["Bearer secreT", "Bearer secret2", "Bearer ", "secret", "Basic secret"] {
            assert!(asks(wrong).is_some(), "{wrong}");
        }
        assert!(guard.refuses(&headers(&[("host", "127.0.0.1:1")])).is_some());
        let offers = |protocols| {
            guard.refuses(&headers(&[("host", "bench.example:1"), ("sec-websocket-protocol", protocols)]))
        };
        assert_eq!(offers("rowscan, bearer.secret"), None);
        assert!(offers("rowscan, bearer.secret2").is_some() && offers("rowscan").is_some());
    }
}
