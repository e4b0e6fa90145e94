//! Scans for the page out of the bytes that go to clients: of what is replayed, where nobody has them otherwise.

use std::collections::HashMap;
use std::sync::Arc;

use rowscan_protocol::frame::{Accept, FrameDecoder};
use rowscan_protocol::scan::Scan;
use rowscan_protocol::telegram::{LmdScandata, Telegram};
use rowscan_recording::{Side, StreamKind, Tap, Taps};
use rowscan_web::{Line, Show};
use tokio::sync::mpsc;

use super::talk::NowOf;

/// Writes that may wait; more are passed over, for a byte path waits for no page.
const WAITING: usize = 256;
/// The largest payload that is taken for one.
const MAX_PAYLOAD: usize = 64 * 1024;

/// Bytes of a device.
struct Sent {
    scanner: usize,
    connection: u64,
    at_s: f64,
    bytes: Vec<u8>,
}

/// Scans on their way to the page.
pub(in super::super) struct Scans(mpsc::Receiver<Sent>);

/// What is read of one scanner: one connection at a time, for all get the same.
struct Reading {
    connection: u64,
    frames: FrameDecoder,
    telegram: LmdScandata,
    scan: Scan,
    last: Option<u16>,
}

impl Scans {
    /// Taps for the streams of these names, in the order of the page's scanners; and what comes through them.
    pub(in super::super) fn listen(names: Vec<String>, now_s: NowOf) -> (Taps, Self) {
        let (sender, sent) = mpsc::channel(WAITING);
        let connections = std::sync::atomic::AtomicU64::new(0);
        let taps = Taps::new(move |name, kind| {
            let scanner = names.iter().position(|known| known == name);
            let (Some(scanner), StreamKind::Cola) = (scanner, kind) else { return Tap::default() };
            let connection = connections.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
            let (sender, now_s) = (sender.clone(), Arc::clone(&now_s));
            Tap::new(move |by, bytes| {
                if by == Side::Device {
                    let sent = Sent { scanner, connection, at_s: now_s(), bytes: bytes.to_vec() };
                    let _ = sender.try_send(sent);
                }
            })
        });
        (taps, Self(sent))
    }

    /// Shows them until nobody sends any more.
    pub(in super::super) async fn show(mut self, show: Show) {
        let mut readings: HashMap<usize, Reading> = HashMap::new();
        while let Some(Sent { scanner, connection, at_s, bytes }) = self.0.recv().await {
            let reading = readings.entry(scanner).or_insert_with(|| Reading::of(connection));
            // The newest connection: older ones end without a word.
            if connection > reading.connection {
                *reading = Reading::of(connection);
            }
            if connection == reading.connection {
                reading.read(&bytes, |scan| show.line(scanner, Line::of_scan(at_s, scan)));
            }
        }
    }
}

impl Reading {
    fn of(connection: u64) -> Self {
        Self {
            connection,
            frames: FrameDecoder::new(Accept::Either, MAX_PAYLOAD),
            telegram: LmdScandata::default(),
            scan: Scan::default(),
            last: None,
        }
    }

    fn read(&mut self, bytes: &[u8], mut each: impl FnMut(&Scan)) {
        self.frames.push(bytes);
        while let Some(frame) = self.frames.next_frame() {
            let Ok(telegram) = Telegram::parse(frame.dialect, frame.payload) else { continue };
            let is_scan = telegram.name == "LMDscandata"
                && telegram.args.decode_into(&mut self.telegram).is_ok()
                && self.telegram.to_scan_into(&mut self.scan).is_ok();
            if is_scan && self.last.replace(self.scan.telegram_counter) != Some(self.scan.telegram_counter) {
                each(&self.scan);
            }
        }
    }
}
