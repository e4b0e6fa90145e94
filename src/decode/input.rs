//! What a file is: recognised by content, never by name.

use super::capture::{self, Capture};
use super::{Line, Stream};

/// Bytes to decode.
#[derive(Debug)]
pub struct Input {
    len: usize,
    content: Content,
}

#[derive(Debug)]
enum Content {
    /// Bytes as they went over the wire, one stream or several.
    Streams(Vec<Vec<Stream>>),
    Capture(Capture),
}

/// A file that looks like one thing and is not.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum InputError {
    /// No bytes at all.
    #[error("nothing to decode: the input is empty")]
    Empty,
    /// Text that is no hex.
    #[error(
        "line {line}: expected bytes as two hex digits each (a comment begins with `;`), found `{found}`"
    )]
    NotHex {
        /// From 1 on.
        line: usize,
        /// The word that is no byte.
        found: String,
    },
}

impl Input {
    /// Recognises pcap, pcapng, hex text; everything else is raw bytes.
    pub fn read(bytes: Vec<u8>) -> Result<Self, InputError> {
        let len = bytes.len();
        if bytes.is_empty() {
            return Err(InputError::Empty);
        }
        let content = if let Some(capture) = capture::read(&bytes) {
            Content::Capture(capture)
        } else if let Some(text) = as_text(&bytes) {
            Content::Streams(vec![hex(text)?])
        } else {
            Content::Streams(vec![vec![Stream::plain(0, bytes)]])
        };
        Ok(Self { len, content })
    }

    /// True for a network capture, of which only the connections with telegrams are wanted.
    pub(super) fn is_capture(&self) -> bool {
        matches!(self.content, Content::Capture(_))
    }

    /// Streams that belong together.
    pub(super) fn connections(&self) -> &[Vec<Stream>] {
        match &self.content {
            Content::Streams(streams) => streams,
            Content::Capture(capture) => &capture.connections,
        }
    }

    /// Where a capture breaks off.
    pub(super) fn cut(&self) -> Option<Line> {
        match &self.content {
            Content::Capture(Capture { cut: Some(cut), .. }) => Some(cut.line(self.len)),
            _ => None,
        }
    }
}

/// The bytes as printable text. Frames hold control characters, so no recording is taken for text.
fn as_text(bytes: &[u8]) -> Option<&str> {
    let printable = |b: &u8| matches!(b, b'\t' | b'\n' | b'\r' | b' '..=b'~' | 0x80..);
    bytes.iter().all(printable).then(|| std::str::from_utf8(bytes).ok())?
}

/// Hex text: one frame a line, or one dump over many lines. Comments begin with `;` or `#`.
fn hex(text: &str) -> Result<Vec<Stream>, InputError> {
    const STX: u8 = 0x02;
    let mut lines = Vec::new();
    for (number, line) in (1..).zip(text.lines()) {
        let bytes = line.split([';', '#']).next().unwrap_or_default();
        let bytes = hex_line(bytes).map_err(|found| InputError::NotHex { line: number, found })?;
        if !bytes.is_empty() {
            lines.push(bytes);
        }
    }
    if lines.is_empty() {
        return Err(InputError::Empty);
    }
    // Where every line begins a frame, a broken one must not swallow the next.
    if !lines.iter().all(|line| line.first() == Some(&STX)) {
        lines = vec![lines.concat()];
    }
    let mut offset = 0;
    let streams = lines.into_iter().map(|line| {
        let len = line.len() as u64;
        let stream = Stream::plain(offset, line);
        offset += len;
        stream
    });
    Ok(streams.collect())
}

/// Bytes, apart or not, with or without `0x`; an error is the word that is none.
fn hex_line(line: &str) -> Result<Vec<u8>, String> {
    let mut bytes = Vec::new();
    for word in line.split(|c: char| c.is_whitespace() || c == ',').filter(|word| !word.is_empty()) {
        let digits = word.strip_prefix("0x").unwrap_or(word).as_bytes();
        let (pairs, rest) = digits.as_chunks::<2>();
        let byte = |&[high, low]: &[u8; 2]| {
            let digit = |c: u8| char::from(c).to_digit(16).and_then(|digit| u8::try_from(digit).ok());
            Some(digit(high)? << 4 | digit(low)?)
        };
        let decoded: Option<Vec<u8>> = pairs.iter().map(byte).collect();
        match decoded {
            Some(decoded) if rest.is_empty() => bytes.extend(decoded),
            _ => return Err(word.chars().take(20).collect()),
        }
    }
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hex_in_any_habit_is_read() {
        for line in ["02 73 03", "027303", "0x02, 0x73, 0x03", " 02\t7303 "] {
            assert_eq!(hex_line(line), Ok(vec![2, 0x73, 3]), "{line}");
        }
        assert_eq!(hex_line("02 7"), Err("7".to_owned()));
        assert_eq!(hex_line("02 xy"), Err("xy".to_owned()));
    }

    #[test]
    fn text_that_is_no_hex_is_refused_with_its_line() {
        let error = Input::read(b"02 73 ; fine\nhello\n".to_vec()).unwrap_err();
        assert_eq!(error, InputError::NotHex { line: 2, found: "hello".to_owned() });
        assert_eq!(Input::read(Vec::new()).unwrap_err(), InputError::Empty);
    }
}
