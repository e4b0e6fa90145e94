//! Faults of a CAN bus.

use std::time::Duration;

/// A fault of a bus.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum BusFault {
    /// Controllers are off the bus: nothing passes.
    Off {
        /// They come back by themselves after so long.
        restart: Option<Duration>,
    },
    /// Controllers have counted many errors; frames pass.
    Passive {
        /// Transmit and receive error counters.
        counters: (u8, u8),
    },
    /// Somebody else's frames fill the bus.
    Load {
        /// Share of the bus's time.
        share: f64,
    },
    /// Frames are destroyed.
    Error {
        /// Which rule is broken, as byte 2 of an error frame's data says.
        code: u8,
        /// Error frames a second.
        per_s: f64,
    },
    /// Nobody acknowledges what the tractor sends.
    AckNone,
    /// A node with a better NAME takes an address.
    AddressSteal {
        /// Which; the tractor's own where absent.
        address: Option<u8>,
    },
    /// The tractor says nothing.
    NoTecu,
    /// A second tractor says other things.
    TwoTecu {
        /// Its address.
        address: u8,
        /// Its speeds are so many times the true ones.
        speed_ratio: f64,
    },
    /// A node with the tractor's NAME claims another address.
    NameClash {
        /// Its address.
        address: u8,
    },
}
