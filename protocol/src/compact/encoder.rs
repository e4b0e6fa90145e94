//! Type 4: the encoder at the scanner's inputs.

use super::error::{CompactError, Expected};
use super::wire::{Always, Fields, Reader, Writer, layout};
use crate::visit::Visitor;

layout! {
    /// One reading of the encoder, one a frame; 88 bytes with frame.
    #[derive(Default)]
    pub struct Encoder {
        /// Counts telegrams.
        pub telegram_counter: u64,
        /// When it was sent.
        pub transmit_time_us: u64 ["µs"],
        /// Always 1.
        pub version: Always<1>,
        /// Bytes from `sender_id` on.
        pub payload_bytes: PayloadLength ["bytes"],
        /// The scanner's serial number.
        pub sender_id: u32,
        /// Frame that it belongs to.
        pub frame_number: u64,
        /// Ticks; wraps.
        pub tick: u32 ["ticks"],
        /// Ticks at the first of two references, which the speed is of.
        pub tick_ref1: u32 ["ticks"],
        /// Ticks at the second.
        pub tick_ref2: u32 ["ticks"],
        /// Speed; its unit follows the scanner's settings.
        pub speed: f32,
        /// When `tick` was read.
        pub tick_time_us: u64 ["µs"],
        /// When the first reference was.
        pub ref1_time_us: u64 ["µs"],
        /// When the second was.
        pub ref2_time_us: u64 ["µs"],
    }
}

/// How long the fields of an [`Encoder`] are said to be. Real telegrams say 52; SICK's descriptions disagree on whether the sender's 4 bytes
/// count, so 48 is taken, too. The layout is the same either way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PayloadLength(u32);

impl PayloadLength {
    /// As real telegrams have it: with the sender.
    pub const WITH_SENDER: Self = Self(52);
    /// Without the sender; not seen on a device.
    pub const WITHOUT_SENDER: Self = Self(48);
}

impl Default for PayloadLength {
    fn default() -> Self {
        Self::WITH_SENDER
    }
}

impl Fields for PayloadLength {
    fn read(&mut self, reader: &mut Reader<'_>) -> Result<(), CompactError> {
        let at = reader.at();
        self.0.read(reader)?;
        match *self {
            Self::WITH_SENDER | Self::WITHOUT_SENDER => Ok(()),
            Self(other) => Err(CompactError { expected: Expected::PayloadLength, found: other.into(), at }),
        }
    }

    fn write(&self, writer: &mut Writer<'_>) {
        self.0.write(writer);
    }

    fn visit(&self, visitor: &mut dyn Visitor) {
        self.0.visit(visitor);
    }
}
