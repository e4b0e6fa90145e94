//! Recordings packed by gzip, in any number of members, read as what they hold.

use std::io::{self, BufReader, Cursor, Read};

use flate2::bufread::MultiGzDecoder;

use super::CHUNK;

/// First bytes of a gzip archive.
const GZIP: &[u8] = b"\x1F\x8B\x08";

/// The first bytes of a recording and what comes behind them, unpacked where it is packed once.
pub(super) fn unpacked(mut input: Box<dyn Read + Send>) -> io::Result<(Vec<u8>, Box<dyn Read + Send>)> {
    let head = head(&mut input)?;
    if !head.starts_with(GZIP) {
        return Ok((head, input));
    }
    let mut input: Box<dyn Read + Send> =
        Box::new(Unpacked(MultiGzDecoder::new(BufReader::new(Cursor::new(head).chain(input)))));
    Ok((self::head(&mut input)?, input))
}

fn head(input: &mut Box<dyn Read + Send>) -> io::Result<Vec<u8>> {
    let mut head = Vec::new();
    input.by_ref().take(CHUNK as u64).read_to_end(&mut head)?;
    Ok(head)
}

/// A gzip archive that is damaged or breaks off.
#[derive(Debug, thiserror::Error)]
#[error(
    "a gzip archive that is damaged or breaks off ({0}): expected a whole one; `gunzip -c` gives what can be saved"
)]
pub struct BrokenArchive(#[source] io::Error);

/// Tells where damage lies: in the archive, and not in the recording.
struct Unpacked<R>(R);

impl<R: Read> Read for Unpacked<R> {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        self.0.read(into).map_err(|error| match error.kind() {
            io::ErrorKind::UnexpectedEof | io::ErrorKind::InvalidData | io::ErrorKind::InvalidInput => {
                io::Error::other(BrokenArchive(error))
            }
            _ => error,
        })
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use flate2::Compression;
    use flate2::write::GzEncoder;

    use crate::{Format, Recording};

    fn packed(bytes: &[u8]) -> Vec<u8> {
        let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
        encoder.write_all(bytes).expect("packed");
        encoder.finish().expect("packed")
    }

    #[test]
    fn a_packed_recording_is_what_it_holds() {
        let members = [packed(b"\x02sRN DeviceIdent\x03"), packed(b"\x02sRN STlms\x03")].concat();
        let mut recording = Recording::read(Box::new(std::io::Cursor::new(members))).expect("it opens");
        assert_eq!(recording.format(), Format::Raw);
        let packet = recording.next_packet().expect("read").expect("one");
        assert_eq!(packet.bytes, b"\x02sRN DeviceIdent\x03\x02sRN STlms\x03");
    }

    #[test]
    fn an_archive_that_breaks_off_says_so() {
        let mut cut = packed(b"02 73 03\n");
        cut.truncate(cut.len() - 6);
        let error = Recording::read(Box::new(std::io::Cursor::new(cut))).expect_err("cut").to_string();
        assert!(error.contains("a gzip archive that is damaged or breaks off"), "{error}");
        // Packed twice is no recording: nobody does that on purpose.
        let twice = packed(&packed(b"02 73 03\n"));
        let error = Recording::read(Box::new(std::io::Cursor::new(twice))).expect_err("twice").to_string();
        assert!(error.contains("packed twice"), "{error}");
    }
}
