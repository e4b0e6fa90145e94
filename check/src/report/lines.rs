//! JSON lines: every event, then every verdict.

use serde_json::json;

use crate::verdict::Tried;

/// One scenario with one seed, one object a line.
pub fn jsonl(tried: &Tried) -> String {
    let scenario = tried.scenario.display().to_string();
    let events = tried.events.iter().map(|event| {
        json!({
            "kind": "event", "scenario": scenario, "seed": tried.seed, "event": event.event, "t_s": event.t_s,
            "row_m": event.row_m, "wall_s": event.wall_s, "detail": event.detail,
        })
    });
    let cases = tried.cases.iter().map(|case| {
        json!({
            "kind": "verdict", "scenario": scenario, "seed": tried.seed, "name": case.name, "verdict": case.verdict,
            "message": case.message, "t_s": case.t_s, "row_m": case.row_m, "tree": case.tree,
            "last_events": case.last_events, "rerun": case.rerun,
        })
    });
    events.chain(cases).map(|line| format!("{line}\n")).collect()
}
