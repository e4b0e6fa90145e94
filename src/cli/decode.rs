//! `rowscan decode`

use std::path::{Path, PathBuf};

use rowscan_driver::Source;
use rowscan_recording::{ReadError, Recording, Side};

use super::{Failure, Format, Outcome, grid, output};
use crate::decode::{Entry, Filter, Input, InputError, Options, Transcript, Verdict};

/// Most bytes that are decoded at once.
const MOST_BYTES: u64 = 256 * 1024 * 1024;

/// What stands for standard input.
const STDIN: &str = "-";

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// A recording: MCAP, pcap, pcapng, raw bytes, hex text (one frame a line, comments after `;`), telegrams as text, CARMEN log, candump log, CSV of ranges, each as it is or packed by gzip; `-` reads standard input to its end
    file: PathBuf,
    /// Write every value out in words; else long lists are shown by length and extremes
    #[arg(long)]
    values: bool,
    /// Show telegrams of this name alone, such as LMDscandata; repeatable
    #[arg(long, value_name = "NAME")]
    only: Vec<String>,
    /// Hide telegrams of this name; repeatable
    #[arg(long, value_name = "NAME")]
    not: Vec<String>,
    /// Show events (sSN) alone
    #[arg(long)]
    events: bool,
    /// How to write the telegrams
    #[arg(long, value_enum, default_value_t)]
    format: Format,
}

/// Shows every telegram. Damage is a finding; a file without any telegram is bad input.
pub(super) fn run(args: Args) -> Result<Outcome, Failure> {
    let name = if args.file == Path::new(STDIN) {
        "standard input".to_owned()
    } else {
        args.file.display().to_string()
    };
    let refused = |why: String| Failure::Usage(format!("{name}: {why}"));
    // A scan's fields take fifty times the memory of its bytes.
    let fields = args.format != Format::Table;
    let most_bytes = if fields { MOST_BYTES / 4 } else { MOST_BYTES };
    let read = Recording::open(&args.file)
        .map_err(InputError::from)
        .and_then(|found| Input::read(found, most_bytes));
    let input = read.map_err(|error| match error {
        InputError::Read(ReadError::Io(cause)) => match name.parse() {
            Ok(Source::Recording { path, stream: Some(stream) }) if path.is_file() => refused(format!(
                "expected a file, found the stream `{stream}` of {}; decode shows all streams: write that one with `rowscan record {name} -o NEW.mcap` first",
                path.display()
            )),
            _ => Failure::Read { what: name.clone(), cause },
        },
        other => refused(other.to_string()),
    })?;
    let options = Options { values: args.values, fields };
    let transcript = Transcript::of(&input, options).map_err(|error| refused(error.to_string()))?;
    let filter = Filter { only: args.only, not: args.not, events: args.events };
    let shown: Vec<&Entry> = transcript.lines.iter().filter(|entry| filter.shows(entry)).collect();
    match args.format {
        Format::Table if shown.is_empty() => {}
        Format::Table => output::print(&table(&shown, grid::columns()))?,
        format => output::print_rows(format, &shown)?,
    }
    let (bad, opaque) = (transcript.count(Verdict::Bad), transcript.count(Verdict::Opaque));
    if transcript.frames() == 0 {
        return Err(refused(
            "no telegram found; MCAP, pcap, pcapng, raw bytes, hex text, telegrams as text, CARMEN logs, candump logs and CSV of ranges are understood"
                .to_owned(),
        ));
    }
    output::say(format_args!("{} telegrams, {opaque} lines opaque, {bad} bad", transcript.frames()));
    if !filter.is_empty() {
        output::say(format_args!("{} of {} lines shown", shown.len(), transcript.lines.len()));
    }
    if transcript.other_connections > 0 {
        output::say(format_args!("{} connections without telegrams left out", transcript.other_connections));
    }
    Ok(if bad > 0 { Outcome::Finding } else { Outcome::Done })
}

/// The narrowest column that words are wrapped into.
const NARROWEST: usize = 24;

/// A table for people, as wide as the terminal where there is one: longer words go on below. Columns are as wide as they mostly need to be, so
/// that a long recording need not be measured first.
fn table(entries: &[&Entry], columns: Option<usize>) -> String {
    let connections = entries.iter().any(|entry| entry.connection.is_some());
    let mut text = String::new();
    if connections {
        text.push_str("  conn       time s ");
    }
    text.push_str(&format!("{:>10} {:>6} {:<6} {:<6} telegram\n", "offset", "bytes", "from", "in"));
    for entry in entries {
        let mut head = String::new();
        if connections {
            let number = entry.connection.map(|number| number.to_string()).unwrap_or_default();
            let time = entry.time_s.map(|time| format!("{time:.6}")).unwrap_or_default();
            head.push_str(&format!("{number:>6} {time:>12} "));
        }
        let from = match entry.from {
            Some(Side::Host) => "host",
            Some(Side::Device) => "device",
            None => "?",
        };
        let dialect = entry.dialect.as_deref().unwrap_or("-");
        head.push_str(&format!("{:>10} {:>6} {from:<6} {dialect:<6} ", entry.offset, entry.length));
        let parts =
            [entry.kind, entry.name.as_deref(), entry.words.as_deref().filter(|words| !words.is_empty())];
        let mut words = parts.into_iter().flatten().collect::<Vec<_>>().join(" ");
        if let (Some(at), Some(expected), Some(found)) = (entry.error_offset, &entry.expected, &entry.found) {
            words.push_str(&format!(" BAD at {at}: expected {expected}, found {found}"));
        }
        let indent = head.chars().count();
        let width = columns.map(|columns| columns.saturating_sub(indent).max(NARROWEST));
        text.push_str(&head);
        wrap(&words, width.unwrap_or(usize::MAX), indent, &mut text);
    }
    text
}

/// Appends `words` in lines of `width` characters at most, all but the first behind `indent` blanks. Longer words are cut.
fn wrap(words: &str, width: usize, indent: usize, out: &mut String) {
    let mut used = 0;
    for word in words.split(' ') {
        let mut rest = word;
        loop {
            let length = rest.chars().count();
            let blank = usize::from(used > 0);
            if used + blank + length <= width {
                out.push_str(if blank == 1 { " " } else { "" });
                out.push_str(rest);
                used += blank + length;
                break;
            }
            if used == 0 {
                let cut = rest.char_indices().nth(width).map_or(rest.len(), |(at, _)| at);
                let (piece, after) = rest.split_at_checked(cut).unwrap_or((rest, ""));
                out.push_str(piece);
                rest = after;
            }
            out.push('\n');
            out.push_str(&" ".repeat(indent));
            used = 0;
        }
    }
    out.push('\n');
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_wrapped_to_the_width_and_none_is_lost() {
        let wrapped = |words: &str, width| {
            let mut out = String::new();
            wrap(words, width, 2, &mut out);
            out
        };
        assert_eq!(wrapped("one two three four", 9), "one two\n  three\n  four\n");
        assert_eq!(wrapped("a 0123456789 b", 4), "a\n  0123\n  4567\n  89 b\n");
        assert_eq!(wrapped("one two three", usize::MAX), "one two three\n");
        assert_eq!(wrapped("", 4), "\n");
    }
}
