//! The same routes by lines of text: `GET /clock`, `POST /faults {"name": "stall"}`.

use axum::Router;
use axum::body::{Body, to_bytes};
use axum::http::{Method, Request};
use serde::Serialize;
use serde_json::Value;
use tower::ServiceExt;

/// The longest answer.
const ANSWER_BYTES: usize = 16 * 1024 * 1024;

/// Routes, asked by lines.
#[derive(Clone, Debug)]
pub struct Lines(Router);

/// What came of a line.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LineAnswer {
    /// `control`.
    pub event: &'static str,
    /// As HTTP has it: 200 and a little more are good.
    pub status: u16,
    /// The answer; none where there is nothing to say.
    pub body: Option<Value>,
}

impl Lines {
    /// Asks these routes.
    pub fn new(routes: Router) -> Self {
        Self(routes)
    }

    /// Does what one line says: a method, a path, and what follows as the body. No host and no token are needed.
    pub async fn ask(&self, line: &str) -> LineAnswer {
        let mut words = line.trim().splitn(3, char::is_whitespace);
        let (method, path, body) = (words.next(), words.next(), words.next().unwrap_or_default().trim());
        let method = method.map(str::to_ascii_uppercase).unwrap_or_default();
        let known = ["GET", "POST", "PATCH", "DELETE"].contains(&method.as_str());
        let wrong = || LineAnswer {
            event: "control",
            status: 400,
            body: Some(Value::from(format!(
                "expected GET, POST or DELETE and a path such as /clock, found `{}`",
                line.trim()
            ))),
        };
        let (Some(path), Ok(method), true) = (path, Method::from_bytes(method.as_bytes()), known) else {
            return wrong();
        };
        let Ok(request) = Request::builder().method(method).uri(path).body(Body::from(body.to_owned()))
        else {
            return wrong();
        };
        // Routes cannot fail.
        let Ok(response) = self.0.clone().oneshot(request).await;
        let status = response.status().as_u16();
        let bytes = to_bytes(response.into_body(), ANSWER_BYTES).await.unwrap_or_default();
        let body = if bytes.is_empty() {
            None
        } else {
            let text = || Value::from(String::from_utf8_lossy(&bytes).into_owned());
            Some(serde_json::from_slice(&bytes).unwrap_or_else(|_| text()))
        };
        LineAnswer { event: "control", status, body }
    }
}
