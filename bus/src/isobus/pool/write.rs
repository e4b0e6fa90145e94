//! A pool as bytes.

use super::{Device, Kind, Object, Pool};

/// Editions of ISO 11783-10, as versions are told on the bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Version {
    /// The first edition and what came before: no extended structure label.
    Third,
    /// The second edition.
    Fourth,
}

impl Version {
    /// Of the byte on the wire: 4 is the second edition; later ones are read as that.
    pub fn of(byte: u8) -> Self {
        if byte >= 4 { Self::Fourth } else { Self::Third }
    }

    /// The byte on the wire.
    pub fn byte(self) -> u8 {
        match self {
            Self::Third => 3,
            Self::Fourth => 4,
        }
    }
}

impl Pool {
    /// Its bytes for a task controller of this version.
    pub fn bytes(&self, version: Version) -> Vec<u8> {
        let mut out = Vec::new();
        self.0.iter().for_each(|object| object.write(version, &mut out));
        out
    }
}

fn put(out: &mut Vec<u8>, value: u16) {
    out.extend(value.to_le_bytes());
}

/// A text with its length before it; beyond 255 bytes it is cut off.
fn text(out: &mut Vec<u8>, text: &[u8]) {
    let text = text.get(..usize::from(u8::MAX)).unwrap_or(text);
    out.push(u8::try_from(text.len()).unwrap_or(u8::MAX));
    out.extend(text);
}

impl Object {
    fn write(&self, version: Version, out: &mut Vec<u8>) {
        let designator = self.designator.as_bytes();
        let head = |out: &mut Vec<u8>, table: &[u8; 3]| {
            out.extend(table);
            put(out, self.id);
        };
        match &self.kind {
            Kind::Device(device) => {
                head(out, b"DVC");
                text(out, designator);
                device.write(version, out);
            }
            Kind::Element { kind, number, parent, children } => {
                head(out, b"DET");
                out.push(kind.number());
                text(out, designator);
                put(out, *number);
                put(out, *parent);
                put(out, u16::try_from(children.len()).unwrap_or(u16::MAX));
                children.iter().for_each(|child| put(out, *child));
            }
            Kind::Process { ddi, properties, triggers, presentation } => {
                head(out, b"DPD");
                put(out, *ddi);
                out.extend([*properties, *triggers]);
                text(out, designator);
                put(out, *presentation);
            }
            Kind::Property { ddi, value, presentation } => {
                head(out, b"DPT");
                put(out, *ddi);
                out.extend(value.to_le_bytes());
                text(out, designator);
                put(out, *presentation);
            }
            Kind::Presentation { offset, scale, decimals } => {
                head(out, b"DVP");
                out.extend(offset.to_le_bytes());
                out.extend(scale.to_le_bytes());
                out.push(*decimals);
                text(out, designator);
            }
        }
    }
}

impl Device {
    fn write(&self, version: Version, out: &mut Vec<u8>) {
        text(out, self.software.as_bytes());
        out.extend(self.name.0.to_le_bytes());
        text(out, self.serial.as_bytes());
        out.extend(self.structure);
        out.extend(self.localization);
        if version >= Version::Fourth {
            text(out, &self.extended);
        }
    }
}
