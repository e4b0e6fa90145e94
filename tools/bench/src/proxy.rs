//! The proxy's byte path beside a bare copy loop: how much later a telegram comes, and how many bytes pass a second.

use std::sync::Arc;
use std::time::{Duration, Instant};

use rowscan_faults::{
    FaultControl, GatedListener, HostClock, Language, Medium, StreamFaults, read, relay, reset_on_drop,
};
use rowscan_ports::keep_alive;
use rowscan_protocol::frame::{Dialect, encode};
use tokio::io::{AsyncReadExt, AsyncWriteExt, copy_bidirectional_with_sizes};
use tokio::net::{TcpListener, TcpStream};

use crate::loopback::{quantile_ms, runtime};
use crate::measure::{Case, Report};

const PEER: &str = "bare copy loop (tokio::io::copy_bidirectional), in the same run";
/// An LMS111's scan in CoLa A, and what a client reads of it at a time.
const TELEGRAM: usize = 1815;
const TURNS: usize = 2000;
const ROUNDS: usize = 5;
const BULK: usize = 64 * 1024 * 1024;
/// As the relay takes them.
const CHUNK: usize = 16 * 1024;

/// What stands between.
#[derive(Clone)]
enum Between {
    Nothing,
    Copy,
    Faults(StreamFaults),
}

/// Runs the cases.
pub fn run(report: &mut Report, _arguments: &[String]) {
    runtime().block_on(async {
        let quiet = control("");
        let script = control("[[fault]]\nname = \"drop\"\nat = { s = 86400 }\n[[fault]]\nname = \"flip\"\nat = { scan = 1000000000 }\n");
        for (name, faults) in [("no faults", &quiet), ("a script that has not begun", &script)] {
            let (_, faults) = faults;
            latency(report, name, faults).await;
            bulk(report, name, faults).await;
        }
    });
}

fn control(text: &str) -> (FaultControl, StreamFaults) {
    let (control, _) = FaultControl::new(1, Arc::new(HostClock::start()), None);
    let stream = control.stream("scanner0", Medium::Tcp, Language::Cola);
    control.add_all(read(text).expect("sound")).expect("fits");
    (control, stream)
}

/// A device that echoes telegrams, or pours out bytes, behind `between`.
async fn path(between: Between, pours: bool) -> TcpStream {
    let device = TcpListener::bind("127.0.0.1:0").await.expect("a free port");
    let device_address = device.local_addr().expect("bound");
    tokio::spawn(async move {
        let (mut stream, _) = device.accept().await.expect("it comes");
        keep_alive(&stream).expect("a socket");
        let mut bytes = vec![0; CHUNK];
        if pours {
            let telegram = telegram();
            for _ in 0..BULK / telegram.len() {
                stream.write_all(&telegram).await.expect("open");
            }
            return;
        }
        while let Ok(read @ 1..) = stream.read(&mut bytes).await {
            stream.write_all(&bytes[..read]).await.expect("open");
        }
    });
    let address = match between {
        Between::Nothing => device_address,
        between => {
            let listener = TcpListener::bind("127.0.0.1:0").await.expect("a free port");
            let address = listener.local_addr().expect("bound");
            let faults = if let Between::Faults(faults) = &between { Some(faults.clone()) } else { None };
            let mut listener = GatedListener::new(listener, faults).expect("bound");
            tokio::spawn(async move {
                let (mut client, _) = listener.accept().await.expect("it comes");
                let mut device = TcpStream::connect(device_address).await.expect("it listens");
                for stream in [&client, &device] {
                    keep_alive(stream).expect("a socket");
                }
                if let Between::Faults(faults) = between {
                    let _ = relay(&mut faults.wrap(client, reset_on_drop), &mut device).await;
                } else {
                    let _ = copy_bidirectional_with_sizes(&mut client, &mut device, CHUNK, CHUNK).await;
                }
            });
            address
        }
    };
    let stream = TcpStream::connect(address).await.expect("it listens");
    keep_alive(&stream).expect("a socket");
    stream
}

fn telegram() -> Vec<u8> {
    let mut payload = b"sSN LMDscandata ".to_vec();
    payload.resize(TELEGRAM - 2, b'1');
    let mut bytes = Vec::new();
    encode(Dialect::A, &payload, &mut bytes);
    bytes
}

/// There and back, `TURNS` times.
async fn there_and_back(stream: &mut TcpStream) -> Vec<Duration> {
    let (telegram, mut got) = (telegram(), vec![0; TELEGRAM]);
    let mut times = Vec::with_capacity(TURNS);
    for _ in 0..TURNS {
        let start = Instant::now();
        stream.write_all(&telegram).await.expect("open");
        stream.read_exact(&mut got).await.expect("open");
        times.push(start.elapsed());
    }
    assert!(got == telegram, "the bytes are others");
    times
}

async fn latency(report: &mut Report, name: &str, faults: &StreamFaults) {
    let mut times = [Vec::new(), Vec::new(), Vec::new()];
    let mut streams = Vec::new();
    for between in [Between::Nothing, Between::Copy, Between::Faults(faults.clone())] {
        streams.push(path(between, false).await);
    }
    for round in 0..=ROUNDS {
        for (stream, times) in streams.iter_mut().zip(&mut times) {
            let turn = there_and_back(stream).await;
            if round > 0 {
                times.extend(turn);
            }
        }
    }
    for (share, title) in [(0.5, "p50"), (0.99, "p99")] {
        let [direct, copy, ours] = [0, 1, 2].map(|path: usize| quantile_ms(&times[path], share) * 1e3);
        let case = Case {
            name: format!("added each way, {title}, {name}"),
            unit: "µs",
            peer: PEER,
            threads: 1,
            work: [1.0; 2],
        };
        report.less_is_better(&case, (ours - direct) / 2.0, (copy - direct) / 2.0);
    }
}

async fn bulk(report: &mut Report, name: &str, faults: &StreamFaults) {
    let mut best = [0.0_f64; 2];
    for _ in 0..3 {
        for (side, between) in [Between::Faults(faults.clone()), Between::Copy].into_iter().enumerate() {
            let mut stream = path(between, true).await;
            let (start, mut bytes, mut read) = (Instant::now(), vec![0; 256 * 1024], 0);
            while let Ok(more @ 1..) = stream.read(&mut bytes).await {
                read += more;
            }
            best[side] = best[side].max(read as f64 / 1e6 / start.elapsed().as_secs_f64());
        }
    }
    let case = Case {
        name: format!("bytes through it, {name}"),
        unit: "MB/s",
        peer: PEER,
        threads: 1,
        work: [1.0; 2],
    };
    report.more_is_better(&case, best[0], best[1]);
}
