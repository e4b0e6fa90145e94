//! Finds frames in the bytes of a stream, in its language.

use rowscan_protocol::compact::{self, StreamDecoder};
use rowscan_protocol::frame::{Accept, Dialect, FrameDecoder};
use rowscan_protocol::lms2xx;
use rowscan_protocol::telegram::{Kind, LmdScandata, Telegram};

use crate::scan_reader::MAX_PAYLOAD;
use crate::{Side, StreamKind};

/// Finds frames in the language of the stream.
#[derive(Debug)]
pub(crate) enum Finder {
    Cola(FrameDecoder),
    Lms2xx(lms2xx::frame::FrameDecoder),
    /// With the stretches that were no telegrams.
    Compact(StreamDecoder, u64),
}

/// A frame that was found.
pub(crate) struct Found {
    pub(crate) offset: u64,
    pub(crate) len: usize,
    pub(crate) dialect: Option<Dialect>,
    /// Who sends such telegrams.
    pub(crate) from: Option<Side>,
    /// It holds a telegram: a frame of CoLa A may be two bytes of noise.
    pub(crate) is_telegram: bool,
    /// When it was sent, by the device's clock, if it says so.
    pub(crate) device_us: Option<u32>,
}

impl Finder {
    /// For a stream of this kind, of which `from` sends the bytes; both sides where that is not known.
    pub(crate) fn new(kind: StreamKind, from: Option<Side>) -> Self {
        use lms2xx::frame::Listener;
        match (kind, from) {
            (StreamKind::Lms2xx, Some(Side::Device)) => Self::lms2xx(Listener::Host),
            (StreamKind::Lms2xx, Some(Side::Host)) => Self::lms2xx(Listener::Device),
            (StreamKind::Lms2xx, None) => Self::lms2xx(Listener::Either),
            (StreamKind::Compact, _) => Self::Compact(StreamDecoder::default(), 0),
            _ => Self::Cola(FrameDecoder::new(Accept::Either, MAX_PAYLOAD)),
        }
    }

    fn lms2xx(listener: lms2xx::frame::Listener) -> Self {
        Self::Lms2xx(lms2xx::frame::FrameDecoder::new(listener))
    }

    pub(crate) fn push(&mut self, bytes: &[u8]) {
        match self {
            Self::Cola(decoder) => decoder.push(bytes),
            Self::Lms2xx(decoder) => decoder.push(bytes),
            Self::Compact(decoder, _) => decoder.push(bytes),
        }
    }

    /// Bytes of a frame that is not whole yet.
    pub(crate) fn pending(&self) -> usize {
        match self {
            Self::Cola(decoder) => decoder.pending(),
            Self::Lms2xx(decoder) => decoder.pending(),
            Self::Compact(decoder, _) => decoder.pending(),
        }
    }

    /// Of these, bytes of one whose rest may still come.
    pub(crate) fn unfinished(&self) -> usize {
        match self {
            Self::Cola(decoder) => decoder.unfinished(),
            Self::Lms2xx(decoder) => decoder.unfinished(),
            Self::Compact(decoder, _) => decoder.unfinished(),
        }
    }

    /// Broken frames so far: wrong checksum, impossible length, text without end.
    pub(crate) fn bad(&self) -> u64 {
        match self {
            Self::Cola(decoder) => decoder.counts().bad,
            Self::Lms2xx(decoder) => decoder.counts().bad,
            Self::Compact(_, bad) => *bad,
        }
    }

    /// No more bytes will come.
    pub(crate) fn finish(&mut self) {
        match self {
            Self::Cola(decoder) => decoder.finish(),
            Self::Lms2xx(decoder) => decoder.finish(),
            Self::Compact(decoder, _) => decoder.finish(),
        }
    }

    /// The next frame.
    pub(crate) fn next(&mut self) -> Option<Found> {
        match self {
            Self::Cola(decoder) => {
                let frame = decoder.next_frame()?;
                let telegram = Telegram::parse(frame.dialect, frame.payload).ok();
                Some(Found {
                    offset: frame.offset,
                    len: frame.len,
                    dialect: Some(frame.dialect),
                    is_telegram: telegram.is_some(),
                    from: telegram.map(|telegram| Side::of(telegram.kind)),
                    device_us: telegram.and_then(transmit_time_us),
                })
            }
            Self::Compact(decoder, bad) => loop {
                match decoder.next_found()? {
                    compact::Found::Bad { .. } => *bad += 1,
                    compact::Found::Telegram { offset, len, .. } => {
                        return Some(Found {
                            offset,
                            len,
                            dialect: None,
                            is_telegram: true,
                            from: Some(Side::Device),
                            device_us: None,
                        });
                    }
                }
            },
            Self::Lms2xx(decoder) => loop {
                if let lms2xx::frame::Received::Frame(frame) = decoder.next_received()? {
                    let from = if frame.is_from_device() { Side::Device } else { Side::Host };
                    let (offset, len) = (frame.offset, frame.len);
                    return Some(Found {
                        offset,
                        len,
                        dialect: None,
                        is_telegram: true,
                        from: Some(from),
                        device_us: None,
                    });
                }
            },
        }
    }
}

/// When a scan was sent, by the device's clock.
fn transmit_time_us(telegram: Telegram<'_>) -> Option<u32> {
    if telegram.kind != Kind::Sn || !telegram.name.starts_with("LMDscandata") {
        return None;
    }
    telegram.args.decode::<LmdScandata>().ok().map(|scan| scan.transmit_time_us)
}
