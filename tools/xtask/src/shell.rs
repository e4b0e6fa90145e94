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

/// When a program that is still running is killed.
#[derive(Clone, Copy, Debug)]
pub enum Limit {
    /// After so long in all.
    InAll(Duration),
    /// After so long without a line on stdout or stderr, however long it runs: a loaded machine is slow, a hanging one is silent.
    Silent(Duration),
}

/// Runs a program and hands over its stdout line by line while it runs; stderr goes to ours. The program and its children are
/// killed at the `limit`.
pub fn run_lines(command: &mut Command, limit: Limit, mut each: impl FnMut(&str)) -> Result<(), String> {
    let line = describe(command);
    let stderr = if matches!(limit, Limit::Silent(_)) { Stdio::piped() } else { Stdio::inherit() };
    let mut child = command
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(stderr)
        .process_group(0)
        .spawn()
        .map_err(|error| format!("{line}: {error}"))?;
    let (sender, lines) = mpsc::channel();
    if let Some(stderr) = child.stderr.take() {
        send_lines(stderr, sender.clone(), |text| {
            eprintln!("{text}");
            None
        });
    }
    send_lines(child.stdout.take().ok_or("stdout is not piped")?, sender, Some);
    let start = Instant::now();
    loop {
        let (patience, why) = match limit {
            Limit::InAll(limit) => {
                (limit.saturating_sub(start.elapsed()), format!("still running after {} s", limit.as_secs()))
            }
            Limit::Silent(limit) => (limit, format!("printed nothing for {} s", limit.as_secs())),
        };
        match lines.recv_timeout(patience) {
            Ok(Some(text)) => each(&text),
            Ok(None) => {}
            Err(mpsc::RecvTimeoutError::Disconnected) => break,
            Err(mpsc::RecvTimeoutError::Timeout) => {
                signal(&child, "KILL");
                let _ = child.wait();
                return Err(format!("{line}: {why}"));
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
    send_lines(stdout, sender, |text| text);
    Ok(receiver)
}

/// Reads lines in a thread of its own and sends what `make` makes of each, until the pipe or the receiver ends.
fn send_lines<T: Send + 'static>(
    pipe: impl Read + Send + 'static,
    sender: mpsc::Sender<T>,
    make: impl Fn(String) -> T + Send + 'static,
) {
    thread::spawn(move || {
        let mut reader = BufReader::new(pipe);
        let mut line = Vec::new();
        while matches!(reader.read_until(b'\n', &mut line), Ok(n) if n > 0) {
            let text = String::from_utf8_lossy(&line).trim_end_matches(['\r', '\n']).to_owned();
            if sender.send(make(text)).is_err() {
                break;
            }
            line.clear();
        }
    });
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

#[cfg(test)]
mod tests {
    use super::*;

    fn run(script: &str, limit: Limit) -> (Vec<String>, Result<(), String>) {
        let mut lines = Vec::new();
        let result =
            run_lines(Command::new("sh").args(["-c", script]), limit, |line| lines.push(line.to_owned()));
        (lines, result)
    }

    #[test]
    fn a_program_that_goes_on_talking_may_take_long_and_a_silent_one_is_killed() {
        let silence = Limit::Silent(Duration::from_millis(500));
        let talks = "for n in 1 2 3 4 5 6 7 8; do echo $n >&2; sleep 0.1; done; echo end";
        assert_eq!(run(talks, silence), (vec!["end".to_owned()], Ok(())));
        let (lines, result) = run("echo begin; sleep 30", silence);
        assert_eq!(lines, ["begin"]);
        assert!(result.is_err_and(|why| why.ends_with("printed nothing for 0 s")));
    }

    #[test]
    fn a_limit_in_all_counts_whatever_is_said() {
        let talks = "while true; do echo on; sleep 0.05; done";
        let (lines, result) = run(talks, Limit::InAll(Duration::from_millis(300)));
        assert!(!lines.is_empty() && result.is_err_and(|why| why.contains("still running")));
    }
}
