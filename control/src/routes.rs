//! The routes.

use axum::Router;
use axum::extract::rejection::QueryRejection;
use axum::extract::{DefaultBodyLimit, Path, Query, State};
use axum::http::StatusCode;
use axum::response::IntoResponse;
use axum::routing::{delete, get, post};
use serde::Deserialize;
use serde_json::{Value, json};

use crate::bench::Bench;
use crate::clock;
use crate::fault_table::FaultTable;
use crate::json::Json;
use crate::problem::Problem;
use crate::request::{Body, body, of_fault, spec};
use crate::toxiproxy;

/// The longest body.
const BODY_BYTES: usize = 64 * 1024;
/// Faults of one request.
const MOST_FAULTS: usize = 256;
/// Steps of one request.
const MOST_STEPS: u64 = 1_000_000_000;

/// The routes of `bench`, to be served by [`Server`](crate::Server) alone or merged with others.
pub fn router(bench: Bench) -> Router {
    Router::new()
        .route("/faults", get(faults).post(add_faults).delete(reset))
        .route("/faults/{id}", delete(remove_fault))
        .route("/fault-table", get(fault_table))
        .route("/reset", post(reset))
        .route("/clock", get(time).post(set_time))
        .route("/step", post(step))
        .route("/log", get(log))
        .route("/state", get(state))
        .merge(toxiproxy::routes())
        .fallback(unknown)
        .method_not_allowed_fallback(other_method)
        .layer(DefaultBodyLimit::max(BODY_BYTES))
        .with_state(bench)
}

async fn faults(State(bench): State<Bench>) -> impl IntoResponse {
    Json(bench.faults.list())
}

/// One fault, or a list of them.
#[derive(Deserialize)]
#[serde(untagged)]
enum Added {
    Several(Vec<Value>),
    One(Value),
}

async fn add_faults(State(bench): State<Bench>, bytes: Body) -> Result<impl IntoResponse, Problem> {
    let tables = match body(&bytes)? {
        Added::Several(tables) => tables,
        Added::One(table) => vec![table],
    };
    if tables.len() > MOST_FAULTS || bench.faults.list().len() > MOST_FAULTS {
        return Err(Problem::conflict(format!("more than {MOST_FAULTS} faults; remove some first")));
    }
    let specs = tables.into_iter().map(spec).collect::<Result<Vec<_>, _>>()?;
    let ids = bench.faults.add_from_now(specs).map_err(|error| of_fault(&error))?;
    Ok((StatusCode::CREATED, Json(json!({ "ids": ids }))))
}

/// Every fault there is, with its parameters, and the streams it may be on.
async fn fault_table(State(bench): State<Bench>) -> impl IntoResponse {
    Json(FaultTable::of(&bench.faults))
}

async fn remove_fault(State(bench): State<Bench>, Path(id): Path<String>) -> Result<StatusCode, Problem> {
    bench.faults.remove(&id).map_err(|error| of_fault(&error))?;
    Ok(StatusCode::NO_CONTENT)
}

/// Ends all faults. Time is left as it is.
async fn reset(State(bench): State<Bench>) -> StatusCode {
    bench.faults.reset();
    bench.toxics.clear();
    bench.note("reset", &json!({}));
    StatusCode::NO_CONTENT
}

async fn time(State(bench): State<Bench>) -> impl IntoResponse {
    Json(bench.time.state())
}

/// What shall become of time. What is left out stays.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct TimeOrder {
    paused: Option<bool>,
    scale: Option<f64>,
    seek: Option<String>,
}

async fn set_time(State(bench): State<Bench>, bytes: Body) -> Result<impl IntoResponse, Problem> {
    let order: TimeOrder = body(&bytes)?;
    let refused = |refused: crate::Refused| Problem::conflict(refused.to_string());
    if order.paused.is_none() && order.scale.is_none() && order.seek.is_none() {
        return Err(Problem::wrong("expected one of `paused`, `scale`, `seek`, found none"));
    }
    if let Some(scale) = order.scale.filter(|scale| !(scale.is_finite() && *scale > 0.0)) {
        return Err(Problem::wrong(format!("expected a `scale` above 0, found {scale}")));
    }
    // What may be refused comes first, so that a refused request changes nothing.
    if let Some(place) = &order.seek {
        bench.time.seek(place).await.map_err(refused)?;
    }
    if let Some(scale) = order.scale {
        bench.time.set_scale(scale).map_err(refused)?;
    }
    if let Some(paused) = order.paused {
        bench.time.pause(paused);
    }
    bench.note("clock", &json!({ "paused": order.paused, "scale": order.scale, "seek": order.seek }));
    Ok(Json(bench.time.state()))
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct StepOrder {
    #[serde(default = "one")]
    n: u64,
}

fn one() -> u64 {
    1
}

/// Lets steps go. The answer comes when they are taken, or after half a second.
async fn step(State(bench): State<Bench>, bytes: Body) -> Result<impl IntoResponse, Problem> {
    let StepOrder { n } = if bytes.0.is_empty() { StepOrder { n: one() } } else { body(&bytes)? };
    if !(1..=MOST_STEPS).contains(&n) {
        return Err(Problem::wrong(format!("expected `n` from 1 to {MOST_STEPS}, found {n}")));
    }
    let last = bench.time.step(n).map_err(|refused| Problem::conflict(refused.to_string()))?;
    bench.note("step", &json!({ "n": n }));
    let done = clock::within(clock::STEPS, bench.time.stepped(last)).await.is_some();
    Ok(Json(json!({ "last": last, "done": done, "clock": bench.time.state() })))
}

#[derive(Debug, Deserialize)]
struct Since {
    #[serde(default)]
    since: u64,
}

async fn log(
    State(bench): State<Bench>,
    since: Result<Query<Since>, QueryRejection>,
) -> Result<impl IntoResponse, Problem> {
    let Query(Since { since }) = since.map_err(|rejection| Problem::wrong(rejection.body_text()))?;
    Ok(Json(bench.log.after(since)))
}

async fn state(State(bench): State<Bench>) -> impl IntoResponse {
    Json(Value::Object(bench.state()))
}

async fn unknown() -> Problem {
    Problem::missing(
        "there is no such path; there are /faults, /faults/{id}, /fault-table, /reset, /clock, /step, /log, /state, /proxies, /populate, /version",
    )
}

async fn other_method() -> Problem {
    Problem::new(StatusCode::METHOD_NOT_ALLOWED, "this path does not take this method")
}
