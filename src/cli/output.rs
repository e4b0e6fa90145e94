//! Data on standard output, in the format asked for; everything else on standard error.

use std::borrow::Cow;
use std::collections::HashMap;
use std::fmt::Display;
use std::io::{self, Write};
use std::path::Path;

use comfy_table::{Cell, CellAlignment};
use erased_serde::Serialize;
use rowscan_canopy::Calibration;
use rowscan_files::{OutputFile, is_standard_output};
use rowscan_study::calibrations;
use serde_json::Value;

use super::grid::{Grid, TIED};
use super::{Failure, Format, is_closed_pipe};

/// Says something to the user, beside the data. This is the only writer to standard error: `eprintln!` panics where nobody reads any more (`2>&1 | head -1`).
pub(super) fn say(message: impl Display) {
    say_to(&mut io::stderr().lock(), &message.to_string());
}

/// One write a message, so that lines of several processes do not mix. What nobody reads is no failure.
fn say_to(out: &mut dyn Write, message: &str) {
    let line = format!("{}\n", printable(message));
    let _ = out.write_all(line.as_bytes()).and_then(|()| out.flush());
}

/// Success where nobody reads any more: of a command whose result is its exit code as well, such as a verdict.
pub(super) fn if_read(printed: Result<(), Failure>) -> Result<(), Failure> {
    match printed {
        Err(Failure::Write { cause, .. }) if is_closed_pipe(&cause) => Ok(()),
        printed => printed,
    }
}

/// A text as a terminal may see it: control characters, which files and devices may send, are written as `\u{1b}`. Lines stay lines.
pub(super) fn printable(text: &str) -> Cow<'_, str> {
    let is_plain = |c: char| !c.is_control() || matches!(c, '\n' | '\t');
    if text.chars().all(is_plain) {
        return Cow::Borrowed(text);
    }
    let mut escaped = String::with_capacity(text.len() + 16);
    for c in text.chars() {
        if is_plain(c) { escaped.push(c) } else { escaped.extend(c.escape_default()) }
    }
    Cow::Owned(escaped)
}

/// Writes a text of data.
pub(super) fn print(text: &str) -> Result<(), Failure> {
    let mut out = io::stdout().lock();
    out.write_all(text.as_bytes()).and_then(|()| out.flush()).map_err(stdout_failure)
}

/// Writes one JSON document, on one line for jsonl. The document's type is erased, so that the code that writes it is compiled once, and not for each of
/// serde_json's writers.
pub(super) fn print_json(format: Format, document: &dyn Serialize) -> Result<(), Failure> {
    let text = match format {
        Format::Jsonl => serde_json::to_string(document),
        _ => serde_json::to_string_pretty(document),
    };
    print(&(text.map_err(json_failure)? + "\n"))
}

/// Tells scripts of an event, on one line: on standard output for jsonl, on standard error for json, whose standard output is one document and nothing
/// else. Other formats have words for it. A command that serves goes on if nobody reads its events any more.
pub(super) fn print_event(format: Format, event: &dyn Serialize) -> Result<(), Failure> {
    match format {
        Format::Jsonl => if_read(print_json(format, event)),
        Format::Json => {
            say(serde_json::to_string(event).map_err(json_failure)?);
            Ok(())
        }
        Format::Csv | Format::Table => Ok(()),
    }
}

/// Writes what was measured beside a result: behind the document as one of its own for jsonl, else for people.
pub(super) fn tell_latency(format: Format, latency: &dyn Serialize) -> Result<(), Failure> {
    match format {
        Format::Jsonl => print_json(format, latency),
        _ => {
            say(serde_json::to_string(latency).map_err(json_failure)?);
            Ok(())
        }
    }
}

/// Writes rows: as a table, a JSON array, one JSON object a line, or CSV. Column names are the rows' keys; in CSV, the fields of a record in a row are columns
/// of their own, `name.field`.
pub(super) fn print_rows<T: Serialize>(format: Format, rows: &[T]) -> Result<(), Failure> {
    print_all(format, &rows.iter().map(|row| row as &dyn Serialize).collect::<Vec<_>>())
}

/// Writes the header alone that such a row would have: of CSV whose rows there are none of.
pub(super) fn print_header(row: &dyn Serialize) -> Result<(), Failure> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(fields(row)?.iter().map(|(key, _)| key)).map_err(csv_failure)?;
    let bytes = writer.into_inner().map_err(|error| stdout_failure(error.into_error()))?;
    print(&String::from_utf8_lossy(&bytes))
}

fn print_all(format: Format, rows: &[&dyn Serialize]) -> Result<(), Failure> {
    match format {
        Format::Json => print_json(format, &rows),
        Format::Jsonl => rows.iter().try_for_each(|row| print_json(format, row)),
        Format::Csv if rows.is_empty() => {
            say("no rows: there is nothing to write");
            Ok(())
        }
        Format::Csv => {
            let mut writer = csv::Writer::from_writer(Vec::new());
            let rows: Vec<_> = rows.iter().map(|row| fields(*row).map(flat)).collect::<Result<_, _>>()?;
            let columns = columns(&rows);
            writer.write_record(&columns).map_err(csv_failure)?;
            for row in &rows {
                let known: HashMap<&str, &Value> =
                    row.iter().map(|(name, value)| (name.as_str(), value)).collect();
                let cell =
                    |name: &String| known.get(name.as_str()).map_or_else(String::new, |value| plain(value));
                let cells = columns.iter().map(cell);
                writer.write_record(cells).map_err(csv_failure)?;
            }
            let bytes = writer.into_inner().map_err(|error| stdout_failure(error.into_error()))?;
            print(&String::from_utf8_lossy(&bytes))
        }
        Format::Table => {
            let mut table = Grid::new();
            for (index, row) in rows.iter().enumerate() {
                let fields = fields(*row)?;
                if index == 0 {
                    head(&mut table, fields.iter().map(|(key, _)| key.as_str()));
                }
                table.add_row(fields.iter().map(|(_, value)| cell(value)));
            }
            print(&format!("{table}\n"))
        }
    }
}

/// Gives `table` its column names.
pub(super) fn head<'a>(table: &mut Grid, names: impl IntoIterator<Item = &'a str>) {
    table.set_header(names.into_iter().map(Cell::new));
}

/// A right-aligned number with so many decimals; a dash where it is unknown.
pub(super) fn number(value: Option<f64>, decimals: usize) -> Cell {
    let text = value.map_or_else(|| "–".to_owned(), |value| unsigned_zero(format!("{value:.decimals$}")));
    right(text)
}

/// A right-aligned text.
pub(super) fn right(text: String) -> Cell {
    Cell::new(text).set_alignment(CellAlignment::Right)
}

/// A number in digits; what is 0 in them has no sign.
fn unsigned_zero(digits: String) -> String {
    let is_zero = digits.starts_with('-') && digits.chars().all(|c| matches!(c, '-' | '0' | '.'));
    if is_zero { digits.replacen('-', "", 1) } else { digits }
}

/// A right-aligned signed percentage of a fraction; a dash where it is unknown.
pub(super) fn percent(fraction: Option<f64>) -> Cell {
    let text = fraction.map_or_else(|| "–".to_owned(), |fraction| format!("{:+.1}{TIED}%", 100.0 * fraction));
    Cell::new(text).set_alignment(CellAlignment::Right)
}

/// A right-aligned percentage of a fraction that has no sign; a dash where it is unknown.
pub(super) fn share(fraction: Option<f64>) -> Cell {
    let text = fraction.map_or_else(|| "–".to_owned(), |fraction| format!("{:.1}{TIED}%", 100.0 * fraction));
    Cell::new(text).set_alignment(CellAlignment::Right)
}

/// A calibration as the text of its file.
pub(super) fn calibration_text(calibration: &Calibration) -> Result<String, Failure> {
    toml::to_string(&calibrations::sealed(calibration)).map_err(|cause| Failure::Write {
        what: "the calibration".to_owned(),
        cause: io::Error::other(cause),
    })
}

/// Writes a file whole or not at all. `-` is standard output; devices and pipes are written to directly.
pub(super) fn write_file(path: &Path, content: &(impl AsRef<[u8]> + ?Sized)) -> Result<(), Failure> {
    write_with(path, |out| out.write_all(content.as_ref()))
}

/// The same, of a content that is written piece by piece.
pub(super) fn write_with(
    path: &Path,
    write: impl FnOnce(&mut io::BufWriter<OutputFile>) -> io::Result<()>,
) -> Result<(), Failure> {
    let written = || {
        let mut out = io::BufWriter::new(OutputFile::create(path)?);
        write(&mut out)?;
        out.into_inner().map_err(io::IntoInnerError::into_error)?.commit()
    };
    written().map_err(|cause| Failure::Write { what: name_of(path), cause })
}

/// Refuses a path that [`write_file`] could not write, before there is anything to write. Devices and pipes are not opened.
pub(super) fn can_be_written(path: &Path) -> Result<(), Failure> {
    let is_direct = std::fs::metadata(path).is_ok_and(|found| !found.is_file() && !found.is_dir());
    if is_direct || is_standard_output(path) {
        return Ok(());
    }
    // Dropped without a commit it leaves nothing.
    let made = OutputFile::create(path).map(drop);
    made.map_err(|cause| Failure::Write { what: name_of(path), cause })
}

/// How messages name an output.
pub(super) fn name_of(path: &Path) -> String {
    if is_standard_output(path) { "standard output".to_owned() } else { path.display().to_string() }
}

fn fields(row: &dyn Serialize) -> Result<Vec<(String, Value)>, Failure> {
    match serde_json::to_value(row).map_err(json_failure)? {
        Value::Object(map) => Ok(map.into_iter().collect()),
        other => Ok(vec![("value".to_owned(), other)]),
    }
}

/// Fields whose values are no records: of one that is, its own fields follow, as `name.field`.
fn flat(fields: Vec<(String, Value)>) -> Vec<(String, Value)> {
    let inner = |(name, value): (String, Value)| match value {
        Value::Object(map) => {
            flat(map.into_iter().map(|(key, value)| (format!("{name}.{key}"), value)).collect())
        }
        value => vec![(name, value)],
    };
    fields.into_iter().flat_map(inner).collect()
}

/// The columns of all rows: of rows that lack some, too. A record that is unknown in one row has its fields' columns where it is known in another.
fn columns(rows: &[Vec<(String, Value)>]) -> Vec<String> {
    let mut columns: Vec<String> = Vec::new();
    for row in rows {
        let mut next = 0;
        for (name, _) in row {
            // Rows are mostly alike.
            if columns.get(next) == Some(name) {
                next += 1;
                continue;
            }
            match columns.iter().position(|column| column == name) {
                Some(found) => next = found + 1,
                None => {
                    columns.insert(next, name.clone());
                    next += 1;
                }
            }
        }
    }
    let is_record = |name: &String| {
        columns
            .iter()
            .any(|other| other.strip_prefix(name.as_str()).is_some_and(|rest| rest.starts_with('.')))
    };
    columns.iter().filter(|name| !is_record(name)).cloned().collect()
}

fn plain(value: &Value) -> String {
    match value {
        Value::Null => String::new(),
        Value::String(text) => text.clone(),
        // A list of records stays JSON.
        Value::Array(items) if !items.iter().any(|item| item.is_object() || item.is_array()) => {
            items.iter().map(plain).collect::<Vec<_>>().join("; ")
        }
        other => other.to_string(),
    }
}

fn cell(value: &Value) -> Cell {
    match value {
        Value::Null => number(None, 0),
        Value::Number(found) => match (found.as_f64(), found.is_f64()) {
            (Some(float), true) => number(Some(float), 3),
            _ => Cell::new(found).set_alignment(CellAlignment::Right),
        },
        Value::Array(items) => Cell::new(printable(&items.iter().map(plain).collect::<Vec<_>>().join("\n"))),
        other => Cell::new(printable(&plain(other))),
    }
}

fn json_failure(cause: serde_json::Error) -> Failure {
    Failure::Write { what: "JSON".to_owned(), cause: cause.into() }
}

fn stdout_failure(cause: io::Error) -> Failure {
    Failure::Write { what: "standard output".to_owned(), cause }
}

fn csv_failure(cause: csv::Error) -> Failure {
    Failure::Write { what: "CSV".to_owned(), cause: cause.into() }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A pipe that nobody reads any more.
    struct Closed;

    impl Write for Closed {
        fn write(&mut self, _: &[u8]) -> io::Result<usize> {
            Err(io::ErrorKind::BrokenPipe.into())
        }

        fn flush(&mut self) -> io::Result<()> {
            Err(io::ErrorKind::BrokenPipe.into())
        }
    }

    #[test]
    fn a_message_is_one_line_and_one_that_nobody_reads_is_lost() {
        let mut heard = Vec::new();
        say_to(&mut heard, "a bell\u{7}");
        assert_eq!(String::from_utf8_lossy(&heard), "a bell\\u{7}\n");
        say_to(&mut Closed, "nobody");
    }

    #[test]
    fn a_record_in_a_row_has_columns_of_its_own_and_rows_may_lack_some() {
        let rows = [
            serde_json::json!({ "class": "a", "holds": null, "n": 1 }),
            serde_json::json!({ "class": "b", "holds": { "share": 0.5, "low": 0.1 }, "n": 2 }),
            serde_json::json!({ "class": "c", "why": "short", "n": 3 }),
        ];
        let rows: Vec<_> = rows.iter().map(|row| fields(row).map(flat).expect("fields")).collect();
        assert_eq!(columns(&rows), ["class", "why", "holds.share", "holds.low", "n"]);
        let lists = [serde_json::json!([1, null, "a"]), serde_json::json!([{ "a": 1 }, { "a": 2 }])];
        assert_eq!(lists.each_ref().map(plain), ["1; ; a", "[{\"a\":1},{\"a\":2}]"]);
    }

    #[test]
    fn zero_has_no_sign() {
        let shown = |value: f64| number(Some(value), 3).content();
        assert_eq!([-0.0, -1e-9, 0.0].map(shown), ["0.000"; 3]);
        assert_eq!([-0.0005001, -0.25].map(shown), ["-0.001", "-0.250"]);
    }

    #[test]
    fn what_a_peer_says_cannot_steer_a_terminal() {
        let name = "LMS\u{1b}[31mRED\u{1b}]0;pwn\u{7}G\u{9b}2J\r";
        assert_eq!(printable(name), "LMS\\u{1b}[31mRED\\u{1b}]0;pwn\\u{7}G\\u{9b}2J\\r");
        assert!(matches!(printable("µm – two\n\tlines"), Cow::Borrowed(_)));
    }
}
