//! A client of an emulator on loopback that tells how late its scans come, and the thread that does nothing but sleep to the same deadlines.

use std::ops::Range;
use std::time::{Duration, Instant};

use rowscan_protocol::frame::{Accept, Dialect, FrameDecoder, encode};
use rowscan_protocol::telegram::{LmdScandata, Telegram};
use rustix::thread::clock_nanosleep_absolute;
use rustix::time::{ClockId, Timespec, clock_gettime};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio::runtime::{Builder, Runtime};

pub const CONTROL: &str = "thread that only sleeps to its deadline, at the same time";
const MAX_PAYLOAD: usize = 64 * 1024;

/// A connection that has asked for scans.
pub async fn subscribe(address: &str) -> TcpStream {
    let mut stream = TcpStream::connect(address).await.expect("it listens");
    let mut frame = Vec::new();
    encode(Dialect::B, b"sEN LMDscandata \x01", &mut frame);
    stream.write_all(&frame).await.expect("it reads");
    stream
}

/// Reads until the scanner ends or the time is up; how late each scan came that was due within it. `due_us` tells when one was due, since `epoch`.
pub async fn lateness(
    mut stream: TcpStream,
    epoch: Instant,
    within: Range<Instant>,
    due_us: fn(&LmdScandata) -> u32,
) -> Vec<Duration> {
    let mut frames = FrameDecoder::new(Accept::Only(Dialect::B), MAX_PAYLOAD);
    let (mut chunk, mut scan, mut lateness) = (vec![0; 8192], LmdScandata::default(), Vec::new());
    loop {
        let read = stream.read(&mut chunk).await.expect("it goes on");
        let now = Instant::now();
        if read == 0 || now > within.end {
            return lateness;
        }
        frames.push(&chunk[..read]);
        while let Some(frame) = frames.next_frame() {
            let telegram = Telegram::parse(frame.dialect, frame.payload).expect("a telegram");
            if telegram.name == "LMDscandata" && telegram.args.decode_into(&mut scan).is_ok() {
                let due = epoch + Duration::from_micros(due_us(&scan).into());
                if due >= within.start {
                    lateness.push(now.saturating_duration_since(due));
                }
            }
        }
    }
}

/// Sleeps to each of these deadlines, from now on; how late it wakes.
pub fn sleep_to(deadlines: impl IntoIterator<Item = Duration>) -> Vec<Duration> {
    let epoch = monotonic();
    let woken = |deadline| {
        sleep_until(epoch + deadline);
        monotonic().saturating_sub(epoch + deadline)
    };
    deadlines.into_iter().map(woken).collect()
}

/// Sleeps to an instant of the monotonic clock; not at all if that has passed.
pub fn sleep_until(due: Duration) {
    let request = Timespec { tv_sec: due.as_secs() as i64, tv_nsec: due.subsec_nanos().into() };
    clock_nanosleep_absolute(ClockId::Monotonic, &request).expect("an undisturbed sleep");
}

pub fn monotonic() -> Duration {
    reading(clock_gettime(ClockId::Monotonic))
}

pub fn reading(time: Timespec) -> Duration {
    Duration::new(time.tv_sec as u64, time.tv_nsec as u32)
}

pub fn quantile_ms(times: &[Duration], share: f64) -> f64 {
    let time = rowscan_ports::latency::quantile(&mut times.to_vec(), share);
    time.map_or(f64::NAN, |time| time.as_secs_f64() * 1e3)
}

pub fn runtime() -> Runtime {
    Builder::new_current_thread().enable_all().build().expect("a runtime")
}
