//! A pseudo-terminal and a port over RFC 2217, whatever their clients did to them: a valid request afterwards is answered. The device by itself is
//! tried with every sequence (`protocol/tests/it/lms2xx_line.rs`); here are some of them on real ends.
#![cfg(target_os = "linux")]

use crate::common;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use common::small_scene;
use rowscan_emulator::clock::TimeScale;
use rowscan_emulator::stage::Stage;
use rowscan_emulator::{SerialConfig, SerialEmulator, pause_slack};
use rowscan_ports::{NetLine, Port, Pty, Wire};
use rowscan_protocol::device::Profile;
use rowscan_protocol::lms2xx::device::{Options, Start};
use rowscan_protocol::lms2xx::frame::{FrameDecoder, Listener, Received, encode};
use rowscan_protocol::lms2xx::model::MODELS;
use rowscan_protocol::random::mix;
use rowscan_protocol::rfc2217;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio::task::JoinSet;
use tokio::time::{Instant, sleep, timeout_at};

/// Simulated seconds a second of the host.
const SCALE: f64 = 4.0;
/// Sequences a kind of line, half of them of a device that streams.
const SEQUENCES: u64 = 24;
/// The longest sequence.
const LONGEST: u64 = 5;
/// Host time in which a busy machine has passed on what was written.
const PASSED_ON: Duration = Duration::from_millis(30);
const PATIENCE: Duration = Duration::from_secs(20);

#[derive(Clone, Copy, Debug)]
enum Act {
    Open,
    Close,
    WrongRate,
    Cut,
    Junk,
    Request,
    Pause,
}

const ACTS: [Act; 7] = [Act::Open, Act::Close, Act::WrongRate, Act::Cut, Act::Junk, Act::Request, Act::Pause];

/// Where a line's clients find it.
#[derive(Clone, Debug)]
enum At {
    Pty(PathBuf),
    Rfc2217(String),
}

/// A client with the port open.
enum Client {
    Pty(Port),
    Rfc2217(TcpStream, rfc2217::Client),
}

impl Client {
    async fn open(at: &At) -> Self {
        match at {
            At::Pty(link) => Self::Pty(Port::open(link, 9600).expect("it opens")),
            At::Rfc2217(address) => {
                // The server takes the next client once it has noticed that the last one is gone.
                let until = Instant::now() + PATIENCE;
                loop {
                    let stream = TcpStream::connect(address).await.expect("it listens");
                    let mut client = Self::Rfc2217(stream, rfc2217::Client::new());
                    if client.agrees().await {
                        return client;
                    }
                    assert!(Instant::now() < until, "the port takes no client any more");
                    sleep(PASSED_ON).await;
                }
            }
        }
    }

    /// Waits until the server has confirmed the rate; false if it has hung up.
    async fn agrees(&mut self) -> bool {
        let Self::Rfc2217(stream, client) = self else { return true };
        let mut out = Vec::new();
        client.begin(&mut out);
        client.set_rate(9600, &mut out);
        if stream.write_all(&out).await.is_err() {
            return false;
        }
        let (mut chunk, mut data, mut answer) = (vec![0; 1024], Vec::new(), Vec::new());
        while client.rate().is_none() {
            match stream.read(&mut chunk).await {
                Ok(read @ 1..) => client.decode(&chunk[..read], &mut data, &mut answer),
                _ => return false,
            }
        }
        true
    }

    async fn set_rate(&mut self, rate: u32) {
        match self {
            Self::Pty(port) => port.set_rate(rate).expect("set"),
            Self::Rfc2217(stream, client) => {
                let mut out = Vec::new();
                client.set_rate(rate, &mut out);
                stream.write_all(&out).await.expect("taken");
            }
        }
    }

    async fn write(&mut self, bytes: &[u8]) {
        match self {
            Self::Pty(port) => port.write_all(bytes).await.expect("taken"),
            Self::Rfc2217(stream, _) => {
                let mut out = Vec::new();
                rfc2217::escape(bytes, &mut out);
                stream.write_all(&out).await.expect("taken");
            }
        }
    }

    /// What has come by `until`; none if nothing has.
    async fn read(&mut self, until: Instant) -> Option<Vec<u8>> {
        let mut chunk = vec![0; 4096];
        match self {
            Self::Pty(port) => {
                let read = timeout_at(until, port.read(&mut chunk)).await.ok()?.expect("it holds");
                Some(chunk[..read].to_vec())
            }
            Self::Rfc2217(stream, client) => {
                let read = timeout_at(until, stream.read(&mut chunk)).await.ok()?.expect("it holds");
                assert_ne!(read, 0, "the server has hung up");
                let (mut data, mut answer) = (Vec::new(), Vec::new());
                client.decode(&chunk[..read], &mut data, &mut answer);
                Some(data)
            }
        }
    }
}

fn framed(body: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    encode(0, body, &mut bytes);
    bytes
}

async fn act(at: &At, client: &mut Option<Client>, what: Act) {
    match (what, client.as_mut()) {
        (Act::Open, None) => *client = Some(Client::open(at).await),
        (Act::Close, _) => *client = None,
        (Act::Pause, _) => sleep(Duration::from_secs_f64(1.3 / SCALE)).await,
        (Act::WrongRate, Some(client)) => {
            client.set_rate(19_200).await;
            client.write(&framed(&[0x31])).await;
            sleep(PASSED_ON).await;
            client.set_rate(9600).await;
        }
        (Act::Cut, Some(client)) => client.write(&framed(b"\x20\x00SICK_LMS")[..6]).await,
        (Act::Junk, Some(client)) => client.write(&[0x55, 0x02, 0x00, 0x0A, 0x00, 0x13]).await,
        (Act::Request, Some(client)) => client.write(&framed(&[0x31])).await,
        (Act::Open, Some(_)) | (Act::WrongRate | Act::Cut | Act::Junk | Act::Request, None) => {}
    }
}

/// After so long without an answer a careful client asks again. A host that is late hands on a pause as none: then what was cut before takes the next
/// request for its rest.
const ASKS_AGAIN: Duration = Duration::from_secs(3);

/// Asks for the status, as a careful client does: an answer is a whole telegram, or it asks again.
async fn is_answered(at: &At, client: Option<Client>) -> bool {
    let mut client = match client {
        Some(client) => client,
        None => Client::open(at).await,
    };
    let mut decoder = FrameDecoder::new(Listener::Host);
    let (until, mut acknowledged) = (Instant::now() + PATIENCE, false);
    let mut asks = Instant::now();
    while Instant::now() < until {
        if asks <= Instant::now() {
            client.write(&framed(&[0x31])).await;
            asks = Instant::now() + ASKS_AGAIN;
        }
        match client.read(until.min(Instant::now() + Duration::from_millis(100))).await {
            Some(bytes) => decoder.push(&bytes),
            None => decoder.finish(),
        }
        while let Some(received) = decoder.next_received() {
            match received {
                Received::Ack => acknowledged = true,
                Received::Frame(frame) if acknowledged && frame.body[0] == 0xB1 => return true,
                _ => {}
            }
        }
    }
    false
}

async fn play(stage: Arc<Stage>, folder: PathBuf, over_tcp: bool, number: u64) {
    let start = if number.is_multiple_of(2) { Start::Idle } else { Start::Streaming };
    let mut keys = number;
    let mut draw = |of: u64| {
        keys = mix(keys.wrapping_add(over_tcp.into()));
        keys % of
    };
    let acts: Vec<Act> = (0..=draw(LONGEST)).map(|_| ACTS[draw(ACTS.len() as u64) as usize]).collect();
    let scale = TimeScale::Paced(SCALE);
    let options = Options { start, pause_slack: pause_slack(Profile::Bench, scale), ..Options::default() };
    let model = MODELS.iter().find(|model| model.name == "lms200").expect("known");
    let (device, world) = stage.serial_scanner(0, model, options).expect("it fits");
    let (wire, at): (Box<dyn Wire>, At) = if over_tcp {
        let line = NetLine::rfc2217("127.0.0.1:0").await.expect("a free port");
        let address = line.address().to_string();
        (Box::new(line), At::Rfc2217(address))
    } else {
        let link: &Path = &folder.join(format!("line{number}"));
        (Box::new(Pty::open(link).expect("a pseudo-terminal")), At::Pty(link.to_path_buf()))
    };
    let _emulator = SerialEmulator::start(device, world, wire, SerialConfig::at(scale));
    let mut client = Some(Client::open(&at).await);
    for what in &acts {
        act(&at, &mut client, *what).await;
        sleep(PASSED_ON).await;
    }
    assert!(is_answered(&at, client).await, "{at:?}, {start:?}: no answer after {acts:?}");
}

async fn play_all(over_tcp: bool) {
    let stage = Arc::new(Stage::grow(small_scene(), &|_, _| {}).expect("it grows"));
    let folder = tempfile::tempdir().expect("a folder");
    let mut playing = JoinSet::new();
    let mut played = 0;
    for number in 0..SEQUENCES {
        playing.spawn(play(Arc::clone(&stage), folder.path().to_owned(), over_tcp, number));
        if playing.len() >= 2 {
            playing.join_next().await.expect("one").expect("answered");
            played += 1;
        }
    }
    while let Some(ended) = playing.join_next().await {
        ended.expect("answered");
        played += 1;
    }
    assert_eq!(played, SEQUENCES);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_pseudo_terminal_answers_whatever_came_before() {
    play_all(false).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_port_over_tcp_answers_whatever_came_before() {
    play_all(true).await;
}
