//! `rowscan bus`: the messages on the CAN bus, as DBC, as a page, or a log in words.

use std::path::PathBuf;

use serde::Serialize;

use super::output::{self, say};
use super::{Failure, Format, Outcome};
use rowscan_bus::link::candump::{Logged, read_line};
use rowscan_bus::message::Message;
use rowscan_bus::pgn::MESSAGES;
use rowscan_bus::{CanFrame, ErrorFrame, J1939Id, dbc, markdown};
use rowscan_protocol::time::SimTime;

/// Longest log that is read: days of a busy bus.
const MOST_BYTES: u64 = 256 * 1024 * 1024;

#[derive(Debug, clap::Subcommand)]
pub(super) enum Command {
    /// The DBC file of every message; docs/rowscan.dbc is what this prints
    Dbc,
    /// The messages as tables, for docs/can.md
    Markdown,
    /// A candump log in words: every frame with its values
    Decode(Decode),
}

#[derive(Debug, clap::Args)]
pub(super) struct Decode {
    /// A log as `candump -L` writes it
    file: PathBuf,
    /// How to write the frames
    #[arg(long, value_enum, default_value_t)]
    format: Format,
}

/// One frame in words.
#[derive(Debug, Serialize)]
struct Row {
    t_s: f64,
    source: Option<u8>,
    pgn: Option<u32>,
    message: &'static str,
    values: String,
}

pub(super) fn run(command: Command) -> Result<Outcome, Failure> {
    match command {
        Command::Dbc => output::print(&dbc())?,
        Command::Markdown => output::print(&markdown())?,
        Command::Decode(args) => return decode(&args),
    }
    Ok(Outcome::Done)
}

fn decode(args: &Decode) -> Result<Outcome, Failure> {
    let what = args.file.display().to_string();
    let text = rowscan_files::read(&args.file, MOST_BYTES)
        .map_err(|cause| Failure::Read { what: what.clone(), cause })?;
    let text = String::from_utf8_lossy(&text);
    let (mut rows, mut strange) = (Vec::new(), Vec::new());
    for (number, line) in (1..).zip(text.lines()).filter(|(_, line)| !line.trim().is_empty()) {
        match read_line(line) {
            Some((at, Logged::Frame(frame))) => rows.push(Row::of(at, &frame)),
            Some((at, Logged::Error(error))) => rows.push(Row::of_error(at, &error)),
            None => strange.push((number, line)),
        }
    }
    if let Some((number, line)) = strange.first() {
        let shown: String = line.chars().take(60).collect();
        let told = format!(
            "{what}, line {number}: expected a classic CAN frame as `candump -L` writes it, `(1436509052.249713) can0 18FE4980#0011223344556677`, found `{shown}`"
        );
        if rows.is_empty() {
            return Err(Failure::Usage(told));
        }
        say(format_args!("{told}; {} lines are left out", strange.len()));
    } else if rows.is_empty() {
        say(format_args!("{what}: no frame"));
    }
    output::print_rows(args.format, &rows)?;
    Ok(if rows.is_empty() || !strange.is_empty() { Outcome::Finding } else { Outcome::Done })
}

impl Row {
    fn of(at: SimTime, frame: &CanFrame) -> Self {
        let id = J1939Id::of(frame.id);
        let known = id.and_then(|id| MESSAGES.iter().find(|message| message.pgn == id.pgn));
        Self {
            t_s: at.as_secs_f64(),
            source: id.map(|id| id.source),
            pgn: id.map(|id| id.pgn),
            message: known.map_or("unknown", |message| message.name),
            values: values(known.copied(), frame.data()),
        }
    }

    /// What the controller told its host; it is on no bus.
    fn of_error(at: SimTime, error: &ErrorFrame) -> Self {
        Self { t_s: at.as_secs_f64(), source: None, pgn: None, message: ERROR_FRAME, values: error.told() }
    }
}

/// The name that stands for a message in an error frame's row.
const ERROR_FRAME: &str = "error_frame";

/// The values of a message, else its bytes.
fn values(known: Option<&Message>, data: &[u8]) -> String {
    let bytes = || data.iter().map(|byte| format!("{byte:02X}")).collect::<Vec<_>>().join(" ");
    let Some(message) = known.filter(|message| message.len <= 8) else { return bytes() };
    if data.len() < message.len {
        return format!("{} of {} bytes: {}", data.len(), message.len, bytes()).trim_end().to_owned();
    }
    let values = message.decode(data);
    let told = message.signals.iter().zip(values).filter_map(|(signal, value)| {
        let value = value?;
        let name = signal.names.iter().find(|(raw, _)| *raw as f64 == value);
        Some(match name {
            Some((_, name)) => format!("{} {name}", signal.name),
            None => format!("{} {:.4} {}", signal.name, value, signal.unit).trim_end().to_owned(),
        })
    });
    told.collect::<Vec<_>>().join(", ")
}
