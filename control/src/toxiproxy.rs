//! Toxiproxy's paths, so that its clients can be used: a stream of the bench is a proxy, a toxic is one or two faults.

use axum::Router;
use axum::extract::{Path, State};
use axum::http::StatusCode;
use axum::response::IntoResponse;
use axum::routing::{get, post};
use serde::Deserialize;
use serde_json::{Value, json};

use crate::bench::Bench;
use crate::json::Json;
use crate::problem::Problem;
use crate::request::{Body, body};
use crate::toxics::{Toxic, ToxicOrder};

/// What `GET /version` says: the version of Toxiproxy whose paths these are, and whose they really are.
const VERSION: &str = concat!("2.12.0-rowscan-", env!("CARGO_PKG_VERSION"));

pub(crate) fn routes() -> Router<Bench> {
    Router::new()
        .route("/version", get(|| async { Json(json!({ "version": VERSION })) }))
        .route("/proxies", get(proxies).post(create))
        .route("/populate", post(populate))
        .route("/proxies/{proxy}", get(proxy).post(update).patch(update).delete(keep))
        .route("/proxies/{proxy}/toxics", get(toxics).post(add))
        .route("/proxies/{proxy}/toxics/{toxic}", get(toxic).post(change).patch(change).delete(remove))
}

/// A proxy as its client asks for it. Addresses are the bench's own and are not changed.
#[derive(Clone, Debug, Deserialize)]
struct ProxyOrder {
    name: Option<String>,
    enabled: Option<bool>,
}

impl Bench {
    /// The stream of this name, or who there is.
    fn stream(&self, name: &str) -> Result<String, Problem> {
        let streams = self.faults.streams();
        match streams.iter().find(|stream| *stream == name) {
            Some(stream) => Ok(stream.clone()),
            None => Err(Problem::missing(format!(
                "there is no stream `{name}`; the bench has {}, and none can be added",
                streams.join(", ")
            ))),
        }
    }

    fn describe(&self, proxy: &str) -> Value {
        json!({
            "name": proxy,
            // Where it listens is in the `listening` events, and it has no upstream.
            "listen": "",
            "upstream": "",
            "enabled": !self.toxics.is_down(proxy),
            "toxics": self.toxics.of(proxy),
        })
    }

    fn enable(&self, proxy: &str, enabled: Option<bool>) -> Result<(), Problem> {
        match enabled {
            Some(true) => self.toxics.up(proxy, &self.faults),
            Some(false) => self.toxics.down(proxy, &self.faults),
            None => Ok(()),
        }
    }

    fn take(&self, order: &ProxyOrder) -> Result<Value, Problem> {
        let name = order.name.as_deref().ok_or_else(|| Problem::wrong("the key `name` is missing"))?;
        let proxy = self.stream(name)?;
        self.enable(&proxy, order.enabled)?;
        Ok(self.describe(&proxy))
    }
}

async fn proxies(State(bench): State<Bench>) -> impl IntoResponse {
    let all = bench.faults.streams().into_iter().map(|stream| (stream.clone(), bench.describe(&stream)));
    Json(Value::Object(all.collect()))
}

/// A proxy that is there already is taken as it is; another cannot be made.
async fn create(State(bench): State<Bench>, bytes: Body) -> Result<impl IntoResponse, Problem> {
    Ok((StatusCode::CREATED, Json(bench.take(&body(&bytes)?)?)))
}

async fn populate(State(bench): State<Bench>, bytes: Body) -> Result<impl IntoResponse, Problem> {
    let orders: Vec<ProxyOrder> = body(&bytes)?;
    let taken = orders.iter().map(|order| bench.take(order)).collect::<Result<Vec<_>, _>>()?;
    Ok((StatusCode::CREATED, Json(json!({ "proxies": taken }))))
}

async fn proxy(State(bench): State<Bench>, Path(proxy): Path<String>) -> Result<impl IntoResponse, Problem> {
    Ok(Json(bench.describe(&bench.stream(&proxy)?)))
}

async fn update(
    State(bench): State<Bench>,
    Path(proxy): Path<String>,
    bytes: Body,
) -> Result<impl IntoResponse, Problem> {
    let proxy = bench.stream(&proxy)?;
    let order: ProxyOrder = body(&bytes)?;
    bench.enable(&proxy, order.enabled)?;
    Ok(Json(bench.describe(&proxy)))
}

async fn keep(State(bench): State<Bench>, Path(proxy): Path<String>) -> Result<StatusCode, Problem> {
    let proxy = bench.stream(&proxy)?;
    Err(Problem::conflict(format!(
        "`{proxy}` is a stream of the bench and stays; POST /reset ends its faults"
    )))
}

async fn toxics(State(bench): State<Bench>, Path(proxy): Path<String>) -> Result<impl IntoResponse, Problem> {
    Ok(Json(bench.toxics.of(&bench.stream(&proxy)?)))
}

async fn add(
    State(bench): State<Bench>,
    Path(proxy): Path<String>,
    bytes: Body,
) -> Result<impl IntoResponse, Problem> {
    let proxy = bench.stream(&proxy)?;
    let order: ToxicOrder = body(&bytes)?;
    Ok(Json(bench.toxics.add(&proxy, order, &bench.faults)?))
}

async fn toxic(
    State(bench): State<Bench>,
    Path((proxy, toxic)): Path<(String, String)>,
) -> Result<Json<Toxic>, Problem> {
    bench.toxics.find(&bench.stream(&proxy)?, &toxic).map(Json)
}

async fn change(
    State(bench): State<Bench>,
    Path((proxy, toxic)): Path<(String, String)>,
    bytes: Body,
) -> Result<impl IntoResponse, Problem> {
    let proxy = bench.stream(&proxy)?;
    let order: ToxicOrder = body(&bytes)?;
    Ok(Json(bench.toxics.change(&proxy, &toxic, order, &bench.faults)?))
}

async fn remove(
    State(bench): State<Bench>,
    Path((proxy, toxic)): Path<(String, String)>,
) -> Result<StatusCode, Problem> {
    bench.toxics.remove(&bench.stream(&proxy)?, &toxic, &bench.faults)?;
    Ok(StatusCode::NO_CONTENT)
}
