//! Where the host's clock is read and waited for: one file in each async crate.

use std::collections::BTreeMap;

use super::facts::{Facts, Scope};

/// A crate that may read the clock: its name, the folder of its sources, and the one file that may.
pub struct Clock {
    pub name: &'static str,
    pub folder: &'static str,
    pub file: &'static str,
}

/// Every crate with a clock. What stands in none of these folders is sans I/O, or a tool.
pub const CLOCKS: &[Clock] = &[
    Clock { name: "driver", folder: "driver/src/", file: "driver/src/clock.rs" },
    Clock { name: "emulator", folder: "emulator/src/", file: "emulator/src/clock/sim_clock.rs" },
    Clock { name: "faults", folder: "faults/src/", file: "faults/src/clock.rs" },
    Clock { name: "ports", folder: "ports/src/", file: "ports/src/clock.rs" },
    Clock { name: "check", folder: "check/src/", file: "check/src/clock.rs" },
    Clock { name: "control", folder: "control/src/", file: "control/src/clock.rs" },
    Clock { name: "web", folder: "web/src/", file: "web/src/clock.rs" },
    Clock { name: "python", folder: "python/src/", file: "python/src/wait.rs" },
    // These wait by the clock of `ports` alone.
    Clock { name: "bench", folder: "bench/src/", file: "" },
    Clock { name: "bus", folder: "bus/src/", file: "" },
    Clock { name: "rest", folder: "rest/src/", file: "" },
    Clock { name: "rowscan", folder: "src/", file: "" },
];

/// Functions that wait, by the module that has them.
const WAITS: &[(&[&str], &[&str])] = &[
    (&["tokio", "time"], &["sleep", "sleep_until", "timeout", "timeout_at", "interval", "interval_at"]),
    (&["std", "thread"], &["sleep", "sleep_ms", "sleep_until", "park_timeout"]),
];

/// What the files of a crate say.
#[derive(Default)]
pub struct Found {
    /// The first place in each file that reads the clock, as `file:line (what)`.
    pub places: Vec<String>,
    /// Those of them that are not in the one file that may.
    pub violations: Vec<String>,
}

/// Looks through the files of a crate.
pub fn find(clock: &Clock, files: &BTreeMap<String, Facts>) -> Found {
    let mut found = Found::default();
    for (path, facts) in
        files.iter().filter(|(path, _)| path.starts_with(clock.folder) && !path.ends_with("/tests.rs"))
    {
        let Some((line, what)) = facts.scopes.iter().flat_map(uses).min() else { continue };
        let place = format!("{path}:{line} ({what})");
        if path != clock.file {
            found.violations.push(format!(
                "{place}: in {} only {} reads the clock or waits for it",
                clock.name, clock.file
            ));
        }
        found.places.push(place);
    }
    found
}

/// Lines and names of everything in `scope` that reads the clock.
fn uses(scope: &Scope) -> Vec<(usize, String)> {
    let imported = scope.imports.iter().filter_map(|import| {
        let path: Vec<&str> = import.path.iter().map(String::as_str).collect();
        let is_glob = import.name == "*" && WAITS.iter().any(|(module, _)| path == *module);
        (is_glob || is_clock(&path)).then(|| (import.line, import.path.join("::")))
    });
    let mentioned = scope.mentions.iter().filter_map(|(path, line)| {
        let (first, rest) = path.split_first()?;
        let import = scope.imports.iter().find(|import| import.name == *first);
        let head = import.map_or(std::slice::from_ref(first), |import| &import.path);
        let whole: Vec<&str> = head.iter().chain(rest).map(String::as_str).collect();
        is_clock(&whole).then(|| (*line, path.join("::")))
    });
    imported.chain(mentioned).collect()
}

/// True if the path names a function that waits, `Instant::now`, or the system's time.
fn is_clock(path: &[&str]) -> bool {
    let waits = WAITS.iter().any(|(module, functions)| {
        path.strip_prefix(*module)
            .is_some_and(|rest| rest.first().is_some_and(|name| functions.contains(name)))
    });
    waits
        || path.windows(2).any(|pair| pair == ["Instant", "now"])
        || path.iter().any(|name| matches!(*name, "SystemTime" | "UNIX_EPOCH"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn violations(files: &[(&str, &str)]) -> Vec<String> {
        let files = files.iter().map(|(path, text)| ((*path).to_owned(), Facts::read(text).expect(path)));
        let files = files.collect();
        CLOCKS.iter().flat_map(|clock| find(clock, &files).violations).collect()
    }

    #[test]
    fn waiting_is_found_however_it_is_imported() {
        for text in [
            "use tokio::time::timeout;",
            "use tokio::time::{Duration, sleep_until as wait};",
            "use tokio::time::*;",
            "use tokio::time; fn f() { time::interval(d) }",
            "use tokio::time as t; fn f() { select! { _ = t::sleep(d) => {} } }",
            "fn f() { tokio::time::timeout(d, x) }",
            "fn f() { use std::thread::{self, sleep}; }",
            "use std::time::Instant as Host; fn f() { Host::now() }",
            "fn f() { std::time::Instant::now() }",
            "use std::time::SystemTime;",
        ] {
            assert_eq!(violations(&[("driver/src/x.rs", text)]).len(), 1, "{text}");
            assert!(violations(&[("driver/src/clock.rs", text)]).is_empty(), "{text}");
            assert!(
                violations(&[("driver/src/x.rs", &format!("#[cfg(test)]\nmod tests {{ {text} }}"))])
                    .is_empty()
            );
        }
    }

    #[test]
    fn a_name_that_only_sounds_like_waiting_is_none() {
        let text = "use crate::clock::timeout; use tokio::time::{Duration, Instant};\n\
                    fn f(timeout: Duration) { self.timeout(timeout); x.sleep(); other::interval(y) }";
        assert!(violations(&[("src/x.rs", text)]).is_empty());
    }
}
