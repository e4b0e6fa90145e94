//! Recordings of real devices. They are not part of this repository; see [`folder`].
// Every test file uses another part; what fails here fails a test.
#![allow(dead_code, unreachable_pub, clippy::unwrap_used, clippy::panic, clippy::print_stderr)]

use std::path::PathBuf;

use serde_json::Value;

/// All recordings with raw frames.
pub const NAMES: [&str; 5] = [
    "lms111_startup_first88",
    "lms511_20210302",
    "tim781s_20210125",
    "tim781s_fieldset_events",
    "mrs1104_20210722",
];

/// One recorded frame's place.
#[derive(Clone, Debug)]
pub struct Indexed {
    pub seconds: f64,
    pub from_device: bool,
    pub offset: usize,
    pub len: usize,
}

/// One recording.
pub struct Recording {
    pub name: &'static str,
    pub json: Value,
    pub device_to_host: Vec<u8>,
    pub host_to_device: Vec<u8>,
    pub index: Vec<Indexed>,
}

/// `$ROWSCAN_FACTS`, else `shared` beside the workspace.
fn folder() -> PathBuf {
    let facts = std::env::var_os("ROWSCAN_FACTS")
        .map_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../shared"), PathBuf::from);
    facts.join("protocol/recordings")
}

/// Every recording; none, with a notice, where the folder is absent.
pub fn recordings() -> Vec<Recording> {
    let folder = folder();
    if !folder.is_dir() {
        eprintln!("SKIPPED: recordings not found at {}", folder.display());
        return Vec::new();
    }
    NAMES.into_iter().map(|name| load(&folder, name)).collect()
}

fn load(folder: &std::path::Path, name: &'static str) -> Recording {
    let read = |suffix: &str| {
        let path = folder.join(format!("{name}{suffix}"));
        std::fs::read(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
    };
    let json: Value = serde_json::from_slice(&read(".json")).unwrap();
    let index = json["index"]
        .as_array()
        .unwrap()
        .iter()
        .map(|entry| Indexed {
            seconds: entry[0].as_f64().unwrap(),
            from_device: entry[1] == "d2h",
            offset: entry[2].as_u64().unwrap() as usize,
            len: entry[3].as_u64().unwrap() as usize,
        })
        .collect();
    Recording { name, json, device_to_host: read(".d2h.bin"), host_to_device: read(".h2d.bin"), index }
}

impl Recording {
    /// The bytes of one recorded frame.
    pub fn frame(&self, at: &Indexed) -> &[u8] {
        let stream = if at.from_device { &self.device_to_host } else { &self.host_to_device };
        &stream[at.offset..at.offset + at.len]
    }

    /// The payload of one recorded frame.
    pub fn payload(&self, at: &Indexed) -> &[u8] {
        let frame = self.frame(at);
        &frame[8..frame.len() - 1]
    }
}

/// The text of one file beside the recordings; `None`, with a notice, where it is absent.
pub fn text(name: &str) -> Option<String> {
    let path = folder().join(name);
    std::fs::read_to_string(&path).inspect_err(|error| eprintln!("SKIPPED: {}: {error}", path.display())).ok()
}
