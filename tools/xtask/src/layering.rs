//! Who may depend on whom, and on what: the crates' borders, checked on the resolved dependency tree.

use std::collections::BTreeSet;

use crate::shell;
use crate::workspace::Workspace;

/// A crate and the crates it must never reach through normal dependencies.
struct Rule {
    package: &'static str,
    features: Features,
    forbidden: &'static [&'static str],
    why: &'static str,
}

/// With which of its features a crate is checked.
#[derive(Clone, Copy)]
enum Features {
    All,
    Default,
    Only(&'static str),
}

/// Crates of the program with its default parts: whoever tries it waits for them to compile.
const MOST_CRATES: usize = 221;

const RULES: &[Rule] = &[
    Rule {
        package: "rowscan-protocol",
        features: Features::All,
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
        features: Features::All,
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
        package: "rowscan-child-clock",
        features: Features::All,
        forbidden: &["tokio", "mio", "socket2", "serde", "rowscan-protocol", "rowscan"],
        why: "bench and child share a page and nothing else",
    },
    Rule {
        package: "rowscan-child-clock-preload",
        features: Features::All,
        forbidden: &["tokio", "mio", "socket2", "serde", "rowscan-protocol", "rowscan"],
        why: "what is loaded into somebody else's program is small",
    },
    Rule {
        package: "rowscan-canopy",
        features: Features::All,
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
        package: "rowscan-settings",
        features: Features::All,
        forbidden: &[
            "tokio",
            "mio",
            "socket2",
            "rowscan-protocol",
            "rowscan-vehicle",
            "rowscan-faults",
            "rowscan",
        ],
        why: "a reader of files, and rows of faults, are data: they know no part and no async",
    },
    Rule {
        package: "rowscan-vehicle",
        features: Features::All,
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
        features: Features::All,
        forbidden: &["tokio", "mio", "socket2", "rowscan-driver", "rowscan-canopy", "rowscan"],
        why: "the orchard knows no async, no socket and no estimate",
    },
    Rule {
        package: "rowscan-render",
        features: Features::All,
        forbidden: &[
            "tokio",
            "mio",
            "socket2",
            "resvg",
            "rowscan-driver",
            "rowscan-canopy",
            "rowscan-emulator",
            "rowscan",
        ],
        why: "pictures know orchards and nothing of scanners' links, estimates and plots",
    },
    Rule {
        package: "rowscan-driver",
        features: Features::All,
        forbidden: &["rowscan-canopy", "rowscan-scenes", "rowscan-vehicle", "rowscan"],
        why: "the driver cannot tell a real scanner from the emulator",
    },
    Rule {
        package: "rowscan-driver",
        features: Features::Only("tcp"),
        forbidden: &["mcap", "zstd", "lz4", "serialport", "tokio-serial", "pcap-parser", "etherparse"],
        // A picoScan's REST is JSON.
        why: "a driver for TCP alone reads no recordings and opens no serial port",
    },
    Rule {
        package: "rowscan-ports",
        features: Features::All,
        forbidden: &[
            "rowscan-driver",
            "rowscan-canopy",
            "rowscan-scenes",
            "rowscan-bus",
            "rowscan-emulator",
            "rowscan",
        ],
        why: "ports carry bytes and know nothing of what they mean",
    },
    Rule {
        package: "rowscan-faults",
        features: Features::All,
        forbidden: &[
            "clap",
            "rowscan-driver",
            "rowscan-canopy",
            "rowscan-scenes",
            "rowscan-vehicle",
            "rowscan-bus",
            "rowscan-recording",
            "rowscan-emulator",
            "rowscan",
        ],
        why: "faults know bytes and telegrams' boundaries, no device, no driver and no command line",
    },
    Rule {
        package: "rowscan-files",
        features: Features::All,
        forbidden: &["tokio", "mio", "socket2", "serde", "rowscan-protocol", "rowscan"],
        why: "who opens files knows nothing of what is in them",
    },
    Rule {
        package: "rowscan-sprayer",
        features: Features::All,
        forbidden: &[
            "tokio",
            "mio",
            "socket2",
            "rowscan-driver",
            "rowscan-canopy",
            "rowscan-bus",
            "rowscan-emulator",
            "rowscan",
        ],
        why: "the sprayer knows commands, leaves and the drive, no async, no bus and no estimate",
    },
    Rule {
        package: "rowscan-bus",
        features: Features::All,
        forbidden: &["rowscan-driver", "rowscan-scenes", "rowscan-emulator", "rowscan"],
        why: "the bus knows no orchard and no emulator",
    },
    Rule {
        package: "rowscan-bench",
        features: Features::All,
        forbidden: &[
            "clap",
            "comfy-table",
            "parquet",
            "plotters",
            "rowscan-driver",
            "rowscan-check",
            "rowscan",
        ],
        why: "a bench runs rigs and knows no driver and no command line",
    },
    Rule {
        package: "rowscan-emulator",
        features: Features::All,
        forbidden: &["clap", "comfy-table", "parquet", "las", "rowscan-driver", "rowscan-study", "rowscan"],
        why: "somebody else's test embeds the emulator without the command line, and the emulator never sees the driver",
    },
    Rule {
        package: "rowscan-control",
        features: Features::All,
        forbidden: &["clap", "comfy-table", "parquet", "rowscan-driver", "rowscan-study", "rowscan"],
        why: "somebody else's test embeds the control without the command line",
    },
    Rule {
        package: "rowscan-rest",
        features: Features::All,
        forbidden: &["clap", "comfy-table", "parquet", "rowscan-driver", "rowscan-study", "rowscan"],
        why: "somebody else's test embeds the REST interface without the command line",
    },
    Rule {
        package: "rowscan-web",
        features: Features::All,
        forbidden: &["clap", "comfy-table", "parquet", "rowscan-driver", "rowscan-study", "rowscan"],
        why: "the page shows what it is handed, whoever measured it",
    },
    Rule {
        package: "rowscan-study",
        features: Features::All,
        forbidden: &["clap", "comfy-table", "rowscan-driver", "rowscan"],
        why: "studies print nothing and open no link",
    },
    Rule {
        package: "rowscan-check",
        features: Features::All,
        forbidden: &["clap", "comfy-table", "rowscan-driver", "rowscan"],
        why: "the bench is a library beneath the command line, and never talks by our own driver",
    },
    Rule {
        package: "rowscan",
        features: Features::Default,
        forbidden: &["resvg", "svg2pdf", "las", "parquet", "foxglove", "lz4-sys", "zstd-sys"],
        why: "what few need is a feature, and the default compiles no C",
    },
];

/// Checks every rule.
pub fn check(workspace: &Workspace) -> Result<(), String> {
    let mut broken = Vec::new();
    for rule in RULES {
        for name in offenders(&tree(workspace, rule.package, rule.features)?, rule) {
            broken.push(format!("{} depends on {name}: {}", rule.package, rule.why));
        }
    }
    let crates = crates(&tree(workspace, "rowscan", Features::Default)?);
    println!("    {crates} crates in the default build");
    if crates > MOST_CRATES {
        broken.push(format!("the default build has {crates} crates, more than {MOST_CRATES}"));
    }
    if broken.is_empty() { Ok(()) } else { Err(broken.join("\n")) }
}

/// A crate's normal dependencies, one a line.
fn tree(workspace: &Workspace, package: &str, features: Features) -> Result<String, String> {
    let mut arguments = vec!["tree", "-p", package, "-e", "normal", "--prefix", "none", "-f", "{p}"];
    match features {
        Features::All => arguments.push("--all-features"),
        Features::Default => {}
        Features::Only(features) => arguments.extend(["--no-default-features", "--features", features]),
    }
    shell::capture(&mut workspace.cargo(&arguments))
}

/// How many crates a flat `cargo tree` names, each version once.
fn crates(tree: &str) -> usize {
    let name = |line: &str| line.split_whitespace().take(2).map(str::to_owned).collect::<Vec<_>>();
    tree.lines().map(name).collect::<BTreeSet<_>>().len()
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
        assert_eq!(crates(tree), 4);
    }
}
