//! A recording written anew: repaired, indexed, or converted from what another program wrote.

use std::io;

use crate::frames::FrameReader;
use crate::writer::{Decoded, McapWriter, WriteSeek};
use crate::{About, Joint, Packet, ReadError, Recorded, Recording, Side, Soundness, Torn};

/// Why a copy was not made.
#[derive(Debug, thiserror::Error)]
pub enum CopyError {
    /// What is read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// What is written.
    #[error("{0}")]
    Write(io::Error),
    /// No such stream.
    #[error("no stream `{wanted}`; it has {}", found.join(", "))]
    NoStream {
        /// What was asked for.
        wanted: String,
        /// What there is.
        found: Vec<String>,
    },
}

/// What became of a copy.
#[derive(Clone, Debug)]
pub struct Copied {
    /// What was written.
    pub recorded: Recorded,
    /// Where what was read breaks off, if it does.
    pub torn: Option<Torn>,
    /// How much of it can be read.
    pub soundness: Soundness,
}

/// Where packets come from.
enum From {
    /// The file knows times and sides.
    Packets(Recording, Option<Packet>),
    /// It does not; the frames in it do.
    Frames(FrameReader),
}

/// Writes all that can be read of `recording` to `out` as a whole, indexed MCAP file. What a log does not say of
/// itself is taken from `about`; one without times gets the device's. `only`: one stream, by its name.
pub fn copy(
    mut recording: Recording,
    only: Option<&str>,
    out: &mut dyn WriteSeek,
    about: About,
    decoded: Decoded,
) -> Result<Copied, CopyError> {
    let mut from = if recording.has_times() {
        let first = recording.next_packet()?;
        From::Packets(recording, first)
    } else {
        From::Frames(FrameReader::new(recording).keeping_unfinished())
    };
    let by_device_clock = matches!(from, From::Frames(_));
    let about = About { by_device_clock, ..About::default() }.or(from.recording().about().clone()).or(about);
    let mut writer = McapWriter::indexed(out, &about, decoded).map_err(CopyError::Write)?;
    let mut streams = Vec::new();
    let mut recorded = Recorded::default();
    loop {
        let packet = from.next()?;
        for stream in from.recording().streams().iter().skip(streams.len()) {
            let wanted = only.is_none_or(|only| stream.name == only);
            let added = wanted.then(|| writer.add_stream(&stream.name, stream.kind)).transpose();
            streams.push(added.map_err(CopyError::Write)?);
        }
        let Some(packet) = packet else { break };
        let lost_before = match packet.joint {
            Joint::Gap { packets, .. } => u32::try_from(packets.max(1)).unwrap_or(u32::MAX),
            _ => 0,
        };
        if let (Some(stream), Some(side), Some(at_ns)) =
            (streams.get(packet.stream).copied().flatten(), packet.from, packet.at_ns)
        {
            writer.write(stream, side, at_ns, lost_before, &packet.bytes).map_err(CopyError::Write)?;
            recorded.packets += 1;
            recorded.from_device += u64::from(side == Side::Device);
            recorded.bytes += packet.bytes.len() as u64;
        }
    }
    // A run says only at its end when its drive began.
    let drive = from.recording().about().drive;
    if drive.is_some() && drive != about.drive {
        writer.describe(&About { drive, ..about }).map_err(CopyError::Write)?;
    }
    writer.finish().map_err(CopyError::Write)?;
    if let (Some(only), false) = (only, streams.iter().any(Option::is_some)) {
        let found = from.recording().streams().iter().map(|stream| stream.name.clone()).collect();
        return Err(CopyError::NoStream { wanted: only.to_owned(), found });
    }
    let read = from.recording();
    Ok(Copied { recorded, torn: read.torn().cloned(), soundness: read.soundness() })
}

impl From {
    fn recording(&self) -> &Recording {
        match self {
            Self::Packets(recording, _) => recording,
            Self::Frames(frames) => frames.recording(),
        }
    }

    fn next(&mut self) -> Result<Option<Packet>, ReadError> {
        match self {
            Self::Packets(recording, first) => match first.take() {
                Some(packet) => Ok(Some(packet)),
                None => recording.next_packet(),
            },
            Self::Frames(frames) => Ok(frames.next_frame()?.map(|frame| Packet {
                stream: frame.stream,
                from: Some(frame.from),
                at_ns: Some(frame.at_ns),
                joint: Joint::Seamless,
                bytes: frame.bytes,
            })),
        }
    }
}
