//! What a message holds, declared once: encoding, decoding, the DBC file and the documents walk this.

use super::frame::J1939Id;

/// One quantity in a message: value = raw · scale + offset, little endian, bits counted from bit 0 of byte 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Signal {
    /// Its name in the DBC file.
    pub name: &'static str,
    /// First bit.
    pub start: u16,
    /// Width, 1 to 64.
    pub bits: u16,
    /// Two's complement.
    pub signed: bool,
    /// Value of one raw step.
    pub scale: f64,
    /// Value of raw 0.
    pub offset: f64,
    /// Unit, empty where it has none.
    pub unit: &'static str,
    /// What it is.
    pub about: &'static str,
    /// Names of raw values, where it is a choice.
    pub names: &'static [(u64, &'static str)],
}

impl Signal {
    /// An unsigned quantity.
    pub const fn new(name: &'static str, start: u16, bits: u16, scale: f64, unit: &'static str) -> Self {
        Self { name, start, bits, signed: false, scale, offset: 0.0, unit, about: "", names: &[] }
    }

    /// A choice.
    pub const fn choice(
        name: &'static str,
        start: u16,
        bits: u16,
        names: &'static [(u64, &'static str)],
    ) -> Self {
        Self { names, ..Self::new(name, start, bits, 1.0, "") }
    }

    /// A quantity that may be negative.
    pub const fn signed(self) -> Self {
        Self { signed: true, ..self }
    }

    /// With what it is.
    pub const fn about(self, about: &'static str) -> Self {
        Self { about, ..self }
    }

    fn mask(&self) -> u64 {
        if self.bits >= 64 { u64::MAX } else { (1 << self.bits) - 1 }
    }

    /// The largest raw value that is a value: above it J1939 and NMEA 2000 keep codes for error and not available.
    pub fn raw_max(&self) -> i128 {
        match (self.signed, self.bits) {
            (true, bits) => (1i128 << (bits - 1)) - 3,
            (false, 8) => 250,
            (false, 16) => 0xFAFF,
            (false, 32) => 0xFAFF_FFFF,
            (false, _) => i128::from(self.mask()),
        }
    }

    /// The smallest raw value.
    pub fn raw_min(&self) -> i128 {
        if self.signed { -(1i128 << (self.bits - 1)) } else { 0 }
    }

    /// The largest value that it can say.
    pub fn largest(&self) -> f64 {
        self.raw_max() as f64 * self.scale + self.offset
    }

    /// The raw value of "not available".
    fn missing(&self) -> u64 {
        if self.signed { self.mask() >> 1 } else { self.mask() }
    }

    /// The raw value that is nearest; 64 bits have more digits than `value`.
    fn nearest(&self, value: f64) -> f64 {
        ((value - self.offset) / self.scale).round()
    }

    /// True of a value that its bits can say, to the nearest step.
    pub fn can_say(&self, value: f64) -> bool {
        (self.raw_min() as f64..=self.raw_max() as f64).contains(&self.nearest(value))
    }

    /// True of a value other than 0 whose nearest step is 0.
    pub fn rounds_to_none(&self, value: f64) -> bool {
        value != 0.0 && value.is_finite() && self.nearest(value) == self.nearest(0.0)
    }

    /// Raw bits of a value, to the nearest step. A value that they cannot say is not available: its limit would be another value, and a wrong one.
    fn raw(&self, value: Option<f64>) -> u64 {
        let Some(value) = value.filter(|value| self.can_say(*value)) else { return self.missing() };
        let raw = self.nearest(value) as i128;
        raw.clamp(self.raw_min(), self.raw_max()) as u64 & self.mask()
    }

    /// The value of raw bits; `None` where they say error or not available.
    fn value(&self, raw: u64) -> Option<f64> {
        let raw = if self.signed && raw >> (self.bits - 1) & 1 == 1 {
            i128::from(raw) - (1i128 << self.bits)
        } else {
            i128::from(raw)
        };
        (raw <= self.raw_max()).then_some(raw as f64 * self.scale + self.offset)
    }
}

/// One parameter group.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Message {
    /// Its name in the DBC file.
    pub name: &'static str,
    /// Parameter group number.
    pub pgn: u32,
    /// 0 most urgent … 7.
    pub priority: u8,
    /// How often it is sent, milliseconds; `None` where only on an occasion.
    pub period_ms: Option<u32>,
    /// Bytes; more than eight go as an NMEA 2000 fast packet.
    pub len: usize,
    /// Address it comes from in the DBC file.
    pub source: u8,
    /// What it is, and where that is laid down.
    pub about: &'static str,
    /// What it holds, in the order of its values.
    pub signals: &'static [Signal],
}

/// The most bytes of any message here.
pub const MAX_LEN: usize = 64;

/// The bytes of a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Payload {
    bytes: [u8; MAX_LEN],
    len: usize,
}

impl Payload {
    /// So many bytes, all "not available".
    pub fn blank(len: usize) -> Self {
        Self { bytes: [0xFF; MAX_LEN], len: len.min(MAX_LEN) }
    }

    /// These bytes; those beyond [`MAX_LEN`] are left out.
    pub fn of(bytes: &[u8]) -> Self {
        let mut payload = Self::blank(bytes.len());
        for (place, byte) in payload.bytes.iter_mut().zip(bytes) {
            *place = *byte;
        }
        payload
    }

    /// Its bytes.
    pub fn bytes(&self) -> &[u8] {
        self.bytes.get(..self.len).unwrap_or_default()
    }
}

impl Message {
    /// Its signal of this name.
    pub fn signal(&self, name: &str) -> Option<&'static Signal> {
        self.signals.iter().find(|signal| signal.name == name)
    }

    /// The identifier it travels under, from `source`.
    pub fn id(&self, source: u8) -> J1939Id {
        let destination = super::frame::EVERYONE;
        J1939Id { priority: self.priority, pgn: self.pgn, source, destination }
    }

    /// One value a signal, in order; what is missing, what its signal cannot say, and bits of no signal, are "not available".
    pub fn encode(&self, values: &[Option<f64>]) -> Payload {
        let mut payload = Payload::blank(self.len);
        for (index, signal) in self.signals.iter().enumerate() {
            let raw = signal.raw(values.get(index).copied().flatten());
            for bit in 0..signal.bits {
                let at = signal.start + bit;
                let Some(byte) = payload.bytes.get_mut(usize::from(at / 8)) else { continue };
                let mask = 1 << (at % 8);
                if raw >> bit & 1 == 1 { *byte |= mask } else { *byte &= !mask }
            }
        }
        payload
    }

    /// One value a signal, in order; `None` where it is not available, or the message too short to hold it.
    pub fn decode(&self, bytes: &[u8]) -> Vec<Option<f64>> {
        self.signals.iter().map(|signal| decode_signal(signal, bytes)).collect()
    }
}

fn decode_signal(signal: &Signal, bytes: &[u8]) -> Option<f64> {
    let mut raw = 0u64;
    for bit in 0..signal.bits {
        let at = signal.start + bit;
        raw |= u64::from(bytes.get(usize::from(at / 8))? >> (at % 8) & 1) << bit;
    }
    signal.value(raw)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pgn::MESSAGES;

    #[test]
    fn every_signal_of_every_message_comes_back_as_it_went() {
        for message in MESSAGES {
            for share in [0.0, 0.31, 1.0] {
                let values: Vec<Option<f64>> = message
                    .signals
                    .iter()
                    .map(|signal| {
                        let (low, high) = (signal.raw_min(), signal.raw_max());
                        let raw = low + ((high - low) as f64 * share) as i128;
                        Some(raw.clamp(low, high) as f64 * signal.scale + signal.offset)
                    })
                    .collect();
                let decoded = message.decode(message.encode(&values).bytes());
                for ((signal, sent), found) in message.signals.iter().zip(&values).zip(&decoded) {
                    let (sent, found) = (sent.unwrap(), found.unwrap_or(f64::NAN));
                    // 64-bit raw values have more digits than a float.
                    let tolerance = signal.scale * 0.51 + sent.abs() * 1e-15;
                    assert!(
                        (sent - found).abs() <= tolerance,
                        "{} {}: {sent} {found}",
                        message.name,
                        signal.name
                    );
                }
            }
            let blank = message.decode(message.encode(&[]).bytes());
            for (signal, found) in message.signals.iter().zip(blank) {
                let choice = !matches!(signal.bits, 8 | 16 | 32) && !signal.signed;
                assert!(choice || found.is_none(), "{} {}", message.name, signal.name);
            }
            assert!(message.decode(&[]).iter().all(Option::is_none));
        }
    }

    #[test]
    fn signals_neither_overlap_nor_leave_their_message() {
        for message in MESSAGES {
            let mut taken = vec![false; message.len * 8];
            for signal in message.signals {
                for bit in signal.start..signal.start + signal.bits {
                    let place = taken.get_mut(usize::from(bit));
                    let place = place.unwrap_or_else(|| panic!("{} {} leaves", message.name, signal.name));
                    assert!(!std::mem::replace(place, true), "{} {} overlaps", message.name, signal.name);
                }
            }
        }
    }

    #[test]
    fn a_value_beyond_what_a_signal_of_any_message_can_say_is_not_available() {
        for message in MESSAGES {
            for (place, signal) in message.signals.iter().enumerate() {
                let worth = |raw: f64| raw * signal.scale + signal.offset;
                let (low, high) = (worth(signal.raw_min() as f64), worth(signal.raw_max() as f64));
                let step = signal.scale.max(f64::EPSILON * high.abs());
                let told = |value: f64| {
                    let mut values = vec![None; message.signals.len()];
                    values[place] = Some(value);
                    message.encode(&values)
                };
                for value in [low - 2.0 * step, high + 2.0 * step, 1e30, -1e30, f64::INFINITY, f64::NAN] {
                    let name = (message.name, signal.name, value);
                    assert_eq!(told(value), message.encode(&[]), "{name:?}");
                }
                for value in [low, high] {
                    let found = message.decode(told(value).bytes())[place];
                    assert!(found.is_some_and(|found| (found - value).abs() <= step), "{value} {found:?}");
                }
            }
        }
    }

    #[test]
    fn codes_for_errors_are_no_values() {
        let signal = Signal::new("Speed", 0, 16, 0.001, "m/s");
        assert_eq!(signal.raw(Some(f64::NAN)), 0xFFFF);
        assert_eq!(signal.value(0xFE00), None);
    }
}
