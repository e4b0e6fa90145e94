//! Compact telegrams: of picoScan, multiScan and LRS4000.

use rowscan_protocol::compact::{Found, StreamDecoder, Telegram};
use rowscan_recording::Side;

use super::description::Description;
use super::{Entry, MOST_LINES, Options, Piece, Stream, Verdict};

/// How the language is called.
const LANGUAGE: &str = "Compact";

/// Appends all lines of a piece.
pub(super) fn lines(stream: &Stream, piece: &Piece, options: Options, lines: &mut Vec<Entry>) {
    let mut decoder = StreamDecoder::default();
    decoder.push(&piece.bytes);
    decoder.finish();
    while lines.len() <= MOST_LINES {
        lines.push(match decoder.next_found() {
            Some(Found::Telegram { offset, len, telegram }) => {
                let line = Entry::new(stream, piece.offset + offset, len as u64, Verdict::Telegram);
                described(&telegram, options, line)
            }
            Some(Found::Bad { offset, len, .. }) if piece.begins_inside && offset == 0 => {
                let words = "the recording begins inside a telegram".to_owned();
                Entry::opaque(stream, piece.offset, len as u64, words)
            }
            Some(Found::Bad { offset, len, error }) => {
                let offset = piece.offset + offset;
                let (expected, found) = (error.expected.to_string(), error.found().to_string());
                Entry::bad(stream, offset, len as u64, offset + error.at as u64, expected, found)
            }
            None => return,
        });
    }
}

/// The telegrams that are whole by now.
pub(super) fn telegrams(decoder: &mut StreamDecoder) -> Vec<Entry> {
    let mut entries = Vec::new();
    while let Some(found) = decoder.next_found() {
        if let Found::Telegram { offset, len, telegram } = found {
            let line = Entry::new(&Stream::default(), offset, len as u64, Verdict::Telegram);
            entries.push(described(&telegram, Options::default(), line));
        }
    }
    entries
}

/// A line with what the telegram says.
fn described(telegram: &Telegram, options: Options, line: Entry) -> Entry {
    let mut description = Description::new(options.values);
    telegram.visit(&mut description);
    Entry {
        from: Some(Side::Device),
        dialect: Some(LANGUAGE.to_owned()),
        name: Some(telegram.name().to_owned()),
        words: Some(std::mem::take(&mut description.words)),
        fields: options.fields.then(|| description.into_json()),
        ..line
    }
}
