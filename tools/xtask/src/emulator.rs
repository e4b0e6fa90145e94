//! The release binary as a scanner on a free loopback port.

use std::os::unix::process::CommandExt;
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
    /// `127.0.0.1:port` of its TCP listener.
    pub tcp: String,
}

impl Emulator {
    /// Starts the built-in scene and waits for the listening line.
    pub fn start(workspace: &Workspace, extra: &[&str]) -> Result<Self, String> {
        Self::command(workspace, "emulate", extra)
    }

    /// The same of another command that listens.
    pub fn command(workspace: &Workspace, name: &str, extra: &[&str]) -> Result<Self, String> {
        let binary = workspace.built_binary()?;
        let child = Command::new(&binary)
            .args([name, "--tcp", "127.0.0.1:0", "--format", "jsonl"])
            .args(extra)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .process_group(0)
            .spawn()
            .map_err(|error| format!("cannot start {}: {error}", binary.display()))?;
        let mut emulator = Self { child, tcp: String::new() };
        let lines = shell::stdout_lines(&mut emulator.child)?;
        let end = Instant::now() + START_LIMIT;
        while emulator.tcp.is_empty() {
            let line = lines
                .recv_timeout(end.saturating_duration_since(Instant::now()))
                .map_err(|_| "rowscan emulate ended or printed no listening line for tcp")?;
            emulator.tcp = listening_address(&line).unwrap_or_default();
        }
        // Later events are nobody's business here, but a pipe nobody reads must not fill up.
        std::thread::spawn(move || lines.into_iter().for_each(drop));
        Ok(emulator)
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

/// The address in `{"event":"listening","endpoint":"tcp","address":"…"}`.
fn listening_address(line: &str) -> Option<String> {
    let event: Value = serde_json::from_str(line).ok()?;
    let listens = event["event"] == "listening" && event["endpoint"] == "tcp";
    listens.then(|| event["address"].as_str().map(str::to_owned)).flatten()
}

#[cfg(test)]
mod tests {
    use super::listening_address;

    #[test]
    fn only_the_tcp_listening_line_has_the_address() {
        let line = r#"{"event":"listening","endpoint":"tcp","address":"127.0.0.1:41123"}"#;
        assert_eq!(listening_address(line).as_deref(), Some("127.0.0.1:41123"));
        assert_eq!(listening_address(r#"{"event":"listening","endpoint":"pty","path":"x"}"#), None);
        assert_eq!(listening_address("listening on 127.0.0.1:41123"), None);
    }
}
