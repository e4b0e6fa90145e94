//! What each device of a recording was set to: which echo it sends, and what takes something from its scans. Its conversations may stand in several streams: a client that came again, a second client, or a
//! conversation beside the datagrams of its scans.

use std::collections::BTreeMap;

use rowscan_protocol::heard_settings::{HeardSettings, SettingsInForce};
use rowscan_protocol::telegram::device_ident::DeviceIdent;

use crate::scan_reader::MAX_PAYLOAD;
use crate::{Packet, ScanReader, StreamInfo, StreamKind};

/// What follows a device's name in the name of the stream of its datagrams.
pub const DATAGRAMS: &str = "-udp";

/// What stands before the addresses in the name of a captured stream of datagrams.
const CAPTURED: &str = "udp://";

/// What is known of each device's settings, by its name.
#[derive(Debug, Default)]
pub struct DeviceSettings {
    known: BTreeMap<String, SettingsInForce>,
    /// What each has said that it is.
    idents: BTreeMap<String, DeviceIdent>,
    /// Listens to conversations that nobody reads scans of.
    beside: BTreeMap<usize, ScanReader>,
}

impl DeviceSettings {
    /// Tells a conversation of the stream `name` what was heard in others with the same device.
    pub fn tell(&self, streams: &[StreamInfo], name: &str, heard: &mut HeardSettings) {
        if let Some(in_force) = self.known.get(device_of(streams, name)) {
            heard.set_in_force(*in_force);
        }
    }

    /// Learns what a conversation of the stream `name` has heard.
    pub fn learn(&mut self, streams: &[StreamInfo], name: &str, heard: &HeardSettings) {
        let device = device_of(streams, name);
        if let Some(ident) = heard.ident().filter(|ident| self.idents.get(device) != Some(ident)) {
            self.idents.insert(device.to_owned(), ident.clone());
        }
        match self.known.get_mut(device) {
            Some(known) => *known = heard.in_force(),
            None => drop(self.known.insert(device.to_owned(), heard.in_force())),
        }
    }

    /// What the device of the stream `name` has said that it is, as far as that was heard.
    pub fn ident_of(&self, streams: &[StreamInfo], name: &str) -> Option<&DeviceIdent> {
        self.idents.get(device_of(streams, name))
    }

    /// Listens to a packet of a conversation that is not read.
    pub fn overhear(&mut self, streams: &[StreamInfo], packet: &Packet) {
        let Some(stream) = streams.get(packet.stream).filter(|stream| stream.kind == StreamKind::Cola) else {
            return;
        };
        let mut reader =
            self.beside.remove(&packet.stream).or_else(|| ScanReader::new(stream.kind, MAX_PAYLOAD));
        if let Some(reader) = &mut reader {
            reader.heard_settings().into_iter().for_each(|heard| self.tell(streams, &stream.name, heard));
            reader.push(std::time::Duration::ZERO, packet);
            while reader.next_event().is_some() {}
            reader.heard_settings().into_iter().for_each(|heard| self.learn(streams, &stream.name, heard));
        }
        self.beside.extend(reader.map(|reader| (packet.stream, reader)));
    }
}

/// The name of the device that the stream `name` belongs to: that of its first stream. Recorders number a name that is taken (`scanner0-2`), captures the
/// conversations with one address (`10.0.0.2:2111/2`); datagrams have a name of their own (`scanner0-udp`). A name is only a device's further one if the first
/// one is there: `left-1` and `left-2` are two devices.
pub fn device_of<'a>(streams: &'a [StreamInfo], name: &'a str) -> &'a str {
    let is_there = |name: &&str| streams.iter().any(|stream| stream.name == *name);
    if let Some(datagrams) = name.strip_prefix(CAPTURED) {
        return captured_device(streams, datagrams).unwrap_or(name);
    }
    let is_number = |text: &str| !text.is_empty() && text.chars().all(|it| it.is_ascii_digit() || it == '.');
    let first = name.strip_suffix(DATAGRAMS).or_else(|| {
        name.rsplit_once(['-', '/']).filter(|(_, number)| is_number(number)).map(|(first, _)| first)
    });
    match first.filter(is_there) {
        Some(first) => device_of(streams, first),
        None => name,
    }
}

/// The device whose datagrams these are (`ADDRESS to ADDRESS`): the only one that was spoken to at that host.
fn captured_device<'a>(streams: &'a [StreamInfo], datagrams: &str) -> Option<&'a str> {
    let host = |address: &'a str| address.rsplit_once(':').map(|(host, _)| host);
    let (from, _) = datagrams.split_once(" to ")?;
    let (from, _) = from.rsplit_once(':')?;
    let mut devices = streams
        .iter()
        .filter(|stream| stream.kind == StreamKind::Cola && host(&stream.name) == Some(from))
        .map(|stream| device_of(streams, &stream.name));
    let first = devices.next()?;
    devices.all(|other| other == first).then_some(first)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stream_belongs_to_the_device_whose_name_it_goes_on() {
        let cola = |name: &str| StreamInfo::new(name, StreamKind::Cola);
        let streams = |names: &[&str]| names.iter().map(|name| cola(name)).collect::<Vec<_>>();
        for (names, name, device) in [
            (&["scanner0", "scanner0-2"][..], "scanner0-2", "scanner0"),
            (&["scanner0", "scanner0-udp"], "scanner0-udp", "scanner0"),
            (&["scanner0", "scanner0-udp", "scanner0-udp-2"], "scanner0-udp-2", "scanner0"),
            (&["scanner0-udp"], "scanner0-udp", "scanner0-udp"),
            (&["left-1", "left-2"], "left-2", "left-2"),
            (&["scanner0", "scanner1"], "scanner1", "scanner1"),
            (&["10.0.0.2:2111", "10.0.0.2:2111/2"], "10.0.0.2:2111/2", "10.0.0.2:2111"),
            (&["10.0.0.2:2111"], "10.0.0.2:2111/1.2", "10.0.0.2:2111"),
            (&["10.0.0.2:2111"], "udp://10.0.0.2:2115 to 10.0.0.9:2115", "10.0.0.2:2111"),
            (&["10.0.0.2:2111", "10.0.0.2:2111/2"], "udp://10.0.0.2:2115 to 10.0.0.9:2115", "10.0.0.2:2111"),
            (
                &["10.0.0.3:2111"],
                "udp://10.0.0.2:2115 to 10.0.0.9:2115",
                "udp://10.0.0.2:2115 to 10.0.0.9:2115",
            ),
            // Two devices at one host: nobody knows whose they are.
            (
                &["127.0.0.1:2111", "127.0.0.1:2112"],
                "udp://127.0.0.1:9 to 127.0.0.1:2115",
                "udp://127.0.0.1:9 to 127.0.0.1:2115",
            ),
        ] {
            assert_eq!(device_of(&streams(names), name), device, "{names:?}, {name}");
        }
    }
}
