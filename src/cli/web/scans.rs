//! Scans for the page out of the bytes that go to clients: of what is replayed, where nobody has them otherwise.

use std::collections::HashMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use rowscan_protocol::host::HostEvent;
use rowscan_protocol::scan::Scan;
use rowscan_recording::{MAX_PAYLOAD, Packet, ScanReader, Side, StreamKind, Tap, Taps};
use rowscan_web::Show;
use tokio::sync::mpsc;

use super::Meter;
use super::talk::NowOf;

/// Writes that may wait; more are passed over, for a byte path waits for no page.
const WAITING: usize = 256;

/// Bytes of a device.
struct Sent {
    scanner: usize,
    kind: StreamKind,
    connection: u64,
    at_s: f64,
    by: Side,
    bytes: Vec<u8>,
}

/// Scans on their way to the page.
pub(in super::super) struct Scans(mpsc::Receiver<Sent>);

/// What is read of one scanner: one connection at a time, for all get the same.
struct Reading {
    connection: u64,
    reader: ScanReader,
    /// Scans have numbers: one that comes again, on another event, is shown once.
    is_numbered: bool,
    last: Option<u16>,
}

impl Scans {
    /// Taps for the streams of these names, in the order of the page's scanners; and what comes through them.
    pub(in super::super) fn listen(names: Vec<String>, now_s: NowOf) -> (Taps, Self) {
        let (sender, sent) = mpsc::channel(WAITING);
        let connections = AtomicU64::new(0);
        let taps = Taps::new(move |name, kind| {
            let scanner = names.iter().position(|known| known == name);
            let (Some(scanner), StreamKind::Cola | StreamKind::Lms2xx) = (scanner, kind) else {
                return Tap::default();
            };
            let connection = connections.fetch_add(1, Ordering::Relaxed);
            let (sender, now_s) = (sender.clone(), Arc::clone(&now_s));
            Tap::new(move |by, bytes| {
                let sent = Sent { scanner, kind, connection, at_s: now_s(), by, bytes: bytes.to_vec() };
                let _ = sender.try_send(sent);
            })
        });
        (taps, Self(sent))
    }

    /// Shows them until nobody sends any more; measures those of scanners that have a meter.
    pub(in super::super) async fn show(mut self, show: Show, mut meters: Vec<Option<Meter>>) {
        let mut readings: HashMap<usize, Reading> = HashMap::new();
        while let Some(Sent { scanner, kind, connection, at_s, by, bytes }) = self.0.recv().await {
            let is_newer = readings.get(&scanner).is_none_or(|reading| connection > reading.connection);
            // The newest connection: older ones end without a word.
            if is_newer && let Some(mut reading) = Reading::of(kind, connection) {
                if let Some(before) = readings.get_mut(&scanner) {
                    reading.follow(before);
                }
                readings.insert(scanner, reading);
            }
            let Some(reading) = readings.get_mut(&scanner) else { continue };
            if connection == reading.connection {
                let mut meter = meters.get_mut(scanner).and_then(Option::as_mut);
                reading.read(at_s, (by, bytes), |scan, is_earlier| {
                    show.scan(scanner, at_s, scan);
                    if let Some(meter) = &mut meter {
                        if is_earlier {
                            meter.begin_anew();
                        }
                        meter.push(scan);
                    }
                });
            }
        }
        meters.iter_mut().flatten().for_each(Meter::show_rest);
    }
}

impl Reading {
    fn of(kind: StreamKind, connection: u64) -> Option<Self> {
        let reader = ScanReader::new(kind, MAX_PAYLOAD)?;
        Some(Self { connection, reader, is_numbered: kind == StreamKind::Cola, last: None })
    }

    /// Goes on from the connection before: the echo that was set there holds.
    fn follow(&mut self, before: &mut Self) {
        if let (Some(heard), Some(before)) = (self.reader.heard_settings(), before.reader.heard_settings()) {
            heard.set_in_force(before.in_force());
        }
    }

    /// Hands on each scan, and whether its number lies before that of the last.
    fn read(&mut self, at_s: f64, (by, bytes): (Side, Vec<u8>), mut each: impl FnMut(&Scan, bool)) {
        let packet = Packet { from: Some(by), bytes, ..Packet::default() };
        self.reader.push(Duration::try_from_secs_f64(at_s).unwrap_or_default(), &packet);
        while let Some(event) = self.reader.next_event() {
            if event != HostEvent::Scan {
                continue;
            }
            let scan = self.reader.scan();
            let last = self.last.replace(scan.telegram_counter).filter(|_| self.is_numbered);
            match last.map(|last| scan.telegram_counter.wrapping_sub(last)) {
                Some(0) => {}
                // Numbers begin anew behind the last of 16 bits.
                Some(ahead) => each(scan, ahead > u16::MAX / 2),
                None => each(scan, false),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use rowscan_protocol::device::scan_event;
    use rowscan_protocol::frame::Dialect;
    use rowscan_protocol::telegram::wire::FixedText;
    use rowscan_protocol::telegram::{Channel, LmdScandata};

    use super::*;

    /// A scan event with this number.
    fn scan(counter: u16) -> Vec<u8> {
        let distances = Channel {
            name: FixedText(*b"DIST1"),
            scale: 1.0,
            step: 5000,
            values: vec![1],
            ..Channel::default()
        };
        let telegram =
            LmdScandata { telegram_counter: counter, channels16: vec![distances], ..LmdScandata::default() };
        let mut frame = Vec::new();
        scan_event(Dialect::A, &telegram, &mut frame);
        frame
    }

    #[test]
    fn a_connection_goes_on_with_the_echo_that_was_set_on_the_one_before() {
        use rowscan_protocol::rig::EchoChoice;
        let of = |connection| Reading::of(StreamKind::Cola, connection).expect("scanners speak it");
        let (mut first, mut second) = (of(0), of(1));
        let say = |reading: &mut Reading, by, bytes: &[u8]| {
            let mut echoes = Vec::new();
            reading.read(0.0, (by, bytes.to_vec()), |scan, _| echoes.push(scan.echo));
            echoes
        };
        say(&mut first, Side::Host, b"\x02sWN FREchoFilter 2\x03");
        say(&mut first, Side::Device, b"\x02sWA FREchoFilter\x03");
        assert_eq!(say(&mut first, Side::Device, &scan(1)), [Some(EchoChoice::Last)]);
        assert_eq!(say(&mut second, Side::Device, &scan(2)), [None], "it has heard nothing");
        second.follow(&mut first);
        assert_eq!(say(&mut second, Side::Device, &scan(3)), [Some(EchoChoice::Last)]);
    }

    #[test]
    fn a_scan_that_comes_twice_is_shown_once_and_one_from_before_begins_anew() {
        let mut reading = Reading::of(StreamKind::Cola, 0).expect("scanners speak it");
        let mut shown = Vec::new();
        for counter in [65_534, 65_535, 65_535, 0, 1, 60_000, 60_001, 5] {
            reading.read(0.0, (Side::Device, scan(counter)), |scan, is_earlier| {
                shown.push((scan.telegram_counter, is_earlier))
            });
        }
        assert_eq!(
            shown,
            [
                (65_534, false),
                (65_535, false),
                (0, false),
                (1, false),
                (60_000, true),
                (60_001, false),
                (5, false)
            ]
        );
    }
}
