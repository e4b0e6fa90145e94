//! The whole binary as a test sees it.

use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

/// A command under test that takes longer hangs. The longest takes half a minute on an idle machine; a loaded one is slower. Less
/// than the silence after which `cargo xtask ci` ends the run, so that the test that hangs is named.
const PATIENCE: Duration = Duration::from_secs(240);

pub fn rowscan() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_rowscan"));
    command.stdin(Stdio::null());
    command
}

/// What a finished command left.
pub struct Ended {
    pub code: Option<i32>,
    pub stdout: String,
    pub stderr: String,
}

/// Runs a command to its end.
pub fn run(args: &[&str]) -> Ended {
    let mut command = rowscan();
    let child =
        command.args(args).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("the binary runs");
    finish(child)
}

/// Runs a command that must be refused: exit code 2 and one complaint, which is given with the lines below it.
pub fn refused(args: &[&str]) -> String {
    let ended = run(args);
    assert_eq!((ended.code, ended.stdout.as_str()), (Some(2), ""), "{args:?}: {}", ended.stderr);
    // Of the command line's parser, or of the command.
    let complains = |line: &&str| line.starts_with("error: ") || line.starts_with("rowscan: ");
    assert_eq!(ended.stderr.lines().filter(complains).count(), 1, "{args:?}: {}", ended.stderr);
    ended.stderr.lines().skip_while(|line| !complains(line)).collect::<Vec<_>>().join("\n")
}

/// A message must say all of this.
pub fn assert_says(message: &str, parts: &[&str]) {
    for part in parts {
        assert!(message.contains(part), "expected `{part}` in: {message}");
    }
}

/// A path as an argument.
pub fn text(path: &Path) -> &str {
    path.to_str().expect("UTF-8")
}

/// Waits for a command, reading what it says meanwhile.
pub fn finish(mut child: Child) -> Ended {
    fn drain(pipe: Option<impl Read + Send + 'static>) -> std::thread::JoinHandle<String> {
        std::thread::spawn(move || {
            let mut text = String::new();
            if let Some(mut pipe) = pipe {
                pipe.read_to_string(&mut text).expect("UTF-8");
            }
            text
        })
    }
    let (stdout, stderr) = (drain(child.stdout.take()), drain(child.stderr.take()));
    let status = wait(&mut child);
    Ended { code: status.code(), stdout: stdout.join().expect("read"), stderr: stderr.join().expect("read") }
}

fn wait(child: &mut Child) -> ExitStatus {
    let start = Instant::now();
    loop {
        if let Some(status) = child.try_wait().expect("it can be waited for") {
            return status;
        }
        if start.elapsed() > PATIENCE {
            let _ = child.kill();
            panic!("a command did not end within {PATIENCE:?}");
        }
        std::thread::sleep(Duration::from_millis(10));
    }
}

/// Sends SIGINT, as Ctrl-C does.
pub fn interrupt(child: &Child) {
    let sent = Command::new("kill").args(["-INT", &child.id().to_string()]).status().expect("kill runs");
    assert!(sent.success());
}

/// An emulator that has said where it listens. Ended when dropped.
pub struct Emulator {
    pub child: Child,
    pub address: String,
}

impl Emulator {
    pub fn start(args: &[&str]) -> Self {
        Self::command("emulate", args)
    }

    /// The same of another command that listens.
    pub fn command(name: &str, args: &[&str]) -> Self {
        let args = [&["--tcp", "127.0.0.1:0"], args].concat();
        let (child, endpoints) = listening(name, &args, 1);
        assert_eq!(endpoints[0]["endpoint"], "tcp");
        let address = endpoints[0]["address"].as_str().expect("an address").to_owned();
        Self { child, address }
    }

    /// The same with a line, or whatever else it says where it is found.
    pub fn on_a_line(name: &str, args: &[&str]) -> Self {
        let (child, _) = listening(name, args, 1);
        Self { child, address: String::new() }
    }

    /// Ends it as Ctrl-C does, and waits for its end.
    pub fn end(mut self) {
        interrupt(&self.child);
        assert!(wait(&mut self.child).success());
    }

    pub fn url(&self) -> String {
        format!("tcp://{}", self.address)
    }

    /// Memory held now, bytes.
    pub fn resident_bytes(&self) -> u64 {
        let path = PathBuf::from(format!("/proc/{}/statm", self.child.id()));
        let statm = std::fs::read_to_string(path).expect("it runs");
        let pages: u64 = statm.split(' ').nth(1).and_then(|pages| pages.parse().ok()).expect("a number");
        pages * 4096
    }
}

/// Starts a command and reads where its first `count` endpoints are.
pub fn listening(name: &str, args: &[&str], count: usize) -> (Child, Vec<serde_json::Value>) {
    let mut command = rowscan();
    let mut child = command
        .args([name, "--format", "jsonl"])
        .args(args)
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .expect("the binary runs");
    let lines = BufReader::new(child.stdout.take().expect("piped")).lines();
    let endpoint = |line: std::io::Result<String>| {
        let endpoint: serde_json::Value = serde_json::from_str(&line.expect("text")).expect("json");
        assert_eq!(endpoint["event"], "listening");
        endpoint
    };
    let endpoints: Vec<_> = lines.take(count).map(endpoint).collect();
    assert_eq!(endpoints.len(), count, "{name} {args:?} ended before it listened");
    (child, endpoints)
}

/// A command that tells what happens in JSON lines. Ended when dropped.
pub struct Telling {
    pub child: Child,
    lines: std::io::Lines<BufReader<std::process::ChildStdout>>,
}

impl Telling {
    pub fn start(name: &str, args: &[&str]) -> Self {
        let mut command = rowscan();
        command.args([name, "--format", "jsonl"]).args(args).stdout(Stdio::piped()).stderr(Stdio::null());
        let mut child = command.spawn().expect("the binary runs");
        let lines = BufReader::new(child.stdout.take().expect("piped")).lines();
        Self { child, lines }
    }

    /// The next line; none at the end.
    pub fn next(&mut self) -> Option<serde_json::Value> {
        let line = self.lines.next()?.expect("text");
        Some(serde_json::from_str(&line).expect("json"))
    }

    /// Where it listens; its first line.
    pub fn address(&mut self) -> String {
        let line = self.next().expect("it listens");
        assert_eq!(line["event"], "listening", "{line}");
        line["address"].as_str().or(line["path"].as_str()).expect("a place").to_owned()
    }

    /// Ends it as Ctrl-C does; what it still tells.
    pub fn end(mut self) -> Vec<serde_json::Value> {
        interrupt(&self.child);
        let rest = std::iter::from_fn(|| self.next()).collect();
        assert!(wait(&mut self.child).success());
        rest
    }
}

impl Drop for Telling {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Drop for Emulator {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
