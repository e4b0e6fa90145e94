//! `[[fault]]` tables. They are read; what they do to the byte path lands separately.

use std::collections::BTreeMap;

use serde::Deserialize;
use serde_json::Value;

/// A `[[fault]]` table: the common keys, and the fault's own parameters unread.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct FaultTable {
    /// Name in the fault table, such as `split`.
    pub name: String,
    /// The stream it is on.
    pub on: Option<String>,
    /// `to_client`, `to_device` or `both`.
    pub direction: Option<Direction>,
    /// What events and expectations call it.
    pub id: Option<String>,
    /// When it begins.
    pub at: Option<Value>,
    /// How long it lasts.
    #[serde(rename = "for")]
    pub lasts: Option<Value>,
    /// When it ends.
    pub until: Option<Value>,
    /// How often it comes again.
    pub every: Option<Value>,
    /// How probable it is at each event.
    pub p: Option<f64>,
    /// How many times it happens.
    pub count: Option<u64>,
    /// The fault's own parameters.
    #[serde(flatten)]
    pub parameters: BTreeMap<String, Value>,
}

/// Which way of a stream a fault is on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Direction {
    /// From the device to its client.
    ToClient,
    /// From the client to the device.
    ToDevice,
    /// Both ways.
    Both,
}

/// Why these faults cannot be run; nothing if they can. The one place to change when the byte path has faults.
pub(crate) fn refusal(faults: &[FaultTable]) -> Option<String> {
    let first = faults.first()?;
    Some(format!("faults on the byte path land separately; found `{}`", first.name))
}
