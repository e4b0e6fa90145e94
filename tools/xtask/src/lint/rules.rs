//! The rules, as data.

/// Words that some files must not hold.
pub struct Rule {
    /// Paths start with one of these; empty: every Rust file.
    folders: &'static [&'static str],
    /// Files that may, and why they may stands beside them.
    except: &'static [&'static str],
    /// The words; letters next to them make another word.
    pub words: &'static [&'static str],
    /// Code under `#[cfg(test)]` is held to it as well.
    pub tests_too: bool,
    /// Why not.
    pub why: &'static str,
}

impl Rule {
    /// True if the rule is about the file at `path`.
    pub fn covers(&self, path: &str) -> bool {
        let in_folder = self.folders.is_empty() || self.folders.iter().any(|folder| path.starts_with(folder));
        let is_exempt = self.except.contains(&path) || !self.tests_too && path.ends_with("/tests.rs");
        in_folder && !is_exempt
    }
}

const SANS_IO: &[&str] = &[
    "protocol/src/",
    "recording/src/",
    "canopy/src/",
    "vehicle/src/",
    "sim-scenes/src/",
    "sprayer/src/",
    "settings/src/",
];

/// Every rule on words.
pub const ALL: &[Rule] = &[
    Rule {
        folders: SANS_IO,
        except: &[],
        words: &["sleep", "sleep_until", "Instant::now", "SystemTime"],
        tests_too: false,
        why: "this crate knows no clock; take the time as an argument",
    },
    Rule {
        folders: SANS_IO,
        except: &[],
        words: &["std::net", "tokio", "mio", "socket2"],
        tests_too: false,
        why: "this crate knows no socket",
    },
    Rule {
        folders: SANS_IO,
        except: &[],
        words: &["std::env", "thread_rng", "rand::rng", "OsRng", "static mut", "thread_local!"],
        tests_too: false,
        why: "this crate reads no environment and keeps no global state",
    },
    Rule {
        folders: &[
            "src/",
            "bench/src/",
            "bus/src/",
            "check/src/",
            "control/src/",
            "driver/src/",
            "emulator/src/",
            "ports/src/",
            "python/src/",
            "recording/src/",
            "sim-scenes/src/",
            "study/src/",
            "web/src/",
        ],
        except: &[
            // What the system tells of processes and devices, in its own folders.
            "bus/src/link/socketcan.rs",
            "emulator/src/processes.rs",
            // The folder that a run makes for itself.
            "check/src/output.rs",
            // A study's journal is added to; a repaired recording's original gets a second name.
            "src/cli/study/shards.rs",
            "src/cli/repair.rs",
        ],
        words: &["File::open", "File::create", "fs::read", "fs::read_to_string", "fs::write", "OpenOptions"],
        tests_too: false,
        why: "files are opened by the crate `files`, which bounds inputs and keeps outputs off them",
    },
    Rule {
        folders: &[],
        // A SIMD module with a scalar twin and a test that they agree may be listed here, too.
        except: &[
            // Memory shared with other processes.
            "child-clock/src/map.rs",
            // In the place of C functions: pointers are what they are given.
            "child-clock/preload/src/clocks.rs",
            "child-clock/preload/src/descriptors.rs",
            "child-clock/preload/src/epolls.rs",
            "child-clock/preload/src/errno.rs",
            "child-clock/preload/src/futexes.rs",
            "child-clock/preload/src/instant.rs",
            "child-clock/preload/src/keeper.rs",
            "child-clock/preload/src/lock.rs",
            "child-clock/preload/src/locks.rs",
            "child-clock/preload/src/page.rs",
            "child-clock/preload/src/polls.rs",
            "child-clock/preload/src/process.rs",
            "child-clock/preload/src/real.rs",
            "child-clock/preload/src/receives.rs",
            "child-clock/preload/src/selects.rs",
            "child-clock/preload/src/sleeps.rs",
            "child-clock/preload/src/sockets.rs",
            "child-clock/preload/src/system_call.rs",
            "child-clock/preload/src/timers.rs",
        ],
        words: &["unsafe"],
        tests_too: true,
        why: "unsafe code needs a place on the list in tools/xtask/src/lint/rules.rs",
    },
    Rule {
        folders: &[],
        except: &[],
        words: &["todo!", "unimplemented!", "#[ignore]"],
        tests_too: true,
        why: "unfinished, or ignored without a reason",
    },
];

/// Home folders of people; the folder of the checkout itself is forbidden too.
pub const HOMES: &[&str] = &["/home/", "/Users/"];

/// Fine in prose, not in code.
pub const TEMPORARY: &str = "/tmp/";

/// This file holds the names it forbids.
pub const MAY_NAME_PATHS: &[&str] = &["tools/xtask/src/lint/rules.rs"];
