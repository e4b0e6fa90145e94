//! Licences of everything that ships: `cargo deny` if it is installed, else a check of `cargo metadata` against the same list.

use std::collections::{BTreeSet, HashMap};
use std::fs;

use serde_json::Value;

use crate::shell;
use crate::workspace::Workspace;

/// Checks all normal and build dependencies of the workspace.
pub fn check(workspace: &Workspace) -> Result<(), String> {
    if shell::has("cargo-deny") {
        return shell::run(&mut workspace.cargo(&["deny", "check", "licenses", "bans"]));
    }
    println!("    cargo-deny is not installed; checking licences by cargo metadata");
    let allowed = allowed_licences(workspace)?;
    let text =
        shell::capture(&mut workspace.cargo(&["metadata", "--format-version", "1", "--all-features"]))?;
    let metadata: Value = serde_json::from_str(&text).map_err(|error| format!("cargo metadata: {error}"))?;
    let mut refused = Vec::new();
    let shipped = shipped_packages(&metadata);
    for package in metadata["packages"].as_array().into_iter().flatten() {
        if !package["id"].as_str().is_some_and(|id| shipped.contains(id)) {
            continue;
        }
        let licence = package["license"].as_str().unwrap_or("");
        if !is_allowed(licence, &allowed) {
            refused.push(format!("{} {}: licence `{licence}`", package["name"], package["version"]));
        }
    }
    println!("    {} packages", shipped.len());
    if refused.is_empty() { Ok(()) } else { Err(format!("not in deny.toml's list:\n{}", refused.join("\n"))) }
}

/// The `allow = […]` list of deny.toml, so that both checks read one list.
fn allowed_licences(workspace: &Workspace) -> Result<BTreeSet<String>, String> {
    let text = fs::read_to_string(workspace.root.join("deny.toml"))
        .map_err(|error| format!("deny.toml: {error}"))?;
    let list = text
        .split_once("[licenses]")
        .and_then(|(_, rest)| rest.split_once("allow = ["))
        .map(|(_, rest)| rest);
    let list = list.and_then(|rest| rest.split_once(']')).map(|(list, _)| list);
    let list = list.ok_or("deny.toml: no `allow = [` under [licenses]")?;
    Ok(list.split('"').skip(1).step_by(2).map(str::to_owned).collect())
}

/// Ids reachable from the workspace by normal and build dependencies.
fn shipped_packages(metadata: &Value) -> BTreeSet<&str> {
    let nodes: HashMap<&str, &Value> = metadata["resolve"]["nodes"]
        .as_array()
        .into_iter()
        .flatten()
        .filter_map(|node| Some((node["id"].as_str()?, node)))
        .collect();
    let mut open: Vec<&str> =
        metadata["workspace_members"].as_array().into_iter().flatten().filter_map(Value::as_str).collect();
    let mut seen = BTreeSet::new();
    while let Some(id) = open.pop() {
        if !seen.insert(id) {
            continue;
        }
        let dependencies = nodes.get(id).and_then(|node| node["deps"].as_array());
        for dependency in dependencies.into_iter().flatten() {
            let kinds = dependency["dep_kinds"].as_array();
            let ships = kinds.into_iter().flatten().any(|kind| kind["kind"] != "dev");
            if let Some(package) = dependency["pkg"].as_str().filter(|_| ships) {
                open.push(package);
            }
        }
    }
    seen
}

/// Judges an SPDX expression: every AND part needs one OR part that is allowed. Exceptions (`WITH`) must be listed whole.
fn is_allowed(expression: &str, allowed: &BTreeSet<String>) -> bool {
    let expression = expression.replace('/', " OR ");
    if let Some((before, rest)) = expression.split_once('(')
        && let Some((inside, after)) = rest.split_once(')')
    {
        // A verdict on the group takes the group's place, under a name the list holds if the group is allowed.
        let verdict =
            if is_allowed(inside, allowed) { allowed.first().map_or("", String::as_str) } else { "refused" };
        return is_allowed(&format!("{before}{verdict}{after}"), allowed);
    }
    expression.split(" OR ").any(|part| part.split(" AND ").all(|name| allowed.contains(name.trim())))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spdx_expressions() {
        let allowed = ["MIT", "Unicode-3.0", "Apache-2.0"].map(str::to_owned).into();
        for good in [
            "MIT",
            "MIT OR GPL-3.0",
            "MIT/Apache-2.0",
            "(MIT OR GPL-3.0) AND Unicode-3.0",
            "GPL-3.0 OR (MIT AND Apache-2.0)",
        ] {
            assert!(is_allowed(good, &allowed), "{good}");
        }
        for bad in [
            "",
            "GPL-3.0",
            "MIT AND GPL-3.0",
            "(MIT OR Apache-2.0) AND GPL-3.0",
            "Apache-2.0 WITH LLVM-exception",
        ] {
            assert!(!is_allowed(bad, &allowed), "{bad}");
        }
    }
}
