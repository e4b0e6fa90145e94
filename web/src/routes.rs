//! What the page asks for, beside what scripts ask for too.

use axum::Router;
use axum::extract::{Query, State};
use axum::http::header::{CACHE_CONTROL, CONTENT_TYPE};
use axum::response::IntoResponse;
use axum::routing::get;
use rowscan_control::{Json, Problem};
use serde::Deserialize;
use serde_json::json;

use crate::live;
use crate::studio::Studio;

const BINARY: [(axum::http::HeaderName, &str); 2] =
    [(CONTENT_TYPE, "application/octet-stream"), (CACHE_CONTROL, "no-store")];

/// The routes below `/watch`.
pub(crate) fn watched(studio: Studio) -> Router {
    Router::new()
        .route("/watch/about", get(about))
        .route("/watch/orchard", get(orchard))
        .route("/watch/scan", get(scan))
        .route("/watch/state", get(state))
        .route("/watch/strip", get(strip))
        .route("/watch/map", get(map))
        .route("/watch/log", get(log))
        .route("/watch/live", get(live::live))
        .with_state(studio)
}

async fn about(State(studio): State<Studio>) -> impl IntoResponse {
    let mut about = json!(studio.show.about());
    about["has_orchard"] = json!(studio.show.orchard().is_some());
    about["has_map"] = json!(studio.show.map().is_some());
    about["has_control"] = json!(studio.bench.is_some());
    about["version"] = json!(env!("CARGO_PKG_VERSION"));
    Json(about)
}

async fn orchard(State(studio): State<Studio>) -> Result<impl IntoResponse, Problem> {
    let picture = studio.show.orchard().ok_or_else(|| Problem::missing("no orchard is known here"))?;
    Ok((BINARY, picture.bytes().to_vec()))
}

async fn scan(State(studio): State<Studio>) -> impl IntoResponse {
    (BINARY, studio.show.picture(0))
}

async fn state(State(studio): State<Studio>) -> impl IntoResponse {
    Json(studio.show.state(studio.bench.as_ref()))
}

async fn strip(State(studio): State<Studio>) -> impl IntoResponse {
    Json(studio.show.strip_now())
}

async fn map(State(studio): State<Studio>) -> Result<impl IntoResponse, Problem> {
    let desk = studio.show.map().ok_or_else(|| Problem::missing("no sprayer is known here"))?;
    let svg = desk
        .svg()
        .await
        .ok_or_else(|| Problem::missing("the drive has not begun: there is nothing to draw"))?;
    Ok(([(CONTENT_TYPE, "image/svg+xml"), (CACHE_CONTROL, "no-store")], svg))
}

#[derive(Debug, Deserialize)]
struct Since {
    #[serde(default)]
    since: u64,
}

async fn log(State(studio): State<Studio>, Query(Since { since }): Query<Since>) -> impl IntoResponse {
    let log = studio.show.log();
    Json(json!({ "last": log.last(), "telegrams": log.after(since) }))
}

/// There is nothing there.
pub(crate) async fn unknown() -> Problem {
    Problem::missing(
        "there is no such path; there are /, /watch/about, /watch/orchard, /watch/scan, /watch/state, /watch/strip, /watch/map, /watch/log, /watch/live",
    )
}
