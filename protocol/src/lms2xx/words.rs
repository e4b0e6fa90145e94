//! The words of the LMS2xx: 16 bits, low byte first.

use alloc::vec::Vec;

use byteorder::{ByteOrder, LittleEndian};

/// The word of two bytes.
pub(super) fn word(bytes: [u8; 2]) -> u16 {
    LittleEndian::read_u16(&bytes)
}

/// The word at a place of a body; none where the body has ended.
pub(super) fn word_at(body: &[u8], at: usize) -> Option<u16> {
    body.get(at..)?.first_chunk().map(|bytes| word(*bytes))
}

/// Appends the words of a body. A last byte without its other half is no word.
pub(super) fn read_words(body: &[u8], words: &mut Vec<u16>) {
    let (pairs, _) = body.as_chunks::<2>();
    let at = words.len();
    words.resize(at + pairs.len(), 0);
    LittleEndian::read_u16_into(pairs.as_flattened(), &mut words[at..]);
}

/// Appends words to a body.
pub(super) fn put_words(words: &[u16], body: &mut Vec<u8>) {
    let at = body.len();
    body.resize(at + 2 * words.len(), 0);
    LittleEndian::write_u16_into(words, &mut body[at..]);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_appended_low_byte_first_and_read_back() {
        let mut body = alloc::vec![0x3B];
        put_words(&[0x0102, 0xFFFE], &mut body);
        assert_eq!(body, [0x3B, 0x02, 0x01, 0xFE, 0xFF]);
        assert_eq!((word_at(&body, 3), word_at(&body, 4), word_at(&body, 9)), (Some(0xFFFE), None, None));
        let mut words = alloc::vec![7];
        // The last byte is half a word.
        read_words(&body[..4], &mut words);
        assert_eq!(words, [7, 0x023B, 0xFE01]);
    }
}
