//! Datagrams of Compact telegrams, as tests hear them.

use std::time::Duration;

use rowscan_protocol::compact::{CompactListener, ScanTelegram, Telegram};
use rowscan_protocol::host::{HostEvent, HostSession};
use rowscan_protocol::scan::Scan;

/// The scan telegram in a datagram.
pub fn scan_of(datagram: &[u8]) -> ScanTelegram {
    match Telegram::decode(datagram).unwrap() {
        Telegram::Scan(scan) => scan,
        other => panic!("{}", other.name()),
    }
}

/// The scans that come of these datagrams, until their end; `other` hears of what else comes.
pub fn heard<'a>(
    datagrams: impl IntoIterator<Item = &'a Vec<u8>>,
    mut other: impl FnMut(HostEvent),
) -> (Vec<Scan>, CompactListener) {
    let (mut listener, mut scans) = (CompactListener::default(), Vec::new());
    let mut take = |listener: &mut CompactListener| {
        while let Some(event) = listener.poll_event() {
            match event {
                HostEvent::Scan => scans.push(listener.scan().clone()),
                event => other(event),
            }
        }
    };
    for datagram in datagrams {
        listener.handle_datagram(Duration::ZERO, datagram);
        take(&mut listener);
    }
    listener.handle_end();
    take(&mut listener);
    (scans, listener)
}
