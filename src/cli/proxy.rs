//! `rowscan proxy`

use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use rowscan_control::Log;
use rowscan_driver::{ByteStream, DriverError, Source};
use rowscan_faults::{
    Direction, FaultyStream, GatedListener, HostClock, Language, Medium, StreamFaults, relay, reset_on_drop,
};
use rowscan_ports::clock::{retry_pause, within};
use rowscan_ports::task;
use rowscan_ports::{Pty, Wire, keep_alive};
use rowscan_protocol::lms2xx::Rate;
use rowscan_recording::{About, Side, StreamKind, Tap, Taps};
use serde::Serialize;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{Semaphore, watch};
use tokio::task::JoinSet;

use super::endpoint::announce_stream;
use super::faulting::{FaultArgs, Faulting};
use super::interrupt::Interrupt;
use super::link_options::stream_kind;
use super::named::Named;
use super::output::{self, say};
use super::recorder::RecordArgs;
use super::{Failure, Format, Outcome, event_format, service};

/// How long a scanner may take to be reached.
const PATIENCE: Duration = Duration::from_secs(3);
/// Bytes taken from a wire at a time.
const CHUNK: usize = 4096;
/// What the stream is called unless it is given a name; as the first scanner of `emulate`.
const NAME: &str = "scanner0";
/// Why a connection ended that the proxy's end has cut.
const CUT: &str = "the proxy ended";

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// The scanner: tcp://HOST:PORT, serial:DEV?baud=RATE, rfc2217://HOST:PORT?baud=RATE; `left=tcp://…` names the stream for `on` in faults
    #[arg(value_name = "[NAME=]SOURCE")]
    source: Named<Source>,
    /// Take its clients at this address; port 0 takes a free one
    #[arg(long, value_name = "ADDR", required_unless_present = "pty", conflicts_with = "pty")]
    tcp: Option<String>,
    /// Be its serial port: a link to a pseudo-terminal, removed at the end
    #[arg(long, value_name = "LINK")]
    pty: Option<PathBuf>,
    #[command(flatten)]
    faults: FaultArgs,
    /// Of what faults leave to chance
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// How to tell where it listens and what happens; jsonl writes one object an event to standard output, json one document at the end
    #[arg(long, default_value = "table", value_parser = event_format::parser())]
    format: Format,
    #[command(flatten)]
    record: RecordArgs,
}

/// What every connection needs.
struct Proxy {
    source: Source,
    name: String,
    faults: StreamFaults,
    taps: Taps,
    kind: StreamKind,
    format: Format,
    counts: Counts,
    /// A serial line has one client at a time.
    places: Semaphore,
}

#[derive(Debug, Default)]
struct Counts {
    connections: AtomicU64,
    unreachable: AtomicU64,
    refused: AtomicU64,
    to_client: AtomicU64,
    to_device: AtomicU64,
}

/// The line that tells a script of a connection's begin or end, or of the command's end.
#[derive(Debug, Default, Serialize)]
struct Line {
    event: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    peer: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    connections: Option<u64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    unreachable: Option<u64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    refused: Option<u64>,
    /// Bytes the client was sent, after faults.
    #[serde(skip_serializing_if = "Option::is_none")]
    to_client_bytes: Option<u64>,
    /// Bytes the client has sent, before faults.
    #[serde(skip_serializing_if = "Option::is_none")]
    to_device_bytes: Option<u64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    faults_begun: Option<u64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    reason: Option<String>,
}

pub(super) async fn run(args: Args, mut interrupt: Interrupt) -> Result<Outcome, Failure> {
    let Named { name, it: source } = args.source.clone();
    if let Source::Recording { .. } = source {
        return Err(Failure::Usage(format!(
            "{source} is a recording: `rowscan replay {source} --faults FILE` has the same faults"
        )));
    }
    if let Source::Picoscan(_) = source {
        return Err(Failure::Usage(format!(
            "{source} sends datagrams, and a proxy stands in a stream of bytes: expected tcp://HOST:PORT or a serial port; `rowscan emulate --faults FILE` loses datagrams"
        )));
    }
    let name = name.unwrap_or_else(|| NAME.to_owned());
    let script = args.faults.read()?;
    let faulting = Faulting::start(args.seed, Arc::new(HostClock::start()), (args.format, &Log::default()));
    let medium = if args.pty.is_some() { Medium::Wire } else { Medium::Tcp };
    let kind = stream_kind(&source);
    let language = if kind == StreamKind::Lms2xx { Language::Lms2xx } else { Language::Cola };
    let faults = faulting.control().stream(&name, medium, language);
    faulting.begin(script)?;
    let about = About { source: Some(source.to_string()), seed: Some(args.seed), ..About::default() };
    let taping = args.record.start(about, false)?;
    let places = Semaphore::new(if kind == StreamKind::Lms2xx { 1 } else { Semaphore::MAX_PERMITS });
    let (format, taps) = (args.format, taping.taps());
    let proxy =
        Arc::new(Proxy { source, name, faults, taps, kind, format, counts: Counts::default(), places });
    let (close, closing) = watch::channel(false);
    let closing = Closing(closing);
    let serving = async {
        match (&args.tcp, &args.pty) {
            (Some(address), _) => proxy.serve_tcp(address, closing).await,
            (None, Some(link)) => proxy.serve_pty(link, closing).await,
            (None, None) => Ok(()),
        }
    };
    tokio::pin!(serving);
    let ended = tokio::select! {
        ended = &mut serving => ended,
        // What is open is closed, counted and told before the end is.
        () = interrupt.wait() => { close.send_replace(true); serving.await }
        // It was told when it happened.
        () = taping.failed() => { close.send_replace(true); serving.await }
    };
    let begun = faulting.finish().await?;
    ended?;
    proxy.tell_end(begun)?;
    Ok(taping.finish())
}

/// Resolves when the proxy is to end.
#[derive(Clone)]
struct Closing(watch::Receiver<bool>);

impl Closing {
    /// Cancel safe.
    async fn wait(&mut self) {
        let _ = self.0.wait_for(|closing| *closing).await;
    }
}

impl Proxy {
    /// Takes clients in until the proxy is to end; returns when the last of them is told.
    async fn serve_tcp(self: &Arc<Self>, address: &str, mut closing: Closing) -> Result<(), Failure> {
        let busy = |cause| rowscan_ports::PortError::Listen { address: address.to_owned(), cause };
        let listener = TcpListener::bind(address).await.map_err(busy)?;
        let mut listener = GatedListener::new(listener, Some(self.faults.clone())).map_err(busy)?;
        announce_stream(self.format, None, "tcp", &listener.address())?;
        service::ready();
        let mut clients = JoinSet::new();
        loop {
            tokio::select! {
                accepted = listener.accept() => match accepted {
                    Ok((stream, peer)) => {
                        let (proxy, closing) = (Arc::clone(self), closing.clone());
                        let peer = peer.to_string();
                        clients.spawn(task(async move { proxy.serve_client(stream, peer, closing).await }));
                    }
                    Err(cause) => {
                        tracing::warn!(%cause, "cannot accept");
                        retry_pause().await;
                    }
                },
                Some(served) = clients.join_next() => served.unwrap_or(Ok(()))?,
                () = closing.wait() => break,
            }
        }
        while let Some(served) = clients.join_next().await {
            served.unwrap_or(Ok(()))?;
        }
        Ok(())
    }

    /// Serves one client, over a connection of its own to the scanner.
    async fn serve_client(
        &self,
        stream: TcpStream,
        peer: String,
        mut closing: Closing,
    ) -> Result<(), Failure> {
        if let Err(cause) = keep_alive(&stream) {
            tracing::debug!(%cause, "socket options refused");
        }
        let Ok(_place) = self.places.try_acquire() else {
            self.counts.refused.fetch_add(1, Ordering::Relaxed);
            let reason = format!("{} is a serial line and has a client already", self.source);
            return self.tell(Line {
                event: "refused",
                peer: Some(peer),
                reason: Some(reason),
                ..Line::default()
            });
        };
        let dialled = tokio::select! {
            dialled = self.dial() => dialled,
            () = closing.wait() => Err(CUT.to_owned()),
        };
        let mut device = match dialled {
            Ok(device) => device,
            Err(reason) => {
                self.counts.unreachable.fetch_add(1, Ordering::Relaxed);
                // A scanner that is not there does not close in order.
                reset_on_drop(&stream);
                return self.tell(Line {
                    event: "unreachable",
                    peer: Some(peer),
                    reason: Some(reason),
                    ..Line::default()
                });
            }
        };
        self.counts.connections.fetch_add(1, Ordering::Relaxed);
        self.tell(Line { event: "connected", peer: Some(peer.clone()), ..Line::default() })?;
        let mut client = self.witnessed(self.faults.wrap(stream, reset_on_drop));
        let reason = tokio::select! {
            ended = relay(&mut client, &mut device) => ended.err().map(|cause| cause.to_string()),
            () = closing.wait() => Some(CUT.to_owned()),
        };
        self.tell_disconnected(peer, client.passed(), reason)
    }

    /// Is a serial port until the proxy is to end; the scanner is dialled again whenever it is lost.
    async fn serve_pty(&self, link: &Path, mut closing: Closing) -> Result<(), Failure> {
        let pty = Pty::open(link)?;
        announce_stream(self.format, None, "pty", pty.path())?;
        service::ready();
        let mut wire = self.witnessed(self.faults.wrap(pty, |_| ()));
        let mut is_told = false;
        loop {
            let dialled = tokio::select! {
                dialled = self.dial() => dialled,
                () = closing.wait() => return Ok(()),
            };
            match dialled {
                Ok(mut device) => {
                    is_told = false;
                    self.counts.connections.fetch_add(1, Ordering::Relaxed);
                    let peer = Some(self.source.to_string());
                    self.tell(Line { event: "connected", peer, ..Line::default() })?;
                    let before = wire.passed();
                    let reason = tokio::select! {
                        ended = carry(&mut wire, &mut device) => ended.err().map(|cause| cause.to_string()),
                        () = closing.wait() => Some(CUT.to_owned()),
                    };
                    let [to_client, to_device] = wire.passed();
                    let passed = [to_client - before[0], to_device - before[1]];
                    self.tell_disconnected(self.source.to_string(), passed, reason)?;
                }
                Err(reason) => {
                    self.counts.unreachable.fetch_add(1, Ordering::Relaxed);
                    if !std::mem::replace(&mut is_told, true) {
                        self.tell(Line { event: "unreachable", reason: Some(reason), ..Line::default() })?;
                    }
                }
            }
            tokio::select! {
                () = retry_pause() => {}
                () = closing.wait() => return Ok(()),
            }
        }
    }

    /// Reaches the scanner; why not, in words.
    async fn dial(&self) -> Result<ByteStream, String> {
        match within(PATIENCE, ByteStream::open(&self.source)).await {
            Some(opened) => opened.map_err(|error: DriverError| error.to_string()),
            None => Err(format!("no connection to {} within {PATIENCE:?}", self.source)),
        }
    }

    /// Has the recording hold what goes over the client's wire.
    fn witnessed<S>(&self, stream: FaultyStream<S>) -> FaultyStream<S> {
        let tap: Tap = self.taps.open(&self.name, self.kind);
        stream.witnessed(move |direction, bytes| {
            let side = if direction == Direction::ToClient { Side::Device } else { Side::Host };
            tap.record(side, bytes);
        })
    }

    /// Tells and counts a connection that has ended: bytes to its client and bytes from it.
    fn tell_disconnected(
        &self,
        peer: String,
        [to_client, to_device]: [u64; 2],
        reason: Option<String>,
    ) -> Result<(), Failure> {
        self.counts.to_client.fetch_add(to_client, Ordering::Relaxed);
        self.counts.to_device.fetch_add(to_device, Ordering::Relaxed);
        self.tell(Line {
            event: "disconnected",
            peer: Some(peer),
            to_client_bytes: Some(to_client),
            to_device_bytes: Some(to_device),
            reason,
            ..Line::default()
        })
    }

    fn tell(&self, line: Line) -> Result<(), Failure> {
        if matches!(self.format, Format::Json | Format::Jsonl) {
            return output::print_event(self.format, &line);
        }
        let Line { event, peer, to_client_bytes, to_device_bytes, reason, .. } = line;
        let peer = peer.map(|peer| format!(" {peer}")).unwrap_or_default();
        let bytes = to_client_bytes.zip(to_device_bytes);
        let bytes = bytes.map(|(to, from)| format!(": {to} bytes to it, {from} from it")).unwrap_or_default();
        say(format_args!("{event}{peer}{bytes}{}", reason.map(|why| format!(": {why}")).unwrap_or_default()));
        Ok(())
    }

    fn tell_end(&self, begun: u64) -> Result<(), Failure> {
        let count = |count: &AtomicU64| count.load(Ordering::Relaxed);
        let Counts { connections, unreachable, refused, to_client, to_device } = &self.counts;
        if matches!(self.format, Format::Json | Format::Jsonl) {
            // The end is what remains: an event for jsonl, the document for json.
            let line = Line {
                event: "end",
                connections: Some(count(connections)),
                unreachable: Some(count(unreachable)),
                refused: Some(count(refused)),
                to_client_bytes: Some(count(to_client)),
                to_device_bytes: Some(count(to_device)),
                faults_begun: Some(begun),
                ..Line::default()
            };
            return output::print_json(self.format, &line);
        }
        say(format_args!(
            "{} connections, {} attempts without a scanner; {} bytes to clients, {} from them; {begun} faults",
            count(connections),
            count(unreachable),
            count(to_client),
            count(to_device)
        ));
        Ok(())
    }
}

/// Carries bytes between a serial wire and the scanner, at the rate the wire's client has set, until the scanner is lost.
async fn carry<W: Wire>(wire: &mut FaultyStream<W>, device: &mut ByteStream) -> io::Result<()> {
    let (mut from_client, mut from_device) = (vec![0; CHUNK], vec![0; CHUNK]);
    let mut rate = None;
    loop {
        tokio::select! {
            read = wire.read(&mut from_client) => {
                let read = read?;
                let wanted = wire.client_rate()?.and_then(Rate::of);
                if let Some(wanted) = wanted.filter(|wanted| rate != Some(*wanted)) {
                    device.set_rate(wanted)?;
                    rate = Some(wanted);
                }
                device.write_all(from_client.get(..read).unwrap_or_default()).await?;
                device.flush().await?;
            }
            read = device.read(&mut from_device) => {
                let read = read?;
                if read == 0 {
                    return Err(io::ErrorKind::UnexpectedEof.into());
                }
                wire.write_all(from_device.get(..read).unwrap_or_default()).await?;
            }
        }
    }
}
