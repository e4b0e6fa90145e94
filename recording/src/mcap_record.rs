//! One record of an MCAP file. Every length in it is held against the bytes there are, before the library sees it and asks for so much memory.

use mcap::records::{Record, op};

/// A part of a record that has a length.
#[derive(Clone, Copy)]
enum Part {
    /// So many bytes without one.
    Skip(usize),
    /// Bytes behind their number, 32 bits.
    Bytes,
    /// Bytes behind their number, 64 bits.
    Bytes64,
    /// Texts, two by two, behind their bytes' number, 32 bits.
    Map,
}

/// The parts of each record up to the last that has a length, and what the library takes for granted behind it; those of other records have none.
fn parts(opcode: u8) -> &'static [Part] {
    use Part::{Bytes, Bytes64, Map, Skip};
    match opcode {
        op::HEADER => &[Bytes, Bytes],
        op::SCHEMA => &[Skip(2), Bytes, Bytes, Bytes],
        op::CHANNEL => &[Skip(4), Bytes, Bytes, Map],
        op::CHUNK => &[Skip(28), Bytes, Bytes64],
        op::MESSAGE_INDEX => &[Skip(2), Bytes],
        op::CHUNK_INDEX => &[Skip(32), Bytes, Skip(8), Bytes],
        op::ATTACHMENT => &[Skip(16), Bytes, Bytes, Bytes64, Skip(4)],
        op::ATTACHMENT_INDEX => &[Skip(40), Bytes, Bytes],
        op::STATISTICS => &[Skip(42), Bytes],
        op::METADATA => &[Bytes, Map],
        op::METADATA_INDEX => &[Skip(16), Bytes],
        _ => &[],
    }
}

/// The record in `data`.
///
/// # Errors
/// What is wrong with it.
pub(crate) fn parse(opcode: u8, data: &[u8]) -> Result<Record<'_>, String> {
    if !lengths_fit(parts(opcode), data) {
        return Err("a length beyond its record's end".to_owned());
    }
    mcap::parse_record(opcode, data).map_err(|error| error.to_string())
}

fn lengths_fit(parts: &[Part], mut data: &[u8]) -> bool {
    parts.iter().all(|part| match part {
        Part::Skip(bytes) => skip(&mut data, *bytes).is_some(),
        Part::Bytes => counted(&mut data).is_some(),
        Part::Bytes64 => {
            let length =
                skip(&mut data, 8).and_then(<[u8]>::first_chunk).map(|length| u64::from_le_bytes(*length));
            let length = length.and_then(|length| usize::try_from(length).ok());
            length.is_some_and(|length| skip(&mut data, length).is_some())
        }
        Part::Map => counted(&mut data).is_some_and(|mut texts| {
            while !texts.is_empty() {
                if counted(&mut texts).is_none() {
                    return false;
                }
            }
            true
        }),
    })
}

fn skip<'a>(data: &mut &'a [u8], bytes: usize) -> Option<&'a [u8]> {
    let (skipped, rest) = data.split_at_checked(bytes)?;
    *data = rest;
    Some(skipped)
}

/// Bytes behind their number.
fn counted<'a>(data: &mut &'a [u8]) -> Option<&'a [u8]> {
    let length = u32::from_le_bytes(*skip(data, 4)?.first_chunk()?);
    skip(data, usize::try_from(length).ok()?)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A channel with one entry of metadata.
    fn channel() -> Vec<u8> {
        let text = |text: &str| [&(text.len() as u32).to_le_bytes()[..], text.as_bytes()].concat();
        let map = [text("key"), text("value")].concat();
        let length = (map.len() as u32).to_le_bytes();
        [&[1, 0, 0, 0][..], &text("/scanner"), &text("bytes"), &length, &map].concat()
    }

    /// The library subtracts before it compares.
    #[test]
    fn no_bytes_are_too_few() {
        for opcode in 0..=u8::MAX {
            for len in 0..80 {
                for byte in [0, 1, 4, 0xFF] {
                    let _ = parse(opcode, &vec![byte; len]);
                }
            }
        }
    }

    #[test]
    fn a_length_beyond_the_record_is_refused_before_memory_is_asked_for() {
        let whole = channel();
        assert!(
            matches!(parse(op::CHANNEL, &whole), Ok(Record::Channel(found)) if found.topic == "/scanner")
        );
        // Topic, encoding, map, key, value.
        for at in [4, 16, 25, 29, 36] {
            let mut damaged = whole.clone();
            damaged[at..at + 4].copy_from_slice(&[0xFF; 4]);
            assert_eq!(parse(op::CHANNEL, &damaged).unwrap_err(), "a length beyond its record's end", "{at}");
        }
    }
}
