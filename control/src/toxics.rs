//! The toxics that clients have added, with the faults they are.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use axum::http::StatusCode;
use rowscan_faults::{FaultControl, FaultSpec};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use crate::problem::Problem;
use crate::request::{of_fault, spec};
use crate::toxic_kinds::{self, Attributes};

/// A toxic as a client asks for it.
#[derive(Clone, Debug, Deserialize)]
pub(crate) struct ToxicOrder {
    name: Option<String>,
    r#type: Option<String>,
    stream: Option<String>,
    toxicity: Option<f64>,
    #[serde(default)]
    attributes: Map<String, Value>,
}

/// A toxic as clients see it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Toxic {
    name: String,
    r#type: String,
    stream: String,
    toxicity: f64,
    attributes: Map<String, Value>,
    #[serde(skip)]
    proxy: String,
    /// The faults it is.
    #[serde(skip)]
    ids: Vec<String>,
}

/// All toxics. Clones share them.
#[derive(Clone, Debug, Default)]
pub(crate) struct Toxics(Arc<Mutex<Held>>);

#[derive(Debug, Default)]
struct Held {
    toxics: Vec<Toxic>,
    /// Proxies that are switched off, with the faults that is.
    down: Vec<(String, Vec<String>)>,
}

impl Toxics {
    fn held(&self) -> MutexGuard<'_, Held> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Forgets all; their faults have been ended.
    pub(crate) fn clear(&self) {
        *self.held() = Held::default();
    }

    pub(crate) fn of(&self, proxy: &str) -> Vec<Toxic> {
        self.held().toxics.iter().filter(|toxic| toxic.proxy == proxy).cloned().collect()
    }

    pub(crate) fn find(&self, proxy: &str, name: &str) -> Result<Toxic, Problem> {
        let found = self.of(proxy).into_iter().find(|toxic| toxic.name == name);
        found.ok_or_else(|| Problem::missing(format!("stream `{proxy}` has no toxic `{name}`")))
    }

    pub(crate) fn is_down(&self, proxy: &str) -> bool {
        self.held().down.iter().any(|(down, _)| down == proxy)
    }

    /// Nobody listens, and who is connected is cut off.
    pub(crate) fn down(&self, proxy: &str, faults: &FaultControl) -> Result<(), Problem> {
        if self.is_down(proxy) {
            return Ok(());
        }
        let fault =
            |name: &str| serde_json::json!({ "name": name, "on": proxy, "id": format!("{proxy}.{name}") });
        let specs =
            ["refuse", "rst"].map(|name| spec(fault(name))).into_iter().collect::<Result<Vec<_>, _>>()?;
        let ids = faults.add_all(specs).map_err(|error| of_fault(&error))?;
        self.held().down.push((proxy.to_owned(), ids));
        Ok(())
    }

    pub(crate) fn up(&self, proxy: &str, faults: &FaultControl) -> Result<(), Problem> {
        let mut held = self.held();
        let found = held.down.iter().position(|(down, _)| down == proxy);
        let Some(number) = found else { return Ok(()) };
        let (_, ids) = held.down.remove(number);
        drop(held);
        end(&ids, faults);
        Ok(())
    }

    pub(crate) fn add(
        &self,
        proxy: &str,
        order: ToxicOrder,
        faults: &FaultControl,
    ) -> Result<Toxic, Problem> {
        let toxic = Toxic::of(proxy, order)?;
        if self.find(proxy, &toxic.name).is_ok() {
            let message = format!("stream `{proxy}` has a toxic `{}` already", toxic.name);
            return Err(Problem::new(StatusCode::CONFLICT, message));
        }
        self.put(toxic, faults)
    }

    /// The toxic with other attributes; what is not given stays.
    pub(crate) fn change(
        &self,
        proxy: &str,
        name: &str,
        order: ToxicOrder,
        faults: &FaultControl,
    ) -> Result<Toxic, Problem> {
        let before = self.find(proxy, name)?;
        let mut attributes = before.attributes.clone();
        attributes.extend(order.attributes);
        let changed = Toxic::of(
            proxy,
            ToxicOrder {
                name: Some(before.name.clone()),
                r#type: Some(before.r#type.clone()),
                stream: Some(before.stream.clone()),
                toxicity: order.toxicity,
                attributes,
            },
        )?;
        // What cannot be leaves the old one in place.
        changed.specs()?;
        self.remove(proxy, name, faults)?;
        self.put(changed, faults)
    }

    pub(crate) fn remove(&self, proxy: &str, name: &str, faults: &FaultControl) -> Result<(), Problem> {
        let toxic = self.find(proxy, name)?;
        self.held().toxics.retain(|held| held.proxy != proxy || held.name != name);
        end(&toxic.ids, faults);
        Ok(())
    }

    fn put(&self, mut toxic: Toxic, faults: &FaultControl) -> Result<Toxic, Problem> {
        toxic.ids = faults.add_all(toxic.specs()?).map_err(|error| of_fault(&error))?;
        self.held().toxics.push(toxic.clone());
        Ok(toxic)
    }
}

/// Ends these faults, as far as they have not been ended by other ways.
fn end(ids: &[String], faults: &FaultControl) {
    for id in ids {
        let _ = faults.remove(id);
    }
}

impl Toxic {
    fn of(proxy: &str, order: ToxicOrder) -> Result<Self, Problem> {
        let r#type = order.r#type.ok_or_else(|| Problem::wrong("the key `type` is missing"))?;
        let kind = toxic_kinds::find(&r#type)?;
        let stream = order.stream.unwrap_or_else(|| "downstream".to_owned());
        if !["downstream", "upstream"].contains(&stream.as_str()) {
            return Err(Problem::wrong(format!(
                "expected `stream` to be downstream or upstream, found `{stream}`"
            )));
        }
        let toxicity = order.toxicity.unwrap_or(1.0);
        if toxicity != 1.0 {
            return Err(Problem::wrong(format!(
                "expected `toxicity` 1, found {toxicity}: faults choose by telegram; take `p` at POST /faults"
            )));
        }
        if let Some(key) = order.attributes.keys().find(|key| !kind.attributes.contains(&key.as_str())) {
            let known = kind.attributes.join(", ");
            return Err(Problem::wrong(format!(
                "`{type}` has no attribute `{key}`; it has {known}",
                r#type = kind.name
            )));
        }
        let name = order.name.unwrap_or_else(|| format!("{}_{stream}", kind.name));
        let (attributes, proxy) = (order.attributes, proxy.to_owned());
        Ok(Self { name, r#type, stream, toxicity, attributes, proxy, ids: Vec::new() })
    }

    /// The faults that it is, named by stream and toxic.
    fn specs(&self) -> Result<Vec<FaultSpec>, Problem> {
        let id = format!("{}.{}", self.proxy, self.name);
        let kind = toxic_kinds::find(&self.r#type)?;
        let tables = (kind.make)(&id, &Attributes(&self.attributes))?;
        let direction = if self.stream == "upstream" { "to_device" } else { "to_client" };
        let named = tables.into_iter().enumerate().map(|(number, mut table)| {
            if let Value::Object(keys) = &mut table {
                let id = if number == 0 { id.clone() } else { format!("{id}.{}", number + 1) };
                keys.insert("id".to_owned(), Value::from(id));
                keys.insert("on".to_owned(), Value::from(self.proxy.as_str()));
                let both = ["rst", "half_open"]
                    .iter()
                    .any(|name| keys.get("name").is_some_and(|found| found == name));
                let direction = if both { "both" } else { direction };
                keys.insert("direction".to_owned(), Value::from(direction));
            }
            table
        });
        named.map(spec).collect()
    }
}
