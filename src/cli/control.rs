//! `--control`: a running command in others' hands, over HTTP or by lines on standard input.

use std::net::SocketAddr;

use rowscan_control::{Bench, Guard, Lines, Server, router};
use rowscan_ports::task;
use tokio::sync::mpsc;
use tokio::task::JoinSet;

use super::endpoint::announce_stream;
use super::output::{print_event, say};
use super::{Failure, Format};

/// The place that is standard input.
const STANDARD_INPUT: &str = "-";

#[derive(Clone, Debug, Default, clap::Args)]
#[command(next_help_heading = "Control")]
pub(super) struct ControlArgs {
    /// Be controlled over HTTP at this address, or by lines on standard input (`-`): faults, clock, steps, log, state; repeatable (docs/control.md)
    #[arg(long, value_name = "ADDR|-", num_args = 0..=1, default_missing_value = STANDARD_INPUT)]
    control: Vec<String>,
    /// Ask everyone for this token [default: on loopback none; elsewhere one that is made up and printed]
    #[arg(long, value_name = "TOKEN", requires = "control", value_parser = token)]
    control_token: Option<String>,
}

pub(super) fn token(text: &str) -> Result<String, String> {
    let sound = (8..=256).contains(&text.len()) && text.bytes().all(|byte| byte.is_ascii_graphic());
    if sound { Ok(text.to_owned()) } else { Err("expected 8 to 256 letters, digits and signs".to_owned()) }
}

/// What listens to others. Dropped, it listens no longer.
#[derive(Debug, Default)]
pub(super) struct Controlled {
    servers: Vec<Server>,
    tasks: JoinSet<()>,
}

impl Controlled {
    /// Where it can be reached.
    pub(super) fn addresses(&self) -> impl Iterator<Item = SocketAddr> {
        self.servers.iter().map(Server::address)
    }
}

impl ControlArgs {
    /// Whether anyone may control.
    pub(super) fn is_given(&self) -> bool {
        !self.control.is_empty()
    }

    /// Opens every place, and announces the addresses.
    pub(super) async fn open(&self, bench: Bench, format: Format) -> Result<Controlled, Failure> {
        let routes = router(bench);
        let mut controlled = Controlled::default();
        for place in &self.control {
            if place == STANDARD_INPUT {
                controlled.tasks.spawn(task(listen(Lines::new(routes.clone()), format)));
                continue;
            }
            let mut made_up = None;
            let guard = |address: &SocketAddr| guard_at(address, self.control_token.as_ref(), &mut made_up);
            let server = Server::open(place, routes.clone(), guard).await?;
            announce_stream(format, None, "control", &server.address())?;
            if let Some(token) = made_up {
                say(format_args!("control needs the token {token}"));
            }
            controlled.servers.push(server);
        }
        Ok(controlled)
    }
}

/// Who may ask at this address: who shows `token`, or one that is made up where others reach it.
pub(super) fn guard_at(address: &SocketAddr, token: Option<&String>, made_up: &mut Option<String>) -> Guard {
    match token {
        Some(token) => Guard::token(token.clone()),
        None if address.ip().is_loopback() => Guard::open(),
        None => Guard::token(made_up.insert(random_token()).clone()),
    }
}

/// 128 bits that nobody guesses.
fn random_token() -> String {
    let mut bytes = [0_u8; 16];
    match getrandom::fill(&mut bytes) {
        Ok(()) => bytes.iter().map(|byte| format!("{byte:02x}")).collect(),
        // Then nobody gets in.
        Err(_) => String::new(),
    }
}

/// Reads lines on a thread of its own: standard input cannot be waited for otherwise. Only where it is asked for: a program in the background
/// that reads the terminal is stopped.
fn read_lines() -> mpsc::Receiver<String> {
    let (lines, taken) = mpsc::channel(16);
    std::thread::spawn(move || {
        for line in std::io::stdin().lines().map_while(Result::ok) {
            if !line.trim().is_empty() && lines.blocking_send(line).is_err() {
                return;
            }
        }
    });
    taken
}

/// Does what lines say, one after the other, and tells what came of each.
async fn listen(asked: Lines, format: Format) {
    let mut lines = read_lines();
    while let Some(line) = lines.recv().await {
        let (written_out, is_short) = match line.trim() {
            "pause" => (r#"POST /clock {"paused": true}"#.to_owned(), true),
            "play" => (r#"POST /clock {"paused": false}"#.to_owned(), true),
            other => match other.strip_prefix("seek ") {
                Some(place) => (format!("POST /clock {}", serde_json::json!({ "seek": place.trim() })), true),
                None => (other.to_owned(), false),
            },
        };
        let answer = asked.ask(&written_out).await;
        let is_good = answer.status < 300;
        let told = match format {
            Format::Json | Format::Jsonl => print_event(format, &answer),
            Format::Csv | Format::Table if is_good && is_short => Ok(()),
            Format::Csv | Format::Table => {
                let body = answer.body.map(|body| body.to_string()).unwrap_or_default();
                say(format_args!("{}: {} {body}", line.trim(), answer.status));
                Ok(())
            }
        };
        if told.is_err() {
            return;
        }
    }
}
