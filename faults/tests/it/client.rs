//! A device that sends numbered scans every 20 ms through faults, and what its client sees of them.

use std::sync::Arc;
use std::time::Duration;

use rowscan_faults::{FaultControl, FaultEvent, HostClock, Language, Medium, read};
use rowscan_protocol::frame::{self, Accept, Dialect};
use rowscan_protocol::lms2xx::frame as serial;
use rowscan_protocol::telegram::{Kind, LmdScandata, Telegram, Variable, encode_frame};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::time::Instant;

pub const PERIOD: Duration = Duration::from_millis(20);
pub const SCANS: u16 = 12;

/// How a scanner speaks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Speech {
    ColaA,
    ColaB,
    Lms2xx,
}

impl Speech {
    pub const ALL: [Self; 3] = [Self::ColaA, Self::ColaB, Self::Lms2xx];

    pub fn language(self) -> Language {
        if self == Self::Lms2xx { Language::Lms2xx } else { Language::Cola }
    }

    /// The scan of this number.
    pub fn scan(self, number: u16) -> Vec<u8> {
        let mut bytes = Vec::new();
        let scan = LmdScandata { version: 1, telegram_counter: number, ..LmdScandata::default() };
        match self {
            Self::ColaA => encode_frame(Dialect::A, Kind::Sn, LmdScandata::NAME, &scan, &mut bytes),
            Self::ColaB => encode_frame(Dialect::B, Kind::Sn, LmdScandata::NAME, &scan, &mut bytes),
            Self::Lms2xx => {
                let [low, high] = number.to_le_bytes();
                // Three values, none of which looks like a start.
                let body = [0xB0, 3, 0, low, high, 0x55, 0x1F, 0x66, 0x1F, 0x10];
                serial::encode(serial::FROM_DEVICE, &body, &mut bytes);
            }
        }
        bytes
    }

    /// A request of the client.
    pub fn request(self) -> Vec<u8> {
        let mut bytes = Vec::new();
        match self {
            Self::ColaA => frame::encode(Dialect::A, b"sRN DeviceIdent", &mut bytes),
            Self::ColaB => frame::encode(Dialect::B, b"sRN DeviceIdent", &mut bytes),
            Self::Lms2xx => serial::encode(0, &[0x31], &mut bytes),
        }
        bytes
    }
}

/// What a client saw.
#[derive(Debug, Default, PartialEq)]
pub struct Seen {
    /// Numbers of the good scans, in their order.
    pub scans: Vec<u16>,
    /// Good telegrams that are no scans.
    pub others: u64,
    pub bad: u64,
    pub skipped: u64,
    /// When each read came, since the start, and how much it was.
    pub reads: Vec<(Duration, usize)>,
    pub bytes: Vec<u8>,
    pub events: Vec<FaultEvent>,
}

impl Seen {
    /// The time from the scan's own instant to its last byte, by reads of whole telegrams.
    pub fn latest(&self) -> Duration {
        self.reads.last().map_or(Duration::ZERO, |(at, _)| *at)
    }

    pub fn decode(&mut self, speech: Speech) {
        let bytes = self.bytes.clone();
        if speech == Speech::Lms2xx {
            let mut decoder = serial::FrameDecoder::new(serial::Listener::Host);
            decoder.push(&bytes);
            decoder.finish();
            while let Some(received) = decoder.next_received() {
                let serial::Received::Frame(found) = received else { continue };
                match found.body {
                    [0xB0, 3, 0, low, high, ..] => self.scans.push(u16::from_le_bytes([*low, *high])),
                    _ => self.others += 1,
                }
            }
            (self.bad, self.skipped) = (decoder.counts().bad, decoder.counts().skipped_bytes);
            return;
        }
        let mut decoder = frame::FrameDecoder::new(Accept::Either, 64 * 1024);
        decoder.push(&bytes);
        decoder.finish();
        while let Some(found) = decoder.next_frame() {
            let scan = Telegram::parse(found.dialect, found.payload)
                .ok()
                .filter(|telegram| telegram.name == LmdScandata::NAME)
                .and_then(|telegram| telegram.args.decode::<LmdScandata>().ok());
            match scan {
                Some(scan) => self.scans.push(scan.telegram_counter),
                None => self.others += 1,
            }
        }
        (self.bad, self.skipped) = (decoder.counts().bad, decoder.counts().skipped_bytes);
    }
}

/// Sends the scans through these faults; the n-th leaves at n · 20 ms, n from 1.
pub async fn run(speech: Speech, faults: &str, seed: u64) -> Seen {
    let (control, mut events) = FaultControl::new(seed, Arc::new(HostClock::start()), None);
    let medium = if speech == Speech::Lms2xx { Medium::Wire } else { Medium::Tcp };
    let stream = control.stream("left", medium, speech.language());
    control.add_all(read(faults).expect(faults)).expect(faults);
    let start = Instant::now();
    let (mut client, device) = tokio::io::duplex(64 * 1024);
    let device = stream.wrap(device, |_| ());
    let sending = tokio::spawn(async move {
        // One task reads and writes, as a host does: reading is what drives the faults.
        let (mut reader, mut writer) = tokio::io::split(device);
        let reading = tokio::spawn(async move {
            let mut chunk = [0; 64];
            while reader.read(&mut chunk).await.is_ok_and(|read| read > 0) {}
        });
        for number in 1..=SCANS {
            tokio::time::sleep_until(start + PERIOD * u32::from(number)).await;
            if writer.write_all(&speech.scan(number)).await.is_err() {
                break;
            }
        }
        tokio::time::sleep(Duration::from_secs(3)).await;
        let _ = writer.shutdown().await;
        reading.abort();
    });
    let mut seen = Seen::default();
    let mut chunk = vec![0; 64 * 1024];
    let limit = start + Duration::from_secs(60);
    while let Ok(Ok(read @ 1..)) = tokio::time::timeout_at(limit, client.read(&mut chunk)).await {
        seen.reads.push((start.elapsed(), read));
        seen.bytes.extend_from_slice(&chunk[..read]);
    }
    sending.abort();
    control.reset();
    seen.events.extend(std::iter::from_fn(|| events.take()));
    seen.decode(speech);
    seen
}
