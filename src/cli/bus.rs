//! `rowscan bus`: the messages on the CAN bus, as DBC, as a page, or a log in words.

use std::path::PathBuf;

use serde::Serialize;

use super::{Failure, Format, Outcome, output};
use rowscan_bus::link::candump::read_line;
use rowscan_bus::pgn::MESSAGES;
use rowscan_bus::{J1939Id, dbc, markdown};

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
        Command::Decode(args) => decode(&args)?,
    }
    Ok(Outcome::Done)
}

fn decode(args: &Decode) -> Result<(), Failure> {
    let what = args.file.display().to_string();
    let text = std::fs::read_to_string(&args.file).map_err(|cause| Failure::Read { what, cause })?;
    let rows: Vec<Row> = text
        .lines()
        .filter_map(read_line)
        .map(|(at, frame)| {
            let id = J1939Id::of(frame.id);
            let known = id.and_then(|id| MESSAGES.iter().find(|message| message.pgn == id.pgn));
            let values = match known.filter(|message| message.len <= 8) {
                Some(message) => {
                    let values = message.decode(frame.data());
                    let told = message.signals.iter().zip(values).filter_map(|(signal, value)| {
                        let value = value?;
                        let name = signal.names.iter().find(|(raw, _)| *raw as f64 == value);
                        Some(match name {
                            Some((_, name)) => format!("{} {name}", signal.name),
                            None => {
                                format!("{} {:.4} {}", signal.name, value, signal.unit).trim_end().to_owned()
                            }
                        })
                    });
                    told.collect::<Vec<_>>().join(", ")
                }
                None => frame.data().iter().map(|byte| format!("{byte:02X}")).collect::<Vec<_>>().join(" "),
            };
            Row {
                t_s: at.as_secs_f64(),
                source: id.map(|id| id.source),
                pgn: id.map(|id| id.pgn),
                message: known.map_or("unknown", |message| message.name),
                values,
            }
        })
        .collect();
    output::print_rows(args.format, &rows)
}
