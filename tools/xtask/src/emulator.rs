//! The release binary as a scanner on a free loopback port.

use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;

use crate::shell;
use crate::workspace::Workspace;

/// How long growing the scene and binding may take.
const START_LIMIT: Duration = Duration::from_secs(60);

/// How long an orderly end may take.
const STOP_LIMIT: Duration = Duration::from_secs(10);

/// A running `rowscan emulate`; killed when dropped.
pub struct Emulator {
    child: Child,
    /// Where it can be reached: `127.0.0.1:port`, or the path of a link.
    pub place: String,
}

impl Emulator {
    /// Starts the built-in scene on a free TCP port and waits for the listening line.
    pub fn start(workspace: &Workspace, extra: &[&str]) -> Result<Self, String> {
        Self::command(workspace, "emulate", extra)
    }

    /// The same of another command that listens.
    pub fn command(workspace: &Workspace, name: &str, extra: &[&str]) -> Result<Self, String> {
        Self::spawn(workspace, name, "tcp", &[&["--tcp", "127.0.0.1:0"], extra].concat())
    }

    /// The same on the endpoint of this name, which `arguments` ask for.
    pub fn start_on(workspace: &Workspace, endpoint: &str, arguments: &[&str]) -> Result<Self, String> {
        Self::spawn(workspace, "emulate", endpoint, arguments)
    }

    /// The built-in scene by another binary than the release build's.
    pub fn of(binary: &Path, arguments: &[&str]) -> Result<Self, String> {
        Self::spawn_of(binary, "emulate", "tcp", arguments)
    }

    fn spawn(workspace: &Workspace, name: &str, endpoint: &str, arguments: &[&str]) -> Result<Self, String> {
        Self::spawn_of(&workspace.built_binary()?, name, endpoint, arguments)
    }

    fn spawn_of(binary: &Path, name: &str, endpoint: &str, arguments: &[&str]) -> Result<Self, String> {
        let child = Command::new(binary)
            .args([name, "--format", "jsonl"])
            .args(arguments)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .process_group(0)
            .spawn()
            .map_err(|error| format!("cannot start {}: {error}", binary.display()))?;
        let mut emulator = Self { child, place: String::new() };
        let lines = shell::stdout_lines(&mut emulator.child)?;
        let end = Instant::now() + START_LIMIT;
        while emulator.place.is_empty() {
            let line = lines
                .recv_timeout(end.saturating_duration_since(Instant::now()))
                .map_err(|_| "rowscan emulate ended or printed no listening line")?;
            emulator.place = listening_place(&line, endpoint).unwrap_or_default();
        }
        // Later events are nobody's business here, but a pipe nobody reads must not fill up.
        std::thread::spawn(move || lines.into_iter().for_each(drop));
        Ok(emulator)
    }

    /// Its process.
    pub fn id(&self) -> u32 {
        self.child.id()
    }

    /// Interrupts it and checks that it ends in order.
    pub fn stop(mut self) -> Result<(), String> {
        shell::signal(&self.child, "INT");
        match shell::wait(&mut self.child, STOP_LIMIT) {
            Some(status) if status.success() => Ok(()),
            Some(status) => Err(format!("rowscan emulate ended with {status} after SIGINT")),
            None => Err(format!("rowscan emulate still runs {} s after SIGINT", STOP_LIMIT.as_secs())),
        }
    }
}

impl Drop for Emulator {
    fn drop(&mut self) {
        if matches!(self.child.try_wait(), Ok(None)) {
            shell::signal(&self.child, "KILL");
            let _ = self.child.wait();
        }
    }
}

/// The address in `{"event":"listening","endpoint":"tcp","address":"…"}`, or the path where it has one.
fn listening_place(line: &str, endpoint: &str) -> Option<String> {
    let event: Value = serde_json::from_str(line).ok()?;
    let listens = event["event"] == "listening" && event["endpoint"] == endpoint;
    let place = event["address"].as_str().or(event["path"].as_str());
    listens.then(|| place.map(str::to_owned)).flatten()
}

#[cfg(test)]
mod tests {
    use super::listening_place;

    #[test]
    fn only_the_endpoints_own_line_has_its_place() {
        let line = r#"{"event":"listening","endpoint":"tcp","address":"127.0.0.1:41123"}"#;
        assert_eq!(listening_place(line, "tcp").as_deref(), Some("127.0.0.1:41123"));
        let link = r#"{"event":"listening","endpoint":"pty","path":"x"}"#;
        assert_eq!(listening_place(link, "tcp"), None);
        assert_eq!(listening_place(link, "pty").as_deref(), Some("x"));
        assert_eq!(listening_place("listening on 127.0.0.1:41123", "tcp"), None);
    }
}
