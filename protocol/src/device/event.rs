//! The events a client can subscribe to.

/// What a session can subscribe to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum DeviceEvent {
    /// Every scan.
    ScanData,
    /// The same scans under the monitor's name.
    Monitor,
    /// The result of an evaluation field.
    FieldResult,
    /// A digital input has changed.
    InputState,
    /// A digital output has changed.
    OutputState,
}

/// The events a session has subscribed to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Subscriptions(u8);

impl Subscriptions {
    /// To this one.
    pub fn has(self, event: DeviceEvent) -> bool {
        self.0 & 1 << event as u8 != 0
    }

    /// To none.
    pub fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// Subscribes, or unsubscribes.
    pub(super) fn set(&mut self, event: DeviceEvent, on: bool) {
        let bit = 1 << event as u8;
        self.0 = if on { self.0 | bit } else { self.0 & !bit };
    }
}
