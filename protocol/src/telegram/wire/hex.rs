//! Runs of plain text numbers: one to four hex digits between single blanks, as devices write measured values.
//!
//! The cost is not in the arithmetic but in checking every character. So the text is checked block by block, which the compiler
//! vectorises, and within a run that holds nothing but hex digits and blanks a token's value takes a dozen
//! operations on all its digits at once. Whatever is not plain (signs, leading zeros, an error) ends the run, and the caller reads
//! it the careful way.

use super::word::Word;

/// Text looked at in one go: long enough to be worth it, short enough that a caller who comes back after every token of a hostile text
/// costs little.
const BLOCK: usize = 4096;
/// Bytes the compiler looks at together.
const LANES: usize = 128;
/// A blank, four digits, a blank, rounded up to a machine word.
const WORD: usize = 8;

/// Reads numbers into `values` as long as they are plain, each led and followed by a blank; a block of text at most. Gives how many, and the
/// bytes they took, the last one's following blank not among them. The text begins with a blank.
pub(super) fn plain_values<T: Word>(text: &[u8], values: &mut [T]) -> (usize, usize) {
    let run = clean_run(text.get(..BLOCK).unwrap_or(text));
    let mut rest = run;
    let mut read = 0;
    for value in values {
        let Some(&word) = rest.first_chunk::<WORD>() else { break };
        let [_, a, b, c, d, e, ..] = word;
        let digits = (u64::from_le_bytes(word) >> 8) as u32;
        // Shifted so that the last digit is the uppermost byte. Branches, not arithmetic: they are foreseen, for neighbours are alike, and
        // the next token need not wait for this one's length.
        let (digits, after) = if a == b' ' {
            break;
        } else if b == b' ' {
            (digits << 24, rest.get(2..))
        } else if c == b' ' {
            (digits << 16, rest.get(3..))
        } else if T::BYTES > 1 && d == b' ' {
            (digits << 8, rest.get(4..))
        } else if T::BYTES > 1 && e == b' ' {
            (digits, rest.get(5..))
        } else {
            break;
        };
        *value = T::from_low(four_digits(digits));
        rest = after.unwrap_or_default();
        read += 1;
    }
    (read, run.len() - rest.len())
}

/// The hex digits and blanks that `text` begins with.
fn clean_run(text: &[u8]) -> &[u8] {
    let clean =
        |byte: &u8| byte.wrapping_sub(b'0') < 10 || (byte & !0x20).wrapping_sub(b'A') < 6 || *byte == b' ';
    let mut end = 0;
    for lanes in text.chunks(LANES) {
        // Without an early exit the compiler looks at all of them at once.
        if !lanes.iter().fold(true, |all, byte| all & clean(byte)) {
            end += lanes.iter().position(|byte| !clean(byte)).unwrap_or(lanes.len());
            break;
        }
        end += lanes.len();
    }
    text.get(..end).unwrap_or_default()
}

/// What four characters are worth, the first in the lowest byte; NUL counts as 0, and all others are hex digits.
fn four_digits(characters: u32) -> u32 {
    // Letters have bit 6, and their low four bits count from 1.
    let nibbles = (characters & 0x0F0F_0F0F) + 9 * (characters >> 6 & 0x0101_0101);
    // Adds every digit's sixteenfold to the next: bytes 1 and 3 then hold two digits each.
    let pairs = nibbles.wrapping_mul(0x1001);
    pairs & 0xFF00 | pairs >> 24
}

#[cfg(test)]
mod tests {
    use alloc::format;
    use alloc::string::String;

    use super::*;

    #[test]
    fn every_number_in_either_case() {
        for value in 0..=u16::MAX {
            for text in [format!(" {value:X} 0 0 0"), format!(" {value:x} 0 0 0")] {
                let mut values = [0u16; 1];
                assert_eq!(plain_values(text.as_bytes(), &mut values), (1, text.len() - 6));
                assert_eq!(values, [value]);
            }
        }
    }

    #[test]
    fn a_run_ends_before_the_first_that_is_not_plain() {
        for odd in ["", "12345", "+1", "-1", "G", "/", ":", "@", "`", "g", "\u{7f}", "R1"] {
            let text = format!(" A 12 BC4 FFFF {odd} 1 2 3 4 5 6");
            let mut values = [7u16; 8];
            let read = plain_values(text.as_bytes(), &mut values);
            // What is not even of digits and blanks ends the run a word earlier, where the careful way takes over.
            assert!(read == (4, 14) || read.0 >= 2 && !odd.is_empty(), "{odd}: {read:?}");
            assert_eq!(values.get(..read.0), [0xA, 0x12, 0xBC4, 0xFFFF].get(..read.0), "{odd}");
        }
        let mut bytes = [0u8; 8];
        assert_eq!(plain_values(b" A FF 100 1 1 1 1", &mut bytes), (2, 5));
    }

    #[test]
    fn a_block_is_left_at_a_border_of_tokens() {
        let text: String = (0..BLOCK).map(|n| format!(" {n:X}")).collect();
        let mut values = [0u16; BLOCK];
        let (mut read, mut at) = (0, 0);
        while let (more @ 1.., bytes) = plain_values(&text.as_bytes()[at..], &mut values[read..]) {
            assert!(bytes <= BLOCK);
            (read, at) = (read + more, at + bytes);
        }
        assert!(read + 2 >= BLOCK, "the last tokens have no word to stand in");
        assert!(values.iter().take(read).copied().eq(0..read as u16));
    }
}
