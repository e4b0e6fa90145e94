//! The tap in a byte path: hands a copy of the bytes to whoever wants them.

use std::fmt;
use std::sync::Arc;

use crate::{Side, StreamKind};

/// Takes the bytes of one stream.
type Sink = dyn Fn(Side, &[u8]) + Send + Sync;

/// Opens the tap of a stream by name.
type Opener = dyn Fn(&str, StreamKind) -> Tap + Send + Sync;

/// Opens taps, as a recorder's; the default one opens taps that do nothing.
#[derive(Clone, Default)]
pub struct Taps(Option<Arc<Opener>>);

/// One stream's tap. Cheap to clone; the default one does nothing.
#[derive(Clone, Default)]
pub struct Tap(Option<Arc<Sink>>);

impl Taps {
    /// Taps that `open` opens, by the stream's name and kind.
    pub fn new(open: impl Fn(&str, StreamKind) -> Tap + Send + Sync + 'static) -> Self {
        Self(Some(Arc::new(open)))
    }

    /// Taps that hand the bytes to both.
    #[must_use]
    pub fn and(self, other: Self) -> Self {
        match (self.0, other.0) {
            (Some(one), Some(two)) => Self::new(move |name, kind| one(name, kind).and(two(name, kind))),
            (one, two) => Self(one.or(two)),
        }
    }

    /// A tap for one stream. A recorder numbers a name that is taken.
    pub fn open(&self, name: &str, kind: StreamKind) -> Tap {
        self.0.as_ref().map_or_else(Tap::default, |open| open(name, kind))
    }
}

impl Tap {
    /// A tap that hands the bytes, and who sent them, to `sink`. The byte path waits for it.
    ///
    /// ```
    /// use std::sync::mpsc;
    /// use rowscan_recording::{Side, Tap};
    ///
    /// let (copies, seen) = mpsc::channel();
    /// let tap = Tap::new(move |from, bytes| drop(copies.send((from, bytes.to_vec()))));
    /// tap.record(Side::Host, b"\x02sRN DeviceIdent\x03");
    /// assert_eq!(seen.recv().unwrap().0, Side::Host);
    /// ```
    pub fn new(sink: impl Fn(Side, &[u8]) + Send + Sync + 'static) -> Self {
        Self(Some(Arc::new(sink)))
    }

    /// A tap that hands the bytes to both.
    #[must_use]
    pub fn and(self, other: Self) -> Self {
        match (self.0, other.0) {
            (Some(one), Some(two)) => Self::new(move |from, bytes| {
                one(from, bytes);
                two(from, bytes);
            }),
            (one, two) => Self(one.or(two)),
        }
    }

    /// Hands on `bytes` sent by `from`.
    pub fn record(&self, from: Side, bytes: &[u8]) {
        if let (Some(sink), false) = (&self.0, bytes.is_empty()) {
            sink(from, bytes);
        }
    }
}

impl fmt::Debug for Taps {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Taps").field(&self.0.is_some()).finish()
    }
}

impl fmt::Debug for Tap {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Tap").field(&self.0.is_some()).finish()
    }
}
