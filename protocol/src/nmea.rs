//! The text form of NMEA 0183: lines out of a receiver's bytes, in whatever pieces they come, and sentences held to their checksums.

use alloc::string::String;
use alloc::vec::Vec;

/// Longer lines are discarded: a sentence is 82 characters by the standard, some receivers' a little more.
const LONGEST: usize = 256;

/// Cuts a receiver's bytes into lines.
#[derive(Debug, Default)]
pub struct NmeaLines {
    bytes: Vec<u8>,
}

impl NmeaLines {
    /// Takes the next bytes.
    pub fn push(&mut self, bytes: &[u8]) {
        self.bytes.extend_from_slice(bytes);
    }

    /// The next whole line with its end; a line that is not UTF-8 is skipped.
    pub fn next_line(&mut self) -> Option<String> {
        loop {
            let Some(end) = self.bytes.iter().position(|byte| *byte == b'\n') else {
                if self.bytes.len() > LONGEST {
                    self.bytes.clear();
                }
                return None;
            };
            if let Ok(line) = String::from_utf8(self.bytes.drain(..=end).collect()) {
                return Some(line);
            }
        }
    }
}

/// What stands between `$` and `*` of a sentence; `None` if the line is no sentence or its checksum is wrong.
pub fn sentence(line: &str) -> Option<&str> {
    let (body, sum) = line.trim().strip_prefix('$')?.split_once('*')?;
    (u8::from_str_radix(sum, 16) == Ok(checksum(body))).then_some(body)
}

/// The exclusive or of all its bytes.
pub fn checksum(body: &str) -> u8 {
    body.bytes().fold(0, |sum, byte| sum ^ byte)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_checksum_is_that_of_published_sentences() {
        // The examples of the `nmea` crate's and pynmea2's own documentation.
        for line in [
            "$GPGGA,184353.07,1929.045,S,02410.506,E,1,04,2.6,100.00,M,-33.9,M,,0000*6D",
            "$GPGGA,092750.000,5321.6802,N,00630.3372,W,1,8,1.03,61.7,M,55.2,M,,*76\r\n",
        ] {
            assert!(sentence(line).is_some_and(|body| body.starts_with("GPGGA")), "{line}");
            assert_eq!(sentence(&line.replace("GGA", "GGB")), None);
        }
    }

    #[test]
    fn lines_come_out_of_any_pieces_and_junk_is_discarded() {
        let mut lines = NmeaLines::default();
        lines.push(b"$GPG");
        assert_eq!(lines.next_line(), None);
        lines.push(b"GA*00\r\n\xFF\xFE\n$");
        assert_eq!(lines.next_line().as_deref(), Some("$GPGGA*00\r\n"));
        assert_eq!(lines.next_line(), None);
        lines.push(&[b'x'; 10_000]);
        assert_eq!((lines.next_line(), lines.bytes.len()), (None, 0));
    }
}
