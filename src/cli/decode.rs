//! `rowscan decode`

use std::path::{Path, PathBuf};

use rowscan_recording::{ReadError, Recording, Side};

use super::{Failure, Format, Outcome, output};
use crate::decode::{Input, Line, Options, Transcript, Verdict};

/// What stands for standard input.
const STDIN: &str = "-";

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// A recording: MCAP, pcap, pcapng, raw bytes, hex text (one frame a line, comments after `;`), candump log, CSV of ranges; `-` reads standard input to its end
    file: PathBuf,
    /// Write every value out; else long lists are told by length and extremes
    #[arg(long)]
    values: bool,
    /// How to write the telegrams
    #[arg(long, value_enum, default_value_t)]
    format: Format,
}

/// Tells every telegram. A finding is whatever is broken; a file without any telegram is bad input.
pub(super) fn run(args: Args) -> Result<Outcome, Failure> {
    let name = if args.file == Path::new(STDIN) {
        "standard input".to_owned()
    } else {
        args.file.display().to_string()
    };
    let refused = |why: String| Failure::Usage(format!("{name}: {why}"));
    let input = open(&args.file).and_then(Input::read).map_err(|error| match error {
        ReadError::Io(cause) => Failure::Read { what: name.clone(), cause },
        other => refused(other.to_string()),
    })?;
    let transcript = Transcript::of(&input, Options { values: args.values });
    match args.format {
        Format::Table if transcript.lines.is_empty() => {}
        Format::Table => output::print(&table(&transcript.lines))?,
        format => output::print_rows(format, &transcript.lines)?,
    }
    let (bad, opaque) = (transcript.count(Verdict::Bad), transcript.count(Verdict::Opaque));
    if transcript.frames() == 0 {
        return Err(refused(
            "no telegram found; MCAP, pcap, pcapng, raw bytes, hex text, candump logs and CSV of ranges are understood"
                .to_owned(),
        ));
    }
    output::say(format_args!("{} telegrams, {opaque} lines opaque, {bad} bad", transcript.frames()));
    if transcript.other_connections > 0 {
        output::say(format_args!("{} connections without telegrams left out", transcript.other_connections));
    }
    Ok(if bad > 0 { Outcome::Finding } else { Outcome::Done })
}

fn open(path: &Path) -> Result<Recording, ReadError> {
    if path == Path::new(STDIN) { Recording::read(Box::new(std::io::stdin())) } else { Recording::open(path) }
}

/// Lines for people. Columns are as wide as they mostly need to be, so that a long recording need not be measured first.
fn table(lines: &[Line]) -> String {
    let connections = lines.iter().any(|line| line.connection.is_some());
    let mut text = String::new();
    if connections {
        text.push_str("  conn       time s ");
    }
    text.push_str(&format!("{:>10} {:>6} {:<6} {:<6} telegram\n", "offset", "bytes", "from", "in"));
    for line in lines {
        if connections {
            let number = line.connection.map(|number| number.to_string()).unwrap_or_default();
            let time = line.time_s.map(|time| format!("{time:.6}")).unwrap_or_default();
            text.push_str(&format!("{number:>6} {time:>12} "));
        }
        let from = match line.from {
            Some(Side::Host) => "host",
            Some(Side::Device) => "device",
            None => "?",
        };
        let dialect = line.dialect.as_deref().unwrap_or("-");
        text.push_str(&format!("{:>10} {:>6} {from:<6} {dialect:<6} ", line.offset, line.length));
        let parts =
            [line.kind, line.name.as_deref(), line.words.as_deref().filter(|words| !words.is_empty())];
        text.push_str(&parts.into_iter().flatten().collect::<Vec<_>>().join(" "));
        if let (Some(at), Some(expected), Some(found)) = (line.error_offset, &line.expected, &line.found) {
            text.push_str(&format!(" BAD at {at}: expected {expected}, found {found}"));
        }
        text.push('\n');
    }
    text
}
