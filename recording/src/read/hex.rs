//! Hex text without addresses: one frame a line, or one dump over many lines. Comments begin with `;` or `#`.

use super::ReadError;
use crate::{Joint, Packet};

const STX: u8 = 0x02;
/// Letters of a word that are shown.
const MOST_SHOWN: usize = 20;

/// The text's bytes, a packet a line where every line begins a frame.
pub(super) fn packets(text: &str) -> Result<Vec<Packet>, ReadError> {
    let mut lines = Vec::new();
    for (number, line) in (1..).zip(text.lines()) {
        let bytes = line.split([';', '#']).next().unwrap_or_default();
        let bytes = hex_line(bytes).map_err(|found| {
            // Where nothing before it is hex, nor how it begins, it is no typing error.
            let first: String = words(bytes).next().unwrap_or_default().chars().take(MOST_SHOWN).collect();
            match lines.is_empty() && first == found {
                true => ReadError::OtherText { line: number, found },
                false => ReadError::NotHex { line: number, found },
            }
        })?;
        if !bytes.is_empty() {
            lines.push(bytes);
        }
    }
    // Where every line begins a frame, a broken one must not swallow the next.
    if !lines.iter().all(|line| line.first() == Some(&STX)) {
        lines = vec![lines.concat()];
    }
    let packet = |bytes| Packet { bytes, joint: Joint::Anew, ..Packet::default() };
    Ok(lines.into_iter().map(packet).collect())
}

/// What is between blanks and commas.
pub(super) fn words(line: &str) -> impl Iterator<Item = &str> {
    line.split(|c: char| c.is_whitespace() || c == ',').filter(|word| !word.is_empty())
}

/// Bytes, apart or not, with or without `0x`; an error is the word that is none.
pub(super) fn hex_line(line: &str) -> Result<Vec<u8>, String> {
    let mut bytes = Vec::new();
    for word in words(line) {
        let digits = word.strip_prefix("0x").unwrap_or(word);
        bytes.extend(pairs(digits).ok_or_else(|| word.chars().take(MOST_SHOWN).collect::<String>())?);
    }
    Ok(bytes)
}

/// Bytes of two digits each, with nothing between them; none where one is no byte.
pub(super) fn pairs(digits: &str) -> Option<Vec<u8>> {
    let (pairs, rest) = digits.as_bytes().as_chunks::<2>();
    let byte = |&[high, low]: &[u8; 2]| {
        let digit = |c: u8| char::from(c).to_digit(16).and_then(|digit| u8::try_from(digit).ok());
        Some(digit(high)? << 4 | digit(low)?)
    };
    rest.is_empty().then(|| pairs.iter().map(byte).collect())?
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
        let error = packets("02 73 ; fine\nhello\n").unwrap_err();
        assert!(error.to_string().starts_with("line 2: "), "{error}");
        assert!(error.to_string().contains("`hello`"), "{error}");
        let error = packets("02 7\nhello\n").unwrap_err();
        assert!(matches!(error, ReadError::NotHex { line: 1, .. }), "{error}");
    }

    #[test]
    fn text_of_another_kind_is_told_as_no_recording() {
        for text in ["# Title\n\nSome words.\n", "key = \"value\"\n", "<html>\n02 73\n"] {
            let error = packets(text).unwrap_err();
            assert!(matches!(error, ReadError::OtherText { .. }), "{text}: {error}");
            assert!(error.to_string().contains("no recording"), "{error}");
        }
    }
}
