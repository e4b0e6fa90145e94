//! Who may depend on whom, and on what: the crates' borders, checked on the resolved dependency tree.

use crate::shell;
use crate::workspace::Workspace;

/// A crate and the crates it must never reach through normal dependencies.
struct Rule {
    package: &'static str,
    forbidden: &'static [&'static str],
    why: &'static str,
}

const RULES: &[Rule] = &[
    Rule {
        package: "rowscan-protocol",
        forbidden: &[
            "tokio",
            "mio",
            "socket2",
            "rowscan-driver",
            "rowscan-canopy",
            "rowscan-scenes",
            "rowscan-vehicle",
            "rowscan",
        ],
        why: "the protocol knows no async and no socket, and stands below every other crate",
    },
    Rule {
        package: "rowscan-recording",
        forbidden: &[
            "tokio",
            "mio",
            "socket2",
            "rowscan-driver",
            "rowscan-canopy",
            "rowscan-scenes",
            "rowscan-vehicle",
            "rowscan",
        ],
        why: "recordings know files and telegrams, no async and no socket",
    },
    Rule {
        package: "rowscan-canopy",
        forbidden: &[
            "tokio",
            "mio",
            "socket2",
            "rowscan-driver",
            "rowscan-scenes",
            "rowscan-vehicle",
            "rowscan",
        ],
        why: "the estimator knows no async, no socket and no truth",
    },
    Rule {
        package: "rowscan-vehicle",
        forbidden: &[
            "tokio",
            "mio",
            "socket2",
            "rowscan-driver",
            "rowscan-canopy",
            "rowscan-scenes",
            "rowscan",
        ],
        why: "the vehicle knows no async, no socket, no orchard and no estimate",
    },
    Rule {
        package: "rowscan-scenes",
        forbidden: &["tokio", "mio", "socket2", "rowscan-driver", "rowscan-canopy", "rowscan"],
        why: "the orchard knows no async, no socket and no estimate",
    },
    Rule {
        package: "rowscan-driver",
        forbidden: &["rowscan-canopy", "rowscan-scenes", "rowscan-vehicle", "rowscan"],
        why: "the driver cannot tell a real scanner from the emulator",
    },
];

/// Checks every rule with all features on.
pub fn check(workspace: &Workspace) -> Result<(), String> {
    let mut broken = Vec::new();
    for rule in RULES {
        let arguments =
            ["tree", "-p", rule.package, "-e", "normal", "--all-features", "--prefix", "none", "-f", "{p}"];
        let tree = shell::capture(&mut workspace.cargo(&arguments))?;
        for name in offenders(&tree, rule) {
            broken.push(format!("{} depends on {name}: {}", rule.package, rule.why));
        }
    }
    if broken.is_empty() { Ok(()) } else { Err(broken.join("\n")) }
}

/// The forbidden crates named in a flat `cargo tree`.
fn offenders<'a>(tree: &'a str, rule: &Rule) -> Vec<&'a str> {
    let mut names: Vec<&str> = tree
        .lines()
        .filter_map(|line| line.split_whitespace().next())
        .filter(|name| *name != rule.package && rule.forbidden.contains(name))
        .collect();
    names.sort_unstable();
    names.dedup();
    names
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn forbidden_crates_are_found_once_and_only_by_full_name() {
        let tree = "rowscan-canopy v0.1.0 (canopy)\nserde v1.0.0\ntokio-util v0.7.0\nrowscan-scenes v0.1.0\nrowscan-scenes v0.1.0 (*)\n";
        let found: Vec<Vec<&str>> = RULES.iter().map(|rule| offenders(tree, rule)).collect();
        let canopy = RULES.iter().position(|rule| rule.package == "rowscan-canopy");
        assert_eq!(canopy.map(|i| found[i].clone()), Some(vec!["rowscan-scenes"]));
    }
}
