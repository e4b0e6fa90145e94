//! Running other programs: checked, line by line, or bounded in time.

use std::io::{BufRead, BufReader, Read};
use std::os::unix::process::CommandExt;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::mpsc;
use std::thread;
use std::time::{Duration, Instant};

/// How often a bounded run looks whether its program has ended.
const POLL: Duration = Duration::from_millis(20);

/// Runs a program with our own output; an exit other than 0 is an error that names the command.
pub fn run(command: &mut Command) -> Result<(), String> {
    let line = describe(command);
    let status = command.stdin(Stdio::null()).status().map_err(|error| format!("{line}: {error}"))?;
    check(&line, status)
}

/// Runs a program and returns what it printed on stdout; stderr is ours.
pub fn capture(command: &mut Command) -> Result<String, String> {
    let line = describe(command);
    let output = command
        .stdin(Stdio::null())
        .stderr(Stdio::inherit())
        .output()
        .map_err(|error| format!("{line}: {error}"))?;
    check(&line, output.status)?;
    Ok(String::from_utf8_lossy(&output.stdout).into_owned())
}

/// Runs a program and hands over its stdout line by line while it runs; stderr is ours. The program and its children are
/// killed after `limit`.
pub fn run_lines(command: &mut Command, limit: Duration, mut each: impl FnMut(&str)) -> Result<(), String> {
    let line = describe(command);
    let mut child = command
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .process_group(0)
        .spawn()
        .map_err(|error| format!("{line}: {error}"))?;
    let lines = stdout_lines(&mut child)?;
    let end = Instant::now() + limit;
    loop {
        match lines.recv_timeout(end.saturating_duration_since(Instant::now())) {
            Ok(text) => each(&text),
            Err(mpsc::RecvTimeoutError::Disconnected) => break,
            Err(mpsc::RecvTimeoutError::Timeout) => {
                signal(&child, "KILL");
                let _ = child.wait();
                return Err(format!("{line}: still running after {} s", limit.as_secs()));
            }
        }
    }
    let status =
        wait(&mut child, Duration::from_secs(10)).ok_or(format!("{line}: closed stdout but did not end"))?;
    check(&line, status)
}

/// The lines a child prints on stdout, read by a thread of their own so that a wait for one can be bounded.
pub fn stdout_lines(child: &mut Child) -> Result<mpsc::Receiver<String>, String> {
    let stdout = child.stdout.take().ok_or("stdout is not piped")?;
    let (sender, receiver) = mpsc::channel();
    thread::spawn(move || {
        let mut reader = BufReader::new(stdout);
        let mut line = Vec::new();
        while matches!(reader.read_until(b'\n', &mut line), Ok(n) if n > 0) {
            let text = String::from_utf8_lossy(&line).trim_end_matches(['\r', '\n']).to_owned();
            if sender.send(text).is_err() {
                break;
            }
            line.clear();
        }
    });
    Ok(receiver)
}

/// The bytes a child prints on stdout, in the pieces they come in.
pub fn stdout_bytes(child: &mut Child) -> Result<mpsc::Receiver<Vec<u8>>, String> {
    let mut stdout = child.stdout.take().ok_or("stdout is not piped")?;
    let (sender, receiver) = mpsc::channel();
    thread::spawn(move || {
        let mut buffer = vec![0; 16 * 1024];
        while let Ok(n) = stdout.read(&mut buffer) {
            if n == 0 || sender.send(buffer[..n].to_vec()).is_err() {
                break;
            }
        }
    });
    Ok(receiver)
}

/// Waits for a child's end, at most `limit`.
pub fn wait(child: &mut Child, limit: Duration) -> Option<ExitStatus> {
    let end = Instant::now() + limit;
    loop {
        match child.try_wait() {
            Ok(Some(status)) => return Some(status),
            Ok(None) if Instant::now() < end => thread::sleep(POLL),
            Ok(None) | Err(_) => return None,
        }
    }
}

/// Sends a signal (`INT`, `KILL`, …) to the process group that `child` leads.
pub fn signal(child: &Child, name: &str) {
    // std cannot signal a group; the kill program can.
    let _ = Command::new("kill")
        .args([&format!("-{name}"), "--", &format!("-{}", child.id())])
        .stderr(Stdio::null())
        .status();
}

/// True if `program` is on the path.
pub fn has(program: &str) -> bool {
    let Some(path) = std::env::var_os("PATH") else { return false };
    std::env::split_paths(&path).any(|folder| folder.join(program).is_file())
}

fn check(line: &str, status: ExitStatus) -> Result<(), String> {
    if status.success() { Ok(()) } else { Err(format!("{line}: {status}")) }
}

fn describe(command: &Command) -> String {
    let program = std::path::Path::new(command.get_program());
    let name = program.file_name().unwrap_or(command.get_program()).to_string_lossy().into_owned();
    let arguments = command.get_args().map(|argument| argument.to_string_lossy().into_owned());
    std::iter::once(name).chain(arguments).collect::<Vec<_>>().join(" ")
}
