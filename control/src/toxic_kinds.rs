//! Which faults a toxic is. A toxic is a line of the table.

use serde_json::{Map, Value, json};

use crate::problem::Problem;

/// A toxic's attributes, read strictly.
#[derive(Debug)]
pub(crate) struct Attributes<'a>(pub(crate) &'a Map<String, Value>);

impl Attributes<'_> {
    fn number(&self, key: &str) -> Result<f64, Problem> {
        match self.0.get(key) {
            None => Ok(0.0),
            Some(value) => value.as_f64().filter(|number| *number >= 0.0).ok_or_else(|| {
                Problem::wrong(format!("expected `{key}` to be a number of 0 or more, found {value}"))
            }),
        }
    }
}

/// Makes the faults of a toxic with this id: tables as a file of faults has them, without `on` and `direction`.
type Make = fn(&str, &Attributes<'_>) -> Result<Vec<Value>, Problem>;

/// One of Toxiproxy's toxics.
pub(crate) struct Kind {
    pub(crate) name: &'static str,
    pub(crate) attributes: &'static [&'static str],
    pub(crate) make: Make,
}

pub(crate) const KINDS: &[Kind] = &[
    Kind {
        name: "latency",
        attributes: &["latency", "jitter"],
        make: |_, given| {
            let (ms, jitter) = (given.number("latency")?, given.number("jitter")?);
            // Theirs is evenly spread over ± jitter; ours is normal, and this wide.
            Ok(vec![match jitter > 0.0 {
                true => json!({ "name": "jitter", "mean_ms": ms, "sd_ms": jitter / 3.0_f64.sqrt() }),
                false => json!({ "name": "delay", "ms": ms }),
            }])
        },
    },
    Kind {
        name: "bandwidth",
        attributes: &["rate"],
        make: |_, given| {
            let bytes_s = (given.number("rate")? * 1000.0).round().max(1.0) as u64;
            Ok(vec![json!({ "name": "bandwidth", "bytes_s": bytes_s })])
        },
    },
    Kind {
        name: "timeout",
        attributes: &["timeout"],
        make: |id, given| {
            let mut faults = vec![json!({ "name": "half_open" })];
            let after_s = given.number("timeout")? / 1e3;
            if after_s > 0.0 {
                faults.push(json!({ "name": "rst", "at": { "after": id, "plus_s": after_s } }));
            }
            Ok(faults)
        },
    },
    Kind {
        name: "reset_peer",
        attributes: &["timeout"],
        make: |_, given| Ok(vec![json!({ "name": "rst", "at": { "s": given.number("timeout")? / 1e3 } })]),
    },
    Kind {
        name: "slicer",
        attributes: &["average_size", "size_variation", "delay"],
        make: |_, given| {
            if given.number("size_variation")? > 0.0 {
                return Err(Problem::wrong("pieces are of one size here: expected `size_variation` 0"));
            }
            let (bytes, gap_us) =
                (given.number("average_size")?.max(1.0) as u64, given.number("delay")? as u64);
            Ok(vec![json!({ "name": "dribble", "bytes": bytes, "gap_us": gap_us, "p": 1.0 })])
        },
    },
    Kind {
        name: "slow_close",
        attributes: &["delay"],
        make: |_, _| {
            Err(Problem::wrong(
                "`slow_close` has no fault here: a device closes when it closes; take `half_close` at POST /faults",
            ))
        },
    },
    Kind {
        name: "limit_data",
        attributes: &["bytes"],
        make: |_, _| {
            Err(Problem::wrong(
                "`limit_data` has no fault here; take `fin` or `rst` with `at = { scan }` at POST /faults",
            ))
        },
    },
];

/// The toxic of this name.
pub(crate) fn find(name: &str) -> Result<&'static Kind, Problem> {
    KINDS.iter().find(|kind| kind.name == name).ok_or_else(|| {
        let names: Vec<&str> = KINDS.iter().map(|kind| kind.name).collect();
        Problem::wrong(format!("unknown toxic `{name}`; there are {}", names.join(", ")))
    })
}
