//! What scanners and clients say to each other, put into words for the page.

use std::collections::HashMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use crate::decode::{Entry, Follow, Verdict};
use rowscan_recording::{Side, StreamKind, Tap, Taps};
use rowscan_web::{Spoken, TelegramLog};
use tokio::sync::mpsc;

/// Writes that may wait to be put into words; more are passed over, for a byte path waits for no page.
const WAITING: usize = 1024;
/// Connections that are followed at once.
const FOLLOWED: usize = 64;
/// Letters of a telegram's contents that are shown.
const WORDS: usize = 400;
/// Telegrams of an LMS2xx that carry values.
const SCANS: [&str; 6] = ["B0", "B6", "B7", "BF", "C4", "F5"];
/// Where a frame has its telegram's name, at the latest.
const NAME_WITHIN: usize = 32;

/// Bytes of one side of a connection.
struct Said {
    stream: Arc<str>,
    connection: u64,
    kind: StreamKind,
    by: Side,
    at_s: f64,
    bytes: Vec<u8>,
}

/// Tells the time, seconds.
pub(in super::super) type NowOf = Arc<dyn Fn() -> f64 + Send + Sync>;

/// What is said, on its way to the log.
pub(in super::super) struct Talk {
    said: mpsc::Receiver<Said>,
}

impl Talk {
    /// Taps for every connection, and what comes through them.
    pub(in super::super) fn listen(now_s: NowOf) -> (Taps, Self) {
        let (sender, said) = mpsc::channel(WAITING);
        let connections = AtomicU64::new(0);
        let taps = Taps::new(move |name, kind| match kind {
            StreamKind::Cola | StreamKind::Lms2xx => {
                let connection = connections.fetch_add(1, Ordering::Relaxed);
                tap(name, (connection, kind), sender.clone(), Arc::clone(&now_s))
            }
            _ => Tap::default(),
        });
        (taps, Self { said })
    }

    /// Puts it into words until nobody speaks any more.
    pub(in super::super) async fn tell(mut self, log: TelegramLog) {
        let mut followed: HashMap<(u64, bool), (Follow, bool)> = HashMap::new();
        while let Some(Said { stream, connection, kind, by, at_s, bytes }) = self.said.recv().await {
            // The oldest have ended, or are as good as ended.
            while followed.len() > 2 * FOLLOWED
                && let Some(oldest) = followed.keys().min().copied()
            {
                followed.remove(&oldest);
            }
            let by_device = by == Side::Device;
            let (follow, was_scan) =
                followed.entry((connection, by_device)).or_insert_with(|| (Follow::of(kind), false));
            for entry in follow.read(&bytes) {
                // A line's scans come in pieces, so that its tap cannot leave them out.
                let is_scan = kind == StreamKind::Lms2xx && is_lms2xx_scan(&entry);
                if !std::mem::replace(was_scan, is_scan) || !is_scan {
                    log.keep(spoken(entry, &stream, by_device, at_s));
                }
            }
        }
    }
}

/// A tap that leaves out all scans but the first of a row.
fn tap(name: &str, (connection, kind): (u64, StreamKind), sender: mpsc::Sender<Said>, now_s: NowOf) -> Tap {
    let (stream, scans): (Arc<str>, _) = (Arc::from(name), AtomicBool::new(false));
    Tap::new(move |by, bytes| {
        let is_scan = kind == StreamKind::Cola && by == Side::Device && is_scan(bytes);
        let was_scan = scans.swap(is_scan, Ordering::Relaxed);
        if is_scan && was_scan {
            return;
        }
        let at_s = now_s();
        let said = Said { stream: Arc::clone(&stream), connection, kind, by, at_s, bytes: bytes.to_vec() };
        let _ = sender.try_send(said);
    })
}

fn is_scan(bytes: &[u8]) -> bool {
    let head = bytes.get(..NAME_WITHIN).unwrap_or(bytes);
    head.windows(7).any(|letters| letters == b"sSN LMD")
}

/// A whole telegram of values.
fn is_lms2xx_scan(entry: &Entry) -> bool {
    entry.is == Verdict::Telegram && entry.name.as_deref().is_some_and(|name| SCANS.contains(&name))
}

fn spoken(entry: Entry, stream: &str, by_device: bool, at_s: f64) -> Spoken {
    let Entry { kind, name, words, is, expected, found, .. } = entry;
    let telegram = [kind.unwrap_or_default(), name.as_deref().unwrap_or_default()].join(" ");
    let is_bad = is == Verdict::Bad;
    let mut words = match (is_bad, expected, found) {
        (true, Some(expected), Some(found)) => format!("expected {expected}, found {found}"),
        _ => words.unwrap_or_default(),
    };
    if let Some((end, _)) = words.char_indices().nth(WORDS) {
        words.truncate(end);
        words.push('…');
    }
    Spoken {
        at_s,
        scanner: stream.to_owned(),
        by_device,
        telegram: telegram.trim().to_owned(),
        words,
        is_bad,
    }
}
