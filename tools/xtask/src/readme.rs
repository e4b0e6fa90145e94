//! The commands of README and of the first pages, run as they stand there.
//!
//! In fenced blocks marked `console`, lines that start with `$ rowscan ` or `$ cargo run --release -- ` run in a shell with the
//! binary under test on the path, in a folder that shows the repository's files but takes new ones itself. They must exit 0
//! within a minute. Two comments change that: `# not run in CI` skips the line; `# until Ctrl-C` keeps it running behind the
//! block's other lines, then interrupts it.

use std::ffi::OsString;
use std::fs;
use std::os::unix::fs::symlink;
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::Duration;

use crate::counts::Counts;
use crate::shell;
use crate::steps::Outcome;
use crate::workspace::Workspace;

const LIMIT: Duration = Duration::from_secs(60);

/// How long a server has to come up before the next line talks to it.
const SETTLE: Duration = Duration::from_secs(3);

/// How a line of a console block is run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Habit {
    ToItsEnd,
    UntilInterrupted,
    NotHere,
}

/// The documents whose commands are run: those that a new user follows.
const DOCUMENTS: &[&str] = &["README.md", "docs/start.md", "docs/rigs.md", "docs/install.md"];

/// Runs every block of these documents.
pub fn run(workspace: &Workspace) -> Outcome {
    let binary = match workspace.built_binary() {
        Ok(binary) => binary,
        Err(why) => return Outcome::Skipped(why),
    };
    let mut counts = Counts::default();
    let mut failures = Vec::new();
    for document in DOCUMENTS {
        let Ok(text) = fs::read_to_string(workspace.root.join(document)) else {
            return Outcome::failed(format!("there is no {document}"));
        };
        // Each in a folder as it is for a new user.
        let stage = match Stage::set(workspace, &binary) {
            Ok(stage) => stage,
            Err(why) => return Outcome::failed(why),
        };
        for block in console_blocks(&text) {
            stage.run_block(&block, &mut counts, &mut failures);
        }
    }
    println!(
        "    commands of README and the first pages: {} run, {} failed, {} not run here",
        counts.passed, counts.failed, counts.skipped
    );
    if failures.is_empty() { Outcome::ok() } else { Outcome::failed(failures.join("\n")) }
}

/// Where the commands run.
struct Stage {
    /// Holds a link to each of the repository's entries, and whatever the commands make.
    folder: PathBuf,
    /// The search path, the binary's folder first.
    path: OsString,
}

impl Stage {
    fn set(workspace: &Workspace, binary: &Path) -> Result<Self, String> {
        let folder = workspace.scratch("readme")?;
        let tell = |error: std::io::Error| format!("cannot stage {}: {error}", folder.display());
        fs::remove_dir_all(&folder).and_then(|()| fs::create_dir(&folder)).map_err(tell)?;
        for entry in fs::read_dir(&workspace.root).map_err(tell)?.filter_map(Result::ok) {
            symlink(entry.path(), folder.join(entry.file_name())).map_err(tell)?;
        }
        let inherited = std::env::var_os("PATH").unwrap_or_default();
        let folders =
            binary.parent().map(Path::to_path_buf).into_iter().chain(std::env::split_paths(&inherited));
        let path = std::env::join_paths(folders).map_err(|error| error.to_string())?;
        Ok(Self { folder, path })
    }

    fn run_block(&self, block: &[(String, Habit)], counts: &mut Counts, failures: &mut Vec<String>) {
        let mut background = Vec::new();
        let mut results = Vec::new();
        for (line, habit) in block {
            println!("    $ {line}");
            match habit {
                Habit::NotHere => {
                    println!("    SKIPPED: marked `not run in CI`");
                    counts.skipped += 1;
                }
                Habit::ToItsEnd => results.push((line, self.spawn(line).and_then(|child| end(child, LIMIT)))),
                // The shell must not stand between the signal and the server.
                Habit::UntilInterrupted => match self.spawn(&format!("exec {line}")) {
                    Ok(child) => {
                        background.push((line, child));
                        thread::sleep(SETTLE);
                    }
                    Err(why) => results.push((line, Err(why))),
                },
            }
        }
        for (line, child) in background {
            results.push((line, interrupt(child)));
        }
        for (line, result) in results {
            match result {
                Ok(()) => counts.passed += 1,
                Err(why) => {
                    counts.failed += 1;
                    failures.push(format!("{line}: {why}"));
                }
            }
        }
    }

    /// Starts a line in a shell of its own process group. Its data is dropped, its messages are shown.
    fn spawn(&self, line: &str) -> Result<Child, String> {
        // A pipe's last program must not hide that ours failed.
        Command::new("bash")
            .args(["-o", "pipefail", "-c", line])
            .current_dir(&self.folder)
            .env("PATH", &self.path)
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .process_group(0)
            .spawn()
            .map_err(|error| error.to_string())
    }
}

/// Ends a server as Ctrl-C does; it must still be there and end with 0.
fn interrupt(mut child: Child) -> Result<(), String> {
    if let Ok(Some(status)) = child.try_wait() {
        return Err(format!("ended before it was interrupted: {status}"));
    }
    shell::signal(&child, "INT");
    end(child, Duration::from_secs(10))
}

fn end(mut child: Child, limit: Duration) -> Result<(), String> {
    match shell::wait(&mut child, limit) {
        Some(status) if status.success() => Ok(()),
        Some(status) => Err(status.to_string()),
        None => {
            shell::signal(&child, "KILL");
            let _ = child.wait();
            Err(format!("still running after {} s", limit.as_secs()))
        }
    }
}

/// The commands of each console block, `cargo run --release --` replaced by the binary's name.
fn console_blocks(text: &str) -> Vec<Vec<(String, Habit)>> {
    let mut blocks = Vec::new();
    let mut block: Option<Vec<(String, Habit)>> = None;
    let mut continued = String::new();
    for line in text.lines() {
        match &mut block {
            None if line.trim() == "```console" => block = Some(Vec::new()),
            None => {}
            Some(_) if line.trim() == "```" => blocks.extend(block.take()),
            Some(commands) => {
                let whole = continued + line.trim();
                continued = String::new();
                if let Some(start) = whole.strip_suffix('\\').filter(|_| whole.starts_with("$ ")) {
                    continued = start.to_owned();
                } else {
                    commands.extend(command(&whole));
                }
            }
        }
    }
    blocks
}

fn command(line: &str) -> Option<(String, Habit)> {
    let line = line.strip_prefix("$ ")?;
    let arguments = line.strip_prefix("cargo run --release -- ").or_else(|| line.strip_prefix("rowscan "))?;
    let habit = if line.contains("# not run in CI") {
        Habit::NotHere
    } else if line.contains("# until Ctrl-C") {
        Habit::UntilInterrupted
    } else {
        Habit::ToItsEnd
    };
    Some((format!("rowscan {arguments}"), habit))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commands_come_from_console_blocks_only() {
        let text = "$ rowscan no\n```console\n$ cargo run --release -- demo\noutput\n$ rowscan emulate \\\n  --seed 7 # until Ctrl-C\n\
                    $ ls\n$ rowscan models # not run in CI\n```\n```sh\n$ rowscan no\n```\n```console\n$ rowscan demo | head\n```\n";
        let blocks = console_blocks(text);
        assert_eq!(blocks.len(), 2);
        assert_eq!(
            blocks[0],
            [
                ("rowscan demo".to_owned(), Habit::ToItsEnd),
                ("rowscan emulate --seed 7 # until Ctrl-C".to_owned(), Habit::UntilInterrupted),
                ("rowscan models # not run in CI".to_owned(), Habit::NotHere),
            ]
        );
        assert_eq!(blocks[1], [("rowscan demo | head".to_owned(), Habit::ToItsEnd)]);
    }
}
